#include "bodyschema/core/error.hpp"
#include "factories.hpp"

namespace bodyschema::effects {
namespace {

/// The optical axis meets the picture elsewhere than configured. `source` says where: "left" or
/// "right", "common" (both by the same) or "difference" (left by +half, right by -half).
class PrincipalPoint final : public Clonable<PrincipalPoint> {
 public:
  PrincipalPoint(const EffectTarget& target, double left, double right)
      : Clonable("principal_point", target,
                 {EffectParameter{.name = "cx", .unit = "px", .si_per_unit = 1.0, .typical = 2.0},
                  EffectParameter{.name = "cy", .unit = "px", .si_per_unit = 1.0, .typical = 2.0}}),
        share_{left, right} {}
  void apply(const Instant& at, Corrections& add_to) const override {
    const double share = at.camera < 2 ? share_[at.camera] : 0.0;
    add_to.camera.cx_px += share * value(0);
    add_to.camera.cy_px += share * value(1);
  }

 private:
  double share_[2];
};

}  // namespace

std::unique_ptr<Effect> make_principal_point(const EffectTarget& target, const JointRoles&) {
  if (target.source == "left") return std::make_unique<PrincipalPoint>(target, 1.0, 0.0);
  if (target.source == "right") return std::make_unique<PrincipalPoint>(target, 0.0, 1.0);
  if (target.source == "common") return std::make_unique<PrincipalPoint>(target, 1.0, 1.0);
  if (target.source == "difference") return std::make_unique<PrincipalPoint>(target, 0.5, -0.5);
  throw ConfigurationError("principal_point: source '" + target.source +
                           "', expected left, right, common or difference");
}

Targets principal_point_targets(const JointRoles&) {
  return {{"", "common"}, {"", "difference"}, {"", "left"}, {"", "right"}};
}

}  // namespace bodyschema::effects
