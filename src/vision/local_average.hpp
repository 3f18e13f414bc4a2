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
  /// Of pixels of the box that are not near the robot. Those without any within reach, and those that are known
  /// already, keep what `local` says of them.
  /// @param wanted  pixels that are asked for
  /// @param beside_px  nearer than this to the robot pixels are mixtures
  /// @param radius  half side of the squares that are averaged, px
  /// @param local  in: noise_sd; out: mean and precision of wanted pixels of the box. A varied background is as
  ///   uncertain as it is varied.
  void around(const Image& image, const BinaryMask& robot, const BinaryMask& wanted, const PixelBox& box, int beside_px,
              int radius, BackgroundModel& local);

 private:
  static constexpr std::size_t kMostPlanes = 5;  ///< colours, their squares, the number of pixels
  /// Columns and rows that are averaged at once, bounds inclusive.
  void average_strip(const Image& image, const BinaryMask& wanted, const PixelBox& box, const PixelBox& strip,
                     int radius, BackgroundModel& local);
  void sum_along_row(const Image& image, int v, const PixelBox& box, const PixelBox& strip, int radius, int* out) const;

  BinaryMask beside_;
  MaskMorphology morphology_;
  std::vector<int> rows_;     ///< sums along rows, of as many as an average takes, plane by plane
  std::vector<int> columns_;  ///< the same summed over these rows
};

}  // namespace bodyschema
