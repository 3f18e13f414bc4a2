#include <algorithm>

#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {
namespace {

/// Play between encoder and link (play operator): the link stays where it is until the encoder has
/// taken up the slack, then follows at half the width behind. `width` is the full play.
class Backlash final : public ClonableEffect<Backlash> {
 public:
  Backlash(const EffectTarget& target, Eigen::Index joint)
      : ClonableEffect(
            "backlash", target,
            {{.name = "width", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg, .at_least = 1e-5}}),
        joint_(joint) {}

  [[nodiscard]] bool has_memory() const override { return true; }
  void forget() override { started_ = false; }
  void observe(const JointSample& sample) override {
    const double x = sample.q[joint_];
    if (!started_) {
      link_ = steady_ = x;
    } else {
      const double dt = std::max(0.0, seconds(sample.utime - last_));
      steady_ += (x - steady_) * (dt > 0.0 ? dt / (kSteady_s + dt) : 0.0);
      link_ = play(steady_);
    }
    last_ = sample.utime;
    started_ = true;
  }
  void apply(const Instant& at, Corrections& add_to) const override {
    if (!started_) return;
    const double x = at.encoder[joint_];
    add_to.dq[joint_] += play(x) - x;
  }

 private:
  [[nodiscard]] double play(double x) const {
    const double half = 0.5 * value(0);
    // A negative width has no physical meaning; least squares may pass through it.
    if (half < 0.0) return x;
    return std::clamp(link_, x - half, x + half);
  }

  /// Encoder noise must not push the link to and fro; the link is only taken along by a mean over
  /// about this time, short against any turn of the motion.
  static constexpr double kSteady_s = 0.015;

  Eigen::Index joint_;
  double link_ = 0.0;    ///< encoder angle at which the link stands
  double steady_ = 0.0;  ///< encoder angle without its noise
  Microseconds last_ = 0;
  bool started_ = false;
};

constexpr double kSparse_s = 0.025;

bool jumps_between_postures(const LogMotion& motion) {
  constexpr double kJump_rad = 8.0 * kDeg;  // between readings 100 ms apart even a fast arm moves less
  return motion.reading_period_s > kSparse_s && motion.reading_step_rad > kJump_rad;
}

/// Why a log with this motion does not show which way the joint moved last.
std::string not_testable(const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) {
  if (motion.reading_period_s > kSparse_s) {
    // Of an arm that is read from one posture to the next it does not matter how often.
    if (jumps_between_postures(motion)) {
      return "the arm's readings jump from posture to posture, by " + short_number(motion.reading_step_rad / kDeg, 0) +
             " deg (median); how the joints moved between them, and in which direction last, was not seen";
    }
    return "the arm's encoders come every " + short_number(1e3 * motion.reading_period_s, 0) +
           " ms; the direction of motion needs 100 Hz or more";
  }
  if (auto still = joint_hardly_moved(target, roles, motion); !still.empty()) return still;
  // Backlash shows where a joint passes the same angles in both directions.
  const int reversals = motion.reversals[static_cast<std::size_t>(roles.index(target.joint))];
  if (reversals >= 2) return {};
  return target.joint + " turned round " + (reversals == 0 ? "never" : "once") +
         "; both directions through the same postures are needed";
}

}  // namespace

std::string needs_motion_that_was_seen(const EffectTarget&, const JointRoles&, const LogMotion& motion) {
  if (!jumps_between_postures(motion)) return "";
  return "the arm was seen in single postures, " + short_number(motion.reading_step_rad / kDeg, 0) +
         " deg apart (median); each would be taken before or after a change, and none shows it happen";
}

EffectKind backlash() {
  return {.name = "backlash",
          .targets = arm_targets,
          .make = [](const EffectTarget& target,
                     const JointRoles& roles) { return std::make_unique<Backlash>(target, roles.index(target.joint)); },
          .sentence = in_words("{joint} has {size} of play between encoder and link"),
          .not_testable = not_testable,
          .lookalikes = {"latency"},
          .splitting_motion = "Repeat the same path at two speeds and in both directions.",
          .remark = "depends on the direction of motion; approach targets from one side"};
}

}  // namespace bodyschema::effects
