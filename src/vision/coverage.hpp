#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {

/// Share of each pixel covered by the robot along a blurred outline, from a rough detection.
///
/// Matting with a known background: I = (1-a) B + a F. B comes from the background model; F is
/// found in two steps: first the mean colour of sure robot pixels nearby, which places the outline
/// roughly; then, along the outline's normal, the colour just inside it, extrapolated to the
/// outline itself with the law that shading follows on a smooth surface that turns away from the
/// camera (its normal, and with it the light, changes with the square root of the depth).
class CoverageEstimator {
 public:
  /// @param detected  pixels where a robot may be: all of it and at most ~2 px around it
  /// @param sure      pixels that differ from the background by themselves
  /// @param least_contrast_sigma  below this difference of F and B a pixel is uncertain
  /// @param mask      out: coverage of at least one half
  /// @param uncertain out: pixels of the outline that cannot be judged
  /// @param coverage  out: 0 to 255, row order
  void estimate(const Image& image, const BackgroundModel& background, const BinaryMask& detected,
                const BinaryMask& sure, float least_contrast_sigma, BinaryMask& mask,
                BinaryMask& uncertain, std::vector<std::uint8_t>& coverage);

 private:
  struct BandPixel {
    int u, v;                  ///< in the picture
    std::size_t local;         ///< in the padded window
    std::array<float, 3> robot;  ///< F
    float share = 0.0f;        ///< a, not clamped
    bool known = false;        ///< F and B differ enough
  };
  void collect_band(const Image& image, const BinaryMask& detected, const BinaryMask& sure);
  void average_robot(const Image& image, const BinaryMask& sure);
  void place_outline(const Image& image, const BackgroundModel& background);
  void project(const Image& image, const BackgroundModel& background, float least_contrast_sigma);

  PixelBox box_;
  int stride_ = 0;             ///< of the window, which has one pixel of padding
  MaskMorphology morphology_;
  BinaryMask inner_, outer_, core_, weak_;
  std::vector<BandPixel> band_;
  std::vector<float> share_;   ///< a over the window
  std::array<std::vector<int>, 4> sums_;    ///< weight and weighted colours, summed along rows
  std::array<std::vector<int>, 4> columns_; ///< the same summed over a window of rows
};

}  // namespace bodyschema
