#include <algorithm>

#include "kinds.hpp"

namespace bodyschema::effects {

/// The optical axis meets the picture elsewhere than configured. `source` says where: the name of a camera, "common"
/// (all by the same) or "difference" (the first by +half, the second by -half).
EffectKind principal_point() {
  return {.name = "principal_point",
          .targets =
              [](const JointRoles& roles) {
                Targets targets = {{"", "common"}};
                if (roles.cameras.size() < 2) return targets;
                targets.push_back({"", "difference"});
                for (const auto& camera : roles.cameras) targets.push_back({"", camera});
                return targets;
              },
          .make =
              [](const EffectTarget& target, const JointRoles& roles) {
                std::vector<double> share(std::max<std::size_t>(1, roles.cameras.size()), 0.0);
                if (target.source == "common") {
                  share.assign(share.size(), 1.0);
                } else if (target.source == "difference") {
                  share[0] = 0.5;
                  share[1] = -0.5;
                } else {
                  for (std::size_t c = 0; c < roles.cameras.size(); ++c) share[c] = roles.cameras[c] == target.source;
                }
                return plain("principal_point", target, {in_px("cx", 2.0), in_px("cy", 2.0)},
                             [share](Parameters p, const Instant& at, Corrections& c) {
                               const double s = at.camera < share.size() ? share[at.camera] : 0.0;
                               c.camera.cx_px += s * p[0].value;
                               c.camera.cy_px += s * p[1].value;
                             });
              },
          .sentence =
              [](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
                const auto& source = e.target().source;
                const std::string where = source == "common"       ? "of the cameras"
                                          : source == "difference" ? "of the first camera, against the second's,"
                                                                   : "of camera '" + source + "'";
                return "the principal point " + where + " lies elsewhere than configured, " + amounts[0] +
                       by_sign(e.parameters()[0], " to the right", " to the left") + " and " + amounts[1] +
                       by_sign(e.parameters()[1], " further down", " further up");
              },
          .not_testable =
              [](const EffectTarget& target, const JointRoles& roles, const LogMotion& motion) {
                return target.source == "common" ? std::string() : needs_two_cameras(target, roles, motion);
              },
          .lookalikes = {"head_offset", "base_shift", "vergence", "camera_pose", "camera_pair", "first_camera"},
          .splitting_motion = "Move the head by 20 to 30 deg with the arm still.",
          .home = EffectHome::kCameras};
}

}  // namespace bodyschema::effects
