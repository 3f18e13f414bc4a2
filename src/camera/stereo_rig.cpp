#include "bodyschema/camera/stereo_rig.hpp"

#include <algorithm>

namespace bodyschema {
namespace {

CameraModel read_camera(const Configuration& section, const std::string& name) {
  CameraModel camera;
  camera.name = name;
  camera.link = section.text("link");
  PinholeIntrinsics& k = camera.intrinsics;
  constexpr int kMaxSide = 8192;
  k.width = static_cast<int>(section.integer("width", 1, kMaxSide));
  k.height = static_cast<int>(section.integer("height", 1, kMaxSide));
  constexpr double kMinFocal = 1.0, kMaxFocal = 1e5;
  k.fx = section.number("fx", kMinFocal, kMaxFocal);
  k.fy = section.number("fy", kMinFocal, kMaxFocal);
  k.cx = section.number("cx", -kMaxSide, 2 * kMaxSide);
  k.cy = section.number("cy", -kMaxSide, 2 * kMaxSide);
  const auto distortion = section.numbers_or("distortion", {0, 0, 0, 0, 0});
  if (distortion.size() != camera.distortion.size()) {
    section.fail("distortion", "five numbers [k1, k2, p1, p2, k3]");
  }
  std::copy(distortion.begin(), distortion.end(), camera.distortion.begin());
  return camera;
}

}  // namespace

bool CameraModel::has_distortion() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double d) { return d != 0.0; });
}

StereoRig StereoRig::from(const Configuration& cameras) {
  StereoRig rig;
  for (const char* name : {"left", "right"}) {
    if (cameras.has(name)) rig.cameras.push_back(read_camera(cameras.section(name), name));
  }
  if (rig.cameras.empty()) cameras.fail("left", "a camera under 'left', 'right' or both");
  return rig;
}

std::vector<PinholeIntrinsics> StereoRig::intrinsics() const {
  std::vector<PinholeIntrinsics> all;
  for (const auto& camera : cameras) all.push_back(camera.intrinsics);
  return all;
}

}  // namespace bodyschema
