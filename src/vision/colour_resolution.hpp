#pragma once

#include <array>

#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

/// Whether a camera's pictures have colour at a lower resolution than brightness, as JPEG and video keep it: beside an
/// outline colours bleed over it, and are no mixtures of both sides.
///
/// How much colour bends, of what brightness does, is compared over one pixel and over four. Where both were taken
/// pixel by pixel it is no less over one, since noise is in both; where colour is interpolated it is a fifth. Says no
/// where there is no colour to be seen.
///
/// Of the first picture all is looked at, of each later one a quarter of the rows: a camera seldom begins to compress.
class ColourResolution {
 public:
  /// @param every  looks at every so many pixels along each axis
  /// @returns whether colours bleed in this picture and the three before
  bool bleeds(const Image& image, int every);

 private:
  static constexpr int kQuarters = 4;
  /// Sums of second differences.
  struct Bend {
    float brightness = 0.0f, colour = 0.0f;
  };
  struct Bends {
    Bend near, far;
  };
  static Bend bend_over(const Image& image, int distance, int every, int quarter);
  std::array<Bends, kQuarters> of_{};  ///< of each quarter, as last seen
  int width_ = 0, height_ = 0;         ///< of the pictures before
  int next_ = 0;                       ///< the quarter that is looked at next
};

}  // namespace bodyschema
