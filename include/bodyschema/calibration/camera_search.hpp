#pragma once

#include <cstddef>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// A place where a camera may be.
struct CameraPlace {
  Pose X_PC = Pose::Identity();  ///< in the frame that carries it: CameraModel::link as configured
  double distance = 1.0;         ///< mean Hammoude distance of the silhouettes seen from there to the masks
};

/// Looks for a camera of which nothing is known but its intrinsics: by the silhouettes of the robot in some postures.
///
/// For every direction of sight and roll, the position follows in closed form from where the masks' centres lie; what
/// remains is ranked by how silhouettes and masks agree, and the best places are moved until they agree best (random
/// search that narrows down, Rubinstein 1999). Joints may be off by some degrees. Deterministic.
/// @param log      its robot and masks
/// @param most     places, at most
/// @param threads  0: one per core
/// @return the best places of the camera, distinct ones, best first; none where it saw the robot in fewer than three
///         postures
[[nodiscard]] std::vector<CameraPlace> find_camera(PictureLog& log, std::size_t camera, std::size_t most, int threads);

}  // namespace bodyschema
