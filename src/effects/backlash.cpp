#include <algorithm>

#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// Play between encoder and link (play operator): the link stays where it is until the encoder has
/// taken up the slack, then follows at half the width behind. `width` is the full play.
class Backlash final : public Clonable<Backlash> {
 public:
  Backlash(const EffectTarget& target, Eigen::Index joint)
      : Clonable("backlash", target,
                 {EffectParameter{.name = "width", .unit = "deg", .si_per_unit = kDeg, .typical = 0.5 * kDeg}}),
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

}  // namespace

std::unique_ptr<Effect> make_backlash(const EffectTarget& target, const JointRoles& roles) {
  return std::make_unique<Backlash>(target, roles.index(target.joint));
}

Targets backlash_targets(const JointRoles& roles) {
  return arm_targets(roles);
}

}  // namespace bodyschema::effects
