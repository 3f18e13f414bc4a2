#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The hand holds something heavy. Every drive of the arm gives way under the extra torque by a
/// compliance that belongs to the robot's data sheet (0.3 deg/Nm unless given).
FaultKind payload() {
  FaultKind kind;
  kind.name = "payload";
  kind.parameter = "mass";
  kind.unit = "kg";
  kind.meaning = "mass at the hand; each arm joint sags by compliance times its torque";
  kind.keys = {"compliance"};
  kind.one_sided = true;
  kind.make = [](const FaultArguments& arguments, const FaultSite& site) -> std::unique_ptr<Fault> {
    class Payload final : public Fault {
     public:
      Payload(std::vector<Eigen::Index> arm, double mass_kg, double softness)
          : arm_(std::move(arm)), mass_kg_(mass_kg), softness_(softness) {}
      void build(TrueBody& body) override { body.payload_kg += mass_kg_; }
      void transmit(const MotorStep& step, Eigen::VectorXd& q) override {
        if (sag_.size() == 0) sag_.setZero(q.size());
        const Eigen::VectorXd motor = q;
        const int rounds = first_ ? 20 : 1;
        for (int i = 0; i < rounds; ++i) {
          q = motor + sag_;
          const Eigen::VectorXd& torque = step.torques.payload(q);
          for (const auto joint : arm_) sag_[joint] = softness_ * torque[joint];
        }
        q = motor + sag_;
        first_ = false;
      }

     private:
      std::vector<Eigen::Index> arm_;
      double mass_kg_, softness_;
      Eigen::VectorXd sag_;
      bool first_ = true;
    };
    return std::make_unique<Payload>(site.arm, arguments.number("value", 0.0, 20.0),
                                     radians(arguments.number_or("compliance", 0.3, 0.0, 20.0)));
  };
  kind.targets = [](const FaultSite&) { return on_robot("payload", 0.25); };
  return kind;
}

}  // namespace bodyschema::simulator::faults
