#include "arm_tracker.hpp"

#include <gmock/gmock.h>

#include "outlines_of_own_robot.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

/// The stages of mode best, called as the estimator calls them.
class TrackerOfOwnRobot : public OutlinesOfOwnRobot {
 protected:
  static constexpr std::size_t kLeastPostures = 3;
  TrackerOfOwnRobot()
      : known_(model_->state(), layout(), {}, kLeastPostures), occlusion_(*model_, *scorer_, rig_, setup_.hand_link),
        tracker_(*model_, *scorer_, *particles_, fitter_, occlusion_, known_, options_) {
    known_.x = nothing_;
  }

  FrameOutcome track(Frame frame) {
    FrameOutcome outcome;
    tracker_.begin_frame(frame);
    scorer_->observe(frame, options_.min_mask_share);
    if (tracker_.shows_wrong_eyes(frame, outcome)) return outcome;
    particles_->score(frame, known_.x);
    particles_->weigh();
    tracker_.read_encoders(frame);
    if (known_.memory.empty()) {
      tracker_.find(frame, outcome);
    } else {
      const OutlineFit fit = tracker_.measure(frame);
      tracker_.gate(frame, fit, outcome);
      if (outcome.verdict == FrameVerdict::kAgrees && !known_.young()) {
        tracker_.remember(frame, fit, outcome);
      } else {
        tracker_.explain(frame, fit, outcome);
      }
    }
    tracker_.spread_particles(outcome);
    tracker_.hand_known_to(1e-3);
    return outcome;
  }
  /// A reach until its postures are believed.
  void reach() {
    for (int i = 0; i < 40 && known_.memory.postures() < 6; ++i) track(at(0.05 * (i % 20)));
    ASSERT_FALSE(known_.young());
  }
  /// From now on every offset is larger by this, rad.
  void offset_by(const Eigen::VectorXd& more) {
    ErrorModel others(model_->roles());
    for (Eigen::Index k = 0; k < more.size(); ++k) {
      others.add("joint_offset", {model_->state().parameters()[static_cast<std::size_t>(k)].name, ""})
          .parameters()[0]
          .value = more[k];
    }
    reach_.befall(others);
  }
  [[nodiscard]] double off_deg(const Eigen::VectorXd& truth) const {
    return degrees((known_.x - truth).cwiseAbs().maxCoeff());
  }

  FusedState known_;
  Occlusion occlusion_;
  ArmTracker tracker_;
};

TEST_F(TrackerOfOwnRobot, FindsAnArmOfWhichNothingIsKnownAndLearnsItPostureByPosture) {
  reach();
  EXPECT_LT(off_deg(truth_), 0.5);
  const FrameOutcome outcome = track(at(0.33));
  EXPECT_EQ(outcome.verdict, FrameVerdict::kAgrees);
  EXPECT_TRUE(outcome.near);
  EXPECT_FALSE(outcome.contradicted);
  EXPECT_TRUE(outcome.changed.empty());
}

TEST_F(TrackerOfOwnRobot, ASlipIsToldByItsJointAndTheRestStaysKnown) {
  reach();
  const Eigen::VectorXd slipped = truth_ + radians(5.0) * Eigen::VectorXd::Unit(7, 3);
  offset_by(slipped - truth_);
  std::string changed;
  for (int i = 0; i < 20 && changed.empty(); ++i) changed = track(at(0.05 * i)).changed;
  EXPECT_THAT(changed, HasSubstr(model_->state().parameters()[3].name + " slipped by"));
  EXPECT_LT(off_deg(slipped), 0.7);
}

TEST_F(TrackerOfOwnRobot, WhatNothingExplainsIsNotLearned) {
  reach();
  const Eigen::VectorXd before = known_.memory.estimate().x;
  const std::size_t postures = known_.memory.postures();
  // Somebody else's outline: another arm, far from this one in every joint.
  offset_by(Eigen::VectorXd::Constant(7, radians(25.0)));
  const FrameOutcome outcome = track(at(0.5));
  EXPECT_NE(outcome.verdict, FrameVerdict::kAgrees);
  EXPECT_EQ(known_.memory.postures(), postures);
  EXPECT_EQ(known_.memory.estimate().x, before);
}

TEST_F(TrackerOfOwnRobot, OutOfSightTheMemoryStays) {
  reach();
  const std::size_t postures = known_.memory.postures();
  tracker_.lose_sight();
  EXPECT_EQ(known_.memory.postures(), postures);
  EXPECT_EQ(known_.in_frame.x, known_.memory.estimate().x);
}

/// A contradiction lasts as long as pictures show it: two bad ones, a minute without the hand between them, are two.
TEST_F(TrackerOfOwnRobot, APauseEndsADoubt) {
  reach();
  offset_by(Eigen::VectorXd::Constant(7, radians(25.0)));
  // What may have happened takes more pictures than one to search.
  OutlineFitter slow_fitter(*model_, *scorer_, options_, rig_.cameras.size(), 0);
  ArmTracker slow(*model_, *scorer_, *particles_, slow_fitter, occlusion_, known_, options_);
  const auto look = [&] {
    Frame frame = at(0.5);
    FrameOutcome outcome;
    slow.begin_frame(frame);
    const OutlineFit fit = slow.measure(frame);
    slow.gate(frame, fit, outcome);
    slow.explain(frame, fit, outcome);
    EXPECT_TRUE(outcome.contradicted);
    return outcome.state;
  };
  EXPECT_NE(look(), EstimatorState::kDiverged);
  slow.lose_sight();
  time_us_ += 60'000'000;
  EXPECT_NE(look(), EstimatorState::kDiverged);
  EXPECT_EQ(look(), EstimatorState::kDiverged) << "a second later";
}

}  // namespace
}  // namespace bodyschema
