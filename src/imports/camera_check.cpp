#include "camera_check.hpp"

#include <spdlog/fmt/fmt.h>

#include <cmath>

namespace bodyschema {

std::optional<std::string> camera_difference(const CameraModel& camera, const CameraInfo& info,
                                             const std::string& source) {
  const PinholeIntrinsics &mine = camera.intrinsics, &theirs = info.intrinsics;
  if (mine.width != theirs.width || mine.height != theirs.height) {
    return fmt::format("camera '{}' is configured with {}x{} px, but {} has {}x{}", camera.name, mine.width,
                       mine.height, source, theirs.width, theirs.height);
  }
  const auto near = [](const PinholeIntrinsics& a, const PinholeIntrinsics& b) {
    constexpr double kShare = 0.02, kShift_px = 0.02;  // of the focal length, of the picture's width
    const double shift_px = kShift_px * a.width;
    return std::abs(a.fx - b.fx) <= kShare * a.fx && std::abs(a.fy - b.fy) <= kShare * a.fy &&
           std::abs(a.cx - b.cx) <= shift_px && std::abs(a.cy - b.cy) <= shift_px;
  };
  if (near(mine, theirs) || near(mine, info.rectified)) return std::nullopt;
  return fmt::format(
      "camera '{}' is configured with fx {:.6g}, fy {:.6g}, cx {:.6g}, cy {:.6g}, but {} has {:.6g}, {:.6g}, {:.6g}, "
      "{:.6g}",
      camera.name, mine.fx, mine.fy, mine.cx, mine.cy, source, theirs.fx, theirs.fy, theirs.cx, theirs.cy);
}

}  // namespace bodyschema
