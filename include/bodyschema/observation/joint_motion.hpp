#pragma once

#include <Eigen/Core>
#include <span>

#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// Velocity and acceleration of the joints at an instant, from positions alone: publishers differ in what
/// they call velocity (zeros, lagging averages, single steps of a coarse encoder).
///
/// A parabola through the positions within 60 ms on both sides (least squares); where few samples follow the
/// instant, as beside a running robot, further back instead. Accelerations: within 150 ms, or as far as
/// samples follow the instant. Encoders slower than some 40 Hz get up to 250 ms. A joint that jumps within the
/// window, as from one hold of a recording to the next, counts as still, and so does everything where fewer
/// than two samples are near. No throw, no allocation once the results have their size.
/// @param ordered  samples in order of time
/// @param qdot     out: rad/s, RobotModel order
/// @param qddot    out: rad/s^2; zero where fewer than five samples are near
void joint_motion(std::span<const JointSample> ordered, Microseconds utime, Eigen::VectorXd& qdot,
                  Eigen::VectorXd& qddot);

/// Steps of a path on each side of its instant, and their length, s: as far as any picture's stamp is off, late and
/// skewed together.
inline constexpr Eigen::Index kPathSteps = 20;
inline constexpr double kPathStep_s = 0.02;

/// Where the joints are from 0.4 s before an instant to 0.4 s after it, against where they are at it: of a stamp that
/// is off by more than some 30 ms velocity and acceleration say too little. Each point is the middle of a parabola
/// through the positions within 125 ms on both sides. NaN where samples do not reach as far or are too few, and of a
/// joint that jumps from there on. No throw.
/// @param path  out: rad, joints in RobotModel order x 2 kPathSteps + 1
void joint_path(std::span<const JointSample> ordered, Microseconds utime, Eigen::MatrixXd& path);

}  // namespace bodyschema
