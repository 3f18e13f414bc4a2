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
  estimate.covariance_rad2 = (Eigen::Matrix2d() << 4e-6, 1e-6, 1e-6, 9.0).finished();
  estimate.prior_sd_rad = Eigen::Vector2d::Constant(10.0);
  estimate.effects.push_back({.effect = "vergence",
                              .joint = "",
                              .source = "",
                              .parameter = "angle",
                              .name = "vergence",
                              .unit = "deg",
                              .si_per_unit = M_PI / 180.0,
                              .value = M_PI / 180.0,
                              .sd = 0.2 * M_PI / 180.0,
                              .prior_sd = 2.0 * M_PI / 180.0});
  estimate.hand_sd_m = 6e-4;
  estimate.verdict = FrameVerdict::kDoubtful;
  estimate.innovation = 31.0;
  estimate.innovation_dof = 9.0;
  estimate.innovation_usual = 1.25;
  estimate.postures = 7;
  estimate.posture_sd_rad = 0.001;
  estimate.outline_sd_px = 0.3;
  estimate.outline_alike = 5.5;
  estimate.changed = "elbow slipped by 4.9 deg";
  estimate.misfit = "postures disagree";
  estimate.stalled_joint = "elbow";
  estimate.stalled_motion_rad = 0.1;
  estimate.cameras_swapped = true;
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
  EXPECT_EQ(seen.covariance_rad2, (std::vector<std::vector<double>>{{4e-6, 1e-6}, {1e-6, 9.0}}));
  EXPECT_EQ(seen.told, (std::vector<std::int8_t>{1, 0}));
  EXPECT_EQ(seen.parameter_name, std::vector<std::string>{"vergence"});
  EXPECT_EQ(seen.parameter_unit, std::vector<std::string>{"deg"});
  ASSERT_EQ(seen.parameter_value.size(), 1u);
  EXPECT_NEAR(seen.parameter_value[0], 1.0, 1e-12);
  EXPECT_NEAR(seen.parameter_stddev.at(0), 0.2, 1e-12);
  EXPECT_NEAR(seen.parameter_prior_stddev.at(0), 2.0, 1e-12);
  EXPECT_EQ(seen.hand_stddev_m, 6e-4);
  EXPECT_EQ(seen.verdict, "doubtful");
  EXPECT_EQ(seen.innovation, 31.0);
  EXPECT_EQ(seen.innovation_dof, 9.0);
  EXPECT_EQ(seen.innovation_usual, 1.25);
  EXPECT_EQ(seen.postures, 7);
  EXPECT_EQ(seen.posture_stddev_rad, 0.001);
  EXPECT_EQ(seen.outline_stddev_px, 0.3);
  EXPECT_EQ(seen.outline_points_alike, 5.5);
  EXPECT_EQ(seen.changed, estimate.changed);
  EXPECT_EQ(seen.misfit, estimate.misfit);
  EXPECT_EQ(seen.stalled_joint, "elbow");
  EXPECT_EQ(seen.stalled_motion_rad, 0.1);
  EXPECT_EQ(seen.cameras_swapped, 1);
  ASSERT_EQ(seen.num_cameras, 1);
  EXPECT_EQ(seen.camera_name[0], "left");
  EXPECT_EQ(seen.hand_pose_in_camera[0].position_m[2], 3.0);
  EXPECT_NEAR(seen.hand_pose_in_camera[0].quaternion_wxyz[0], std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(seen.hand_pose_in_camera[0].quaternion_wxyz[3], std::sqrt(0.5), 1e-12);
}

TEST(FindingsMessage, CarriesWhatIsAskedFor) {
  LiveFindings findings{.utime = 77, .span_s = 30.0, .blocks = 21, .z_threshold = 4.5, .causes = {}};
  findings.causes.push_back({.effect = "slip",
                             .joint = "elbow",
                             .source = "",
                             .sentence = "elbow slipped by 4.9 deg",
                             .parameters = {{"step", "deg", -4.9, 0.1}},
                             .z = 11.0,
                             .hand_mm = 25.0,
                             .outline_px = 12.0,
                             .alike = {"drift of elbow"},
                             .from = 55,
                             .estimated = true});
  EXPECT_EQ(findings.causes[0].text(), "slip of elbow -4.9 deg, or drift of elbow");
  findings_t seen;
  ASSERT_TRUE(decode(encode(to_message(findings)), seen).ok());
  EXPECT_EQ(seen.utime, 77);
  EXPECT_DOUBLE_EQ(seen.span_s, 30.0);
  EXPECT_EQ(seen.blocks, 21);
  ASSERT_EQ(seen.finding.size(), 1u);
  const auto& f = seen.finding[0];
  EXPECT_EQ(f.effect, "slip");
  EXPECT_EQ(f.joint, "elbow");
  EXPECT_EQ(f.parameter_unit, std::vector<std::string>{"deg"});
  EXPECT_EQ(f.parameter_value, std::vector<double>{-4.9});
  EXPECT_EQ(f.parameter_stddev, std::vector<double>{0.1});
  EXPECT_DOUBLE_EQ(f.hand_m, 0.025) << "metres on the wire";
  EXPECT_EQ(f.from_utime, 55);
  EXPECT_EQ(f.estimated, 1);
  EXPECT_EQ(f.alike, findings.causes[0].alike);
}

}  // namespace
}  // namespace bodyschema
