#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/simulator/lens.hpp"

namespace bodyschema::simulator {

/// What stands behind the hand: the inside of a sphere around the robot, painted in one colour or
/// with clutter, so that it moves plausibly when the head does. Immutable after construction.
class Background {
 public:
  /// @param colour  levels 0-255
  /// @param unevenness  how much the light varies over the room, share of the level
  static Background single_colour(const Eigen::Vector3f& colour, float unevenness, std::uint64_t seed);
  /// Shapes with stripes, checks, speckle and gradients in random colours, a share of them close to
  /// `near_colours` (levels 0-255), which is where a segmentation by colour fails.
  static Background clutter(const std::vector<Eigen::Vector3f>& near_colours, std::uint64_t seed);

  /// Fills `picture` (three floats a pixel, levels) with what the camera sees.
  /// @param X_WC  camera in the root frame, metres
  void paint(const CameraModel& camera, const Pose& X_WC, std::vector<float>& picture) const;
  /// The same in rows [v0, v1) alone, for a camera whose rays are known.
  void paint(const Lens& lens, const Pose& X_WC, int v0, int v1, std::vector<float>& picture) const;

 private:
  Background() = default;
  [[nodiscard]] Eigen::Vector3f look_up(const Eigen::Vector3f& direction) const;

  static constexpr int kFaceSize = 512;
  bool flat_ = false;
  Eigen::Vector3f flat_colour_ = Eigen::Vector3f::Zero();
  float unevenness_ = 0.0f;
  std::array<Eigen::Vector3f, 3> waves_;
  std::array<float, 3> phases_{};
  std::vector<float> faces_;  // cube map, six faces, rows, three floats a texel
};

}  // namespace bodyschema::simulator
