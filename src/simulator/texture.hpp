#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "bodyschema/simulator/random.hpp"

namespace bodyschema::simulator {

/// Repeatable smooth noise of the plane, 0 to 1, one bump a unit.
float value_noise(float x, float y, std::uint32_t salt);

/// A painted rectangle, x to the right and y up from its lower left corner, metres. Levels 0-255. Painted with its
/// functions, then finished; immutable from then on.
class Texture {
 public:
  /// @param texel_m  side of a texel
  Texture(float width_m, float height_m, float texel_m, const Eigen::Vector3f& colour);

  enum class Fill { kPlain, kStripesUp, kStripesAcross, kChecks, kSpeckle, kGradient, kGrain };
  struct Colours {
    Eigen::Vector3f first, second;
    Fill fill = Fill::kPlain;
    float pitch_m = 0.02f;
    std::uint32_t salt = 0;
  };
  void rectangle(float x0, float y0, float x1, float y1, const Colours& colours);
  void ellipse(float x, float y, float rx, float ry, const Colours& colours);
  /// A rectangle turned by an angle (rad) about its middle.
  void turned_rectangle(float x, float y, float width, float height, float angle, const Colours& colours);
  /// Multiplies all levels by a smooth factor around 1: stains, uneven light.
  void mottle(float share, float bump_m, std::uint32_t salt);
  /// Multiplies by a factor that goes from `low` at the bottom to `high` at the top.
  void shade_up(float low, float high);
  /// Makes the smaller copies that are looked at from afar.
  void finish();

  /// Level at a point; beyond the border that of the border. @param footprint_m  what a pixel covers there
  [[nodiscard]] Eigen::Vector3f at(float x, float y, float footprint_m) const;
  [[nodiscard]] float width_m() const { return width_m_; }
  [[nodiscard]] float height_m() const { return height_m_; }

 private:
  struct Level {
    int width, height;
    std::vector<std::uint8_t> rgb;
  };
  template <class Inside>
  void paint(float x0, float y0, float x1, float y1, const Colours& colours, const Inside& inside);

  float width_m_, height_m_, texel_m_;
  std::vector<Level> levels_;
};

}  // namespace bodyschema::simulator
