#include <gmock/gmock.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class BeliefsOfOwnRobot : public OwnRobot {
 protected:
  [[nodiscard]] static Configuration load(const std::vector<std::string>& overrides = {}) {
    return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                               overrides);
  }
  [[nodiscard]] Beliefs read(const Configuration& configuration) const {
    const auto rig = StereoRig::from(configuration.section("cameras"));
    return Beliefs::from(configuration, JointRoles::of(robot_, setup_, rig), rig,
                         EstimatorOptions::from(configuration));
  }
  [[nodiscard]] static const Belief* find(const std::vector<Belief>& list, const std::string& effect,
                                          const EffectTarget& target = {}) {
    const auto at = std::find_if(list.begin(), list.end(),
                                 [&](const Belief& b) { return b.effect == effect && b.target == target; });
    return at == list.end() ? nullptr : &*at;
  }
};

TEST_F(BeliefsOfOwnRobot, TheArmsOffsetsComeFirstAsFarAsTheFiltersFirstParticlesSpread) {
  const auto beliefs = read(load({"filter.initial_sd_deg=7"}));
  for (std::size_t i = 0; i < 7; ++i) {
    EXPECT_EQ(beliefs.state[i].effect, "joint_offset");
    EXPECT_EQ(beliefs.state[i].target.joint, setup_.estimated_joints[i]);
    EXPECT_NEAR(beliefs.state[i].sd.at(0), radians(7.0), 1e-12);
  }
  EXPECT_NE(beliefs.state.at(7).effect, "joint_offset");
}

TEST_F(BeliefsOfOwnRobot, PaperModeEstimatesTheArmAlone) {
  EXPECT_EQ(read(load({"estimator.mode=paper"})).state.size(), 7u);
  EXPECT_GT(read(load()).state.size(), 7u);
}

TEST_F(BeliefsOfOwnRobot, ALensNobodyCalibratedIsEstimated) {
  const auto sd = [&](const std::vector<std::string>& overrides) {
    const auto beliefs = read(load(overrides));
    const Belief* lens = find(beliefs.state, "distortion");
    return lens == nullptr ? 0.0 : lens->sd.at(0);
  };
  EXPECT_EQ(sd({}), 0.03) << "zeros may be as wrong as other numbers are";
  EXPECT_EQ(sd({"cameras.left.distortion=none", "cameras.right.distortion=none"}), 0.0);
  EXPECT_EQ(sd({"cameras.left.distortion=unknown"}), 0.2);
  EXPECT_EQ(sd({"cameras.left.distortion=[-0.3, 0, 0, 0, 0]"}), 0.03);
  EXPECT_EQ(sd({"cameras.left.distortion=[-0.3, 0, 0, 0, 0]", "cameras.right.distortion=unknown"}), 0.2);
  EXPECT_EQ(sd({"cameras.left.distortion=unknown", "estimator.state.distortion.sd=0.05"}), 0.05)
      << "what the configuration believes goes first";
  EXPECT_EQ(sd({"cameras.left.distortion=unknown", "estimator.state.distortion.sd=0"}), 0.0);
  EXPECT_EQ(sd({"cameras.left.distortion=unknown", "estimator.mode=paper"}), 0.0);
}

TEST_F(BeliefsOfOwnRobot, HowLongPicturesAreReadOutIsEstimatedUntilTheConfigurationSaysSo) {
  const auto beliefs = read(load({"cameras.left.readout_ms=unknown", "cameras.right.readout_ms=unknown"}));
  ASSERT_NE(find(beliefs.state, "rolling_shutter"), nullptr);
  EXPECT_NEAR(find(beliefs.state, "rolling_shutter")->sd.at(0), 0.015, 1e-12);
  EXPECT_NE(
      find(read(load({"cameras.left.readout_ms=20", "cameras.right.readout_ms=unknown"})).state, "rolling_shutter"),
      nullptr);
  EXPECT_EQ(find(read(load({"cameras.left.readout_ms=20", "cameras.right.readout_ms=0"})).state, "rolling_shutter"),
            nullptr);
}

TEST_F(BeliefsOfOwnRobot, OfTheHeadOnlyWhatMovesBothEyes) {
  const auto beliefs = read(load({"estimator.state.head_offset.sd_deg=2"}));
  for (const char* joint : {"neck_pitch", "neck_roll", "neck_yaw", "eyes_tilt"}) {
    ASSERT_NE(find(beliefs.state, "head_offset", {joint, ""}), nullptr) << joint;
    EXPECT_NEAR(find(beliefs.state, "head_offset", {joint, ""})->sd.at(0), radians(2.0), 1e-12);
  }
  for (const char* joint : {"l_eye_pan", "r_eye_pan"}) {
    EXPECT_EQ(find(beliefs.state, "head_offset", {joint, ""}), nullptr) << joint;
  }
}

TEST_F(BeliefsOfOwnRobot, ZeroLeavesAnEffectOutAndAddsNone) {
  EXPECT_NE(find(read(load()).state, "mesh_scale"), nullptr);
  EXPECT_EQ(find(read(load({"estimator.state.mesh_scale.sd_percent=0"})).state, "mesh_scale"), nullptr);
}

/// What is estimated is not considered as well, where it would count twice: it may be as far off as both say.
TEST_F(BeliefsOfOwnRobot, AToleranceOfWhatIsEstimatedWidensTheBelief) {
  const auto beliefs =
      read(load({"robot.tolerances={mesh_scale: {sd_percent: 1}, link_length: {sd_mm: 2}, baseline: {sd_mm: 0.5}}"}));
  ASSERT_NE(find(beliefs.state, "mesh_scale"), nullptr);
  const double alone = find(read(load()).state, "mesh_scale")->sd.at(0);
  EXPECT_NEAR(find(beliefs.state, "mesh_scale")->sd.at(0), std::hypot(alone, 0.01), 1e-12);
  EXPECT_EQ(find(beliefs.tolerances, "mesh_scale"), nullptr);
  EXPECT_EQ(beliefs.tolerances.size(), 6u);  // three links, two of them with their covers too, and the baseline
  EXPECT_NEAR(find(beliefs.tolerances, "baseline")->sd.at(0), 5e-4, 1e-12);
}

TEST_F(BeliefsOfOwnRobot, OffsetsAreBelievedInOnePlaceOnly) {
  for (const std::string key : {"estimator.state", "robot.tolerances"}) {
    EXPECT_THAT([&] { (void)read(load({key + "={joint_offset: {sd_deg: 3}}"})); },
                ThrowsMessage<ConfigurationError>(HasSubstr("filter.initial_sd_deg")))
        << key;
  }
}

TEST_F(BeliefsOfOwnRobot, WhereACameraSitsIsBelievedAsItsPoseSays) {
  EXPECT_TRUE(camera_beliefs(rig_).empty()) << "exact: a simulator's";
  // Nobody knows a place better than a good calibration does.
  const auto known = read(load({"cameras.left.pose=known", "cameras.right.pose=known"}));
  ASSERT_NE(find(known.state, "camera_pose"), nullptr);
  EXPECT_NEAR(find(known.state, "camera_pose")->sd.at(2), 0.001, 1e-12);
  EXPECT_NEAR(find(known.state, "camera_pair")->sd.at(5), std::sqrt(2.0) * radians(0.1), 1e-12);
  // Roughly: as its deviations say; fixed in a head, so each camera by itself.
  const auto rough = read(load({"cameras.left={pose: roughly, pose_sd_deg: 2, pose_sd_mm: 20}",
                                "cameras.right={pose: roughly, pose_sd_deg: 1, pose_sd_mm: 10}"}));
  const auto* pose = find(rough.state, "camera_pose");
  const auto* pair = find(rough.state, "camera_pair");
  ASSERT_NE(pose, nullptr);
  ASSERT_NE(pair, nullptr);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(pose->sd.at(k), 0.020, 1e-12);
    EXPECT_NEAR(pose->sd.at(k + 3), radians(2.0), 1e-12);
    EXPECT_NEAR(pair->sd.at(k), std::hypot(0.020, 0.010), 1e-12) << "each errs by itself";
    EXPECT_NEAR(pair->sd.at(k + 3), std::hypot(radians(2.0), radians(1.0)), 1e-12);
  }
  // Each axis as it is known, of the first; of the second its own and the widest of the first, which looks elsewhere.
  const auto deep = read(load({"cameras.left={pose: roughly, pose_sd_deg: [1, 2, 3], pose_sd_mm: [5, 6, 40]}",
                               "cameras.right={pose: roughly, pose_sd_deg: 1, pose_sd_mm: [10, 20, 30]}"}));
  EXPECT_NEAR(find(deep.state, "camera_pose")->sd.at(2), 0.040, 1e-12);
  EXPECT_NEAR(find(deep.state, "camera_pose")->sd.at(4), radians(2.0), 1e-12);
  EXPECT_NEAR(find(deep.state, "camera_pair")->sd.at(0), std::hypot(0.040, 0.010), 1e-12);
  EXPECT_NEAR(find(deep.state, "camera_pair")->sd.at(1), std::hypot(0.040, 0.020), 1e-12);
  EXPECT_NEAR(find(deep.state, "camera_pair")->sd.at(3), std::hypot(radians(3.0), radians(1.0)), 1e-12);
  // It stands with the camera, whatever the estimator's file says.
  const auto both = read(load({"cameras.left={pose: roughly, pose_sd_deg: 2, pose_sd_mm: 20}",
                               "estimator.state.camera_pose={sd_mm: 1, sd_deg: 1}"}));
  EXPECT_NEAR(find(both.state, "camera_pose")->sd.at(0), 0.020, 1e-12);
}

TEST_F(BeliefsOfOwnRobot, TheSecondOfARigThatSitsBesideTheFirstErrsByItselfAlone) {
  StereoRig rig = rig_;
  rig.cameras[0].mount.knowledge = PlaceKnowledge::kUnknown;
  rig.cameras[1].mount.knowledge = PlaceKnowledge::kRoughly;
  rig.cameras[1].mount.relative = true;
  rig.cameras[1].mount.sd_m = {0.001, 0.001, 0.003};
  rig.cameras[1].mount.sd_rad.setConstant(0.002);
  const auto beliefs = camera_beliefs(rig);
  ASSERT_EQ(beliefs.size(), 2u);
  EXPECT_GE(beliefs[0].sd.at(0), 0.1) << "nobody knows";
  EXPECT_EQ(beliefs[1].effect, "camera_pair");
  EXPECT_NEAR(beliefs[1].sd.at(0), 0.001, 1e-12);
  EXPECT_NEAR(beliefs[1].sd.at(2), 0.003, 1e-12);
  EXPECT_NEAR(beliefs[1].sd.at(5), 0.002, 1e-12);
  rig.cameras.resize(1);
  EXPECT_EQ(camera_beliefs(rig).size(), 1u);
}

}  // namespace
}  // namespace bodyschema
