#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/outline/coordinates.hpp"

namespace bodyschema {

/// One fitted parameter among several effects: which effect, and which of its parameters.
struct ParameterRef {
  std::size_t effect = 0;
  std::size_t parameter = 0;
  friend bool operator==(const ParameterRef&, const ParameterRef&) = default;
};

/// Every fitted parameter of a model, in order.
std::vector<ParameterRef> fitted_parameters(const ErrorModel& model);

/// How parameters of some effects move the coordinates of a picture: differences between two copies of each
/// effect that have seen the same encoder samples. An effect at zero is compared with one of its typical size (a
/// secant: backlash has no derivative there), others with their neighbours. One per thread.
class EffectProbes {
 public:
  EffectProbes(const ErrorModel& model, std::vector<ParameterRef> parameters, const Coordinates& coordinates);
  EffectProbes(const EffectProbes&) = delete;
  EffectProbes& operator=(const EffectProbes&) = delete;

  [[nodiscard]] std::span<const ParameterRef> parameters() const { return parameters_; }
  /// Takes over the values of a model with the same effects; what was observed stays.
  void follow(const ErrorModel& model);
  /// Every encoder sample in order of time, and back to before the first one.
  void observe(const JointSample& sample);
  void forget();
  /// Per SI unit of each parameter.
  void directions(const Instant& at, std::vector<Direction>& out);

 private:
  struct Probe {
    std::unique_ptr<Effect> low, high;
    double step = 1.0;       ///< between them, SI
    std::size_t effect = 0;  ///< which it is of
  };
  /// Of the effects beside it: what they say of the time at which the picture was taken.
  struct Beside {
    std::unique_ptr<Effect> effect;
    std::size_t which = 0;
    double later_s = 0.0;
  };
  void find_times(const Instant& at);
  void place(Probe& probe, std::size_t parameter, double value) const;

  std::vector<ParameterRef> parameters_;
  std::vector<Probe> probes_;
  std::vector<Beside> beside_;
  Corrections low_, high_;                           ///< zero between two effects
  std::vector<std::pair<double*, double*>> places_;  ///< of each coordinate in these: looked up once, read very often
};

}  // namespace bodyschema
