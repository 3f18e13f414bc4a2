#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/simulator/fault.hpp"
#include "bodyschema/simulator/random.hpp"

/// One function per file of this folder. Adding a fault is adding one file and naming it here and
/// in fault.cpp.
namespace bodyschema::simulator::faults {

FaultKind joint_offset();
FaultKind compliance();
FaultKind payload();
FaultKind backlash();
FaultKind encoder_gain();
FaultKind eccentricity();
FaultKind joint_coupling();
FaultKind latency();
FaultKind camera_skew();
FaultKind link_length();
FaultKind axis_tilt();
FaultKind axis_shift();
FaultKind head_offset();
FaultKind vergence();
FaultKind baseline();
FaultKind focal_length();
FaultKind principal_point();
FaultKind distortion();
FaultKind silhouette_bias();
FaultKind mesh_scale();
FaultKind hand_size();
FaultKind finger_posture();
FaultKind drift();
FaultKind slip();
FaultKind wobble();
FaultKind velocity_lag();
FaultKind acceleration_lag();
FaultKind local_kink();
FaultKind random_walk();
FaultKind camera_rotation();
FaultKind camera_position();
FaultKind cover_dilation();
FaultKind held();
FaultKind stalled_encoder();
FaultKind exposure_time();
FaultKind readout_time();

/// Targets with one detectable size per arm joint, shoulder to wrist; 0 leaves a joint out because
/// pictures of the hand do not show the fault there.
inline std::vector<FaultTarget> on_arm_joints(const FaultSite& site, const std::string& name,
                                              const std::array<double, 7>& detectable) {
  std::vector<FaultTarget> targets;
  for (std::size_t i = 0; i < site.arm.size(); ++i) {
    const double size = detectable[std::min<std::size_t>(i, 6)];
    if (size <= 0.0) continue;
    FaultSpec spec{name, {}};
    spec.arguments["joint"] = site.model->joints()[static_cast<std::size_t>(site.arm[i])].name;
    targets.push_back({std::move(spec), size});
  }
  return targets;
}

/// None: a kind that is never drawn at random.
inline std::vector<FaultTarget> nowhere(const FaultSite&) {
  return {};
}

/// One target: the whole robot.
inline std::vector<FaultTarget> on_robot(const std::string& name, double detectable) {
  return {{FaultSpec{name, {}}, detectable}};
}

/// A fault that only changes the body, given as a function.
template <class Change>
std::unique_ptr<Fault> body_fault(Change change) {
  class BodyFault final : public Fault {
   public:
    explicit BodyFault(Change c) : change_(std::move(c)) {}
    void build(TrueBody& body) override { change_(body); }

   private:
    Change change_;
  };
  return std::make_unique<BodyFault>(std::move(change));
}

/// A fault that only changes when pictures are exposed.
template <class Change>
std::unique_ptr<Fault> timing_fault(Change change) {
  class TimingFault final : public Fault {
   public:
    explicit TimingFault(Change c) : change_(std::move(c)) {}
    void expose(ExposureTiming& timing) override { change_(timing); }

   private:
    Change change_;
  };
  return std::make_unique<TimingFault>(std::move(change));
}

/// A fault that only changes encoder readings.
template <class Change>
std::unique_ptr<Fault> encoder_fault(Change change) {
  class EncoderFault final : public Fault {
   public:
    explicit EncoderFault(Change c) : change_(std::move(c)) {}
    void read(Eigen::VectorXd& encoder) const override { change_(encoder); }

   private:
    Change change_;
  };
  return std::make_unique<EncoderFault>(std::move(change));
}

/// A fault between motor and joint whose change depends on the present step only, or keeps its
/// state in a mutable lambda.
template <class Change>
std::unique_ptr<Fault> transmission_fault(Change change) {
  class TransmissionFault final : public Fault {
   public:
    explicit TransmissionFault(Change c) : change_(std::move(c)) {}
    void transmit(const MotorStep& step, Eigen::VectorXd& q) override { change_(step, q); }

   private:
    Change change_;
  };
  return std::make_unique<TransmissionFault>(std::move(change));
}

}  // namespace bodyschema::simulator::faults
