// A folder of stills. The input is cut at NUL bytes into joints.csv, a ROS CameraInfo, a camera_pose.json and a
// picture.
#include <array>

#include "bodyschema/camera/camera_info.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/imports/stills.hpp"
#include "fuzz.hpp"

using namespace bodyschema;

namespace {

std::filesystem::path put(std::string_view text, const std::string& name) {
  return fuzz::as_file(reinterpret_cast<const std::uint8_t*>(text.data()), text.size(), name);
}

ImportTarget make_target() {
  put("<robot name='r'><link name='base'/><link name='hand'/><joint name='elbow' type='continuous'>"
      "<parent link='base'/><child link='hand'/><axis xyz='0 0 1'/></joint></robot>",
      "stills_robot/robot.urdf");
  return ImportTarget::from(Configuration::load(
      put("robot: {urdf: robot.urdf, rendered_links: [hand], hand_link: hand, estimated_joints: [elbow]}\n"
          "cameras: {left: {link: base, pose: unknown, width: 4, height: 2, fx: 4, fy: 4, cx: 1.5, cy: 0.5}}\n",
          "stills_robot/robot.yaml")));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const ImportTarget target = make_target();
  std::array<std::string_view, 4> parts;
  std::string_view rest = fuzz::as_text(data, size);
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    const std::size_t end = std::min(rest.find('\0'), rest.size());
    parts[i] = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  parts[3] = rest;  // a picture holds NUL bytes of its own
  const auto folder = put(parts[0], "stills/joints.csv").parent_path();
  const auto info = put(parts[1], "stills/camera_info/left.yaml");
  const auto pose = put(parts[2], "stills/camera_pose.json");
  put(parts[3], "stills/images/left/00.png");
  put(parts[3], "stills/masks/left/00.png");
  fuzz::refuse_or_accept([&] { (void)import_stills(folder, target, {}, "/dev/null"); });
  fuzz::refuse_or_accept([&] { (void)CameraInfo::read(info); });
  fuzz::refuse_or_accept([&] { (void)CameraPoses::read(pose); });
  return 0;
}
