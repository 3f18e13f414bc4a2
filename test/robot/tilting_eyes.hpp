#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <utility>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "temporary_folder.hpp"

namespace bodyschema::test {

/// A robot of a neck, an arm of one joint and eyes that pan and tilt each by themselves: the left one hangs its tilt
/// on its pan, the right one its pan on its tilt. Head joints are left to the caller.
inline std::pair<RobotSetup, StereoRig> tilting_eyes() {
  const auto joint = [](const char* name, const char* parent, const char* child, const char* axis) {
    return std::string("<joint name='") + name + "' type='revolute'><parent link='" + parent + "'/><child link='" +
           child + "'/><axis xyz='" + axis + "'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint>";
  };
  const auto camera = [](const char* name, const char* parent) {
    return std::string("<joint name='at_") + name + "' type='fixed'><parent link='" + parent + "'/><child link='" +
           name + "'/><origin rpy='-1.5708 0 -1.5708'/></joint>";
  };
  std::string urdf = "<robot name='eyes'>";
  for (const char* link : {"root", "head", "l_outer", "l_inner", "r_outer", "r_inner", "left", "right", "hand"}) {
    urdf += std::string("<link name='") + link + "'/>";
  }
  urdf += joint("neck", "root", "head", "0 0 1") + joint("l_pan", "head", "l_outer", "0 0 1") +
          joint("l_tilt", "l_outer", "l_inner", "0 1 0") + joint("r_tilt", "head", "r_outer", "0 1 0") +
          joint("r_pan", "r_outer", "r_inner", "0 0.1 -1") + joint("arm", "root", "hand", "0 1 0") +
          camera("left", "l_inner") + camera("right", "r_inner") + "</robot>";
  std::pair<RobotSetup, StereoRig> robot;
  auto& [setup, rig] = robot;
  static const TemporaryFolder folder;
  setup.model.urdf = folder.write("eyes.urdf", urdf);
  setup.hand_link = "hand";
  setup.estimated_joints = {"arm"};
  rig.cameras.resize(2);
  rig.cameras[0].link = "left";
  rig.cameras[1].link = "right";
  return robot;
}

}  // namespace bodyschema::test
