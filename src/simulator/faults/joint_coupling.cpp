#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// Tendons of one joint run past another and are wound up by it: true_i = motor_i + ratio * true_j.
FaultKind joint_coupling() {
  FaultKind kind;
  kind.name = "joint_coupling";
  kind.parameter = "ratio";
  kind.unit = "%";
  kind.meaning = "joint turns by ratio times the angle of joint `source`";
  kind.keys = {"joint", "source"};
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const auto source = arguments.joint("source");
    const double ratio = 0.01 * arguments.number("value", -50.0, 50.0);
    return transmission_fault([=](const MotorStep&, Eigen::VectorXd& q) { q[joint] += ratio * q[source]; });
  };
  kind.targets = [](const FaultSite& site) {
    constexpr std::array<double, 7> kDetectable = {0.5, 0.6, 0.7, 0.7, 1.2, 1.8, 1.8};
    std::vector<FaultTarget> targets;
    const auto name = [&](std::size_t i) { return site.model->joints()[static_cast<std::size_t>(site.arm[i])].name; };
    for (std::size_t i = 0; i < site.arm.size(); ++i) {
      for (const std::size_t j : {i - 1, i + 1}) {  // tendons pass the neighbours
        if (j >= site.arm.size()) continue;
        FaultSpec spec{"joint_coupling", {{"joint", name(i)}, {"source", name(j)}}};
        targets.push_back({std::move(spec), kDetectable[std::min<std::size_t>(i, 6)]});
      }
    }
    return targets;
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
