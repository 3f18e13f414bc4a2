#include "kinds.hpp"
#include "words.hpp"

namespace bodyschema::effects {

/// The arm is mounted elsewhere, seen from the eyes: every part of it lies further along the root's
/// axes. Errors in the lengths between base and eyes look like this while torso and head stand still.
EffectKind base_shift() {
  return {.name = "base_shift",
          .targets = whole_robot,
          .make = everywhere("base_shift", {in_mm("x", 3.0), in_mm("y", 3.0), in_mm("z", 3.0)},
                             [](Parameters p, const Instant&, Corrections& c) {
                               c.base_shift_m += Eigen::Vector3d(p[0].value, p[1].value, p[2].value);
                             }),
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                std::string text;
                for (std::size_t i = 0; i < amounts.size(); ++i) {
                  const auto axis = (e.parameters()[i].value < 0.0 ? -1.0 : 1.0) *
                                    Eigen::Vector3d::Unit(static_cast<Eigen::Index>(i));
                  text += (i > 0 ? ", " : "") + amounts[i] + " along " + direction_in_words(axis);
                }
                return "the arm is mounted elsewhere, seen from the cameras: moved by " + text + " of the root link";
              },
          .not_testable = [](const EffectTarget&, const JointRoles& roles, const LogMotion& motion) -> std::string {
            constexpr double kHeadStill = 5.0 * kDeg;
            if (roles.head.empty()) {
              return "the cameras do not move against the base: a shifted base looks like errors of their place";
            }
            if (motion.neck_range_rad >= kHeadStill) return {};
            return "the neck moved " + short_number(motion.neck_range_rad / kDeg) +
                   " deg: a shifted base looks like errors of neck and eyes";
          },
          .lookalikes = {"head_offset", "principal_point", "camera_pose"},
          .splitting_motion = "Move the head by 20 to 30 deg with the arm still.",
          .home = EffectHome::kUrdf};
}

}  // namespace bodyschema::effects
