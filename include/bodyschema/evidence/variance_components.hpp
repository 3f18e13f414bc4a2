#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "bodyschema/evidence/posture_memory.hpp"

namespace bodyschema {

/// Several parameters about zero that have one standard deviation in common, which nobody has measured: how far each
/// joint of an arm sits beside where its URDF has it.
using VarianceComponent = std::vector<Eigen::Index>;

struct MeasuredComponents {
  /// Root mean square of each component's standard deviation, over all that the pictures leave possible.
  Eigen::VectorXd sd;
  /// Natural logarithm of how much likelier the pictures are than if all were zero: of the Bayes factor.
  double log_odds = 0.0;
};

/// What pictures say of the standard deviations of variance components, the parameters' own values integrated out
/// (Gelman, 2006): before any picture each is below its unit as likely as above it, by a half Cauchy distribution, so
/// that none is ruled out by what is believed, and none made up.
/// @param evidence  of parameters in their units; those of no component are believed to be of standard deviation 1
MeasuredComponents measure_components(const Quadratic& evidence, std::span<const VarianceComponent> components);

}  // namespace bodyschema
