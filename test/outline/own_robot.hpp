#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>

#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"

namespace bodyschema {

/// Our own robot with its arm before its eyes.
class OwnRobot : public ::testing::Test {
 protected:
  /// @param reduction  of the pictures (picture_reduction)
  explicit OwnRobot(int reduction = 1)
      : configuration_(
            Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/robot.yaml")),
        setup_(RobotSetup::from(configuration_.section("robot"))), robot_(setup_.load()),
        rig_(StereoRig::from(configuration_.section("cameras"))) {
    for (auto& camera : rig_.cameras) {
      if (reduction > 1) camera.intrinsics = reduced(camera.intrinsics, reduction);
    }
  }

  /// The offsets of the paper's Table I.
  [[nodiscard]] static Eigen::VectorXd paper_offsets_rad() {
    Eigen::VectorXd offset(7);
    offset << 5, 4, 3, -2, 3, -7, 3;
    return offset * (kPi / 180.0);
  }

  /// A joint vector of a reach, s from 0 (low and right) to 1.
  [[nodiscard]] Eigen::VectorXd pose(double s) const {
    Eigen::VectorXd q = setup_.default_joints(*robot_);
    const auto set = [&](const char* name, double from_deg, double to_deg) {
      q(robot_->joint_index(name)) = radians(from_deg + s * (to_deg - from_deg));
    };
    set("neck_pitch", -10, -10);
    set("eyes_tilt", -10, -10);
    set("r_shoulder_pitch", -68, -74);
    set("r_shoulder_roll", 20, 24);
    set("r_shoulder_yaw", 18, 14);
    set("r_elbow", 72, 78);
    set("r_wrist_prosup", 50, 42);
    set("r_wrist_pitch", -20, -12);
    set("r_wrist_yaw", 5, 2);
    set("r_thumb_oppose", 50, 50);
    set("r_index_proximal", 20, 20);
    set("r_middle_distal", 40, 40);
    set("r_pinky", 60, 60);
    return q;
  }

  Configuration configuration_;
  RobotSetup setup_;
  std::shared_ptr<const RobotModel> robot_;
  StereoRig rig_;
};

}  // namespace bodyschema
