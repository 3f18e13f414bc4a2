#include "kinds.hpp"

namespace bodyschema::effects {

/// Rows are exposed one after the other: the last one later than the first by `readout`, of all cameras or of the one
/// that `source` names. A picture's stamp is of its middle row.
EffectKind rolling_shutter() {
  return {.name = "rolling_shutter",
          .targets =
              [](const JointRoles& roles) {
                Targets targets = {EffectTarget{}};
                if (roles.cameras.size() < 2) return targets;
                for (const auto& camera : roles.cameras) targets.push_back({"", camera});
                return targets;
              },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                std::vector<bool> own(std::max<std::size_t>(1, roles.cameras.size()), target.source.empty());
                for (std::size_t c = 0; c < roles.cameras.size(); ++c) {
                  if (roles.cameras[c] == target.source) own[c] = true;
                }
                return plain("rolling_shutter", target, {in_ms("readout", 10.0)},
                             [own](Parameters p, const Instant& at, Corrections& c) {
                               if (at.camera < own.size() && own[at.camera]) c.camera.readout_s += p[0].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                const auto& camera = e.target().source;
                return "the last row of pictures" + (camera.empty() ? "" : " of camera '" + camera + "'") +
                       " is exposed " + amounts[0] + by_sign(e.parameters()[0], " later", " earlier") +
                       " after the first than configured (rolling shutter)";
              },
          .not_testable = too_slow,
          .lookalikes = {"latency"},
          .splitting_motion = "Move the hand fast through the upper and the lower half of the picture.",
          .remark = "add it to cameras.NAME.readout_ms"};
}

}  // namespace bodyschema::effects
