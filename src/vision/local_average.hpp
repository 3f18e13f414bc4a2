#pragma once

#include <array>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {

/// The background beside the robot where nobody knows it: the mean of what is near and not robot. Allocates nothing
/// once warm. One per camera and thread.
class LocalAverage {
 public:
  /// Of pixels more than two away from the robot, over squares of this half side, px. Pixels of the box without any
  /// within reach, and those that are known already, keep what `local` says of them.
  /// @param local  in: noise_sd; out: mean and precision within `box`. A varied background is as uncertain as it is
  ///   varied.
  void around(const Image& image, const BinaryMask& robot, const PixelBox& box, int radius, BackgroundModel& local);

 private:
  BinaryMask beside_;
  MaskMorphology morphology_;
  std::array<std::vector<int>, 5> sums_;  ///< colours, their squares, the number of pixels
  std::vector<int> columns_;
};

}  // namespace bodyschema
