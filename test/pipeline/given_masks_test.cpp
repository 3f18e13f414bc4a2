// Masks of others, from the log to the estimate.
#include <cmath>
#include <deque>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/pipeline/replay.hpp"
#include "bodyschema/simulator/recording.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const std::map<std::string, double> kOffsets_deg = {{"r_shoulder_pitch", 4}, {"r_elbow", -3}, {"r_wrist_yaw", 2}};

/// A reach before clutter, and masks that a network would make of its pictures, with what is behind a box unknown.
class GivenMasks : public testing::Test {
 protected:
  struct Network {
    Microseconds delay = 120'000;
    bool left = true, right = true;
    bool unknown_stripe = true;
  };

  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("bodyschema_given_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static Configuration configuration() {
    return Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                               {"vision.method=given", "filter.particles=100", "silhouette.engine=contour"});
  }
  static Configuration simulated() {
    return Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml",
                               {"simulator.room.background=clutter", "simulator.motion.background_frames=0"});
  }

  /// Hands each message on when it is due.
  class Log : public MessageSink {
   public:
    explicit Log(const fs::path& file) : writer_(file) {}
    void publish(const std::string& channel, Microseconds time_us, Bytes message) override {
      send_until(time_us);
      writer_.publish(channel, time_us, message);
    }
    void later(const std::string& channel, Microseconds time_us, std::vector<std::uint8_t> message) {
      waiting_.push_back({channel, time_us, std::move(message)});
    }
    void send_until(Microseconds time_us) {
      for (; !waiting_.empty() && waiting_.front().time_us <= time_us; waiting_.pop_front()) {
        const auto& next = waiting_.front();
        writer_.publish(next.channel, next.time_us, next.message);
      }
    }

   private:
    struct Waiting {
      std::string channel;
      Microseconds time_us;
      std::vector<std::uint8_t> message;
    };
    LogWriter writer_;
    std::deque<Waiting> waiting_;
  };

  fs::path record(const Network& network, int frames = 40) {
    const Configuration c = simulated();
    const RobotSetup setup = RobotSetup::from(c.section("robot"));
    const Channels channels = BusOptions::from(c.section("bus")).channels();
    simulator::SimulationPlan plan;
    plan.seed = 3;
    plan.frames = frames;
    plan.offsets_deg = kOffsets_deg;
    simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")),
                                   simulator::SimulatorSettings::from(c.section("simulator")), plan);
    const fs::path file = folder_ / "reach.lcmlog";
    Log log(file);
    simulator::FramePublisher::Options options;
    options.channels = channels;
    simulator::FramePublisher publisher(simulator.joint_names(), options);
    Microseconds last = 0;
    while (auto frame = simulator.next()) {
      publisher.publish(*frame, log);
      last = frame->utime;
      bot_core::images_t masks;
      masks.utime = frame->utime;
      for (const auto& camera : frame->cameras) {
        if (!(camera->number == 0 ? network.left : network.right)) continue;
        const BinaryMask& robot = camera->silhouette;
        Image mask(robot.width(), robot.height(), 1);
        for (int v = 0; v < mask.height; ++v) {
          for (int u = 0; u < mask.width; ++u) *mask.pixel(u, v) = robot.at(u, v) ? kMaskRobot : kMaskBackground;
        }
        if (network.unknown_stripe) {
          for (int v = 100; v < 110; ++v) std::fill_n(mask.pixel(0, v), mask.width, kMaskUnknown);
        }
        masks.image_types.push_back(static_cast<std::int16_t>(camera->number));
        masks.images.push_back(to_message(mask, camera->utime));
      }
      masks.n_images = static_cast<std::int32_t>(masks.images.size());
      log.later(channels.masks, frame->utime + network.delay, encode(masks));
    }
    log.send_until(last + 10'000'000);
    return file;
  }

  nlohmann::json replayed(const fs::path& log) {
    ReplayOptions options;
    options.log = log;
    options.out = folder_ / "out";
    options.overlays = 0;
    (void)replay(configuration(), options);
    return nlohmann::json::parse(std::ifstream(options.out / "summary.json"));
  }
  std::string refusal_of(const fs::path& log) {
    try {
      (void)replayed(log);
    } catch (const DataError& e) {
      return e.what();
    }
    return "nothing was refused";
  }
  static void expect_the_offsets(const nlohmann::json& summary, double within_sd) {
    for (const auto& [joint, offset] : kOffsets_deg) {
      const double estimate = summary["estimate"]["offset_deg"][joint];
      const double sd = summary["estimate"]["stddev_deg"][joint];
      EXPECT_LT(std::abs(estimate - offset), 0.3 + within_sd * sd) << joint << " " << estimate;
    }
  }
  fs::path folder_;
};

TEST_F(GivenMasks, ComeLateAndTellTheOffsets) {
  const auto summary = replayed(record({}));
  EXPECT_EQ(summary["frames"], 40);
  EXPECT_FALSE(summary.contains("not_used")) << summary["not_used"];
  EXPECT_EQ(summary["estimate"]["state"], "converged");
  expect_the_offsets(summary, 3.0);
}

TEST_F(GivenMasks, OfOneCameraLeaveTheOtherOutOfEveryFrame) {
  Network network;
  network.right = false;
  const auto summary = replayed(record(network));
  EXPECT_EQ(summary["not_used"]["dropped.no_mask"], summary["frames"]);
  expect_the_offsets(summary, 4.0);
}

TEST_F(GivenMasks, ThatComeTooLateAreCountedAndNothingIsMadeUp) {
  Network network;
  network.delay = 900'000;
  const auto summary = replayed(record(network));
  const int late = summary["not_used"]["masks.late"], without = summary["not_used"]["dropped.no_mask"];
  EXPECT_EQ(late, without);
  EXPECT_GT(late, 40) << "of 80 pictures; at the end of the log nothing tells how late it is";
  EXPECT_EQ(2 * summary["frames"].get<int>() + without, 80);
}

TEST_F(GivenMasks, ThatNeverComeAreAskedFor) {
  Network network;
  network.left = network.right = false;
  EXPECT_THAT(refusal_of(record(network, 10)), HasSubstr("each with its picture's stamp: 0 came"));
}

/// Without the synchroniser, as from an own program: a camera without mask is skipped for that frame.
TEST_F(GivenMasks, ACameraWithoutOneHasSeenNothing) {
  Pipeline pipeline(configuration());
  CameraObservation seen;
  seen.joints = {0, pipeline.setup().default_joints(pipeline.robot()),
                 Eigen::VectorXd::Zero(pipeline.robot().joint_count())};
  seen.image = Image(320, 240, 3);
  Observation observation{0, {seen, seen}, {}};
  observation.cameras[1]->given_mask = Image(320, 240, 1);
  EXPECT_TRUE(pipeline.segment(observation));
  EXPECT_TRUE(observation.cameras[0]->mask.empty());
  EXPECT_FALSE(observation.cameras[1]->mask.empty());
}

}  // namespace
}  // namespace bodyschema
