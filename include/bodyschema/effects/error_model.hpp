#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/effect_kind.hpp"

namespace bodyschema {

/// How well parameters of a model are known together. Nothing else of it is uncertain.
struct ModelUncertainty {
  struct Parameter {
    std::string effect;
    EffectTarget target;
    std::size_t parameter = 0;  ///< of the effect
    friend bool operator==(const Parameter&, const Parameter&) = default;
  };
  std::vector<Parameter> parameters;
  Eigen::MatrixXd covariance;  ///< SI
};

/// A list of effects with their parameters: what is known to be wrong with the model of a robot.
/// The diagnosis writes one (`extended_model.yaml`); the daemon, replay and export load it, so that
/// the filter runs on the extended model.
///
/// Call `observe` with every encoder sample in order of time, then `corrections` for each exposure.
/// Neither throws nor allocates. Not thread-safe; copy one per thread.
class ErrorModel {
 public:
  explicit ErrorModel(JointRoles roles);
  ErrorModel(const ErrorModel& other);
  ErrorModel& operator=(const ErrorModel& other);
  ErrorModel(ErrorModel&&) noexcept = default;
  ErrorModel& operator=(ErrorModel&&) noexcept = default;

  /// Throws ConfigurationError naming file, entry and the nearest known effect, joint or parameter.
  static ErrorModel load(const std::filesystem::path& file, const JointRoles& roles);
  static ErrorModel parse(const std::string& yaml, const JointRoles& roles,
                          const std::string& origin = "extended model");
  /// Throws as write_file (core/write_file.hpp).
  void save(const std::filesystem::path& file) const;
  [[nodiscard]] std::string to_yaml() const;

  [[nodiscard]] const JointRoles& roles() const { return roles_; }
  [[nodiscard]] std::size_t size() const { return effects_.size(); }
  [[nodiscard]] const Effect& operator[](std::size_t i) const { return *effects_[i]; }
  [[nodiscard]] Effect& operator[](std::size_t i) { return *effects_[i]; }
  /// The effect of that name and target, or null.
  [[nodiscard]] Effect* find(const std::string& name, const EffectTarget& target);
  [[nodiscard]] const Effect* find(const std::string& name, const EffectTarget& target) const;
  /// Adds the effect (parameters zero) unless it is there already; throws as make_effect.
  Effect& add(const std::string& name, const EffectTarget& target);
  void add(std::unique_ptr<Effect> effect);
  void remove(const std::string& name, const EffectTarget& target);

  /// What whoever found these parameters left open of them; a model that names none is taken for exact.
  [[nodiscard]] const ModelUncertainty& uncertainty() const { return uncertainty_; }
  void set_uncertainty(ModelUncertainty uncertainty) { uncertainty_ = std::move(uncertainty); }

  /// Offsets held by the joint_offset effects (encoder = true + offset), radians, RobotModel order.
  [[nodiscard]] Eigen::VectorXd offsets() const;

  void forget();
  void observe(const JointSample& sample);
  /// The sum of all effects on one exposure.
  void corrections(const Instant& at, Corrections& out) const;

  /// The rig with what does not depend on time put right: intrinsics, distortion.
  [[nodiscard]] StereoRig corrected(const StereoRig& rig) const;

 private:
  JointRoles roles_;
  std::vector<std::unique_ptr<Effect>> effects_;
  ModelUncertainty uncertainty_;
};

/// "backlash of r_elbow width 0.8 deg": fitted parameters only.
std::string describe(const Effect& effect);
/// "latency delay 40 ms; backlash of r_elbow width 0.8 deg", joint offsets left out.
std::string describe(const ErrorModel& model);

}  // namespace bodyschema
