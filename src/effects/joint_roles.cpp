#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/effects/effect.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

JointRoles JointRoles::of(std::shared_ptr<const RobotModel> model, const RobotSetup& setup) {
  JointRoles roles;
  for (const auto& joint : model->joints()) roles.names.push_back(joint.name);
  for (const auto& name : setup.estimated_joints) roles.arm.push_back(roles.index(name));
  for (const auto& name : setup.head_joints) roles.head.push_back(roles.index(name));

  auto links = setup.model.rendered_links;
  links.push_back(setup.hand_link);
  const ForwardKinematics fk(model, links);
  for (Eigen::Index j = 0; j < model->joint_count(); ++j) {
    if (fk.moves(j, links.size() - 1)) continue;
    const auto& name = roles.names[static_cast<std::size_t>(j)];
    const bool spreads = name.find("oppose") != std::string::npos ||
                         name.find("abduction") != std::string::npos ||
                         name.find("_hand_finger") != std::string::npos;
    bool moves_part = false;
    for (std::size_t l = 0; l + 1 < links.size(); ++l) moves_part = moves_part || fk.moves(j, l);
    if (moves_part && !spreads) roles.fingers.push_back(j);
  }
  return roles;
}

Eigen::Index JointRoles::index(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) {
    throw ConfigurationError("unknown joint '" + name + "'; did you mean '" +
                             nearest_name(name, names) + "'?");
  }
  return at - names.begin();
}

}  // namespace bodyschema
