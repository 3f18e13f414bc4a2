#pragma once

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

/// A silhouette of a pinhole camera as a lens with radial distortion k1 (OpenCV's, no unit) shows it. One that would
/// move no pixel of the picture by half of one is left as it is.
BinaryMask bent_silhouette(BinaryMask straight, const PinholeIntrinsics& intrinsics, double k1);

}  // namespace bodyschema
