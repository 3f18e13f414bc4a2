#pragma once

#include <cstdint>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/vision_setup.hpp"

namespace bodyschema {

class Undistorter;

/// Masks that others found (`vision.method: given`), in the form in which Segmenter gives its own: what is not known
/// is not valid, and neither are specks, which segmentation networks leave; holes of VisionSetup::max_hole_px pixels
/// are filled, of any picture: larger ones are gaps between links. One thread.
class GivenMask {
 public:
  explicit GivenMask(const VisionSetup& setup) : setup_(setup) {}

  /// @param given  gray, kMaskBackground, kMaskUnknown or kMaskRobot a pixel
  /// @param lens   what straightens pictures of this camera; null: they come straight
  /// The rest as of Segmenter::segment. Throws DataError for a mask of another size than the lens's pictures, or not
  /// gray.
  void read(const Image& given, const Undistorter* lens, BinaryMask& mask, BinaryMask& valid,
            std::vector<std::uint8_t>& coverage);

 private:
  VisionSetup setup_;
  ComponentFilter components_;
};

}  // namespace bodyschema
