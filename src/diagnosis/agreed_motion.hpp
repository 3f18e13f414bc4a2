#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "bodyschema/core/time.hpp"

namespace bodyschema::diagnosis {

/// What one picture's residuals say about motions of what is seen: A and b as of OutlineEvidence, over the motions.
struct MotionEvidence {
  Microseconds utime = 0;
  std::size_t camera = 0;
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double square = 0.0;     ///< r'Wr, px^2
  double precision = 0.0;  ///< 1 / variance of a residual, 1/px^2
};

struct AgreedMotionSettings {
  Eigen::VectorXd sd;           ///< of each motion: only keeps what no single picture tells from running off
  Microseconds longest_us = 0;  ///< between two pictures that are compared
  double level = 0.01;          ///< share of logs of mere noise in which anything is agreed about
};

/// The share of the misfit (in squares) by which pictures agree, two by two, that what is seen stood elsewhere than the
/// model has it: the two cameras at one instant, or a camera's picture with its next. Each picture of a pair says what
/// motion it asks for, and the other how much of its own misfit would go with that. Pixels of two pictures err
/// independently, so that noise, however large and however alike along an outline, adds nothing on average; a robot
/// that moved does, however fast it goes to and fro. 0 where chance alone reaches as much.
/// @param pictures  in order of time
double agreed_share(const std::vector<MotionEvidence>& pictures, const AgreedMotionSettings& settings);

}  // namespace bodyschema::diagnosis
