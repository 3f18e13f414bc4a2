#include "bodyschema/bus/observation_stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/observation_queue.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/encoder_track.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

constexpr Microseconds kMs = 1000;

std::vector<CameraModel> rig() {
  std::vector<CameraModel> cameras(2);
  cameras[0].name = "left";
  cameras[1].name = "right";
  for (auto& camera : cameras) camera.intrinsics = {8, 6, 10.0, 10.0, 3.5, 2.5};
  return cameras;
}

bot_core::joint_state_t arm(Microseconds utime, float q) {
  bot_core::joint_state_t m;
  m.utime = utime;
  m.num_joints = 1;
  m.joint_name = {"arm"};
  m.joint_position = {q};
  m.joint_velocity = {0.0F};
  m.joint_effort = {0.0F};
  return m;
}

bot_core::images_t pictures(Microseconds utime, Image left = Image(8, 6, 3), Image right = Image(8, 6, 1)) {
  bot_core::images_t m;
  m.utime = utime;
  m.n_images = 3;
  m.image_types = {2, bot_core::images_t::LEFT, bot_core::images_t::RIGHT};
  m.images = {to_message(Image(100, 1, 1), utime), to_message(left, utime), to_message(right, utime)};
  return m;
}

TEST(LostPictures, AreSaidWithTheReasonsMostFrequentFirst) {
  BusStatistics bus;
  bus.synchroniser.images = 95;
  bus.images_malformed = 5;
  EXPECT_EQ(bus.lost_pictures(0.05), "") << "5 of 100";
  bus.faults[static_cast<std::size_t>(MessageFault::kWrongSize)] = 4;
  bus.faults[static_cast<std::size_t>(MessageFault::kNotFinite)] = 40;  // of encoders
  bus.synchroniser.images_dropped[static_cast<std::size_t>(DropReason::kNoEncoders)] = 20;
  EXPECT_EQ(bus.lost_pictures(0.05),
            "25 of 100 pictures are not used: 20 without encoder readings before and after, 4 of another size "
            "than configured, 1 malformed");
  EXPECT_EQ(BusStatistics{}.lost_pictures(0.05), "");
}

TEST(ObservationStream, TurnsMessagesIntoObservations) {
  ObservationStream stream({"arm"}, {}, rig(), {});
  EXPECT_FALSE(stream.receive("ICUB_JOINT_OFFSETS", {}));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(stream.receive("ICUB_JOINT_STATE", encode(arm(10 * i * kMs, 0.5F))));
  EXPECT_TRUE(stream.receive("ICUB_CAMERAS", encode(pictures(45 * kMs)), 77));
  const auto arrived = stream.next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->arrival_us, 77);
  ASSERT_TRUE(arrived->observation.cameras[0] && arrived->observation.cameras[1]);
  EXPECT_EQ(arrived->observation.cameras[0]->image.channels, 3);
  EXPECT_EQ(arrived->observation.cameras[1]->image.channels, 1);
  EXPECT_EQ(stream.statistics().messages, 11u);
  for (const auto& [name, count] : stream.statistics().counters()) EXPECT_EQ(count, 0u) << name;
}

TEST(ObservationStream, TakesMasksOfOthersWhereTheyAreAskedFor) {
  BusOptions options;
  {
    ObservationStream stream({"arm"}, {}, rig(), options);
    EXPECT_FALSE(stream.receive("ICUB_MASKS", encode(pictures(45 * kMs)))) << "not asked for";
  }
  options.synchroniser.masks = true;
  ObservationStream stream({"arm"}, {}, rig(), options);
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(stream.receive("ICUB_JOINT_STATE", encode(arm(10 * i * kMs, 0.5F))));
  EXPECT_TRUE(stream.receive("ICUB_CAMERAS", encode(pictures(45 * kMs))));
  Image left(8, 6, 1), right(8, 6, 3);
  left.data[0] = 250;
  left.data[1] = 130;
  right.data[0] = right.data[1] = right.data[2] = 255;  // gray, told three times
  EXPECT_TRUE(stream.receive("ICUB_MASKS", encode(pictures(45 * kMs, left, right)), 99));
  const auto arrived = stream.next();
  ASSERT_TRUE(arrived);
  EXPECT_EQ(arrived->arrival_us, 99);
  const auto& mask = arrived->observation.cameras[0]->given_mask;
  EXPECT_EQ(mask.channels, 1);
  EXPECT_EQ(mask.data[0], kMaskRobot);
  EXPECT_EQ(mask.data[1], kMaskUnknown);
  EXPECT_EQ(mask.data[2], kMaskBackground);
  EXPECT_EQ(arrived->observation.cameras[1]->given_mask.data[0], kMaskRobot);
}

TEST(ObservationStream, RefusesWhatIsNoMask) {
  BusOptions options;
  options.synchroniser.masks = true;
  const auto refused = [&](const bot_core::images_t& message) {
    ObservationStream stream({"arm"}, {}, rig(), options);
    stream.receive("ICUB_MASKS", encode(message));
    return stream.statistics().faults[static_cast<std::size_t>(MessageFault::kBadMask)];
  };
  Image good(8, 6, 1);
  EXPECT_EQ(refused(pictures(0, good, good)), 0u) << "a robot that is out of the picture";
  Image ones = good;
  ones.data[5] = 1;
  EXPECT_EQ(refused(pictures(0, ones, good)), 1u) << "0 and 1, as of a Boolean array";
  Image colour(8, 6, 3);
  colour.data[0] = 255;
  EXPECT_EQ(refused(pictures(0, good, colour)), 1u);
  EXPECT_EQ(refused(pictures(0, Image(9, 6, 1), good)), 1u);
  auto jpeg = pictures(0, good, good);
  jpeg.images[1] = to_jpeg_message(good, 0, 90);
  EXPECT_EQ(refused(jpeg), 1u);
}

TEST(ObservationStream, PicturesBelongToTheCameraOfTheirNumberWhateverItsName) {
  auto cameras = rig();
  cameras[0].name = "head";
  cameras[0].image_type = 2;
  cameras[0].intrinsics.width = 100;
  cameras[0].intrinsics.height = 1;
  cameras[1].name = "wrist";
  cameras[1].image_type = 5;
  ObservationStream stream({"arm"}, {}, cameras, {});
  for (int i = 0; i < 40; ++i) stream.receive("ICUB_JOINT_STATE", encode(arm(10 * i * kMs, 0.5F)));
  stream.receive("ICUB_CAMERAS", encode(pictures(45 * kMs)));
  stream.finish();
  const auto arrived = stream.next();
  ASSERT_TRUE(arrived);
  EXPECT_TRUE(arrived->observation.cameras[0]);
  EXPECT_FALSE(arrived->observation.cameras[1]);
  std::swap(cameras[0], cameras[1]);
  EXPECT_THROW(ObservationStream({"arm"}, {}, cameras, {}), ConfigurationError);
}

/// What a backlash of the elbow that is known says of four exposures, from the encoder samples that observations
/// carry: two cameras, on the way up and down again. The link first lags below the encoder, then above it. A picture
/// that comes after its encoders have gone on must not see the later ones.
/// @param publish  sends the readings of an instant, given the elbow's
std::vector<double> elbow_dq(
    const std::function<void(ObservationStream& stream, Microseconds now, float elbow_rad)>& publish) {
  const Configuration configuration =
      Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
  RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  setup.model.rendered_links.clear();
  const auto robot = setup.load();
  const JointRoles roles = JointRoles::of(robot, setup, StereoRig::from(configuration.section("cameras")));
  const auto elbow = roles.index("r_elbow");
  ErrorModel model(roles);
  model.add("backlash", {"r_elbow", ""}).parameters()[0].value = 0.02;
  std::map<std::string, double> resting;
  for (const auto& name : roles.names) resting[name] = 0.0;
  ObservationStream stream(roles.names, resting, rig(), {});
  EncoderTrack track(robot, setup);

  std::vector<double> dq;
  for (int i = 0; i <= 40; ++i) {
    const Microseconds now = 10 * i * kMs;
    publish(stream, now, 0.01F * static_cast<float>(i <= 20 ? i : 40 - i));
    if (i == 20 || i == 40) stream.receive("ICUB_CAMERAS", encode(pictures(now - 45 * kMs)));
    while (const auto arrived = stream.next()) {
      const Observation& observation = arrived->observation;
      if (observation.encoders_begin_anew) {
        track.forget();
        model.forget();
      }
      track.add(observation.encoders);
      for (std::size_t c = 0; c < 2; ++c) {
        EXPECT_TRUE(observation.cameras[c]);
        track.advance(observation.cameras[c]->utime, [&](const JointSample& sample) { model.observe(sample); });
        Instant at;
        track.instant(observation.cameras[c]->joints, c, Eigen::VectorXd::Zero(robot->joint_count()), at);
        Corrections corrections = roles.no_corrections();
        model.corrections(at, corrections);
        dq.push_back(corrections.dq[elbow]);
        EXPECT_EQ(corrections.dq.cwiseAbs().sum(), std::abs(dq.back())) << "the elbow alone";
      }
    }
  }
  return dq;
}

void read_joint(ObservationStream& stream, const char* name, Microseconds utime, float q_rad) {
  auto message = arm(utime, q_rad);
  message.joint_name = {name};
  stream.receive("ICUB_JOINT_STATE", encode(message));
}

void expect_lag_up_and_down(const std::vector<double>& dq) {
  ASSERT_EQ(dq.size(), 4u);
  EXPECT_NEAR(dq[0], -0.01, 1e-6);
  EXPECT_NEAR(dq[1], dq[0], 1e-12);
  EXPECT_NEAR(dq[2], 0.01, 1e-6);
  EXPECT_NEAR(dq[3], dq[2], 1e-12);
}

/// Arm and head published apart, as many robots do, with a backlash that is known.
TEST(ObservationStream, CarriesTheEncodersOnWhichAMemoryLives) {
  expect_lag_up_and_down(elbow_dq([](ObservationStream& stream, Microseconds now, float elbow_rad) {
    read_joint(stream, "r_elbow", now, elbow_rad);
    read_joint(stream, "neck_pitch", now, 0.1F);
  }));
}

TEST(ObservationStream, AnArmWhoseMessagesTrailTheHeadsIsFollowedToo) {
  expect_lag_up_and_down(elbow_dq([](ObservationStream& stream, Microseconds now, float elbow_rad) {
    read_joint(stream, "neck_pitch", now + 3 * kMs, 0.1F);
    read_joint(stream, "r_elbow", now, elbow_rad);
  }));
}

TEST(ObservationStream, OneStampFarAheadOfAJointThatThenFallsSilentStopsNothing) {
  expect_lag_up_and_down(elbow_dq([](ObservationStream& stream, Microseconds now, float elbow_rad) {
    read_joint(stream, "r_elbow", now, elbow_rad);
    if (now == 50 * kMs) read_joint(stream, "torso_yaw", now + 3'600'000 * kMs, 0.1F);
  }));
}

/// Every sample comes with one observation, in order, and what came before another clock is not of it.
TEST(ObservationStream, CarriesEveryEncoderSampleOnceAndSaysWhereTheyBeginAnew) {
  ObservationStream stream({"arm"}, {}, rig(), {});
  std::vector<Microseconds> seen;
  int anew = 0;
  const auto receive = [&](Microseconds begin) {
    for (int i = 0; i <= 30; ++i) {
      stream.receive("ICUB_JOINT_STATE", encode(arm(begin + 10 * i * kMs, 0.01F * static_cast<float>(i))));
      if (i % 10 == 5) stream.receive("ICUB_CAMERAS", encode(pictures(begin + 10 * i * kMs - 15 * kMs)));
      while (const auto arrived = stream.next()) {
        const Observation& observation = arrived->observation;
        if (observation.encoders_begin_anew) {
          seen.clear();
          ++anew;
        }
        for (const auto& sample : observation.encoders) seen.push_back(sample.utime);
        EXPECT_GE(seen.back(), observation.utime) << "no sample after the exposure, though there were";
      }
    }
  };
  const auto expect_all_since = [&](Microseconds first) {
    ASSERT_GE(seen.size(), 20u);
    for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(seen[i], first + static_cast<Microseconds>(i) * 10 * kMs);
  };
  constexpr Microseconds kAnHour = 3'600'000 * kMs;
  receive(kAnHour);
  EXPECT_EQ(anew, 0);
  expect_all_since(kAnHour);
  receive(0);  // the clock steps back
  EXPECT_EQ(anew, 1);
  EXPECT_LT(seen.front(), 100 * kMs);
  expect_all_since(seen.front());
}

TEST(ObservationStream, ALegThatFallsSilentIsNotMissed) {
  TemporaryFolder folder;
  const auto joint = [](const std::string& name, const std::string& child) {
    return "<link name='" + child + "'/><joint name='" + name +
           "' type='continuous'><parent link='base'/><child link='" + child + "'/><axis xyz='0 0 1'/></joint>";
  };
  RobotSetup setup;
  setup.model.urdf = folder.write(
      "robot.urdf", "<robot name='r'><link name='base'/>" + joint("arm", "hand") + joint("knee", "foot") + "</robot>");
  setup.hand_link = "hand";
  setup.estimated_joints = {"arm"};
  StereoRig cameras;
  cameras.cameras = rig();
  for (auto& camera : cameras.cameras) camera.link = "base";
  ObservationStream stream(setup.load(), setup, cameras, {});
  int observations = 0;
  for (int i = 0; i < 300; ++i) {
    auto message = arm(10 * i * kMs, 0.5F);
    stream.receive("ICUB_JOINT_STATE", encode(message));
    message.joint_name = {"knee"};
    if (i < 20) stream.receive("ICUB_JOINT_STATE", encode(message));
    if (i % 10 == 5) stream.receive("ICUB_CAMERAS", encode(pictures(message.utime - 1)));
    while (stream.next()) ++observations;
  }
  EXPECT_EQ(observations, 30);
  EXPECT_EQ(stream.statistics().synchroniser.total_dropped(), 0u);
}

TEST(ObservationStream, CountsAndSkipsWhatIsMalformed) {
  ObservationStream stream({"arm"}, {}, rig(), {});
  auto nan = arm(0, std::nanf(""));
  stream.receive("ICUB_JOINT_STATE", encode(nan));
  stream.receive("ICUB_JOINT_STATE", {});
  auto cut = encode(pictures(5 * kMs));
  cut.resize(cut.size() / 2);
  stream.receive("ICUB_CAMERAS", cut);
  for (int i = 0; i < 10; ++i) stream.receive("ICUB_JOINT_STATE", encode(arm(10 * i * kMs, 0.5F)));
  // A picture of another size is refused by itself; its partner goes on alone.
  stream.receive("ICUB_CAMERAS", encode(pictures(5 * kMs, Image(9, 6, 3))));
  stream.finish();
  const auto arrived = stream.next();
  ASSERT_TRUE(arrived);
  EXPECT_FALSE(arrived->observation.cameras[0]);
  EXPECT_TRUE(arrived->observation.cameras[1]);
  const auto statistics = stream.statistics();
  EXPECT_EQ(statistics.messages_malformed, 3u);
  EXPECT_EQ(statistics.images_malformed, 1u);
  EXPECT_EQ(statistics.faults[static_cast<std::size_t>(MessageFault::kNotFinite)], 1u);
  EXPECT_EQ(statistics.faults[static_cast<std::size_t>(MessageFault::kTruncated)], 2u);
  EXPECT_EQ(statistics.faults[static_cast<std::size_t>(MessageFault::kWrongSize)], 1u);
  std::uint64_t all = 0;
  for (const auto& [name, count] : statistics.counters()) all += count;
  EXPECT_EQ(all, 4u);
}

/// How many of `n` pictures of each camera, left in colour or gray, become part of an observation.
struct Used {
  int left = 0, right = 0;
};
Used used(ObservationStream& stream, Microseconds& now, int n, int left_channels) {
  Used used;
  for (int i = 0; i < n; ++i, now += 20 * kMs) {
    stream.receive("ICUB_JOINT_STATE", encode(arm(now, 0.5F)));
    stream.receive("ICUB_CAMERAS", encode(pictures(now - 5 * kMs, Image(8, 6, left_channels))));
    while (const auto arrived = stream.next()) {
      used.left += arrived->observation.cameras[0].has_value();
      used.right += arrived->observation.cameras[1].has_value();
    }
  }
  return used;
}

TEST(ObservationStream, RefusesPicturesOfAnotherKindUntilTheyAreManyInARow) {
  BusOptions options;
  options.synchroniser.camera_wait = 0;
  ObservationStream stream({"arm"}, {}, rig(), options);
  Microseconds now = 20 * kMs;
  stream.receive("ICUB_JOINT_STATE", encode(arm(0, 0.5F)));
  EXPECT_EQ(used(stream, now, 10, 3).left, 10);
  const Used stray = used(stream, now, 20, 1);
  EXPECT_EQ(stray.left, 0);
  EXPECT_GE(stray.right, 15);
  EXPECT_EQ(stream.statistics().faults[static_cast<std::size_t>(MessageFault::kOtherKind)], 20u);
  EXPECT_EQ(used(stream, now, 10, 3).left, 10);
  // A driver that was exchanged sends them for good.
  EXPECT_EQ(used(stream, now, 290, 1).left, 0);
  EXPECT_EQ(used(stream, now, 30, 1).left, 21);
}

TEST(ObservationStream, WhereTheBackgroundIsGivenItsKindIsKeptForGood) {
  ObservationStream stream({"arm"}, {}, rig(), {});
  stream.expect_channels(0, 3);
  Microseconds now = 20 * kMs;
  EXPECT_EQ(used(stream, now, 1000, 1).left, 0);
  EXPECT_GE(used(stream, now, 30, 3).left, 25);
}

TEST(ObservationStream, RefusesARigItCannotServe) {
  auto swapped = rig();
  std::swap(swapped[0], swapped[1]);
  EXPECT_THROW(ObservationStream({"arm"}, {}, swapped, {}), ConfigurationError);
  auto odd = rig();
  odd[1].name = "middle";
  EXPECT_THROW(ObservationStream({"arm"}, {}, odd, {}), ConfigurationError);
}

TEST(ObservationStream, ServesAMonoRigOfTheRightCamera) {
  ObservationStream stream({"arm"}, {{"arm", 0.25}}, {rig()[1]}, {});
  stream.receive("ICUB_CAMERAS", encode(pictures(45 * kMs)));
  const auto arrived = stream.next();
  ASSERT_TRUE(arrived);
  ASSERT_EQ(arrived->observation.cameras.size(), 1u);
  EXPECT_EQ(arrived->observation.cameras[0]->image.channels, 1);
}

TEST(BusOptions, ReadTheirSectionAndRefuseNonsense) {
  const auto configuration =
      Configuration::parse("bus: {channel_prefix: ROBOT, pairing_window_ms: 20, joint_velocity: differences}");
  const BusOptions options = BusOptions::from(configuration.section("bus"));
  EXPECT_EQ(options.channels().cameras, "ROBOT_CAMERAS");
  EXPECT_EQ(options.synchroniser.pairing_window, 20 * kMs);
  EXPECT_TRUE(options.synchroniser.joints.velocity_from_differences);
  EXPECT_NO_THROW(configuration.reject_unknown_keys());
  for (const char* bad : {"bus: {channel_prefix: 'A.*'}", "bus: {channel_prefix: ''}", "bus: {pairing_window_ms: -1}",
                          "bus: {joint_velocity: guessed}", "bus: {queue_frames: 0}"}) {
    EXPECT_THROW(BusOptions::from(Configuration::parse(bad).section("bus")), ConfigurationError) << bad;
  }
}

TEST(BusOptions, ShippedFileHoldsTheDefaultsAndOnlyKnownKeys) {
  const auto configuration = Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/bus.yaml");
  const BusOptions options = BusOptions::from(configuration.section("bus"));
  EXPECT_NO_THROW(configuration.reject_unknown_keys());
  const BusOptions defaults;
  EXPECT_EQ(options.channel_prefix, defaults.channel_prefix);
  EXPECT_EQ(options.synchroniser.pairing_window, defaults.synchroniser.pairing_window);
  EXPECT_EQ(options.synchroniser.encoder_wait, defaults.synchroniser.encoder_wait);
  EXPECT_NEAR(options.synchroniser.joints.max_speed_rad_s, defaults.synchroniser.joints.max_speed_rad_s, 0.01);
}

TEST(BusOptions, MessagesMayBeAsLongAsThePicturesTheyAllow) {
  constexpr std::size_t kMiB = 1u << 20;
  BusOptions options;
  options.limits.max_width_px = options.limits.max_height_px = 2448;
  EXPECT_EQ(options.longest_message_bytes(2), 2u * 3u * 2448u * 2448u + kMiB);
  EXPECT_EQ(options.longest_message_bytes(1), 32 * kMiB);
  options.limits.max_width_px = options.limits.max_height_px = 32'768;
  EXPECT_EQ(options.longest_message_bytes(2), 256 * kMiB) << "what LCM carries";
}

TEST(LcmUrl, ComesFromCommandLineThenEnvironmentThenDefault) {
  unsetenv("LCM_DEFAULT_URL");
  EXPECT_EQ(resolve_lcm_url(std::nullopt), "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(resolve_lcm_url(""), kDefaultLcmUrl);
  setenv("LCM_DEFAULT_URL", "memq://", 1);
  EXPECT_EQ(resolve_lcm_url(std::nullopt), "memq://");
  EXPECT_EQ(resolve_lcm_url("udpm://239.1.1.1:1?ttl=0"), "udpm://239.1.1.1:1?ttl=0");
  unsetenv("LCM_DEFAULT_URL");
}

TEST(LcmLink, CarriesMessagesAndSurvivesAHandlerThatThrows) {
  LcmLink link("memq://");
  std::vector<std::string> received;
  link.subscribe("ICUB_JOINT_STATE", 10, [&](const std::string& channel, Bytes message, std::int64_t) {
    JointStateMessage out;
    ASSERT_TRUE(decode(message, out).ok());
    received.push_back(channel + std::to_string(out.utime));
    throw std::runtime_error("a handler's own trouble");
  });
  link.publish_message("ICUB_JOINT_STATE", 0, arm(11, 0.5F));
  link.publish_message("ICUB_JOINT_STATE_2", 0, arm(12, 0.5F));
  link.publish_message("ICUB_JOINT_STATE", 0, arm(13, 0.5F));
  while (link.handle(50)) {
  }
  EXPECT_THAT(received, testing::ElementsAre("ICUB_JOINT_STATE11", "ICUB_JOINT_STATE13"));
}

TEST(LcmLink, NamesAUrlItCannotUse) {
  try {
    LcmLink link("nonsense://here");
    FAIL();
  } catch (const DeviceError& e) {
    EXPECT_THAT(e.what(), HasSubstr("nonsense://here"));
  }
}

TEST(ObservationQueue, ShedsTheOldestWhenFull) {
  ObservationQueue queue(2);
  for (int i = 0; i < 5; ++i) {
    ArrivedObservation arrived;
    arrived.observation.utime = i;
    queue.push(std::move(arrived));
  }
  EXPECT_EQ(queue.shed(), 3u);
  EXPECT_EQ(queue.pop(std::chrono::milliseconds(0))->observation.utime, 3);
  EXPECT_EQ(queue.pop(std::chrono::milliseconds(0))->observation.utime, 4);
  EXPECT_FALSE(queue.pop(std::chrono::milliseconds(1)));
  queue.close();
  EXPECT_FALSE(queue.pop(std::chrono::hours(1)));
}

TEST(ObservationQueue, WhatIsShedLeavesItsEncodersToTheNext) {
  const auto with_samples = [](Microseconds from, bool anew) {
    ArrivedObservation arrived;
    arrived.observation.encoders_begin_anew = anew;
    for (const Microseconds t : {from, from + 1}) {
      JointSample sample;
      sample.utime = t;
      arrived.observation.encoders.push_back(sample);
    }
    return arrived;
  };
  for (const std::size_t capacity : {1u, 2u}) {
    ObservationQueue queue(capacity);
    queue.push(with_samples(0, true));
    for (int i = 1; i < 4; ++i) queue.push(with_samples(2 * i, false));
    const auto first = queue.pop(std::chrono::milliseconds(0));
    ASSERT_TRUE(first);
    EXPECT_TRUE(first->observation.encoders_begin_anew);
    const auto& kept = first->observation.encoders;
    ASSERT_EQ(kept.size(), 2 * (4 - capacity + 1));
    for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].utime, static_cast<Microseconds>(i));
  }
  // Those of another clock are no part of what comes after it.
  ObservationQueue queue(1);
  queue.push(with_samples(100, false));
  queue.push(with_samples(0, true));
  EXPECT_EQ(queue.pop(std::chrono::milliseconds(0))->observation.encoders.size(), 2u);
}

}  // namespace
}  // namespace bodyschema
