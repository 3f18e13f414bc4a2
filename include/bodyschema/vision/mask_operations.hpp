#pragma once

#include <cstdint>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"

namespace bodyschema {

/// The smallest rectangle around all set pixels, bounds inclusive; empty when u1 < u0.
struct PixelBox {
  int u0 = 0;
  int v0 = 0;
  int u1 = -1;
  int v1 = -1;
  [[nodiscard]] bool empty() const { return u1 < u0; }
  [[nodiscard]] int width() const { return u1 - u0 + 1; }
  [[nodiscard]] int height() const { return v1 - v0 + 1; }
  /// Grown by `px` on each side, cut to a picture.
  [[nodiscard]] PixelBox grown(int px, int picture_width, int picture_height) const;
};

PixelBox bounding_box(const BinaryMask& mask);

/// Erosion or dilation by a 3x3 square, `steps` times, in place. What lies beyond the border of the
/// picture counts as the border pixel itself, so that a border is never an outline.
/// Allocates nothing once its buffer has grown. One per thread.
class MaskMorphology {
 public:
  void erode(BinaryMask& mask, int steps = 1);
  void dilate(BinaryMask& mask, int steps = 1);

 private:
  template <bool kErode>
  void step(BinaryMask& mask);
  template <bool kErode>
  void steps(BinaryMask& mask, int count);
  std::vector<std::uint64_t> rows_;
};

/// Sets pixels [begin, end) of a row.
void set_run(BinaryMask& mask, int v, int begin, int end, bool value);

/// Drops small connected pieces and fills small holes. Allocates nothing once warm. One per thread.
class ComponentFilter {
 public:
  /// Clears 8-connected pieces with fewer than `min_px` pixels.
  void remove_small(BinaryMask& mask, int min_px);
  /// Pixels of the largest 8-connected piece; 0: there is none.
  [[nodiscard]] int largest_piece(const BinaryMask& mask);
  /// Sets 4-connected pieces of background that touch no border and have at most `max_px` pixels.
  void fill_small_holes(BinaryMask& mask, int max_px);

 private:
  struct Run {
    int v, begin, end;  ///< row; pixels [begin, end)
    int parent;         ///< union-find, towards smaller indices
    int area;           ///< of the whole piece, at its root
    bool on_border;     ///< of the whole piece, at its root
  };
  void label(const BinaryMask& mask, bool value, bool eight_connected);
  int root(int run);
  std::vector<Run> runs_;
};

}  // namespace bodyschema
