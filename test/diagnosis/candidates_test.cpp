#include "candidates.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "block_plan.hpp"
#include "diagnosis/edited_log.hpp"
#include "diagnosis_trials/trial_robot.hpp"
#include "regression.hpp"

namespace bodyschema::diagnosis {
namespace {

using testing::HasSubstr;

Linearisation at_zero(MeasurementSource& log) {
  return linearise(log, ErrorModel(log.roles()));
}

const NotTestable* find(const std::vector<NotTestable>& list, const CauseName& cause) {
  const auto at = std::find_if(list.begin(), list.end(), [&](const auto& n) { return n.cause == cause; });
  return at == list.end() ? nullptr : &*at;
}

TEST(Candidates, AreTheCatalogueTheSlipsAndTheGenericFeatures) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  const auto at = at_zero(*log);
  const auto plan = plan_blocks(*log, at.views, 2.0);
  const auto set = make_candidates(*log, at, plan, CoordinateLayout(log->roles()), usual_nuisances(log->roles()),
                                   {{{"backlash", "r_elbow", ""}, "for a test"}});
  EXPECT_EQ(set.offsets.size(), 7u);
  std::size_t nuisances = 0, generic = 0, slips = 0, backlashes = 0;
  for (const auto& c : set.candidates) {
    nuisances += c.nuisance;
    generic += c.generic();
    slips += c.slip;
    backlashes += c.name == "backlash";
    EXPECT_FALSE(c.columns.empty()) << c.description();
    EXPECT_FALSE(c.name == "backlash" && c.target.joint == "r_elbow");
  }
  EXPECT_EQ(nuisances, usual_nuisances(log->roles()).size());
  EXPECT_EQ(backlashes, 6u);
  EXPECT_GT(generic, 7u * 10u);
  EXPECT_GT(slips, 7u * 60u);  // at least one a second and joint
}

/// Neck roll and eye tilt, wherever the head is listed first.
TEST(Candidates, NuisancesDoNotDependOnTheOrderInWhichTheHeadIsListed) {
  const auto& robot = test::robot();
  auto listed_backwards = robot.setup;
  std::reverse(listed_backwards.head_joints.begin(), listed_backwards.head_joints.end());
  const auto nuisances = usual_nuisances(JointRoles::of(robot.model, listed_backwards, robot.rig));
  EXPECT_EQ(nuisances, usual_nuisances(JointRoles::of(robot.model, robot.setup, robot.rig)));
  for (const char* joint : {"neck_roll", "eyes_tilt"}) {
    EXPECT_THAT(nuisances, testing::Contains(CauseName{"head_offset", joint, ""}));
  }
}

TEST(Untestable, NamesWhatTheLogLacks) {
  TrialOptions options;
  options.frozen_joints = {"r_wrist_pitch"};
  const auto log = make_synthetic_log(test::robot(), options, 1);
  const auto list = untestable(*log, at_zero(*log));
  for (const char* name : {"encoder_gain", "eccentricity", "axis_tilt", "backlash"}) {
    const auto* item = find(list, {name, "r_wrist_pitch", ""});
    ASSERT_NE(item, nullptr) << name;
    EXPECT_THAT(item->reason, HasSubstr("r_wrist_pitch moved 0."));
    EXPECT_EQ(find(list, {name, "r_elbow", ""}), nullptr) << name;
  }
}

TEST(Untestable, OneCameraTestsNothingBetweenTwo) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  std::vector<std::size_t> left;
  for (std::size_t v = 0; v < log->views().size(); ++v) {
    if (log->views()[v].camera == 0) left.push_back(v);
  }
  test::EditedLog one(*log, left);
  const auto list = untestable(one, at_zero(one));
  for (const char* name : {"camera_skew", "vergence", "baseline"}) {
    EXPECT_NE(find(list, {name, "", ""}), nullptr) << name;
  }
  EXPECT_EQ(find(list, {"latency", "", ""}), nullptr);
}

TEST(Untestable, RareEncodersKnowNoDirection) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  auto rare = test::EditedLog::whole(*log);
  auto& stream = rare.stream_for_editing();
  std::vector<JointSample> few;
  for (std::size_t i = 0; i < stream.size(); i += 5) few.push_back(stream[i]);
  stream = few;
  const auto list = untestable(rare, at_zero(rare));
  const auto* item = find(list, {"backlash", "r_elbow", ""});
  ASSERT_NE(item, nullptr);
  EXPECT_THAT(item->reason, HasSubstr("every 50 ms"));
}

/// A robot that publishes its encoders only where a posture is reached: rare messages, or frequent ones that
/// repeat the last posture. That 100 Hz are missing is not the reason then.
TEST(Untestable, ReadingsThatJumpKnowNoDirection) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  for (const std::size_t published : {80u, 1u}) {
    auto jumping = test::EditedLog::whole(*log);
    auto& stream = jumping.stream_for_editing();
    std::vector<JointSample> read;
    for (std::size_t i = 0; i < stream.size(); i += published) {
      auto sample = stream[i];
      sample.q = stream[i - i % 80].q;
      for (const auto joint : log->roles().arm) sample.q[joint] += i / 80 % 2 == 0 ? 0.2 : -0.2;
      read.push_back(std::move(sample));
    }
    stream = read;
    const auto list = untestable(jumping, at_zero(jumping));
    const auto* item = find(list, {"backlash", "r_elbow", ""});
    ASSERT_NE(item, nullptr);
    EXPECT_THAT(item->reason, HasSubstr("jump from posture to posture"));
    EXPECT_THAT(item->reason, testing::Not(HasSubstr(" ms")));
  }
}

/// A joint that sets out upwards turns round as often as one that sets out downwards.
TEST(Untestable, CountsTheFirstTurnWhicheverWayAJointSetsOut) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  const auto elbow = log->roles().index("r_elbow");
  for (const double way : {1.0, -1.0}) {
    auto turning = test::EditedLog::whole(*log);
    auto& stream = turning.stream_for_editing();
    for (std::size_t i = 0; i < stream.size(); ++i) {
      const double third = 3.0 * static_cast<double>(i) / static_cast<double>(stream.size());  // to, fro, to
      stream[i].q[elbow] = way * (third < 1.0 ? third : third < 2.0 ? 2.0 - third : third - 2.0);
    }
    EXPECT_EQ(find(untestable(turning, at_zero(turning)), {"backlash", "r_elbow", ""}), nullptr) << way;
  }
}

TEST(Lookalikes, OfAShiftedBaseAreNeckAndEyesWhileTheHeadStandsStill) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  auto still = test::EditedLog::whole(*log), moving = test::EditedLog::whole(*log);
  const auto neck = log->roles().head.front();
  for (std::size_t v = 0; v < log->views().size(); ++v) {
    still.views_for_editing()[v].joints.q[neck] = 0.1;
    moving.views_for_editing()[v].joints.q[neck] = v % 2 == 0 ? 0.1 : 0.3;
  }
  const auto list = lookalikes(still, {"base_shift", "", ""});
  for (const char* joint : {"neck_pitch", "neck_roll", "neck_yaw", "eyes_tilt"}) {
    EXPECT_NE(std::find(list.begin(), list.end(), CauseName{"head_offset", joint, ""}), list.end()) << joint;
  }
  EXPECT_TRUE(lookalikes(still, {"latency", "", ""}).empty());
  EXPECT_TRUE(lookalikes(moving, {"base_shift", "", ""}).empty());
  // Eyes that pan on a still neck tell nothing about what lies below it.
  auto panning = test::EditedLog::whole(*log);
  for (std::size_t v = 0; v < log->views().size(); ++v) {
    for (const auto joint : log->roles().neck) panning.views_for_editing()[v].joints.q[joint] = 0.1;
    panning.views_for_editing()[v].joints.q[log->roles().left_pan] = v % 2 == 0 ? 0.1 : 0.3;
  }
  EXPECT_FALSE(lookalikes(panning, {"base_shift", "", ""}).empty());
}

TEST(SplittingMotion, IsSaidForEveryAliasOfTheHandbook) {
  EXPECT_THAT(splitting_motion({{"encoder_gain", "r_elbow", ""}, {"eccentricity", "r_elbow", ""}}),
              HasSubstr("Sweep r_elbow through more than 90 deg"));
  EXPECT_THAT(splitting_motion({{"payload", "", ""}, {"compliance", "r_elbow", ""}}), HasSubstr("without the load"));
  EXPECT_THAT(splitting_motion({{"slip", "r_elbow", ""}, {"drift", "r_elbow", ""}}), HasSubstr("first postures"));
  EXPECT_THAT(splitting_motion({{"vergence", "", ""}, {"baseline", "", ""}}), HasSubstr("checkerboard"));
  EXPECT_THAT(splitting_motion({{"base_shift", "", ""}, {"head_offset", "neck_pitch", ""}}),
              HasSubstr("Move the head by 20 to 30 deg"));
  EXPECT_FALSE(splitting_motion({{"drift", "r_elbow", ""}, {"latency", "", ""}}).empty());
}

}  // namespace
}  // namespace bodyschema::diagnosis
