#pragma once

#include <vector>

#include "bodyschema/evidence/batch_fit.hpp"

namespace bodyschema {

/// How an arm may be built otherwise than its URDF says, in many small ways of which pictures name none: joints sit
/// beside where they should (`joint_place`), axes are tilted (`axis_tilt`). Printed parts, a URDF that was
/// drawn by eye. How far, nobody has measured, but all postures together tell it, as one number for all joints.
class ArmGeometry {
 public:
  /// Of every joint, the effects that neither state nor tolerances hold.
  ArmGeometry(const JointRoles& roles, const State& state, const std::vector<Belief>& tolerances);

  /// Each with a standard deviation of one unit, to be considered by a fit that `measure` asks.
  [[nodiscard]] const std::vector<Belief>& probe() const { return probe_; }
  /// Whether these are all there are: nobody has said how well any joint of the arm is built.
  [[nodiscard]] bool of_every_joint() const { return of_every_joint_; }
  struct Found {
    std::vector<Belief> beliefs;  ///< `probe`, each with the standard deviation that the log leaves possible
    double beside_sd_m = 0.0, tilted_sd_rad = 0.0;
    bool asked_for = false;  ///< the pictures speak for it
  };
  [[nodiscard]] Found measure(const BatchFit& batch) const;

 private:
  std::vector<Belief> probe_;
  bool of_every_joint_ = true;
};

}  // namespace bodyschema
