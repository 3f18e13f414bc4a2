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
/// Matting with a known background: I = (1-a) B + a F. B comes from the background model. F is
/// the colour along the outline's normal just inside the outline, extrapolated to the outline
/// itself with the law that shading follows on a smooth surface that turns away from the camera
/// (its normal, and with it the light, changes with the square root of the depth). The outline in
/// turn is where a is one half: two rounds, from the outline of the pixels that differ. Where colours bleed, brightness
/// follows that law and colour is read deeper inside, and both say by their variances; one round more, since the pixels
/// that differ reach further out.
///
/// Of an overexposed F no shading is seen, which may bring it to B before the outline is reached: where B is such a
/// shade, pixels are uncertain.
class CoverageEstimator {
 public:
  /// @param detected  pixels where a robot may be: all of it and at most ~2 px around it
  /// @param sure      pixels that differ from the background by themselves
  /// @param clipped   the level that no channel exceeds: 255, of another light that times a gain
  /// @param least_contrast_sigma  below this difference of F and B a pixel is uncertain
  /// @param sharp_colours  a colour beside the outline that is no mixture of F and B is another part of the robot; not
  ///   so where compression lets colours bleed
  /// @param mask      out: coverage of at least one half
  /// @param uncertain out: pixels of the outline that cannot be judged
  /// @param coverage  out: 0 to 255, row order
  void estimate(const Image& image, const BackgroundModel& background, const BinaryMask& detected,
                const BinaryMask& sure, const std::array<float, 3>& clipped, float least_contrast_sigma,
                bool sharp_colours, BinaryMask& mask, BinaryMask& uncertain, std::vector<std::uint8_t>& coverage);

 private:
  struct BandPixel {
    int u, v;                    ///< in the picture
    std::size_t local;           ///< in the padded window
    std::array<float, 3> robot;  ///< F
    float share = 0.0f;          ///< a, not clamped
    float smooth = 0.0f;         ///< a, smoothed over 3x3 pixels
    float slope_u = 0.0f;        ///< of a, towards the background
    float slope_v = 0.0f;
    bool robot_known = false;  ///< F has been found; only pixels near the outline need it
    bool contrast = false;     ///< F and B differ enough
    bool fades = false;        ///< towards the outline F may become what B is: that may lie further out
  };
  void collect_band(const Image& image, const BinaryMask& detected, const BinaryMask& sure);
  void smooth();
  /// Finds F for pixels near the outline. `rough`: the outline may lie too far out.
  void look_inside(const Image& image, const BackgroundModel& background, const BinaryMask& sure, bool rough,
                   bool sharp_colours);
  void average_nearby(const Image& image, const BinaryMask& sure, BandPixel& pixel) const;
  void project(const Image& image, const BackgroundModel& background, float least_contrast_sigma, bool sharp_colours);

  std::array<float, 3> clipped_{};
  PixelBox box_;
  int stride_ = 0;  ///< of the window, which has one pixel of padding
  MaskMorphology morphology_;
  BinaryMask inner_, outer_, core_, weak_;
  std::vector<BandPixel> band_;
  std::vector<float> share_;   ///< a over the window
  std::vector<float> smooth_;  ///< a over the window, smoothed
};

}  // namespace bodyschema
