#include "bodyschema/pipeline/ros_files.hpp"

#include <spdlog/fmt/fmt.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <map>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/core/yaml_name.hpp"
#include "bodyschema/robot/urdf_origin.hpp"

namespace bodyschema {
namespace {

using tinyxml2::XMLElement;

struct Origin {
  Eigen::Vector3d xyz = Eigen::Vector3d::Zero(), rpy = Eigen::Vector3d::Zero();
};

/// A URDF's joints with their origins, in document order.
std::vector<std::pair<std::string, Origin>> origins_of(const std::filesystem::path& urdf) {
  tinyxml2::XMLDocument document;
  const bool read = document.LoadFile(urdf.c_str()) == tinyxml2::XML_SUCCESS;
  const XMLElement* robot = read ? document.FirstChildElement("robot") : nullptr;
  if (robot == nullptr) throw FileError(urdf.string() + ": cannot be read as a URDF");
  std::vector<std::pair<std::string, Origin>> all;
  for (const XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    if (joint->Attribute("name") == nullptr || joint->Attribute("type") == nullptr) continue;  // of a transmission
    const XMLElement* origin = joint->FirstChildElement("origin");
    const auto triple = [&](const char* key) {
      return urdf_triple(origin != nullptr ? origin->Attribute(key) : nullptr);
    };
    all.emplace_back(joint->Attribute("name"), Origin{triple("xyz"), triple("rpy")});
  }
  return all;
}

/// In an XML attribute.
std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : name) {
    switch (c) {
      case '&': text += "&amp;"; break;
      case '<': text += "&lt;"; break;
      case '"': text += "&quot;"; break;
      default: text += c;
    }
  }
  return text;
}

/// As one word of a shell.
std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

/// encoder - true by joint: what was found and what an extended model knows.
std::map<std::string, double> offsets_of(const Correction& correction) {
  std::map<std::string, double> all;
  for (const auto* list : {&correction.offsets_rad, &correction.known_offsets_rad}) {
    for (const auto& [joint, offset] : *list) all[joint] += offset;
  }
  return all;
}

std::string warnings_of(const Correction& correction, const std::string& mark) {
  std::string text;
  for (const std::string& warning : correction.warnings) text += mark + warning + '\n';
  return text;
}

std::string calibration_yaml(const std::filesystem::path& urdf, const std::filesystem::path& corrected,
                             const Correction& correction) {
  std::string text =
      "# Joints as calibrated, for xacro:\n"
      "#   <xacro:property name=\"calibration\" value=\"${xacro.load_yaml('joint_calibration.yaml')}\"/>\n"
      "#   <xacro:property name=\"c\" value=\"${calibration['joints']['NAME']}\"/>\n"
      "#   <origin xyz=\"${c['x']} ${c['y']} ${c['z']}\" rpy=\"${c['roll']} ${c['pitch']} ${c['yaw']}\"/>\n"
      "# x to yaw: the joint's origin (m, rad) with which the encoders, as they are, are right. offset (rad; m of a "
      "joint\n"
      "# that slides): encoder = true + offset; it is in the origin already, for whoever corrects encoders instead.\n";
  text += warnings_of(correction, "# ") + "joints:\n";
  const auto offsets = offsets_of(correction);
  std::map<std::string, double> sds(correction.sd_rad.begin(), correction.sd_rad.end());
  const auto before = origins_of(urdf);
  const std::map<std::string, Origin> known(before.begin(), before.end());
  bool any = false;
  for (const auto& [joint, origin] : origins_of(corrected)) {
    const auto old = known.find(joint);
    const auto offset = offsets.find(joint);
    const bool moved = old != known.end() && (old->second.xyz != origin.xyz || old->second.rpy != origin.rpy);
    if (!moved && offset == offsets.end()) continue;
    any = true;
    text += fmt::format(
        "  {}:\n    x: {:.12g}\n    y: {:.12g}\n    z: {:.12g}\n    roll: {:.12g}\n    pitch: {:.12g}\n"
        "    yaw: {:.12g}\n    offset: {:.9g}\n",
        yaml_name(joint), origin.xyz.x(), origin.xyz.y(), origin.xyz.z(), origin.rpy.x(), origin.rpy.y(),
        origin.rpy.z(), offset == offsets.end() ? 0.0 : offset->second);
    if (const auto sd = sds.find(joint); sd != sds.end()) text += fmt::format("    offset_sd: {:.6g}\n", sd->second);
  }
  return any ? text : text + "  {}\n";
}

std::string camera_info_yaml(const RosCamera& camera, const Correction& correction) {
  const auto& k = camera.intrinsics;
  const auto& d = camera.distortion;
  return warnings_of(correction, "# ") +
         fmt::format(
             "image_width: {}\nimage_height: {}\ncamera_name: {}\n"
             "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{:.9g}, 0, {:.9g}, 0, {:.9g}, {:.9g}, 0, 0, 1]\n"
             "distortion_model: plumb_bob\n"
             "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{:.9g}, {:.9g}, {:.9g}, {:.9g}, {:.9g}]\n"
             "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
             "projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{:.9g}, 0, {:.9g}, 0, 0, {:.9g}, {:.9g}, 0, 0, 0, 1, "
             "0]\n",
             k.width, k.height, yaml_name(camera.name), k.fx, k.cx, k.fy, k.cy, d[0], d[1], d[2], d[3], d[4], k.fx,
             k.cx, k.fy, k.cy);
}

std::string static_transforms(const std::vector<RosCamera>& cameras, const Correction& correction) {
  std::string text =
      "#!/bin/sh\n"
      "# Publishes where the cameras are, for ROS 2; the lines of ROS 1 stand above. Optical axes: x right, y down,\n"
      "# z forward.\n" +
      warnings_of(correction, "# ");
  bool any = false;
  for (const RosCamera& camera : cameras) {
    if (camera.parent.empty()) {
      text += fmt::format("# {}: its link is in corrected.urdf\n", camera.name);
      continue;
    }
    any = true;
    const Eigen::Vector3d t = camera.X_PC.translation();
    const Eigen::Quaterniond q(camera.X_PC.linear());
    const std::string parent = shell_word(camera.parent), child = shell_word(ros_frame_of(camera.name));
    text += fmt::format(
        "# rosrun tf2_ros static_transform_publisher {:.9g} {:.9g} {:.9g} {:.12g} {:.12g} {:.12g} {:.12g} {} {}\n",
        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), parent, child);
    text += fmt::format(
        "ros2 run tf2_ros static_transform_publisher --x {:.9g} --y {:.9g} --z {:.9g} --qx {:.12g} "
        "--qy {:.12g} --qz {:.12g} --qw {:.12g} --frame-id {} --child-frame-id {} &\n",
        t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w(), parent, child);
  }
  return any ? text + "wait\n" : text;
}

std::string transmissions_xml(const Correction& correction) {
  std::string notes = warnings_of(correction, "     ");
  for (auto at = notes.find("--"); at != std::string::npos; at = notes.find("--"))
    notes.erase(at, 1);  // ends a comment
  std::string text =
      "<?xml version=\"1.0\"?>\n"
      "<!-- Transmissions for the <ros2_control> block of the URDF as it was: <offset> takes the encoders' error out "
      "(rad;\n"
      "     m of a joint that slides; what stands there already is to be added). Not beside corrected.urdf or\n"
      "     joint_calibration.yaml, which hold the same correction. Reduction and actuator names are yours.\n" +
      notes + "-->\n<ros2_control>\n";
  for (const auto& [joint, offset] : offsets_of(correction)) {
    if (offset == 0.0) continue;
    const std::string name = escaped(joint);
    text += fmt::format(
        "  <transmission name=\"{}_transmission\">\n"
        "    <plugin>transmission_interface/SimpleTransmission</plugin>\n"
        "    <actuator name=\"{}_actuator\" role=\"actuator1\"/>\n"
        "    <joint name=\"{}\" role=\"joint1\">\n"
        "      <mechanical_reduction>1</mechanical_reduction>\n"
        "      <offset>{:.9g}</offset>\n"
        "    </joint>\n"
        "  </transmission>\n",
        name, name, name, -offset);
  }
  return text + "</ros2_control>\n";
}

}  // namespace

std::string ros_frame_of(const std::string& camera) {
  return camera + "_optical_frame";
}

std::vector<RosCamera> ros_cameras_of(const StereoRig& rig) {
  std::vector<RosCamera> cameras;
  for (const CameraModel& camera : rig.cameras) {
    const CameraMount& mount = camera.mount;
    RosCamera one{camera.name, camera.intrinsics, camera.distortion, "", mount.X_PC};
    if (mount.relative) {
      const CameraModel& first = rig.cameras.front();
      one.parent = first.link == first.mount.parent ? first.link : ros_frame_of(first.name);
    } else if (camera.link != mount.parent) {
      one.parent = mount.parent;
    }
    cameras.push_back(std::move(one));
  }
  return cameras;
}

std::string write_ros_files(const std::filesystem::path& folder, const std::filesystem::path& urdf,
                            const std::filesystem::path& corrected_urdf, const Correction& correction,
                            const std::vector<RosCamera>& cameras) {
  make_folder(folder / "camera_info");
  std::string files;
  const auto write = [&](const char* what, const std::filesystem::path& file, const std::string& text) {
    replace_file(file, text);
    files += fmt::format("{:<21} {}\n", what, file.string());
  };
  write("xacro                ", folder / "joint_calibration.yaml", calibration_yaml(urdf, corrected_urdf, correction));
  for (const RosCamera& camera : cameras) {
    write("ROS camera_info      ", folder / "camera_info" / (camera.name + ".yaml"),
          camera_info_yaml(camera, correction));
  }
  write("ROS transforms       ", folder / "static_transforms.sh", static_transforms(cameras, correction));
  write("ros2_control offsets ", folder / "ros2_control_transmissions.xml", transmissions_xml(correction));
  return files;
}

}  // namespace bodyschema
