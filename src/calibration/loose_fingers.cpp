#include "loose_fingers.hpp"

#include <algorithm>

#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {
namespace {

/// Physical: a finger is about so long, and half as wide as this many metres.
constexpr double kFinger_m = 0.08, kHalfWidth_m = 0.008;
constexpr double kBend_rad = 0.1;  ///< any: what moves with a finger's joints is a finger

}  // namespace

std::vector<bool> loose_fingers(const PictureLog& log, const Beliefs& beliefs) {
  double sd_rad = 0.0;
  for (const auto& list : {beliefs.state, beliefs.tolerances}) {
    for (const auto& belief : list) {
      if (belief.effect == "finger_posture" && !belief.sd.empty()) sd_rad = std::max(sd_rad, belief.sd.front());
    }
  }
  if (kFinger_m * sd_rad <= kHalfWidth_m) return {};
  const auto& links = log.setup().model.rendered_links;
  ForwardKinematics kinematics(log.robot(), links);
  Eigen::VectorXd q = log.setup().default_joints(*log.robot());
  std::vector<Pose> straight(links.size()), bent(links.size());
  kinematics.compute(q, straight);
  for (const auto finger : log.roles().fingers) q[finger] += kBend_rad;
  kinematics.compute(q, bent);
  std::vector<bool> loose;
  for (std::size_t l = 0; l < links.size(); ++l) loose.push_back(!bent[l].isApprox(straight[l], 1e-6));
  return loose;
}

}  // namespace bodyschema
