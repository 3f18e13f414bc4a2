// What is estimated beside the offsets, and what is said where something else is wrong.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bodyschema/estimator/estimator.hpp"
#include "effects/own_effect.hpp"
#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"
#include "random_seed.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

class EffectsOnline : public OwnRobot {
 protected:
  EffectsOnline() : roles_(JointRoles::of(robot_, setup_, rig_)) {
    options_ = EstimatorOptions::from(configuration_);
    options_.silhouette.engine = "contour";
    options_.filter.particles = 60;
  }
  [[nodiscard]] Beliefs beliefs(const std::vector<Belief>& more = {},
                                const std::vector<Belief>& tolerances = {}) const {
    Beliefs beliefs;
    for (const auto& target : effect_targets("joint_offset", roles_)) {
      beliefs.state.push_back({"joint_offset", target, {options_.filter.initial_sd_rad}});
    }
    beliefs.state.insert(beliefs.state.end(), more.begin(), more.end());
    beliefs.tolerances = tolerances;
    return beliefs;
  }
  /// A motion through many postures: at frame i of 5 Hz.
  [[nodiscard]] Eigen::VectorXd motion(double i) const {
    Eigen::VectorXd q = pose(0.5 + std::sin(0.4 * i));
    const auto turn = [&](const char* joint, double deg, double rate) {
      q(robot_->joint_index(joint)) += radians(deg) * std::sin(rate * i);
    };
    turn("r_elbow", 8.0, 0.9);
    turn("r_wrist_prosup", 40.0, 0.7);
    turn("r_wrist_pitch", 12.0, 1.3);
    turn("r_shoulder_roll", 4.0, 1.1);
    turn("neck_yaw", 3.0, 0.5);
    return q;
  }
  Estimate follow(Estimator& estimator, SyntheticReach& reach, int from, int to) const {
    Estimate estimate;
    for (int i = from; i < to; ++i) estimate = estimator.step(reach.observe(motion(i), 200'000 * (i + 1)));
    return estimate;
  }
  static const EstimatedParameter* find(const Estimate& estimate, const std::string& name) {
    const auto at = std::find_if(estimate.effects.begin(), estimate.effects.end(),
                                 [&](const EstimatedParameter& p) { return p.name == name; });
    return at == estimate.effects.end() ? nullptr : &*at;
  }

  JointRoles roles_;
  EstimatorOptions options_;
};

/// An effect that the software does not know is estimated like its own, once it is registered.
TEST_F(EffectsOnline, ARegisteredEffectIsEstimated) {
  test::register_own_effect();
  ErrorModel others(roles_);
  const double ripple = radians(4.0);
  others.add(test::kOwnEffect, {"r_wrist_prosup", ""}).parameters()[0].value = ripple;
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  reach.befall(others);
  Estimator estimator(robot_, setup_, rig_, beliefs({{test::kOwnEffect, {"r_wrist_prosup", ""}, {radians(5.0)}}}),
                      options_);
  const Estimate estimate = follow(estimator, reach, 0, 24);
  const auto* found = find(estimate, std::string(test::kOwnEffect) + " of r_wrist_prosup");
  ASSERT_NE(found, nullptr);
  EXPECT_EQ(found->unit, "deg");
  EXPECT_EQ(found->effect, test::kOwnEffect);
  EXPECT_EQ(found->joint, "r_wrist_prosup");
  EXPECT_LT(found->sd, radians(1.0));
  EXPECT_NEAR(found->value, ripple, 4.0 * found->sd);
  EXPECT_NEAR(found->prior_sd, radians(5.0), 1e-12);
  EXPECT_LT((estimate.offset_rad - paper_offsets_rad()).cwiseAbs().maxCoeff(), radians(1.5));
}

TEST_F(EffectsOnline, ALinkAndWhereTheCamerasSitAreEstimatedWithTheOffsets) {
  ErrorModel others(roles_);
  others.add("link_length", {"r_wrist_pitch", ""}).parameters()[0].value = 0.006;
  auto& pose = others.add("camera_pose", {});
  pose.parameters()[0].value = 0.01;
  pose.parameters()[4].value = radians(1.0);
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  reach.befall(others);
  const double deg = radians(1.0);
  Estimator estimator(robot_, setup_, rig_,
                      beliefs({{"link_length", {"r_wrist_pitch", ""}, {0.01}},
                               {"camera_pose", {}, {0.02, 0.02, 0.02, 2 * deg, 2 * deg, 2 * deg}}}),
                      options_);
  const Estimate estimate = follow(estimator, reach, 0, 24);
  for (const auto& [name, truth] : {std::pair{"link_length of r_wrist_pitch", 0.006},
                                    {"camera_pose x", 0.01},
                                    {"camera_pose y", 0.0},
                                    {"camera_pose turn_y", deg}}) {
    const auto* found = find(estimate, name);
    ASSERT_NE(found, nullptr) << name;
    EXPECT_LT(std::abs(found->value - truth), 4.0 * found->sd) << name;
    EXPECT_LT(found->sd, found->prior_sd) << name;
  }
  EXPECT_LT(find(estimate, "link_length of r_wrist_pitch")->sd, 0.002);
  EXPECT_TRUE(estimate.misfit.empty()) << estimate.misfit;
  EXPECT_LT((estimate.X_CP[0].translation() - reach.true_hand(motion(23), 0).translation()).norm(), 1e-3);
}

/// Fingers that stand elsewhere, each by itself, turned the wrist: it was a degree off and claimed to be known to a
/// tenth.
TEST_F(EffectsOnline, FingersThatStandElsewhereOneByOneDoNotTurnTheWrist) {
  ErrorModel others(roles_);
  const std::vector<double> off_deg = {-5.0, -6.0, 1.0, 2.0, 6.0, 4.0, -4.0, 3.0};
  const auto joints = effect_targets("finger_offset", roles_);
  ASSERT_EQ(joints.size(), off_deg.size());
  for (std::size_t i = 0; i < joints.size(); ++i) {
    others.add("finger_offset", joints[i]).parameters()[0].value = radians(off_deg[i]);
  }
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  reach.befall(others);
  std::vector<Belief> fingers{{"finger_posture", {}, {radians(1.5)}}};
  for (const auto& joint : joints) fingers.push_back({"finger_offset", joint, {radians(1.0)}});
  Estimator estimator(robot_, setup_, rig_, beliefs(fingers), options_);
  const Estimate estimate = follow(estimator, reach, 0, 24);
  for (Eigen::Index k = 0; k < estimate.offset_rad.size(); ++k) {
    const double sd = std::sqrt(estimate.covariance_rad2(k, k));
    EXPECT_LT(std::abs(estimate.offset_rad[k] - paper_offsets_rad()[k]), 4.0 * sd)
        << estimate.joint_names[static_cast<std::size_t>(k)] << ", sd " << degrees(sd) << " deg";
  }
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const auto* found = find(estimate, "finger_offset of " + joints[i].joint);
    ASSERT_NE(found, nullptr) << joints[i].joint;
    // Fingers are off by four times what is believed of them: it is found too narrow, for those that are hardly seen
    // too.
    EXPECT_LT(std::abs(found->value - radians(off_deg[i])), 4.0 * found->sd) << joints[i].joint;
    EXPECT_LT(found->sd, 0.5 * radians(4.2)) << joints[i].joint << ": half of how far they are off, root mean square";
  }
}

/// Readings that err tell of the hand's place in one picture, whatever many have taught of the offsets.
TEST_F(EffectsOnline, EncodersThatErrFromReadingToReadingWidenTheHand) {
  const auto hand_sd_m = [&](double noise_deg) {
    SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
    Estimator estimator(robot_, setup_, rig_, beliefs(), options_);
    std::mt19937_64 random(test::seed());
    std::normal_distribution<double> noise(0.0, radians(noise_deg));
    Estimate estimate;
    for (int i = 0; i < 30; ++i) {
      auto observation = reach.observe(motion(i), 200'000 * (i + 1));
      const Eigen::VectorXd offsets = observation.cameras[0]->joints.q - motion(i);
      observation.encoders.clear();
      for (int k = 1; k <= 20; ++k) {
        JointSample reading{200'000 * i + 10'000 * k, motion(i - 1.0 + 0.05 * k) + offsets, {}};
        for (auto& angle : reading.q) angle += noise(random);
        observation.encoders.push_back(std::move(reading));
      }
      estimate = estimator.step(observation);
    }
    return estimate.hand_sd_m;
  };
  const double quiet = hand_sd_m(0.02), noisy = hand_sd_m(0.3);
  EXPECT_LT(quiet, 0.5e-3);
  EXPECT_GT(noisy, 1.5e-3) << "0.3 deg of each joint move the hand by some 2 mm";
}

/// What no state holds and no tolerance names still shows in what fits leave, alike in all postures.
TEST_F(EffectsOnline, AHandOfAnotherShapeWidensWhatIsPublished) {
  ErrorModel others(roles_);
  others.add("mesh_scale", {"", "r_hand"}).parameters()[0].value = 0.1;
  SyntheticReach exact_reach(robot_, setup_, rig_, paper_offsets_rad());
  SyntheticReach other_reach(robot_, setup_, rig_, paper_offsets_rad());
  other_reach.befall(others);
  Estimator on_exact(robot_, setup_, rig_, beliefs(), options_), on_other(robot_, setup_, rig_, beliefs(), options_);
  const Estimate exact = follow(on_exact, exact_reach, 0, 16), other = follow(on_other, other_reach, 0, 16);
  EXPECT_GT(other.hand_sd_m, 3.0 * exact.hand_sd_m);
  EXPECT_LT((other.X_CP[0].translation() - other_reach.true_hand(motion(15), 0).translation()).norm(),
            3.0 * other.hand_sd_m);
  for (Eigen::Index k = 0; k < 7; ++k) EXPECT_GT(other.covariance_rad2(k, k), exact.covariance_rad2(k, k)) << k;
}

/// What was never moved keeps what was believed, and is said not to be told.
TEST_F(EffectsOnline, JointsAreToldByPicturesThatTellThem) {
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  Estimator moving(robot_, setup_, rig_, beliefs(), options_);
  const Estimate all = follow(moving, reach, 0, 20);
  for (std::size_t k = 0; k < 7; ++k) EXPECT_TRUE(all.told(k)) << all.joint_names[k];
  // One posture has six numbers, and cameras that may sit elsewhere explain them all.
  const double deg = radians(5.0);
  Estimator still(robot_, setup_, rig_, beliefs({{"camera_pose", {}, {0.1, 0.1, 0.1, deg, deg, deg}}}), options_);
  Estimate one;
  for (int i = 0; i < 5; ++i) one = still.step(reach.observe(motion(0), 200'000 * (i + 1)));
  EXPECT_FALSE(one.told(0)) << "the shoulder's pitch looks like the cameras'";
  EXPECT_GT(std::sqrt(one.covariance_rad2(0, 0)), radians(0.5));
}

/// What may be wrong and is not estimated widens what is claimed, of the hand too.
TEST_F(EffectsOnline, TolerancesWidenWhatIsClaimed) {
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  Estimator sure(robot_, setup_, rig_, beliefs(), options_);
  Estimator wary(robot_, setup_, rig_, beliefs({}, {{"link_length", {"r_wrist_pitch", ""}, {0.005}}}), options_);
  const Estimate a = follow(sure, reach, 0, 12), b = follow(wary, reach, 0, 12);
  EXPECT_GT(b.covariance_rad2.trace(), 2.0 * a.covariance_rad2.trace());
  EXPECT_GT(b.hand_sd_m, a.hand_sd_m);
  EXPECT_GE(b.hand_sd_limit_m, a.hand_sd_limit_m) << "what tolerances leave open nobody can ask for";
  EXPECT_LT((a.offset_rad - b.offset_rad).norm(), radians(0.5));
  EXPECT_TRUE(b.effects.empty()) << "considered, not estimated";
}

/// A model that a diagnosis found holds a camera's place that its log hardly told from the shoulder's pitch: offsets
/// found beside it are known no better, the hand in the camera is.
TEST_F(EffectsOnline, WhatAnExtendedModelLeavesOpenIsInTheOffsets) {
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  ErrorModel exact(roles_);
  auto& pose = exact.add("camera_pose", {});  // 2.5 deg about the cameras' x that is not there
  pose.parameters()[3].value = radians(2.5);
  ErrorModel open = exact;
  const double sd = radians(2.0);
  open.set_uncertainty({{{"camera_pose", {}, 3}}, Eigen::MatrixXd::Constant(1, 1, sd * sd)});
  Estimator sure(robot_, setup_, rig_, beliefs(), options_, exact);
  Estimator wary(robot_, setup_, rig_, beliefs(), options_, open);
  const Estimate a = follow(sure, reach, 0, 15), b = follow(wary, reach, 0, 15);
  const auto worst = [&](const Estimate& e) {
    return (e.offset_rad - paper_offsets_rad())
        .cwiseQuotient(e.covariance_rad2.diagonal().cwiseSqrt())
        .cwiseAbs()
        .maxCoeff();
  };
  EXPECT_GT(worst(a), 5.0) << "what is taken for exact is not";
  EXPECT_LT(worst(b), 2.5);
  EXPECT_LT((b.X_CP[0].translation() - reach.true_hand(motion(14), 0).translation()).norm(), 3.0 * b.hand_sd_m);
  EXPECT_LT(b.hand_sd_m, 0.25 * sd * b.X_CP[0].translation().norm()) << "the pictures show the hand all the same";
}

/// Somebody knocks the camera: its place is what changed, the arm's offsets stay known.
TEST_F(EffectsOnline, AKnockedCameraIsNotTakenForTheArm) {
  const double deg = radians(2.0);
  Estimator estimator(robot_, setup_, rig_, beliefs({{"camera_pose", {}, {0.02, 0.02, 0.02, deg, deg, deg}}}),
                      options_);
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  const Estimate before = follow(estimator, reach, 0, 24);
  ErrorModel knocked(roles_);
  auto& pose = knocked.add("camera_pose", {});
  pose.parameters()[1].value = 0.012;
  pose.parameters()[3].value = radians(-1.5);
  reach.befall(knocked);
  std::string changed;
  Estimate after;
  for (int i = 24; i < 30; ++i) {
    after = follow(estimator, reach, i, i + 1);
    changed += after.changed;
  }
  EXPECT_EQ(changed, "the cameras were moved") << "once: the fit from afar has arrived where it says";
  EXPECT_LT((after.offset_rad - before.offset_rad).cwiseAbs().maxCoeff(), radians(0.7));
  EXPECT_LT((after.X_CP[0].translation() - reach.true_hand(motion(29), 0).translation()).norm(), 1.5e-3);
}

/// Postures agree only with a camera that nobody believes in: that is said, with what is asked for.
TEST_F(EffectsOnline, WhatIsBeyondBeliefIsAMisfit) {
  ErrorModel others(roles_);
  auto& pose = others.add("camera_pose", {});
  pose.parameters()[0].value = 0.009;
  pose.parameters()[1].value = -0.006;
  SyntheticReach reach(robot_, setup_, rig_, paper_offsets_rad());
  reach.befall(others);
  Estimator estimator(robot_, setup_, rig_, beliefs({{"camera_pose", {}, {0.001, 0.001, 0.001, 0.001, 0.001, 0.001}}}),
                      options_);
  const Estimate estimate = follow(estimator, reach, 0, 30);
  EXPECT_EQ(estimate.state, EstimatorState::kModelMisfit);
  EXPECT_THAT(estimate.misfit, HasSubstr("camera_pose"));
  EXPECT_THAT(estimate.misfit, HasSubstr("pose_sd_mm")) << "where to say that it may be further off";
  EXPECT_THAT(estimate.misfit, HasSubstr("bodyschema diagnose"));
}

/// A robot that is wrong in a way that no state holds: every posture asks for other offsets. Nothing is called
/// converged, and the hand is where each picture shows it all the same.
TEST_F(EffectsOnline, PosturesThatDisagreeDoNotConverge) {
  ErrorModel others(roles_);
  others.add("encoder_gain", {"r_wrist_prosup", ""}).parameters()[0].value = 0.12;
  others.add("encoder_gain", {"r_wrist_pitch", ""}).parameters()[0].value = -0.15;
  SyntheticReach reach(robot_, setup_, rig_, Eigen::VectorXd::Zero(7));
  reach.befall(others);
  Estimator estimator(robot_, setup_, rig_, beliefs(), options_);
  for (int i = 0; i < 30; ++i) {
    const Estimate estimate = follow(estimator, reach, i, i + 1);
    EXPECT_NE(estimate.state, EstimatorState::kConverged) << i;
    EXPECT_LT((estimate.X_CP[0].translation() - reach.true_hand(motion(i), 0).translation()).norm(), 1e-3) << i;
  }
}

}  // namespace
}  // namespace bodyschema
