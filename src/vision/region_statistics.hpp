#pragma once

#include <cstdint>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/vision_setup.hpp"
#include "local_average.hpp"

namespace bodyschema {

/// Separates robot and background without knowing the background, as region-based trackers do: two
/// colour histograms, one from inside and one from around a predicted silhouette, decide each pixel
/// within `search_px` of the predicted outline, and are then taken again from what they decided.
/// Robot colours are remembered from frame to frame; the background's are not, as it may move.
/// Allocates nothing once warm. One per camera and thread.
class RegionStatistics {
 public:
  /// @param predicted  where the robot is thought to be, at most `search_px` off
  /// @param robot      out: pixels taken for robot
  /// @param local      out: mean colour of the background next to the robot, known within reach of
  ///   its outline only
  void separate(const Image& image, const BinaryMask& predicted, const VisionSetup& setup, BinaryMask& robot,
                BackgroundModel& local);

 private:
  using Histogram = std::vector<float>;

  static float collect(const Image& image, const BinaryMask& where, const PixelBox& box, Histogram& histogram);
  void measure_depth(const BinaryMask& predicted, int reach);
  void decide(const Image& image, int reach, BinaryMask& robot);

  PixelBox box_;
  MaskMorphology morphology_;
  BinaryMask inside_, outside_, work_;
  Histogram robot_histogram_, remembered_, background_histogram_;
  std::vector<float> evidence_;      ///< log odds by colour
  std::vector<std::int16_t> depth_;  ///< steps inside (positive) or outside the prediction
  std::vector<float> row_sums_, odds_;
  LocalAverage average_;
};

/// Noise of one channel from a single picture, levels: the median response to a mask that is blind
/// to slopes. Texture makes it too large, never too small.
float noise_of(const Image& image);

}  // namespace bodyschema
