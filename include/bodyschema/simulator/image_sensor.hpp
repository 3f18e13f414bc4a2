#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bodyschema/geometry/image.hpp"
#include "bodyschema/simulator/random.hpp"

namespace bodyschema::simulator {

/// From light to numbers: a slightly soft lens, an exposure, Gaussian noise, and 8 bits.
/// One per thread; allocates nothing once warm.
class ImageSensor {
 public:
  /// @param blur_px  standard deviation of the point spread, 0 to 3 px
  /// @param noise_levels  standard deviation of the noise of each channel, levels of 255
  ImageSensor(int width, int height, double blur_px, double noise_levels);

  /// @param light  three floats a pixel, levels 0-255; destroyed
  /// @param exposure  factor on all levels
  void expose(std::vector<float>& light, double exposure, Random& random, Image& picture);

 private:
  void blur(std::vector<float>& light);
  int width_, height_;
  std::vector<float> kernel_;  // from the centre outwards
  std::vector<float> scratch_;
  std::array<float, 4096> noise_table_{};  // quantiles of the noise
  bool noisy_;
};

}  // namespace bodyschema::simulator
