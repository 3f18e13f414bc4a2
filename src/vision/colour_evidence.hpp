#pragma once

#include <cstdint>
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

  /// @param predicted  where the robot is thought to be
  /// @param reach_px   how far off that may be
  /// @param looks      the robot's colours as known before
  /// @param colours    those of both sides in all pictures; null: not known
  /// @param background pixels whose background is known say themselves whether they differ, in `differs`; null: none is
  /// @param robot      out: pixels taken for robot
  void separate(const Image& image, const BinaryMask& predicted, double reach_px, const RobotLooks& looks,
                const SceneColours* colours, const BackgroundModel* background, const BinaryMask& differs,
                BinaryMask& robot);
  /// Pixels near the outline whose colour, with those around, told nothing in the last `separate`: what was decided
  /// there is the prediction, not the picture.
  void mark_weak(BinaryMask& weak);
  /// Pixels of a known background that differed in the last `separate`, and whose colours are those of the rest.
  [[nodiscard]] const BinaryMask& denied() const { return denied_; }
  /// The robot's colours where it was predicted in the last `separate`.
  /// @param share  of the new ones in `looks`
  void learn(const Image& image, const BinaryMask& predicted, float share, RobotLooks& looks);

  /// Where the last `separate` looked.
  [[nodiscard]] const PixelBox& box() const { return box_; }
  /// How far inside the prediction a pixel of the box lay, px; outside: negative.
  [[nodiscard]] float depth(int u, int v) const {
    return depth_[static_cast<std::size_t>(v - box_.v0) * static_cast<std::size_t>(box_.width()) +
                  static_cast<std::size_t>(u - box_.u0)];
  }

 private:
  struct Side {
    std::vector<float> tiles;  ///< counts by tile and cell
    std::vector<float> near;   ///< the same, summed over a tile and its neighbours
    std::vector<float> total;  ///< pixels by tile, of `near`
    std::vector<float> all;    ///< of the whole box
    float count = 0.0f;
  };
  void measure_depth(const BinaryMask& predicted);
  [[nodiscard]] float core_depth(double reach_px) const;
  void find_cells(const Image& image);
  void collect(Side& robot, Side& rest) const;
  void spread(Side& side) const;
  void weigh(const RobotLooks& looks, const SceneColours* colours, double reach_px);
  void decide(double reach_px, int smoothing, bool may_deny, const BackgroundModel* background,
              const BinaryMask& differs, BinaryMask& robot);

  PixelBox box_;
  double unit_ = 1.0;   ///< px of a 320x240 picture in this one
  bool rough_ = false;  ///< the prediction may be far off
  int tile_px_ = 32, columns_ = 0, rows_ = 0;
  std::vector<float> depth_;            ///< px inside (positive) or outside the prediction
  std::vector<std::int8_t> side_;       ///< 1: robot for certain, -1: background for certain, 0: to be found
  std::vector<std::uint16_t> cell_;     ///< of each pixel of the box: its number in `palette_`
  std::vector<std::uint16_t> palette_;  ///< cells that the box shows
  std::vector<std::uint16_t> number_;   ///< of every cell, in `palette_`
  std::vector<float> evidence_, sums_, smooth_;
  Side robot_, rest_;
  BinaryMask denied_;
  MaskMorphology morphology_;
};

}  // namespace bodyschema
