#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/outline/effect_probes.hpp"

namespace bodyschema {

/// What is believed of an effect before any picture: its parameters lie about zero with these standard deviations.
struct Belief {
  std::string effect;
  EffectTarget target;
  std::vector<double> sd;  ///< of each fitted parameter, SI; 0: it is what the model says
};

/// Reads a mapping of effects to standard deviations, as `estimator.state` and `robot.tolerances` are:
///
///     joint_offset: {sd_deg: 5}             # every target that the robot has for it
///     link_length of r_elbow: {sd_mm: 2}    # one of them
///     principal_point difference: {sd_px: 1}
///     camera_pose: {sd_mm: 5, sd_deg: 0.5}  # by the unit of its parameters
///
/// A later entry for a target of an earlier one replaces it; a standard deviation of 0 leaves it out. Effects that this
/// robot has no target for are left out where no target is named, and so is what is about two cameras where it has one.
/// Throws ConfigurationError.
std::vector<Belief> read_beliefs(const Configuration& mapping, const JointRoles& roles);

/// One number of a state.
struct StateParameter {
  ParameterRef ref;
  std::string name;  ///< "r_elbow" for a joint's offset, otherwise "link_length of r_elbow", "camera_pose turn_x"
  std::string unit;  ///< of the effect's parameter; `si_per_unit` converts
  double si_per_unit = 1.0;
  double prior_sd = 0.0;    ///< SI
  Eigen::Index joint = -1;  ///< an arm joint's offset: which, RobotModel order
};

/// What is estimated: the values of some effects' parameters, in SI, with what was believed of them before. Those of a
/// given model (robot.extended_model) that are not believed to be uncertain stay as they are.
class State {
 public:
  /// Joint offsets come first, in the order of `beliefs`. Throws ConfigurationError.
  State(const JointRoles& roles, const std::vector<Belief>& beliefs);
  /// The same beside what is known already: beliefs are about what lies beyond.
  State(const ErrorModel& known, const std::vector<Belief>& beliefs);

  [[nodiscard]] const ErrorModel& model() const { return model_; }
  [[nodiscard]] ErrorModel& model() { return model_; }
  [[nodiscard]] const std::vector<StateParameter>& parameters() const { return parameters_; }
  /// Where the model holds them, in this order.
  [[nodiscard]] std::vector<ParameterRef> refs() const;
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  /// How many are offsets of the arm's joints; these come first.
  [[nodiscard]] Eigen::Index joints() const { return joints_; }
  /// Values, SI, and where the beliefs have their centre.
  [[nodiscard]] Eigen::VectorXd x() const;
  [[nodiscard]] const Eigen::VectorXd& prior_mean() const { return prior_mean_; }
  [[nodiscard]] Eigen::VectorXd prior_sd() const;
  /// Effects' bounds are kept.
  void set(const Eigen::VectorXd& x);
  /// Values that another model has for the same parameters; those that it does not hold stay.
  void set(const ErrorModel& model);
  /// Position of a fitted parameter; -1: it is not estimated.
  [[nodiscard]] Eigen::Index find(const std::string& effect, const EffectTarget& target, std::size_t parameter) const;

 private:
  ErrorModel model_;
  std::vector<StateParameter> parameters_;
  Eigen::VectorXd prior_mean_;
  Eigen::Index joints_ = 0;
};

/// What may be wrong beside a state: effects whose fitted parameters are not estimated, and how far off they may be.
struct Considered {
  ErrorModel effects;
  Eigen::MatrixXd root;  ///< of the covariance of `effects`' fitted parameters, in their order, SI

  /// What is tolerated, and what the state's own model leaves open of itself (ErrorModel::uncertainty) where the state
  /// does not hold it.
  static Considered beside(const State& state, const std::vector<Belief>& tolerances);
};

}  // namespace bodyschema
