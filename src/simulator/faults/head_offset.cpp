#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The zero of an encoder of neck or eyes is wrong: true - encoder = angle.
FaultKind head_offset() {
  FaultKind kind;
  kind.name = "head_offset";
  kind.parameter = "angle";
  kind.unit = "deg";
  kind.meaning = "true - encoder of a joint of neck or eyes";
  kind.keys = {"joint"};
  kind.stage = 1;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const auto joint = arguments.joint();
    const double angle = radians(arguments.number("value", -60.0, 60.0));
    return encoder_fault([=](Eigen::VectorXd& encoder) { encoder[joint] -= angle; });
  };
  kind.targets = [](const FaultSite& site) {
    // Neck pitch, roll, yaw and eye tilt; roll shows best.
    constexpr std::array<double, 4> kDetectable = {0.3, 0.2, 0.3, 0.4};
    std::vector<FaultTarget> targets;
    for (std::size_t i = 0; i < site.head.size() && i < kDetectable.size(); ++i) {
      FaultSpec spec{"head_offset", {{"joint", site.model->joints()[static_cast<std::size_t>(site.head[i])].name}}};
      targets.push_back({std::move(spec), kDetectable[i]});
    }
    return targets;
  };
  return kind;
}

}  // namespace bodyschema::simulator::faults
