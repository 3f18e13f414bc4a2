#include "bodyschema/bus/synchroniser.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

using ::testing::ElementsAre;

constexpr Microseconds kMs = 1000;

JointStateMessage joints(Microseconds utime, std::vector<std::pair<std::string, float>> values, float velocity = 0.0F) {
  JointStateMessage m;
  m.utime = utime;
  for (const auto& [name, value] : values) {
    m.names.push_back(name);
    m.position_rad.push_back(value);
    m.velocity_rad_s.push_back(velocity);
  }
  return m;
}

StampedImage image(int camera, Microseconds utime) {
  StampedImage stamped;
  stamped.camera = camera;
  stamped.utime = utime;
  stamped.image = Image(2, 2, 1);
  stamped.arrival_us = utime + 1;
  return stamped;
}

/// A synchroniser of two joints, fed with encoders that move steadily: arm = 1 rad/s, neck = -0.5.
class SynchroniserTest : public ::testing::Test {
 protected:
  void make(int cameras = 2, SynchroniserOptions options = {}, std::map<std::string, double> fixed = {}) {
    sync_.emplace(std::vector<std::string>{"arm", "neck"}, fixed, cameras, options);
  }
  void encoders(Microseconds from, Microseconds to, Microseconds step = 10 * kMs) {
    for (Microseconds t = from; t <= to; t += step) {
      sync_->add(joints(t, {{"neck", static_cast<float>(-0.5 * seconds(t))}, {"arm", static_cast<float>(seconds(t))}}));
    }
  }
  void picture(int camera, Microseconds utime) {
    std::vector<StampedImage> list;
    list.push_back(image(camera, utime));
    sync_->add(std::move(list));
  }
  void pair(Microseconds left, Microseconds right) {
    std::vector<StampedImage> list;
    list.push_back(image(0, left));
    list.push_back(image(1, right));
    sync_->add(std::move(list));
  }
  /// What has come out since the last call: stamps of left and right in ms, -1 where missing.
  std::vector<std::pair<Microseconds, Microseconds>> out() {
    std::vector<std::pair<Microseconds, Microseconds>> stamps;
    while (auto arrived = sync_->next()) {
      const auto& cameras = arrived->observation.cameras;
      const auto stamp = [&](std::size_t c) {
        return c < cameras.size() && cameras[c] ? cameras[c]->utime / kMs : Microseconds{-1};
      };
      stamps.emplace_back(stamp(0), stamp(1));
      EXPECT_EQ(arrived->observation.utime, kMs * (stamp(0) >= 0 ? stamp(0) : stamp(1)));
      for (const auto& camera : cameras) {
        if (!camera) continue;
        EXPECT_EQ(camera->joints.utime, camera->utime);
        EXPECT_EQ(camera->image.width, 2);
      }
    }
    return stamps;
  }
  void expect_every_image_accounted_for() {
    const auto& s = sync_->statistics();
    EXPECT_EQ(s.images, s.images_used + s.total_dropped() + sync_->waiting_images());
  }
  std::uint64_t dropped(DropReason reason) const { return sync_->statistics().dropped(reason); }
  void TearDown() override {
    if (sync_) expect_every_image_accounted_for();
  }
  std::optional<Synchroniser> sync_;
};

TEST_F(SynchroniserTest, InterpolatesEncodersToEachPicturesStamp) {
  make();
  encoders(0, 100 * kMs);
  pair(33 * kMs, 45 * kMs);
  const auto arrived = sync_->next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->arrival_us, 45 * kMs + 1);
  const auto& cameras = arrived->observation.cameras;
  ASSERT_TRUE(cameras[0] && cameras[1]);
  EXPECT_NEAR(cameras[0]->joints.q[0], 0.033, 1e-8);
  EXPECT_NEAR(cameras[0]->joints.q[1], -0.0165, 1e-8);
  EXPECT_NEAR(cameras[1]->joints.q[0], 0.045, 1e-8);
  EXPECT_NEAR(cameras[0]->joints.qdot[0], 1.0, 1e-4);  // nobody publishes any
}

TEST_F(SynchroniserTest, VelocityIsPublishedOrFromDifferences) {
  for (const bool differences : {false, true}) {
    SynchroniserOptions options;
    options.joints.velocity_from_differences = differences;
    make(1, options);
    sync_->add(joints(0, {{"arm", 0.0F}, {"neck", 0.0F}}, 4.0F));
    sync_->add(joints(10 * kMs, {{"arm", 0.01F}, {"neck", 0.0F}}, 6.0F));
    picture(0, 5 * kMs);
    const auto arrived = sync_->next();
    ASSERT_TRUE(arrived);
    EXPECT_NEAR(arrived->observation.cameras[0]->joints.qdot[0], differences ? 1.0 : 5.0, 1e-6);
  }
}

TEST_F(SynchroniserTest, VelocitiesThatNobodyPublishesAreSlopesOfTheReadings) {
  make(1, {});
  constexpr float kStep = 0.0015F;  // of an encoder of 12 bits
  const auto read = [&](int k, float velocity) {
    sync_->add(
        joints(10 * k * kMs, {{"arm", 0.01F * static_cast<float>(k)}, {"neck", k % 2 == 0 ? 0.0F : kStep}}, velocity));
  };
  for (int k = 0; k <= 20; ++k) read(k, 0.0F);
  picture(0, 195 * kMs);
  const auto moving = sync_->next();
  ASSERT_TRUE(moving);
  EXPECT_NEAR(moving->observation.cameras[0]->joints.qdot[0], 1.0, 1e-4);
  EXPECT_EQ(moving->observation.cameras[0]->joints.qdot[1], 0.0);
  // Who publishes some means the zeros, too.
  read(21, 1.0F);
  for (int k = 22; k <= 24; ++k) read(k, 0.0F);
  picture(0, 235 * kMs);
  const auto published = sync_->next();
  ASSERT_TRUE(published);
  EXPECT_EQ(published->observation.cameras[0]->joints.qdot[0], 0.0);
}

TEST_F(SynchroniserTest, WaitsForTheEncoderAfterThePicture) {
  make();
  encoders(0, 30 * kMs);
  pair(33 * kMs, 33 * kMs);
  EXPECT_TRUE(out().empty());
  encoders(40 * kMs, 40 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{33, 33}));
}

TEST_F(SynchroniserTest, PairsSeparateMessagesByStamp) {
  make();
  encoders(0, 500 * kMs);
  for (int i = 0; i < 4; ++i) {
    picture(1, (20 + 33 * i) * kMs);  // right comes first though it is later
    picture(0, (10 + 33 * i) * kMs);
  }
  sync_->finish();
  EXPECT_THAT(out(), ElementsAre(std::pair{10, 20}, std::pair{43, 53}, std::pair{76, 86}, std::pair{109, 119}));
  EXPECT_EQ(sync_->statistics().mono_observations, 0u);
}

TEST_F(SynchroniserTest, OnceTheFrameRateIsKnownAPairDoesNotWaitForTheNextPicture) {
  make();
  encoders(0, 500 * kMs);
  for (int i = 0; i < 9; ++i) {  // eight intervals
    picture(0, (10 + 33 * i) * kMs);
    picture(1, (20 + 33 * i) * kMs);
  }
  out();
  picture(0, 307 * kMs);
  EXPECT_TRUE(out().empty());
  picture(1, 317 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{307, 317}));
}

// With a window longer than half a frame, one lost picture must not shift all later pairs by a frame.
TEST_F(SynchroniserTest, LosesOnePairWhenOnePictureIsLost) {
  make();
  encoders(0, 500 * kMs);
  for (int i = 0; i < 8; ++i) {
    picture(0, 33 * i * kMs);
    if (i != 3) picture(1, (33 * i + 2) * kMs);
  }
  sync_->finish();
  EXPECT_THAT(out(), ElementsAre(std::pair{0, 2}, std::pair{33, 35}, std::pair{66, 68}, std::pair{99, -1},
                                 std::pair{132, 134}, std::pair{165, 167}, std::pair{198, 200}, std::pair{231, 233}));
}

TEST_F(SynchroniserTest, PicturesBeyondTheWindowAreNotPaired) {
  SynchroniserOptions options;
  options.allow_mono = false;
  make(2, options);
  encoders(0, 1000 * kMs);
  pair(100 * kMs, 150 * kMs);  // exactly the window
  pair(300 * kMs, 351 * kMs);
  sync_->finish();
  EXPECT_THAT(out(), ElementsAre(std::pair{100, 150}));
  EXPECT_EQ(dropped(DropReason::kUnpaired), 2u);
}

TEST_F(SynchroniserTest, DeadCameraGivesMonoWhenAllowed) {
  make();
  encoders(0, 1000 * kMs);
  for (int i = 0; i < 10; ++i) picture(0, 33 * i * kMs);
  const auto mono = out();
  ASSERT_GE(mono.size(), 5u);  // those that camera_wait (100 ms) has passed
  EXPECT_EQ(mono[0], (std::pair<Microseconds, Microseconds>{0, -1}));
  EXPECT_EQ(sync_->statistics().mono_observations, mono.size());
  // The camera returns.
  pair(330 * kMs, 332 * kMs);
  EXPECT_EQ(out().back(), (std::pair<Microseconds, Microseconds>{330, 332}));
}

TEST_F(SynchroniserTest, MonoRigDoesNotWait) {
  make(1);
  encoders(0, 100 * kMs);
  picture(0, 50 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{50, -1}));
  EXPECT_EQ(sync_->statistics().mono_observations, 0u);
  picture(1, 60 * kMs);  // not of this rig
  EXPECT_EQ(sync_->statistics().images, 1u);
}

TEST_F(SynchroniserTest, PictureThatComesAfterItsPartnersSuccessorStillPairs) {
  make();
  encoders(0, 500 * kMs);
  picture(0, 0);
  picture(0, 33 * kMs);
  picture(1, 1 * kMs);
  picture(0, 66 * kMs);
  picture(1, 34 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{0, 1}, std::pair{33, 34}));
}

TEST_F(SynchroniserTest, DuplicatesAndOlderPicturesAreSkipped) {
  make();
  encoders(0, 500 * kMs);
  pair(100 * kMs, 100 * kMs);
  pair(100 * kMs, 100 * kMs);
  pair(90 * kMs, 90 * kMs);
  pair(133 * kMs, 133 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{100, 100}, std::pair{133, 133}));
  EXPECT_EQ(dropped(DropReason::kDuplicate), 2u);
  EXPECT_EQ(dropped(DropReason::kOutOfOrder), 2u);
  EXPECT_EQ(sync_->statistics().clock_steps, 0u);
}

TEST_F(SynchroniserTest, DuplicateAndOlderEncodersAreSkipped) {
  make(1);
  sync_->add(joints(0, {{"arm", 0.0F}, {"neck", 0.0F}}));
  sync_->add(joints(20 * kMs, {{"arm", 0.2F}, {"neck", 0.0F}}));
  sync_->add(joints(20 * kMs, {{"arm", 9.0F}, {"neck", 9.0F}}));
  sync_->add(joints(10 * kMs, {{"arm", 9.0F}, {"neck", 9.0F}}));
  picture(0, 10 * kMs);
  const auto arrived = sync_->next();
  ASSERT_TRUE(arrived);
  EXPECT_NEAR(arrived->observation.cameras[0]->joints.q[0], 0.1, 1e-7);
  EXPECT_EQ(sync_->statistics().joint_messages, 2u);
  EXPECT_EQ(sync_->statistics().joint_messages_duplicate, 1u);
  EXPECT_EQ(sync_->statistics().joint_messages_out_of_order, 1u);
}

TEST_F(SynchroniserTest, HeadAndArmMayComeInSeparateMessages) {
  make(1);
  for (int i = 0; i < 10; ++i) {
    sync_->add(joints(10 * i * kMs, {{"arm", static_cast<float>(i)}}, 0.0F));
    sync_->add(joints((10 * i - 3) * kMs + 5 * kMs, {{"neck", 2.0F}, {"somebody_elses_joint", 5.0F}}));
  }
  picture(0, 40 * kMs);
  const auto arrived = sync_->next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->observation.cameras[0]->joints.q[0], 4.0);
  EXPECT_EQ(arrived->observation.cameras[0]->joints.q[1], 2.0);
  sync_->add(joints(200 * kMs, {{"tail", 1.0F}}));
  EXPECT_EQ(sync_->statistics().joint_messages_without_known_joint, 1u);
}

TEST_F(SynchroniserTest, JointThatIsNeverPublishedTakesItsFixedValue) {
  make(1, {}, {{"neck", -0.7}, {"arm", 9.0}});
  for (int i = 0; i < 10; ++i) sync_->add(joints(10 * i * kMs, {{"arm", 0.5F}}));
  picture(0, 40 * kMs);
  const auto arrived = sync_->next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->observation.cameras[0]->joints.q[0], 0.5);  // what is published wins
  EXPECT_EQ(arrived->observation.cameras[0]->joints.q[1], -0.7);
  EXPECT_EQ(arrived->observation.cameras[0]->joints.qdot[1], 0.0);
}

// One message gone astray makes no publisher: its reading is kept, and the next picture is not waited for.
TEST_F(SynchroniserTest, FixedJointThatIsReadOnceHoldsThatReading) {
  make(1, {}, {{"neck", -0.7}});
  const auto arm_until = [&](int from_ms, int to_ms) {
    for (int ms = from_ms; ms <= to_ms; ms += 10) sync_->add(joints(ms * kMs, {{"arm", 0.5F}}));
  };
  const auto neck_at = [&](int ms) {
    picture(0, ms * kMs);
    const auto arrived = sync_->next();
    return arrived ? arrived->observation.cameras[0]->joints.q[1] : -99.0;
  };
  arm_until(0, 1000);
  sync_->add(joints(1005 * kMs, {{"neck", 0.25F}}));
  arm_until(1010, 1100);
  EXPECT_NEAR(neck_at(1002), -0.7, 1e-6) << "before it, the fixed value";
  EXPECT_NEAR(neck_at(1050), 0.25, 1e-6);
  arm_until(1110, 5000);
  EXPECT_NEAR(neck_at(4900), 0.25, 1e-6);
  sync_->add(joints(5005 * kMs, {{"neck", 0.5F}}));
  arm_until(5010, 9000);
  EXPECT_NEAR(neck_at(5003), 0.25, 1e-6) << "between two";
  EXPECT_NEAR(neck_at(8900), 0.5, 1e-6);
  EXPECT_EQ(sync_->statistics().total_dropped(), 0u);
}

TEST_F(SynchroniserTest, JointThatMovesNothingThatIsSeenNeverStandsInTheWay) {
  SynchroniserOptions options;
  options.joints.idle_joints = {"neck"};
  make(1, options, {{"neck", -0.7}});
  encoders(0, 100 * kMs);  // published, then silent, then back with a jump
  for (int ms = 110; ms <= 2000; ms += 10) {
    sync_->add(joints(ms * kMs, {{"arm", 0.5F}}));
    if (ms % 30 == 0) picture(0, (ms - 5) * kMs);
  }
  sync_->add(joints(2001 * kMs, {{"neck", 9.0F}}));
  sync_->add(joints(2010 * kMs, {{"arm", 0.5F}, {"neck", -9.0F}}));
  picture(0, 2005 * kMs);
  EXPECT_EQ(out().size(), 64u);
  EXPECT_EQ(sync_->statistics().total_dropped(), 0u);
}

TEST_F(SynchroniserTest, JointThatIsNeitherPublishedNorFixedIsNamed) {
  make(1);
  for (int i = 0; i < 100; ++i) {
    sync_->add(joints(10 * i * kMs, {{"arm", 0.5F}}));
    if (i % 3 == 0) picture(0, 10 * i * kMs);
  }
  EXPECT_TRUE(out().empty());
  EXPECT_GT(dropped(DropReason::kMissingJoint), 20u);
  EXPECT_EQ(dropped(DropReason::kNoEncoders), 0u);
  EXPECT_THAT(sync_->joints().missing_joints(), ElementsAre("neck"));
}

TEST_F(SynchroniserTest, LostJointStopsObservationsAndIsNamed) {
  make(1, {}, {{"neck", 0.0}});
  encoders(0, 100 * kMs);
  for (int i = 0; i < 60; ++i) {
    sync_->add(joints((110 + 10 * i) * kMs, {{"arm", 0.5F}}));
    if (i % 3 == 0) picture(0, (110 + 10 * i) * kMs);
  }
  EXPECT_TRUE(out().empty());  // a fixed value would be a guess once the joint is known to be published
  EXPECT_GT(dropped(DropReason::kMissingJoint), 5u);
  EXPECT_EQ(sync_->statistics().blocking_joint, 1);
}

TEST_F(SynchroniserTest, LateEncodersAreWaitedForUpToTheLimit) {
  make();
  encoders(0, 100 * kMs);
  for (int i = 0; i < 10; ++i) pair((110 + 33 * i) * kMs, (110 + 33 * i) * kMs);
  EXPECT_TRUE(out().empty());
  EXPECT_EQ(sync_->statistics().encoder_lag, (110 + 33 * 9 - 100) * kMs);
  // 407 is the newest picture; those up to 207 are given up.
  EXPECT_EQ(dropped(DropReason::kNoEncoders), 6u);
  encoders(110 * kMs, 450 * kMs);
  EXPECT_THAT(out(), testing::SizeIs(7));
}

TEST_F(SynchroniserTest, NothingIsInterpolatedAcrossAGap) {
  make();
  encoders(0, 100 * kMs);
  encoders(300 * kMs, 400 * kMs);
  pair(200 * kMs, 200 * kMs);
  pair(350 * kMs, 350 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{350, 350}));
  EXPECT_EQ(dropped(DropReason::kEncoderGap), 2u);
}

TEST_F(SynchroniserTest, AGapAtRestIsBridgedUpToItsOwnLimit) {
  make(1);
  const auto still = [&](int ms) { sync_->add(joints(ms * kMs, {{"arm", 0.4F}, {"neck", 0.1F}})); };
  for (const int ms : {0, 900, 2000}) still(ms);
  picture(0, 500 * kMs);
  picture(0, 1500 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{500, -1}));
  EXPECT_EQ(dropped(DropReason::kEncoderGap), 1u);
}

TEST_F(SynchroniserTest, NothingIsInterpolatedAcrossAJump) {
  make(1);
  const auto at = [&](int ms, float q) { sync_->add(joints(ms * kMs, {{"arm", q}, {"neck", 0.0F}})); };
  at(0, 0.1F);
  at(10, 0.1F);
  at(20, 1.1F);  // 100 rad/s
  at(30, 1.1F);
  for (const int ms : {5, 15, 20, 25}) picture(0, ms * kMs);
  std::vector<double> q;
  while (auto arrived = sync_->next()) q.push_back(arrived->observation.cameras[0]->joints.q[0]);
  EXPECT_THAT(
      q, ElementsAre(testing::DoubleNear(0.1, 1e-6), testing::DoubleNear(1.1, 1e-6), testing::DoubleNear(1.1, 1e-6)));
  EXPECT_EQ(dropped(DropReason::kEncoderJump), 1u);
}

// Readings that jump to and fro: between two pictures they may do so any number of times and look smooth at
// each. An estimate learned 60 deg of offset from such.
TEST_F(SynchroniserTest, NothingIsTakenFromReadingsThatJumpToAndFro) {
  make(1);
  const auto at = [&](int ms, double q) {
    sync_->add(joints(ms * kMs, {{"arm", static_cast<float>(q)}, {"neck", 0.0F}}));
  };
  for (int i = 0; i < 100; ++i) at(10 * i, i / 2 % 2 == 0 ? 0.1 : 1.15);
  for (const int ms : {305, 505, 700, 900}) picture(0, ms * kMs);
  EXPECT_FALSE(sync_->next().has_value());
  EXPECT_EQ(dropped(DropReason::kEncoderJump), 4u);
  // Quiet for 100 ms, and well again.
  for (int i = 100; i < 150; ++i) at(10 * i, 0.1);
  picture(0, 1205 * kMs);
  EXPECT_TRUE(sync_->next().has_value());
  // Hovering about the place where it wraps.
  for (int i = 150; i < 200; ++i) at(10 * i, i / 2 % 2 == 0 ? 3.14 : 3.14 - 2.0 * kPi);
  picture(0, 1905 * kMs);
  EXPECT_TRUE(sync_->next().has_value());
}

TEST_F(SynchroniserTest, PictureOlderThanAllEncodersIsDropped) {
  make(1);
  encoders(100 * kMs, 200 * kMs);
  picture(0, 50 * kMs);
  EXPECT_EQ(dropped(DropReason::kNoEncoders), 1u);
}

TEST_F(SynchroniserTest, SilenceOfACameraIsAGap) {
  make(1);
  encoders(0, 5000 * kMs);
  picture(0, 100 * kMs);
  picture(0, 300 * kMs);
  picture(0, 501 * kMs);
  EXPECT_EQ(sync_->statistics().gaps, 1u);
}

TEST_F(SynchroniserTest, ClockThatStepsBackIsFollowed) {
  make();
  const Microseconds late = 3'600'000 * kMs;
  encoders(late, late + 200 * kMs);
  for (int i = 0; i < 4; ++i) pair(late + 33 * i * kMs, late + 33 * i * kMs);
  EXPECT_THAT(out(), testing::SizeIs(4));
  // An hour back.
  for (int i = 0; i < 60; ++i) {
    encoders(10 * i * kMs, 10 * i * kMs);
    if (i % 3 == 0) pair(10 * i * kMs, 10 * i * kMs);
  }
  EXPECT_GE(sync_->statistics().clock_steps, 1u);
  EXPECT_LE(sync_->statistics().clock_steps, 2u);
  EXPECT_GE(out().size(), 14u);  // of 20; three of evidence, and what waited then
}

TEST_F(SynchroniserTest, SingleStrayStampsDoNotResetAnything) {
  make();
  encoders(10'000 * kMs, 10'200 * kMs);
  for (int i = 0; i < 4; ++i) {
    pair((10'000 + 33 * i) * kMs, (10'000 + 33 * i) * kMs);
    pair(0, 0);
    sync_->add(joints(0, {{"arm", 9.0F}, {"neck", 9.0F}}));
    encoders((10'210 + 10 * i) * kMs, (10'210 + 10 * i) * kMs);
  }
  EXPECT_THAT(out(), testing::SizeIs(4));
  EXPECT_EQ(sync_->statistics().clock_steps, 0u);
  EXPECT_EQ(sync_->statistics().joint_messages_out_of_order, 4u);
}

TEST_F(SynchroniserTest, RecoversFromAStampFarInTheFuture) {
  make();
  encoders(0, 100 * kMs);
  pair(50 * kMs, 50 * kMs);
  pair(9'000'000'000 * kMs, 9'000'000'000 * kMs);
  sync_->add(joints(9'000'000'000 * kMs, {{"arm", 9.0F}, {"neck", 9.0F}}));
  for (int i = 0; i < 60; ++i) {
    encoders((110 + 10 * i) * kMs, (110 + 10 * i) * kMs);
    if (i % 3 == 0) pair((110 + 10 * i) * kMs, (110 + 10 * i) * kMs);
  }
  EXPECT_GE(out().size(), 14u);
}

TEST_F(SynchroniserTest, RecoversFromAStampFarInTheFutureWhereHeadAndArmComeApart) {
  make();
  const auto both = [this](Microseconds t) {
    sync_->add(joints(t, {{"neck", static_cast<float>(-0.5 * seconds(t))}}));
    sync_->add(joints(t + kMs, {{"arm", static_cast<float>(seconds(t + kMs))}}));
  };
  for (int i = 0; i < 10; ++i) both(10 * i * kMs);
  sync_->add(joints(3'600'000 * kMs, {{"arm", 9.0F}}));
  for (int i = 10; i < 70; ++i) {
    both(10 * i * kMs);
    if (i % 3 == 0) pair((10 * i - 5) * kMs, (10 * i - 5) * kMs);
  }
  EXPECT_GE(out().size(), 14u);
  EXPECT_EQ(sync_->statistics().clock_steps, 1u);
}

TEST_F(SynchroniserTest, ACameraThatStampsThePictureBeforeItsDeathInTheFutureHoldsUpNobody) {
  make();
  for (int i = 0; i < 60; ++i) {
    const Microseconds now = 10 * i * kMs;
    if (i == 10) picture(1, 3'600'000 * kMs);
    // The picture comes before the encoders of its time.
    if (i % 3 == 0) picture(0, now + 5 * kMs);
    encoders(now, now);
  }
  EXPECT_GE(out().size(), 18u);
  EXPECT_LE(dropped(DropReason::kNoEncoders), 1u) << "the one that waited when that stamp came";
  EXPECT_LE(sync_->statistics().encoder_lag, 20 * kMs);
}

TEST_F(SynchroniserTest, BoundsWhatWaitsAndShedsTheOldest) {
  SynchroniserOptions options;
  options.max_waiting = 8;
  options.encoder_wait = 1'000'000 * kMs;
  options.camera_wait = 1'000'000 * kMs;
  make(2, options);
  for (int i = 0; i < 100; ++i) picture(0, 33 * i * kMs);
  EXPECT_EQ(sync_->waiting_images(), 8u);
  for (int i = 100; i < 200; ++i) pair(33 * i * kMs, 33 * i * kMs);
  EXPECT_LE(sync_->waiting_images(), 32u);
  encoders(0, 33 * 200 * kMs);
  const auto stamps = out();
  EXPECT_LE(stamps.size(), 8u);
  EXPECT_EQ(stamps.back().first, 33 * 199);
  EXPECT_GT(dropped(DropReason::kOverload), 100u);
}

TEST_F(SynchroniserTest, FinishSettlesWhatWaits) {
  make();
  encoders(0, 100 * kMs);
  picture(0, 50 * kMs);
  picture(0, 83 * kMs);
  pair(110 * kMs, 110 * kMs);  // no encoder after it
  sync_->finish();
  EXPECT_THAT(out(), ElementsAre(std::pair{50, -1}, std::pair{83, -1}));
  EXPECT_EQ(dropped(DropReason::kNoEncoders), 2u);
  EXPECT_EQ(sync_->waiting_images(), 0u);
}

// Random arrivals: nothing is lost unaccounted for, stamps rise, encoders are those of the stamp.
// Encoders and pictures are then interleaved in another order, each stream in its own: the same
// observations must come out, since only stamps count.
TEST_F(SynchroniserTest, InterleavingOfStreamsDoesNotChangeTheObservations) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::vector<std::pair<Microseconds, Microseconds>> reference;
  struct Arrival {
    Microseconds at;
    Microseconds stamp;
    int source;  // 0, 1: camera; 2: encoders
  };
  std::vector<Arrival> stamps;
  for (int i = 0; i < 300; ++i) {
    for (int camera = 0; camera < 2; ++camera) {
      if (random() % 10 == 0) continue;  // lost
      stamps.push_back({0, (200 + 33 * i + static_cast<int>(random() % 8)) * kMs, camera});
    }
  }
  for (int i = 0; i < 1100; ++i) stamps.push_back({0, 10 * i * kMs, 2});
  for (int round = 0; round < 5; ++round) {
    // Every source has a delay that varies by less than its own period, so it stays in order. The
    // cameras' delays differ by less than a period: a picture that is later than the other camera's
    // next two is not waited for, by intent.
    Microseconds delay[3];
    for (auto& d : delay) d = static_cast<Microseconds>(random() % 25) * kMs;
    auto arrivals = stamps;
    for (auto& a : arrivals) a.at = a.stamp + delay[a.source] + static_cast<Microseconds>(random() % 9) * kMs;
    std::stable_sort(arrivals.begin(), arrivals.end(), [](const auto& a, const auto& b) { return a.at < b.at; });
    make();
    std::vector<std::pair<Microseconds, Microseconds>> result;
    for (const auto& a : arrivals) {
      if (a.source == 2) {
        encoders(a.stamp, a.stamp);
      } else {
        picture(a.source, a.stamp);
      }
      for (const auto& stamp : out()) result.push_back(stamp);
    }
    sync_->finish();
    for (const auto& stamp : out()) result.push_back(stamp);
    expect_every_image_accounted_for();
    EXPECT_EQ(dropped(DropReason::kOutOfOrder), 0u);
    ASSERT_GT(result.size(), 250u);
    if (round == 0) {
      reference = result;
    } else {
      EXPECT_EQ(result, reference);
    }
  }
}

TEST_F(SynchroniserTest, SurvivesAnything) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int round = 0; round < 20; ++round) {
    make(1 + static_cast<int>(random() % 2));
    Microseconds last = -1;
    for (int i = 0; i < 3000; ++i) {
      const Microseconds t = random() % 20 == 0 ? static_cast<Microseconds>(random() % 9'000'000'000'000'000)
                                                : static_cast<Microseconds>(random() % 1'000'000);
      if (random() % 2 == 0) {
        sync_->add(joints(t, {{"arm", static_cast<float>(random() % 3)}, {"neck", 0.0F}}));
      } else {
        std::vector<StampedImage> list;
        for (std::size_t n = random() % 4; n > 0; --n) list.push_back(image(static_cast<int>(random() % 4) - 1, t));
        sync_->add(std::move(list));
      }
      const auto steps = sync_->statistics().clock_steps;
      while (auto arrived = sync_->next()) {
        if (steps == 0) {
          EXPECT_GT(arrived->observation.utime, last);
        }
        last = arrived->observation.utime;
      }
      EXPECT_LE(sync_->waiting_images(), 4u * 64u);
    }
    expect_every_image_accounted_for();
  }
}

/// With masks asked for, as of a segmentation network beside the robot.
class MaskTest : public SynchroniserTest {
 protected:
  void make_with_masks(int cameras = 2, bool allow_mono = true) {
    SynchroniserOptions options;
    options.masks = true;
    options.mask_wait = 300 * kMs;
    options.allow_mono = allow_mono;
    make(cameras, options);
  }
  void mask(int camera, Microseconds utime, std::uint8_t level = kMaskRobot) {
    StampedImage stamped = image(camera, utime);
    stamped.image.data.assign(4, level);
    stamped.arrival_us = utime + 150 * kMs;
    sync_->add_mask(std::move(stamped));
  }
};

TEST_F(MaskTest, APictureWaitsForItsMask) {
  make_with_masks();
  encoders(0, 100 * kMs);
  pair(30 * kMs, 35 * kMs);
  EXPECT_TRUE(out().empty());
  mask(0, 30 * kMs, 200);
  EXPECT_TRUE(out().empty()) << "the other camera's is still to come";
  mask(1, 35 * kMs, 100);
  const auto arrived = sync_->next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->observation.cameras[0]->given_mask.data[0], 200);
  EXPECT_EQ(arrived->observation.cameras[1]->given_mask.data[0], 100);
  EXPECT_EQ(arrived->arrival_us, 185 * kMs) << "when all of it had come";
  EXPECT_EQ(sync_->statistics().masks, 2u);
}

TEST_F(MaskTest, MasksMayComeBeforeTheirPicturesAndBetweenThem) {
  make_with_masks();
  encoders(0, 300 * kMs);
  mask(1, 30 * kMs);
  mask(0, 30 * kMs);
  pair(30 * kMs, 30 * kMs);
  pair(60 * kMs, 60 * kMs);
  pair(90 * kMs, 90 * kMs);
  mask(0, 90 * kMs);
  mask(1, 90 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{30, 30})) << "in order: the second still waits";
  mask(1, 60 * kMs);
  mask(0, 60 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{60, 60}, std::pair{90, 90}));
}

TEST_F(MaskTest, APictureWithoutMaskIsLeftOutAndTheOtherCamerasIsUsed) {
  make_with_masks();
  encoders(0, 100 * kMs);
  pair(30 * kMs, 30 * kMs);
  mask(1, 30 * kMs);
  EXPECT_TRUE(out().empty());
  encoders(110 * kMs, 330 * kMs);
  EXPECT_TRUE(out().empty()) << "not yet later than the wait";
  encoders(340 * kMs, 340 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{-1, 30}));
  EXPECT_EQ(dropped(DropReason::kNoMask), 1u);
  mask(0, 30 * kMs);
  EXPECT_EQ(sync_->statistics().masks_late, 1u);
}

TEST_F(MaskTest, WithoutMonoBothAreLeftOut) {
  make_with_masks(2, false);
  encoders(0, 100 * kMs);
  pair(30 * kMs, 30 * kMs);
  mask(1, 30 * kMs);
  encoders(110 * kMs, 400 * kMs);
  EXPECT_TRUE(out().empty());
  EXPECT_EQ(dropped(DropReason::kNoMask), 1u);
  EXPECT_EQ(dropped(DropReason::kUnpaired), 1u);
  EXPECT_EQ(sync_->statistics().masks_unused, 1u);
}

TEST_F(MaskTest, PicturesGoOnWhereNoMaskEverComes) {
  make_with_masks(1);
  for (Microseconds t = 0; t <= 1000 * kMs; t += 10 * kMs) {
    encoders(t, t);
    if (t % (100 * kMs) == 0) picture(0, t);
  }
  EXPECT_TRUE(out().empty());
  EXPECT_EQ(dropped(DropReason::kNoMask), 7u) << "four are within the wait";
  sync_->finish();
  EXPECT_TRUE(out().empty());
  EXPECT_EQ(dropped(DropReason::kNoMask), 11u);
  EXPECT_EQ(dropped(DropReason::kOverload), 0u);
}

TEST_F(MaskTest, OneEncoderStampFarInTheFutureCostsNoMoreThanThePicturesThatWait) {
  make_with_masks(1);
  encoders(0, 100 * kMs);
  picture(0, 50 * kMs);
  encoders(90'000 * kMs, 90'000 * kMs);
  EXPECT_EQ(dropped(DropReason::kNoMask), 1u);
  sync_->add(joints(110 * kMs, {{"arm", 0.11F}, {"neck", -0.055F}}));
  sync_->add(joints(120 * kMs, {{"arm", 0.12F}, {"neck", -0.06F}}));
  encoders(130 * kMs, 200 * kMs);
  picture(0, 170 * kMs);
  EXPECT_EQ(dropped(DropReason::kNoMask), 1u);
  mask(0, 170 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{170, -1}));
}

TEST_F(MaskTest, MasksOfNoPictureAreBoundedAndCounted) {
  make_with_masks(1);
  encoders(0, 100 * kMs);
  for (int i = 0; i < 100; ++i) mask(0, (1000 + i) * kMs);
  EXPECT_EQ(sync_->statistics().masks_unused, 36u) << "64 may wait";
  mask(5, 0);
  sync_->finish();
  EXPECT_EQ(sync_->statistics().masks_unused, 100u);
  EXPECT_EQ(sync_->statistics().masks, 100u);
}

TEST_F(MaskTest, NotAskedForTheyAreNotLookedAt) {
  make(1);
  encoders(0, 100 * kMs);
  mask(0, 30 * kMs);
  picture(0, 30 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{30, -1}));
  EXPECT_EQ(sync_->statistics().masks, 0u);
}

TEST_F(MaskTest, AfterAClockStepMasksBelongToTheNewTime) {
  make_with_masks(1);
  encoders(10'000 * kMs, 10'100 * kMs);
  picture(0, 10'050 * kMs);
  mask(0, 10'050 * kMs);
  EXPECT_EQ(out().size(), 1u);
  encoders(0, 200 * kMs);
  picture(0, 150 * kMs);
  mask(0, 150 * kMs);
  EXPECT_THAT(out(), ElementsAre(std::pair{150, -1}));
}

}  // namespace
}  // namespace bodyschema
