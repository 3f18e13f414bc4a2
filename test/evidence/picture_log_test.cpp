#include "bodyschema/evidence/picture_log.hpp"

#include "evidence/drawn_log.hpp"

namespace bodyschema {
namespace {

class PictureLogOfOwnRobot : public DrawnLog {
 protected:
  void SetUp() override { seen_ = observe(2, Eigen::VectorXd::Zero(7)); }
  std::vector<Observation> seen_;
};

TEST_F(PictureLogOfOwnRobot, HoldsThePicturesInOrderOfTheirOwnTimes) {
  seen_[1].cameras[0]->utime = 2'000'500;  // left a little later than right
  const auto log = log_of(seen_);
  ASSERT_EQ(log->pictures().size(), 4u);
  const std::vector<std::size_t> cameras = {0, 1, 1, 0};
  for (std::size_t p = 0; p < 4; ++p) {
    EXPECT_EQ(log->pictures()[p].camera, cameras[p]) << p;
    if (p > 0) {
      EXPECT_GE(log->pictures()[p].joints.utime, log->pictures()[p - 1].joints.utime);
    }
  }
}

TEST_F(PictureLogOfOwnRobot, FindsPicturesAndLeavesPixelsOut) {
  const auto log = log_of(seen_);
  const auto& last = log->pictures()[3];
  EXPECT_EQ(log->find(last.camera, last.joints.utime), 3u);
  EXPECT_EQ(log->find(last.camera, last.joints.utime + 1), std::nullopt);
  BinaryMask corner(last.mask.width(), last.mask.height());
  corner.set(0, 0);
  log->leave_out(3, corner);
  EXPECT_EQ(last.valid.count(), static_cast<std::size_t>(last.mask.width() * last.mask.height() - 1));
  EXPECT_TRUE(log->pictures()[2].valid.empty());
}

/// Of a clock that stepped back, what came before and would stand behind is left out.
TEST_F(PictureLogOfOwnRobot, ForgetsWhatAnotherClockPutsLater) {
  PictureLog log(robot_, setup_, rig_);
  for (auto& observation : seen_) log.add(observation);
  const auto begin = seen_[0].utime;
  seen_[1].encoders_begin_anew = true;
  seen_[1].utime = begin - 5'000'000;
  seen_[1].encoders.clear();
  for (auto& camera : seen_[1].cameras) camera->utime = camera->joints.utime = seen_[1].utime;
  log.add(seen_[1]);
  EXPECT_EQ(log.pictures().size(), 2u);
  EXPECT_TRUE(log.encoders().empty());
}

/// A simulator at rest, a driver that publishes twice: the same outlines at the same readings say nothing new.
TEST_F(PictureLogOfOwnRobot, LeavesOutWhatRepeatsTheLast) {
  PictureLog log(robot_, setup_, rig_);
  for (int i = 0; i < 5; ++i) {
    seen_[0].utime += 33'000;
    for (auto& camera : seen_[0].cameras) camera->utime += 33'000;
    log.add(seen_[0]);
  }
  EXPECT_EQ(log.pictures().size(), 2u);
  // Noise moves an edge by a hair: a picture of its own.
  seen_[0].cameras[1]->coverage[5000] ^= 1;
  log.add(seen_[0]);
  EXPECT_EQ(log.pictures().size(), 4u);
  // The arm has moved a little, the outline not.
  seen_[0].cameras[0]->joints.q[0] += 1e-4;
  log.add(seen_[0]);
  EXPECT_EQ(log.pictures().size(), 6u);
}

/// Of a background learned from the pictures themselves, a part that never moved out of the way is one with it.
TEST_F(PictureLogOfOwnRobot, WhatStandsStillIsPartOfALearnedBackground) {
  for (auto& camera : seen_[1].cameras) {
    camera->joints.q = seen_[0].cameras[0]->joints.q;
    camera->joints.q[roles_.index("r_wrist_yaw")] += 0.6;
  }
  auto log = log_of(seen_);
  const auto all = log->parts_shown();
  EXPECT_EQ(std::count(all.begin(), all.end(), false), 0) << "masks of others show the whole robot";
  log->learned_background();
  const auto shown = log->parts_shown();
  const auto& links = setup_.model.rendered_links;
  ASSERT_EQ(shown.size(), links.size());
  EXPECT_FALSE(shown.front()) << links.front() << " did not move";
  EXPECT_TRUE(shown[static_cast<std::size_t>(std::find(links.begin(), links.end(), setup_.hand_link) - links.begin())]);
  LogFit fit(*log, 1);
  const auto some = fit.linearise(ErrorModel(roles_), {}, {}).sampled();
  log = log_of(seen_);
  LogFit whole(*log, 1);
  EXPECT_LT(some, 0.95 * whole.linearise(ErrorModel(roles_), {}, {}).sampled()) << "it is not asked for";
}

TEST_F(PictureLogOfOwnRobot, ACameraWithoutAMaskHasNoPicture) {
  seen_[0].cameras[0]->mask = BinaryMask();
  seen_[1].cameras[1].reset();
  const auto log = log_of(seen_);
  ASSERT_EQ(log->pictures().size(), 2u);
  EXPECT_EQ(log->pictures()[0].camera, 1u);
  EXPECT_EQ(log->pictures()[1].camera, 0u);
}

/// Whatever was published: the arm's motion is that of its readings, once each.
TEST_F(PictureLogOfOwnRobot, MotionComesFromTheEncoders) {
  const auto elbow = roles_.index("r_elbow");
  PictureLog log(robot_, setup_, rig_);
  seen_[0].encoders.clear();
  for (Microseconds t = 500'000; t <= 1'500'000; t += 10'000) {
    JointSample sample = seen_[0].cameras[0]->joints;
    sample.utime = t;
    sample.q[elbow] += 0.3 * seconds(t - 1'000'000);
    sample.qdot.setConstant(77.0);
    seen_[0].encoders.push_back(sample);
  }
  log.add(seen_[0]);
  seen_[1].encoders = seen_[0].encoders;  // the same again
  log.add(seen_[1]);
  log.finish();
  EXPECT_EQ(log.encoders().size(), 101u);
  EXPECT_NEAR(log.pictures()[0].joints.qdot[elbow], 0.3, 1e-3);
  EXPECT_NEAR(log.pictures()[0].joints.qdot[roles_.arm[0]], 0.0, 1e-9);
  EXPECT_EQ(log.pictures()[3].joints.qdot.cwiseAbs().maxCoeff(), 0.0) << "no readings near";
}

/// A window of pictures: what is old goes, with the readings that nobody needs any more; what is looked at keeps only
/// its motion.
TEST_F(PictureLogOfOwnRobot, ForgetsWhatIsOldAndLetsGoOfOutlines) {
  PictureLog log(robot_, setup_, rig_);
  for (int i = 0; i < 2; ++i) {
    auto& seen = seen_[static_cast<std::size_t>(i)];
    for (auto& camera : seen.cameras) camera->utime = 10'000'000 * (i + 1);
    seen.encoders.clear();
    for (Microseconds t = 10'000'000 * i; t < 10'000'000 * (i + 1); t += 500'000) {
      seen.encoders.push_back(seen.cameras[0]->joints);
      seen.encoders.back().utime = t;
    }
    log.add(seen);
  }
  log.forget_before(15'000'000);
  ASSERT_EQ(log.pictures().size(), 2u);
  EXPECT_EQ(log.pictures()[0].joints.utime, 20'000'000);
  EXPECT_EQ(log.encoders().front().utime, 14'000'000) << "what has a memory begins before the first picture";
  const auto& newest = log.pictures()[1];
  log.drop_outlines(newest.mask.bytes() + newest.valid.bytes() + newest.coverage.size());
  EXPECT_TRUE(log.pictures()[0].mask.empty()) << "the oldest ones go first";
  EXPECT_FALSE(log.pictures()[1].mask.empty());
  log.drop_outlines(0);
  EXPECT_TRUE(log.pictures()[1].mask.empty());
  EXPECT_TRUE(log.pictures()[1].coverage.empty());
  log.forget_before(INT64_MAX);
  EXPECT_TRUE(log.pictures().empty());
  EXPECT_TRUE(log.encoders().empty());
}

}  // namespace
}  // namespace bodyschema
