#pragma once

#include <Eigen/Core>
#include <span>

#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// Variance of what lies between two readings, of theirs: in the mean over where a picture falls.
constexpr double kInterpolatedVariance = 2.0 / 3.0;

/// How far single readings of each joint's encoder err, rad (standard deviation): their noise and their steps, told
/// from how readings that follow each other differ beyond any motion of a robot. 0 where readings come too seldom to
/// tell.
/// @param share  of the differences that this is told from, the smallest: the rest may be lost or stalled readings, or
///   hold motion. A half bears an arm that is jerked from place to place; nine in ten bear readings that come twice.
Eigen::VectorXd encoder_noise(std::span<const JointSample> encoders, double share = 0.9);

}  // namespace bodyschema
