#include "bodyschema/pipeline/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/export_correction.hpp"
#include "bodyschema/pipeline/hand_errors.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/recording.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const fs::path kConfig = fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml";

std::string content(const fs::path& file) {
  std::ifstream stream(file);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// Plays a plan into a log, with what was true beside it.
void record(const Configuration& configuration, const simulator::SimulatorSettings& settings,
            const simulator::SimulationPlan& plan, const fs::path& file, const fs::path& truth_file) {
  const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  simulator::Simulator simulator(setup.load(), setup, StereoRig::from(configuration.section("cameras")), settings,
                                 plan);
  LogWriter log(file);
  simulator::FramePublisher publisher(simulator.joint_names(), {});
  simulator::TruthWriter truth(truth_file, simulator, setup);
  while (auto frame = simulator.next()) {
    publisher.publish(*frame, log);
    truth.add(*frame);
  }
  truth.close();
}

/// A short reach of our own robot, recorded once for all tests of this file.
class ReplayTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("replay_test_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    const Configuration configuration = Configuration::load(kConfig);
    simulator::SimulationPlan plan;
    plan.seed = 3;
    plan.frames = 20;
    plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_elbow", -2}, {"r_wrist_pitch", -7}};
    record(configuration, simulator::SimulatorSettings::from(configuration.section("simulator")), plan,
           folder_ / "reach.log", folder_ / "truth.json");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static ReplayOptions options(const std::string& out) {
    ReplayOptions o;
    o.log = folder_ / "reach.log";
    o.out = folder_ / out;
    o.overlays = 2;
    return o;
  }
  static Configuration configuration(const std::vector<std::string>& overrides = {}) {
    Configuration c = Configuration::load(kConfig, overrides);
    (void)simulator::SimulatorSettings::from(c.section("simulator"));  // its keys are known here
    return c;
  }
  /// The reach, but its last four pictures show these cameras the empty room.
  static void record_with_an_empty_room_at_the_end(const fs::path& file, const std::vector<std::size_t>& cameras) {
    std::vector<LogEvent> events;
    LogReader reader(folder_ / "reach.log");
    for (LogEvent event; reader.next(event);) events.push_back(event);
    std::vector<std::size_t> pictures;
    for (std::size_t i = 0; i < events.size(); ++i) {
      if (events[i].channel == "ICUB_CAMERAS") pictures.push_back(i);
    }
    const auto decoded = [&](std::size_t i) {
      bot_core::images_t message;
      message.decode(events[i].data.data(), 0, static_cast<int>(events[i].data.size()));
      return message;
    };
    const bot_core::images_t empty_room = decoded(pictures.front());
    LogWriter log(file);
    for (std::size_t i = 0; i < events.size(); ++i) {
      const auto from_end = std::find(pictures.end() - 4, pictures.end(), i);
      if (from_end == pictures.end()) {
        log.publish(events[i].channel, events[i].time_us, events[i].data);
        continue;
      }
      bot_core::images_t message = decoded(i);
      for (const std::size_t c : cameras) message.images.at(c).data = empty_room.images.at(c).data;
      log.publish_message(events[i].channel, events[i].time_us, message);
    }
  }
  static inline fs::path folder_;
};

TEST_F(ReplayTest, WritesEstimatesSummaryAndPictures) {
  ReplayOptions o = options("first");
  o.truth = folder_ / "truth.json";
  o.masks = true;
  const std::string table = replay(configuration(), o);
  EXPECT_THAT(table, HasSubstr("r_wrist_pitch"));
  std::ifstream lines(o.out / "estimates.jsonl");
  std::string line;
  nlohmann::json last;
  std::int64_t before = 0;
  while (std::getline(lines, line)) {
    last = nlohmann::json::parse(line);
    EXPECT_GT(last["utime"].get<std::int64_t>(), before);
    before = last["utime"].get<std::int64_t>();
  }
  EXPECT_EQ(last["state"], "converged");
  EXPECT_EQ(last["offset_deg"].size(), 7u);
  EXPECT_EQ(last["stddev_deg"].size(), 7u);
  EXPECT_THAT(last["told"], ::testing::Contains("r_elbow"));
  const auto& effects = last["effects"];
  const auto neck = std::find_if(effects.begin(), effects.end(), [](const auto& effect) {
    return effect["name"] == "head_offset" && effect["joint"] == "neck_pitch";
  });
  ASSERT_NE(neck, effects.end());
  EXPECT_EQ((*neck)["unit"], "deg");
  EXPECT_LE((*neck)["stddev"].get<double>(), (*neck)["prior_stddev"].get<double>());
  EXPECT_EQ(last["hand_pose_left_camera"].size(), 4u);
  EXPECT_GT(last["likelihood"].get<double>(), 0.95);
  EXPECT_LT(last["error_left"]["position_mm"].get<double>(), 1.0);
  const auto summary = nlohmann::json::parse(content(o.out / "summary.json"));
  EXPECT_LT(summary["errors"]["left"]["last_frames"]["position_mm"]["after"].get<double>(),
            0.1 * summary["errors"]["left"]["last_frames"]["position_mm"]["before"].get<double>());
  const RobotSetup setup = RobotSetup::from(configuration().section("robot"));
  const StereoRig rig = StereoRig::from(configuration().section("cameras"));
  EXPECT_NO_THROW(export_correction(o.out / "summary.json", setup, rig, o.out / "apply"));
  StereoRig other = rig;
  other.cameras[0].intrinsics.cx += 10.0;
  EXPECT_THROW(export_correction(o.out / "summary.json", setup, other, o.out / "apply"), ConfigurationError);
  EXPECT_TRUE(fs::exists(o.out / "overlay_final.png"));
  EXPECT_FALSE(fs::is_empty(o.out / "masks"));
}

TEST_F(ReplayTest, ARigWithARightCameraAloneIsSimulatedAndReplayedUnderItsName) {
  std::string yaml = Configuration::load(kConfig).print();
  const auto left = yaml.find("left: {", yaml.find("cameras:"));
  ASSERT_NE(left, std::string::npos);
  yaml.erase(left, yaml.find("right: {", left) - left);
  const Configuration right_only = Configuration::parse(yaml, kConfig.parent_path());
  ASSERT_EQ(StereoRig::from(right_only.section("cameras")).cameras.size(), 1u);
  simulator::SimulationPlan plan;
  plan.seed = 3;
  plan.frames = 12;
  plan.offsets_deg = {{"r_elbow", 4}};
  ReplayOptions o;
  o.log = folder_ / "right.log";
  o.out = folder_ / "right";
  o.truth = folder_ / "right.json";
  record(right_only, simulator::SimulatorSettings::from(right_only.section("simulator")), plan, o.log, *o.truth);
  const std::string table = replay(right_only, o);
  EXPECT_THAT(table, HasSubstr("right eye, last"));
  EXPECT_THAT(table, ::testing::Not(HasSubstr("left eye")));
  const auto summary = nlohmann::json::parse(content(o.out / "summary.json"));
  EXPECT_FALSE(summary["errors"].contains("left"));
  EXPECT_LT(summary["errors"]["right"]["last_frames"]["position_mm"]["after"].get<double>(), 5.0);
}

/// The arm is in view from the first picture on: learned from the first pictures it would be background.
TEST_F(ReplayTest, LearnsTheBackgroundFromTheWholeLogUnlessToldOtherwise) {
  const Configuration c = Configuration::load(kConfig);
  auto settings = simulator::SimulatorSettings::from(c.section("simulator"));
  settings.background_frames = 0;
  settings.entry_frames = 0;
  simulator::SimulationPlan plan;
  plan.seed = 1;
  plan.frames = 100;
  plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_shoulder_roll", 4}, {"r_elbow", -2}, {"r_wrist_pitch", -7}};
  ReplayOptions o = options("in_view");
  o.log = folder_ / "in_view.log";
  o.truth = folder_ / "in_view.json";
  o.overlays = 0;
  record(c, settings, plan, o.log, *o.truth);
  const auto largest_error_mm = [&](int from) {
    std::ifstream lines(o.out / "estimates.jsonl");
    double largest = 0.0;
    std::string line;
    for (int i = 0; std::getline(lines, line); ++i) {
      if (i < from) continue;
      largest = std::max(largest, nlohmann::json::parse(line)["error_left"]["position_mm"].get<double>());
    }
    return largest;
  };
  const auto first_state = [&] {
    std::ifstream lines(o.out / "estimates.jsonl");
    std::string line;
    std::getline(lines, line);
    return nlohmann::json::parse(line)["state"].get<std::string>();
  };
  constexpr int kLearning = 20;
  double whole_log_mm = 0.0;
  for (const auto& [mode, from, bound_mm] :
       {std::tuple<std::string, int, double>{"best", 3, 2.0}, {"paper", 60, 15.0}}) {
    replay(configuration({"estimator.mode=" + mode}), o);
    EXPECT_LT(largest_error_mm(from), bound_mm) << mode;
    std::printf("%s, learned from the whole log: %.2f mm at most\n", mode.c_str(), largest_error_mm(from));
    EXPECT_NE(first_state(), "learning_background") << mode;
    if (mode == "best") whole_log_mm = largest_error_mm(kLearning);
  }
  o.learn_background_online = true;
  replay(configuration(), o);
  EXPECT_EQ(first_state(), "learning_background");
  EXPECT_GT(largest_error_mm(kLearning), whole_log_mm) << "the arm was in view while it learned";
  std::printf("best, learned from the first pictures: %.2f mm at most\n", largest_error_mm(kLearning));
}

TEST_F(ReplayTest, SaysSoWhenItEndsWithoutHavingConverged) {
  ReplayOptions o = options("cut");
  o.learn_background_online = true;
  o.overlays = 0;
  EXPECT_THAT(replay(configuration({"vision.learning_frames=1000"}), o),
              HasSubstr("\nNOT CONVERGED: the log ended in state 'learning_background': it holds too few pictures"));
  const std::string good = replay(configuration(), o);
  EXPECT_THAT(good, ::testing::Not(HasSubstr("NOT CONVERGED")));
}

/// At the end of most recordings the arm leaves the pictures. What was known is known.
TEST_F(ReplayTest, ALogWhoseArmLeavesThePicturesAtTheEndHasConverged) {
  ReplayOptions o = options("leaves");
  o.log = folder_ / "leaves.log";
  o.overlays = 0;
  record_with_an_empty_room_at_the_end(o.log, {0, 1});
  const std::string table = replay(configuration(), o);
  EXPECT_THAT(table, ::testing::Not(HasSubstr("NOT CONVERGED")));
  EXPECT_THAT(table, HasSubstr("The last frames (hand_not_in_view) tell the hand less well"));
  EXPECT_EQ(nlohmann::json::parse(content(o.out / "summary.json"))["estimate"]["state"], "converged");
}

/// The offsets of a log that has converged before its end are those of then, not the estimator's last.
TEST_F(ReplayTest, SaysWhichLimitWasMissedByHowMuch) {
  ReplayOptions o = options("demanding");
  o.overlays = 0;
  EXPECT_THAT(
      replay(configuration({"estimator.best.converged_hand_sd_mm=0.01"}), o),
      ::testing::ContainsRegex("settled: the hand is known to [0-9.]+ mm, 0.01 mm are needed; do not use them"));
  EXPECT_THROW(replay(configuration({"cameras.left.pose=unknown"}), o), ConfigurationError);
}

TEST_F(ReplayTest, ErrorsAndTheLastPictureAreOfTheOffsetsThatAreReported) {
  ReplayOptions o = options("one_eye");
  o.log = folder_ / "one_eye.log";
  o.truth = folder_ / "truth.json";
  o.learn_background_online = true;
  record_with_an_empty_room_at_the_end(o.log, {1});
  std::vector<Observation> seen;
  std::vector<Exposure> exposures;
  std::vector<Estimate> estimates;
  const auto watch = [&](Pipeline& pipeline) {
    seen.clear();
    exposures.clear();
    estimates.clear();
    ObservationStream stream = pipeline.make_stream();
    const auto drain = [&] {
      while (auto arrived = stream.next()) {
        estimates.push_back(pipeline.process(arrived->observation));
        exposures.push_back(pipeline.estimator().exposure(0));
        seen.push_back(std::move(arrived->observation));
      }
    };
    LogReader log(o.log);
    for (LogEvent event; log.next(event);) {
      if (stream.receive(event.channel, event.data, event.time_us)) drain();
    }
    stream.finish();
    drain();
  };
  // One eye tells the hand less well than two, as long as an arm that moves is no less known: what is asked for lies
  // between.
  const std::string exact_stamps = "estimator.best.stamp_sd_ms=0.01";
  Pipeline first(configuration({exact_stamps}));
  watch(first);
  ASSERT_GT(estimates.size(), 10u);
  const double both_m = (estimates.end() - 5)->hand_sd_m, one_m = estimates.back().hand_sd_m;
  ASSERT_GT(one_m, 1.01 * both_m);
  const Configuration demanding = configuration(
      {exact_stamps, fmt::format("estimator.best.converged_hand_sd_mm={}", 1e3 * std::sqrt(both_m * one_m))});
  Pipeline pipeline(demanding);
  watch(pipeline);
  ASSERT_EQ(estimates.back().state, EstimatorState::kConverging);
  const auto converged = std::find_if(estimates.rbegin(), estimates.rend(),
                                      [](const auto& e) { return e.state == EstimatorState::kConverged; });
  ASSERT_NE(converged, estimates.rend());

  const Truth truth = Truth::load(*o.truth);
  const auto mean_mm = [&](const Estimate& estimate) {
    double sum = 0.0;
    int n = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (!seen[i].cameras[0]) continue;
      const TruthInstant* instant = truth.at(seen[i].cameras[0]->utime);
      if (instant == nullptr) continue;
      const Pose hand = pipeline.estimator().hand_pose(exposures[i], estimate);
      sum += 1e3 * hand_error(hand, *instant, 0, pipeline.rig().cameras[0].intrinsics).position_m;
      ++n;
    }
    return sum / n;
  };
  ASSERT_GT(std::abs(mean_mm(*converged) - mean_mm(estimates.back())), 1e-6);
  EXPECT_THAT(replay(demanding, o), HasSubstr("The last frames (converging) tell the hand less well"));
  const auto summary = nlohmann::json::parse(content(o.out / "summary.json"));
  EXPECT_EQ(summary["estimate"]["utime"], converged->utime);
  EXPECT_NEAR(summary["errors"]["left"]["final_on_all_frames"]["position_mm"]["after"].get<double>(),
              mean_mm(*converged), 1e-9);
  const fs::path picture = folder_ / "expected.png";
  auto views = overlay_views(pipeline, seen.back(), *converged);
  crop_to_arm(views);
  write_png(picture, draw_overlay(views, "last frame"));
  EXPECT_TRUE(content(o.out / "overlay_final.png") == content(picture));
}

TEST_F(ReplayTest, SaysSoWhenLeftAndRightAreSwapped) {
  ReplayOptions o = options("swapped");
  o.log = folder_ / "swapped.log";
  o.overlays = 0;
  {
    LogReader reader(folder_ / "reach.log");
    LogWriter log(o.log);
    for (LogEvent event; reader.next(event);) {
      if (event.channel == "ICUB_CAMERAS") {
        bot_core::images_t pictures;
        pictures.decode(event.data.data(), 0, static_cast<int>(event.data.size()));
        std::swap(pictures.images.at(0).data, pictures.images.at(1).data);
        log.publish_message(event.channel, event.time_us, pictures);
      } else {
        log.publish(event.channel, event.time_us, event.data);
      }
    }
  }
  const std::string table = replay(configuration(), o);
  EXPECT_THAT(table,
              HasSubstr("\nNOT CONVERGED: the log ended in state 'diverged': each picture shows what the other eye"));
  EXPECT_THAT(table, HasSubstr("\nWARNING: the left and right pictures are swapped in "));
}

TEST_F(ReplayTest, TwoReplaysAreIdenticalWhateverTheThreads) {
  replay(configuration({"silhouette.threads=1"}), options("a"));
  for (const char* threads : {"silhouette.threads=2", "silhouette.threads=3"}) {
    replay(configuration({threads}), options("b"));
    EXPECT_EQ(content(folder_ / "a/estimates.jsonl"), content(folder_ / "b/estimates.jsonl")) << threads;
  }
  replay(configuration({"filter.seed=2", "estimator.mode=paper"}), options("c"));
  EXPECT_NE(content(folder_ / "a/estimates.jsonl"), content(folder_ / "c/estimates.jsonl"));
}

TEST_F(ReplayTest, ALogOfVersion010Replays) {
  // Recorded by bodyschema-sim 0.1.0: --pictures jpeg --frames 8 --background-frames 5 --seed 11 with
  // simulator.cameras.noise_levels=0.6. Message types must not change without a way to read this.
  ReplayOptions o = options("old");
  o.log = fs::path(BODYSCHEMA_SOURCE_DIR) / "test/pipeline/logs/version_0_1_0.lcmlog";
  replay(configuration({"vision.learning_frames=5"}), o);
  std::ifstream lines(o.out / "estimates.jsonl");
  nlohmann::json last;
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) last = nlohmann::json::parse(line);
  EXPECT_GE(count, 26) << "of 28 frames";
  EXPECT_GT(last["likelihood"].get<double>(), 0.8);
  // Eight pictures of one posture hardly tell it, and the estimate says so.
  EXPECT_NEAR(last["offset_deg"]["r_wrist_pitch"].get<double>(), -7.0,
              3.0 * last["stddev_deg"]["r_wrist_pitch"].get<double>());
  EXPECT_LT(last["stddev_deg"]["r_wrist_pitch"].get<double>(), 4.0);
}

/// The mean of every estimate, deg by joint.
std::vector<std::map<std::string, double>> means_of(const fs::path& estimates) {
  std::vector<std::map<std::string, double>> means;
  std::ifstream lines(estimates);
  for (std::string line; std::getline(lines, line);) {
    means.push_back(nlohmann::json::parse(line).at("offset_deg").get<std::map<std::string, double>>());
  }
  return means;
}

TEST_F(ReplayTest, BothEnginesGiveTheSameEstimatesWithinHalfADegree) {
  // They count the same pixels but for some on the outline, and the particles drawn are the same.
  constexpr double kTolerance_deg = 0.5;
  for (const std::string mode : {"estimator.mode=best", "estimator.mode=paper"}) {
    try {
      replay(configuration({mode, "filter.particles=60", "silhouette.engine=atlas"}), options("atlas"));
    } catch (const DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
    replay(configuration({mode, "filter.particles=60", "silhouette.engine=contour"}), options("contour"));
    EXPECT_THAT(content(folder_ / "atlas/summary.json"), HasSubstr("\"engine\": \"atlas on"));
    EXPECT_THAT(content(folder_ / "contour/summary.json"), HasSubstr("\"engine\": \"contour"));
    const auto atlas = means_of(folder_ / "atlas/estimates.jsonl");
    const auto contour = means_of(folder_ / "contour/estimates.jsonl");
    ASSERT_EQ(atlas.size(), contour.size());
    ASSERT_FALSE(atlas.empty());
    double worst = 0.0;
    for (std::size_t i = 0; i < atlas.size(); ++i) {
      for (const auto& [joint, value] : atlas[i]) {
        worst = std::max(worst, std::abs(value - contour[i].at(joint)));
        EXPECT_NEAR(value, contour[i].at(joint), kTolerance_deg) << mode << ", " << joint << ", frame " << i;
      }
    }
    std::printf("%s: largest difference between the engines %.2g deg\n", mode.c_str(), worst);
  }
}

TEST_F(ReplayTest, ALogWithoutOurChannelsIsRefused) {
  {
    LogWriter log(folder_ / "other.log");
    const std::vector<std::uint8_t> bytes(16, 0);
    log.publish("OTHER", 1, bytes);
  }
  ReplayOptions o = options("other");
  o.log = folder_ / "other.log";
  try {
    replay(configuration(), o);
    FAIL() << "no error";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("ICUB_JOINT_STATE"));
  }
  o.log = folder_ / "none.log";
  EXPECT_THROW(replay(configuration(), o), FileError);
}

TEST_F(ReplayTest, PicturesOfAnotherSizeThanConfiguredAreRefused) {
  try {
    replay(configuration({"cameras.left.width=640"}), options("size"));
    FAIL() << "no error";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("camera 'left'"));
    EXPECT_THAT(e.what(), HasSubstr("640x240"));
  }
}

TEST_F(ReplayTest, ACameraOnALinkThatIsNotThereIsRefusedByItsKey) {
  try {
    replay(configuration({"cameras.right.link=r_eye_optica"}), options("link"));
    FAIL() << "no error";
  } catch (const ConfigurationError& e) {
    EXPECT_STREQ(
        e.what(),
        "--set cameras.right.link=r_eye_optica: key 'cameras.right.link' is 'r_eye_optica'; expected a link of "
        "robot 'icub_right'; did you mean 'r_eye_optical'?");
  }
}

TEST_F(ReplayTest, AWrongPrefixNamesTheChannelsThatAreThere) {
  try {
    replay(configuration({"bus.channel_prefix=LAB"}), options("prefix"));
    FAIL() << "no error";
  } catch (const DataError& e) {
    EXPECT_THAT(e.what(), HasSubstr("0 messages on LAB_JOINT_STATE and LAB_CAMERAS; it holds "
                                    "ICUB_CAMERAS, ICUB_JOINT_STATE (bus.channel_prefix)"));
  }
}

TEST_F(ReplayTest, AnUnknownKeyIsRefused) {
  try {
    replay(configuration({"filter.particels=3"}), options("unknown"));
    FAIL() << "no error";
  } catch (const ConfigurationError& e) {
    EXPECT_THAT(e.what(), HasSubstr("filter.particles"));
  }
}

}  // namespace
}  // namespace bodyschema
