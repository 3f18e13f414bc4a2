#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/robot_looks.hpp"
#include "bodyschema/vision/scene_colours.hpp"

namespace bodyschema {

/// Tells robot from background near a predicted outline by colours: of each side as they are near that piece of the
/// outline in this picture, and of the robot as they were. Evidence is the log of the likelihood ratio of a pixel's
/// colour, and what the prediction says for itself. Allocates nothing once warm. One per camera and thread.
class ColourEvidence {
 public:
  /// px of a 320x240 picture: a prediction that may be further off says nothing of where a known background has
  /// changed.
  static constexpr double kEverywhere_px = 30.0;

  /// First of all: where to look, and how deep inside the prediction each pixel near its outline lies.
  /// @param predicted  where the robot is thought to be
  /// @param reach_px   how far off that may be
  /// @param whole      look at all of the picture where the prediction may be as far off as says nothing
  void look_at(const BinaryMask& predicted, double reach_px, bool whole);
  /// @param looks    the robot's colours as known before
  /// @param colours  those of both sides in all pictures; null: not known
  /// @param known    pixels whose background is known: they say themselves whether they differ, in `differs`
  /// @param robot    out: pixels taken for robot
  void separate(const Image& image, const RobotLooks& looks, const SceneColours* colours, const BinaryMask& known,
                const BinaryMask& differs, BinaryMask& robot);
  /// Pixels near the outline whose colour, with those around, told nothing in the last `separate`: what was decided
  /// there is the prediction, not the picture.
  void mark_weak(BinaryMask& weak);
  /// Pixels of a known background that differed in the last `separate`, and whose colours are those of the rest.
  [[nodiscard]] const BinaryMask& denied() const { return denied_; }
  /// The robot's colours where it was predicted.
  /// @param share  of the new ones in `looks`
  void learn(const Image& image, float share, RobotLooks& looks);

  /// Larger pictures have more pixels than statistics need: every so many along each axis are as many as in one of
  /// 320x240.
  [[nodiscard]] int sample_step() const { return std::max(1, static_cast<int>(std::lround(unit_))); }
  /// Where is looked.
  [[nodiscard]] const PixelBox& box() const { return box_; }
  /// Calls function(u, v) for pixels outside of the prediction whose distance from its outline lies between these,
  /// px, as far as `look_at` measured it: as far as the prediction may be off, and a little further.
  template <class Function>
  void for_each_outside(float from_px, float to_px, Function&& function);

 private:
  struct Side {
    std::vector<float> tiles;  ///< counts by tile and cell
    std::vector<float> total;  ///< the same of all cells
    std::vector<float> all;    ///< counts by cell, of the whole box
    float count = 0.0f;
  };
  void measure_distance();
  void mark_outline();
  void pass_on(int v, bool forwards);
  /// No further than this from the predicted outline.
  void within(float px, BinaryMask& out);
  [[nodiscard]] float core_depth() const;
  void find_sides();
  void find_sides_again(const BinaryMask& robot);
  void find_cells(const Image& image);
  void collect(const BinaryMask& pixels, Side& side) const;
  void weigh(const RobotLooks& looks, const SceneColours* colours);
  [[nodiscard]] float evidence_of(const RobotLooks& looks, const SceneColours* colours, std::size_t tile,
                                  std::size_t cell) const;
  void decide(BinaryMask& robot);
  [[nodiscard]] int smoothing() const { return rough_ ? 2 : 1; }
  /// Calls function(u, v) for pixels of the box.
  template <class Function>
  void for_each_in(const BinaryMask& mask, Function&& function) const;

  /// Of a pixel in what is kept by pixel: whole words of the rows of the box, and a pixel and a row around them.
  [[nodiscard]] std::size_t index(int u, int v) const {
    return static_cast<std::size_t>(v - box_.v0 + 1) * stride_ + static_cast<std::size_t>(u - first_u_ + 1);
  }
  [[nodiscard]] std::size_t tile_of(int u, int v) const {
    return static_cast<std::size_t>((v - box_.v0) / tile_px_ * columns_ + (u - box_.u0) / tile_px_);
  }

  PixelBox box_;
  int first_u_ = 0;         ///< of the words that the box touches
  std::size_t stride_ = 0;  ///< pixels of these, and one
  BinaryMask in_box_;
  double unit_ = 1.0;  ///< px of a 320x240 picture in this one
  double reach_px_ = 0.0;
  bool rough_ = false;  ///< the prediction may be far off
  int tile_px_ = 32, columns_ = 0, rows_ = 0;
  BinaryMask predicted_;
  BinaryMask band_;                        ///< in whose words distances are measured; elsewhere they are larger
  BinaryMask near_;                        ///< no further from the outline than the prediction may be off
  BinaryMask judged_;                      ///< near, and of unknown background: colours decide
  BinaryMask doubted_;                     ///< of known background that differs: colours may deny it
  BinaryMask denied_;                      ///< ... and do
  BinaryMask weighed_;                     ///< these and those around, whose evidence they take in
  BinaryMask robot_pixels_, rest_pixels_;  ///< robot for certain, background for certain
  BinaryMask work_;
  std::vector<float> distance_;         ///< from the predicted outline, px
  std::vector<std::uint8_t> hits_;      ///< of one word's pixels, 0 or 1
  std::vector<std::uint16_t> cell_;     ///< of each pixel: its number in `palette_`
  std::vector<std::uint16_t> palette_;  ///< cells that the box shows
  std::vector<std::uint16_t> number_;   ///< of every cell, in `palette_`
  std::vector<float> known_evidence_;   ///< by tile and cell, once one was asked for; not a number: not yet
  std::vector<float> evidence_, sums_, smooth_;
  Side robot_, rest_;
  MaskMorphology morphology_;
};

template <class Function>
void ColourEvidence::for_each_in(const BinaryMask& mask, Function&& function) const {
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      for (std::uint64_t bits = mask.row(v)[w] & in_box_.row(v)[w]; bits != 0; bits &= bits - 1) {
        function(64 * w + std::countr_zero(bits), v);
      }
    }
  }
}

template <class Function>
void ColourEvidence::for_each_outside(float from_px, float to_px, Function&& function) {
  within(to_px, near_);
  within(std::nextafter(from_px, 0.0f), work_);
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) near_.row(v)[w] &= ~(work_.row(v)[w] | predicted_.row(v)[w]);
  }
  for_each_in(near_, std::forward<Function>(function));
}

}  // namespace bodyschema
