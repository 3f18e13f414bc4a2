#pragma once

#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/effects/instant.hpp"
#include "bodyschema/observation/corrections.hpp"
#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// One number of an effect. Inside the program it is SI and radians; `unit` is what people read
/// and write, and `si_per_unit` converts.
struct EffectParameter {
  std::string name;          ///< "compliance"
  std::string unit;          ///< "deg/Nm"
  double si_per_unit = 1.0;  ///< value_si = value_in_unit * si_per_unit
  double value = 0.0;        ///< SI
  bool fitted = true;        ///< false: a setting (a time, a reference), not estimated by least squares
  double typical = 0.0;      ///< SI; a plausible size, the step of secants and the scale of columns
  /// SI; what lies below has no physical meaning.
  double at_least = -std::numeric_limits<double>::infinity();
  [[nodiscard]] double in_unit() const { return value / si_per_unit; }
  /// "width_deg", "compliance_deg_per_Nm", "gain_percent", "k1": as files and configurations name it.
  [[nodiscard]] std::string key() const;
};

/// What an effect acts on: a joint for most; `source` is the second joint of a coupling, a camera or the
/// segment of the body whose shape is meant. Both empty for the whole robot.
struct EffectTarget {
  std::string joint;
  std::string source;
  friend bool operator==(const EffectTarget&, const EffectTarget&) = default;
};

/// One way in which a real robot departs from its URDF and configuration: a cause.
///
/// An effect with all fitted parameters zero changes nothing. `observe` sees every encoder sample
/// in order of time (effects with memory, such as backlash, live on it); `apply` adds the effect
/// on one exposure and changes no state. Neither throws nor allocates.
/// Not thread-safe; clone one per thread.
class Effect {
 public:
  Effect(std::string name, EffectTarget target, std::vector<EffectParameter> parameters)
      : name_(std::move(name)), target_(std::move(target)), parameters_(std::move(parameters)) {}
  virtual ~Effect() = default;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const EffectTarget& target() const { return target_; }
  [[nodiscard]] std::span<const EffectParameter> parameters() const { return parameters_; }
  [[nodiscard]] std::span<EffectParameter> parameters() { return parameters_; }
  /// "backlash of r_elbow", "joint_coupling of r_elbow with r_shoulder_yaw", "latency".
  [[nodiscard]] std::string description() const;

  virtual void observe(const JointSample&) {}
  virtual void forget() {}  ///< back to the state before the first sample
  virtual void apply(const Instant& at, Corrections& add_to) const = 0;
  [[nodiscard]] virtual std::unique_ptr<Effect> clone() const = 0;
  /// Whether `observe` matters, so that others need not replay the stream.
  [[nodiscard]] virtual bool has_memory() const { return false; }
  /// Whether `apply` looks at velocity or acceleration, so that others need not find them.
  [[nodiscard]] virtual bool follows_motion() const { return false; }
  /// Whether `apply` looks at the torques, which others then take where the arm stands under all effects, sagged.
  [[nodiscard]] virtual bool follows_gravity() const { return false; }

 protected:
  Effect(const Effect&) = default;
  [[nodiscard]] double value(std::size_t i) const { return parameters_[i].value; }

 private:
  std::string name_;
  EffectTarget target_;
  std::vector<EffectParameter> parameters_;
};

/// Gives an effect its `clone`.
template <class Derived>
class ClonableEffect : public Effect {
 public:
  using Effect::Effect;
  [[nodiscard]] std::unique_ptr<Effect> clone() const override {
    return std::make_unique<Derived>(static_cast<const Derived&>(*this));
  }
};

}  // namespace bodyschema
