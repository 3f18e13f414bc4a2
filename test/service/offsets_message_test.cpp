#include "bodyschema/service/offsets_message.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(OffsetsMessage, CarriesTheEstimate) {
  Estimate estimate;
  estimate.utime = 1'234'567;
  estimate.state = EstimatorState::kConverging;
  estimate.joint_names = {"shoulder", "elbow"};
  estimate.offset_rad = Eigen::Vector2d(0.1, -0.2);
  estimate.covariance_rad2 = (Eigen::Matrix2d() << 4.0, 1.0, 1.0, 9.0).finished();
  estimate.nuisance_names = {"vergence"};
  estimate.nuisance_units = {"rad"};
  estimate.nuisance = Eigen::VectorXd::Constant(1, 0.01);
  estimate.nuisance_sd = Eigen::VectorXd::Constant(1, 0.002);
  estimate.effective_sample_size = 42.0;
  estimate.best_likelihood = 0.9;
  Pose X = Pose::Identity();
  X.translation() = Eigen::Vector3d(1.0, 2.0, 3.0);
  X.rotate(Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()));
  estimate.X_CP = {X};
  StereoRig rig;
  rig.cameras.resize(2);
  rig.cameras[0].name = "left";
  rig.cameras[1].name = "right";

  // Through the wire and back: what a subscriber sees.
  joint_offsets_t seen;
  ASSERT_TRUE(decode(encode(to_message(estimate, rig)), seen).ok());
  EXPECT_EQ(seen.utime, 1'234'567);
  EXPECT_EQ(seen.state, "converging");
  EXPECT_EQ(seen.joint_name, estimate.joint_names);
  EXPECT_EQ(seen.mean_rad, (std::vector<double>{0.1, -0.2}));
  EXPECT_EQ(seen.covariance_rad2, (std::vector<std::vector<double>>{{4.0, 1.0}, {1.0, 9.0}}));
  EXPECT_EQ(seen.parameter_name, estimate.nuisance_names);
  EXPECT_EQ(seen.parameter_unit, estimate.nuisance_units);
  EXPECT_EQ(seen.parameter_value, std::vector<double>{0.01});
  EXPECT_EQ(seen.parameter_stddev, std::vector<double>{0.002});
  ASSERT_EQ(seen.num_cameras, 1);
  EXPECT_EQ(seen.camera_name[0], "left");
  EXPECT_EQ(seen.hand_pose_in_camera[0].position_m[2], 3.0);
  EXPECT_NEAR(seen.hand_pose_in_camera[0].quaternion_wxyz[0], std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(seen.hand_pose_in_camera[0].quaternion_wxyz[3], std::sqrt(0.5), 1e-12);
}

}  // namespace
}  // namespace bodyschema
