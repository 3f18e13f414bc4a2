#pragma once

#include <optional>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/truth.hpp"

namespace bodyschema {

/// How far an estimated hand is from the true one in one camera's frame.
struct HandError {
  double position_m = 0.0;    ///< distance of the hand bases
  double rotation_rad = 0.0;  ///< equation (8)
  double fingertip_m = 0.0;   ///< mean distance of the fingertips; 0 without fingertips
  double fingertip_px = 0.0;  ///< mean distance of their projections, px of this camera's own pictures
};

/// Fingertips are those of the truth, carried by the true and by the estimated hand base, so that
/// the figure measures the hand's pose and not the shape of somebody's fingers.
HandError hand_error(const Pose& X_CP_estimated, const TruthInstant& truth, std::size_t camera,
                     const PinholeIntrinsics& intrinsics);

}  // namespace bodyschema
