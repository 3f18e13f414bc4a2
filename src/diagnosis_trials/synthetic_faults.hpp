#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis_trials/synthetic_log.hpp"
#include "bodyschema/observation/corrections.hpp"
#include "synthetic_path.hpp"

namespace bodyschema::trials {

/// What faults do to motors, encoders and cameras of a synthetic log: physics, not the catalogue.
class FaultyRobot {
 public:
  /// All references outlive this.
  FaultyRobot(const TrialRobot& robot, const JointRoles& roles, const TrialOptions& options, const SyntheticPath& path,
              SeededRandom& random);

  /// True joint angles at a time.
  [[nodiscard]] Eigen::VectorXd true_joints(double t_s);
  /// What the encoders read at that time; draws their noise.
  [[nodiscard]] Eigen::VectorXd encoders(double t_s);
  /// Links and camera as built.
  [[nodiscard]] Corrections body(std::size_t camera) const;
  /// When a picture is really taken.
  [[nodiscard]] double exposure(double stamp_s, std::size_t camera) const;

 private:
  void make_tables();
  void transmit(const TrialFault& fault, std::size_t index, double t_s, const Eigen::VectorXd& motor,
                Eigen::VectorXd& q);
  void build(const TrialFault& fault, std::size_t camera, Corrections& body) const;

  const TrialRobot& robot_;
  const JointRoles& roles_;
  const TrialOptions& options_;
  const SyntheticPath& path_;
  SeededRandom& random_;
  InstantBuilder instants_;
  GravityTorques torques_;
  Instant scratch_;
  Eigen::VectorXd offset_;
  double phase_ = 0.0;
  std::vector<std::vector<double>> table_;       ///< play, lags and walks over time, per fault
  std::vector<std::pair<double, double>> kink_;  ///< centre and width, per fault
};

}  // namespace bodyschema::trials
