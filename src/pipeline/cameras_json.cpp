#include "cameras_json.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/pipeline/pose_json.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

Json camera_json(const CameraModel& camera, const CameraModel& first) {
  const PinholeIntrinsics& k = camera.intrinsics;
  const CameraMount& mount = camera.mount;
  Json json = {{mount.relative ? "beside" : "link", mount.relative ? first.name : mount.parent},
               {mount.relative ? "X_beside_optical" : "X_link_optical", pose_json(mount.X_PC)}};
  json.update({{"image_type", camera.number()}, {"width", k.width}, {"height", k.height}, {"fx", k.fx}});
  json.update({{"fy", k.fy}, {"cx", k.cx}, {"cy", k.cy}, {"distortion", camera.distortion}});
  return json;
}

bool alike(const Json& a, const Json& b) {
  constexpr double kRelative = 1e-9;
  if (!a.is_number() || !b.is_number()) return a == b;
  const double x = a.get<double>(), y = b.get<double>();
  return std::abs(x - y) <= kRelative * std::max({1.0, std::abs(x), std::abs(y)});
}

/// "/left/distortion/2" as people write it: "cameras.left.distortion.2".
std::string key_of(std::string pointer) {
  std::replace(pointer.begin(), pointer.end(), '/', '.');
  return "cameras" + pointer;
}

}  // namespace

nlohmann::ordered_json cameras_json(const StereoRig& rig) {
  Json json = Json::object();
  for (const auto& camera : rig.cameras) json[camera.name] = camera_json(camera, rig.cameras.front());
  return json;
}

std::string difference_of_cameras(const nlohmann::ordered_json& there, const nlohmann::ordered_json& here) {
  const Json made_with = there.flatten(), now = here.flatten();
  for (const auto& [pointer, value] : made_with.items()) {
    const auto other = now.find(pointer);
    if (other == now.end()) return key_of(pointer) + " " + value.dump() + ", but the configuration has no such key";
    if (!alike(value, *other))
      return key_of(pointer) + " " + value.dump() + ", but the configuration has " + other->dump();
  }
  for (const auto& [pointer, value] : now.items()) {
    if (!made_with.contains(pointer)) return "no " + key_of(pointer) + ", but the configuration has " + value.dump();
  }
  return {};
}

}  // namespace bodyschema
