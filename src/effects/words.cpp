#include "words.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "bodyschema/effects/across_axis.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "kinds.hpp"

namespace bodyschema {
namespace effects {

std::string part_in_words(const std::string& link) {
  std::string plain = link;
  for (const char* side : {"left_", "right_", "l_", "r_"}) {
    if (plain.starts_with(side)) plain.erase(0, std::string_view(side).size());
  }
  for (const auto& [name, words] : {std::pair("upper_arm", "the upper arm"), std::pair("upperarm", "the upper arm"),
                                    std::pair("forearm", "the forearm"), std::pair("hand", "the hand")}) {
    if (plain == name || plain.starts_with(std::string(name) + "_")) return words;
  }
  return "the link " + link;
}

std::string direction_in_words(const Eigen::Vector3d& direction) {
  // Nearer to an axis than a URDF's angles are written.
  constexpr double kAlong = 0.9999;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (std::abs(direction[axis]) < kAlong) continue;
    return std::string(direction[axis] > 0.0 ? "+" : "-") + "xyz"[axis];
  }
  std::string text = "(";
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double rounded = std::round(100.0 * direction[axis]) / 100.0;
    text += (axis > 0 ? ", " : "") + (rounded == 0.0 ? "0" : short_number(rounded, 2));
  }
  return text + ")";
}

std::string both(std::span<const std::string> amounts) {
  const auto may_be_zero = [](const std::string& amount) { return amount.find("at most") != std::string::npos; };
  const bool told = !std::all_of(amounts.begin(), amounts.end(), may_be_zero);
  std::string text;
  for (const auto& amount : amounts) {
    if (!told || !may_be_zero(amount)) text += (text.empty() ? "" : " and ") + amount;
  }
  return text;
}

decltype(EffectKind::sentence) in_words(std::string pattern) {
  return [pattern = std::move(pattern)](const Effect& e, const JointRoles&, std::span<const std::string> amounts) {
    std::string text;
    std::size_t at = 0;
    for (auto open = pattern.find('{'); open != std::string::npos; open = pattern.find('{', at)) {
      const auto close = pattern.find('}', open);
      const std::string word = pattern.substr(open + 1, close - open - 1);
      text += pattern.substr(at, open - at);
      if (word == "joint") {
        text += e.target().joint;
      } else if (word == "size") {
        text += amounts[0];
      } else {
        const auto bar = word.find('|');
        text += e.parameters()[0].value < 0.0 ? word.substr(bar + 1) : word.substr(0, bar);
      }
      at = close + 1;
    }
    return text + pattern.substr(at);
  };
}

}  // namespace effects

std::vector<AcrossAxis> across_axes(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                    const JointRoles& roles) {
  // Links beyond every joint of the arm, so that all of them count as moving something; then the parents.
  std::vector<std::string> links = {setup.hand_link};
  for (const auto joint : roles.arm) links.push_back(robot->joints()[static_cast<std::size_t>(joint)].child_link);
  CorrectedKinematics kinematics(robot, links, {robot->root_link()});
  ForwardKinematics forward(robot, [&] {
    std::vector<std::string> parents;
    for (const auto joint : roles.arm) parents.push_back(robot->joints()[static_cast<std::size_t>(joint)].parent_link);
    return parents;
  }());
  const auto q = setup.default_joints(*robot);
  std::vector<Pose> X_CB(links.size()), X_WP(roles.arm.size());
  kinematics.compute(q, roles.no_corrections(), 0, X_CB);
  forward.compute(q, X_WP);
  std::vector<AcrossAxis> list;
  for (std::size_t i = 0; i < roles.arm.size(); ++i) {
    const auto joint = roles.arm[i];
    const Eigen::Matrix3d to_link = X_WP[i].linear().transpose();
    list.push_back({roles.names[static_cast<std::size_t>(joint)],
                    robot->joints()[static_cast<std::size_t>(joint)].parent_link,
                    {to_link * kinematics.tilt_axis(joint, 0), to_link * kinematics.tilt_axis(joint, 1)}});
  }
  return list;
}

std::string AcrossAxis::direction(std::size_t which, bool positive) const {
  return effects::direction_in_words(positive ? directions.at(which) : Eigen::Vector3d(-directions.at(which))) +
         " of the link " + link;
}

}  // namespace bodyschema
