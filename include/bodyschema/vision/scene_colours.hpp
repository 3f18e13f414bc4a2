#pragma once

#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/robot_looks.hpp"

namespace bodyschema {

/// Colours of both sides in all pictures of a recording: the robot's, and those of all that is none. Whatever hides the
/// robot in some of them, or lies beside it, has little share in either.
struct SceneColours {
  RobotLooks robot, rest;
  [[nodiscard]] bool known() const { return robot.known() && rest.known(); }
};

/// Counts them in pictures where it is known about where the robot is.
class SceneColourCounts {
 public:
  SceneColourCounts();
  /// @param predicted  where the robot is thought to be, of the picture's size
  /// @param reach_px  how far off that may be: robot for certain is what lies deeper inside, or the deepest part of it
  /// @param beside  all that may be robot
  void add(const Image& image, const BinaryMask& predicted, double reach_px, const BinaryMask& beside);
  [[nodiscard]] SceneColours shares() const;

 private:
  int channels_ = 0;
  std::vector<double> robot_, rest_;
};

}  // namespace bodyschema
