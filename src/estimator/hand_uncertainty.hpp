#pragma once

#include <Eigen/Core>

#include "frame_model.hpp"
#include "fused_state.hpp"
#include "outline_fitter.hpp"

namespace bodyschema {

/// How well the hand's place in a camera is known, by one frame.
struct HandUncertainty {
  Eigen::Matrix3d own_m2;         ///< covariance, were nothing wrong but what is estimated
  Eigen::Matrix3d covariance_m2;  ///< with what is considered
  Eigen::MatrixXd J;              ///< how state and what lies beside it move the hand, m per SI unit
  /// Root of the summed variances of x, y, z.
  [[nodiscard]] double sd_m() const;
  /// The same of what is considered alone.
  [[nodiscard]] double tolerated_sd_m() const;
  /// How well the robot's description puts the hand before any picture, offsets left out: what may be wrong with links
  /// and cameras, and is estimated.
  [[nodiscard]] double described_sd_m(const State& state) const;
};

/// @param shape  shape_covariance of what is known, and what else errs in this frame: over the state
HandUncertainty hand_uncertainty(FrameModel& model, const Exposure& exposure, const FusedState& known,
                                 const Eigen::MatrixXd& shape);

}  // namespace bodyschema
