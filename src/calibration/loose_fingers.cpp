#include "loose_fingers.hpp"

#include <algorithm>
#include <string>

namespace bodyschema {
namespace {

/// Physical: a finger is about so long, and half as wide as this many metres.
constexpr double kFinger_m = 0.08, kHalfWidth_m = 0.008;

}  // namespace

std::vector<bool> loose_fingers(const PictureLog& log, const Beliefs& beliefs) {
  double sd_rad = 0.0;
  for (const auto& list : {beliefs.state, beliefs.tolerances}) {
    for (const auto& belief : list) {
      if (belief.effect == "finger_posture" && !belief.sd.empty()) sd_rad = std::max(sd_rad, belief.sd.front());
    }
  }
  if (kFinger_m * sd_rad <= kHalfWidth_m) return {};
  const auto& joints = log.robot()->joints();
  std::vector<std::string> links;  // that a finger's joint carries, from the palm outwards
  for (const auto finger : log.roles().fingers) links.push_back(joints[static_cast<std::size_t>(finger)].child_link);
  for (std::size_t i = 0; i < links.size(); ++i) {
    for (const auto& joint : joints) {
      if (joint.parent_link == links[i] && std::find(links.begin(), links.end(), joint.child_link) == links.end()) {
        links.push_back(joint.child_link);
      }
    }
  }
  std::vector<bool> loose;
  for (const auto& link : log.setup().model.rendered_links) {
    loose.push_back(std::find(links.begin(), links.end(), link) != links.end());
  }
  return loose;
}

}  // namespace bodyschema
