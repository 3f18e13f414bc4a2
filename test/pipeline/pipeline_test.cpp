#include "bodyschema/pipeline/pipeline.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <random>
#include <stdexcept>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

Configuration configuration(const std::string& method, std::vector<std::string> overrides = {}) {
  overrides.insert(overrides.end(), {"vision.method=" + method, "filter.particles=50", "silhouette.engine=contour"});
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml",
                             overrides);
}

/// A learned background, then a short reach.
std::vector<Observation> observations(const Configuration& c = configuration("learned_background")) {
  const RobotSetup setup = RobotSetup::from(c.section("robot"));
  simulator::SimulationPlan plan;
  plan.seed = 5;
  plan.frames = 12;
  plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_elbow", -2}};
  simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")),
                                 simulator::SimulatorSettings::from(c.section("simulator")), plan);
  std::vector<Observation> result;
  std::vector<JointSample> history;
  while (auto frame = simulator.next()) {
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    result.push_back(simulator::to_observation(*frame, history));
  }
  return result;
}

class PipelineLooksAhead : public testing::TestWithParam<const char*> {
 protected:
  static void SetUpTestSuite() { seen_ = observations(); }
  static inline std::vector<Observation> seen_;
};

TEST_P(PipelineLooksAhead, WithoutChangingAnyResult) {
  Pipeline one_by_one(configuration(GetParam()));
  Pipeline ahead(configuration(GetParam()));
  auto first = seen_, second = seen_;
  int with_hand = 0;
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    const Estimate a = one_by_one.process(first[i]);
    const Estimate b = ahead.process(second[i], i + 1 < second.size() ? &second[i + 1] : nullptr);
    ASSERT_EQ(a.state, b.state) << "observation " << i;
    ASSERT_EQ(a.offset_rad, b.offset_rad) << "observation " << i;
    ASSERT_EQ(a.covariance_rad2, b.covariance_rad2) << "observation " << i;
    for (std::size_t c = 0; c < first[i].cameras.size(); ++c) {
      ASSERT_EQ(first[i].cameras[c]->mask, second[i].cameras[c]->mask);
      ASSERT_EQ(first[i].cameras[c]->coverage, second[i].cameras[c]->coverage);
      with_hand += first[i].cameras[c]->mask.empty() ? 0 : first[i].cameras[c]->mask.count() > 500;
    }
  }
  EXPECT_GT(with_hand, 10) << "nothing was seen, nothing was compared";
}

INSTANTIATE_TEST_SUITE_P(Methods, PipelineLooksAhead,
                         testing::Values("learned_background", "single_colour", "statistics"));

TEST_F(PipelineLooksAhead, AndSaysSoWhenAnotherObservationComes) {
  Pipeline pipeline(configuration("learned_background"));
  auto seen = seen_;
  pipeline.process(seen[0], &seen[1]);
  EXPECT_THROW(pipeline.process(seen[2]), std::logic_error);
}

TEST_F(PipelineLooksAhead, AndComplainsOfAPictureAtItsOwnTurn) {
  Pipeline pipeline(configuration("learned_background"));
  auto seen = seen_;
  seen[1].cameras[0]->image = Image(8, 6, 3);
  EXPECT_NO_THROW(pipeline.process(seen[0], &seen[1]));
  EXPECT_THROW(pipeline.process(seen[1], &seen[2]), DataError);
  EXPECT_NO_THROW(pipeline.process(seen[2]));
}

/// Both cameras see this; the joints rest.
Observation observation_of(const Pipeline& pipeline, const Image& image, Microseconds utime) {
  CameraObservation seen;
  seen.utime = utime;
  seen.joints = {utime, pipeline.setup().default_joints(pipeline.robot()),
                 Eigen::VectorXd::Zero(pipeline.robot().joint_count())};
  seen.image = image;
  return {utime, {seen, seen}, {}};
}

std::vector<std::string> lens(const std::string& k1) {
  return {"cameras.left.distortion=[" + k1 + ", 0, 0, 0, 0]", "cameras.right.distortion=[" + k1 + ", 0, 0, 0, 0]"};
}

/// With noise of two levels.
Image grey_room(std::mt19937& random) {
  Image image(320, 240, 3);
  std::normal_distribution<double> level(120.0, 2.0);
  for (auto& byte : image.data) byte = static_cast<std::uint8_t>(std::lround(level(random)));
  return image;
}

class PipelineWithALens : public testing::TestWithParam<const char*> {};

/// A pincushion: what is straight fills the picture's corners from beyond its border.
TEST_P(PipelineWithALens, JudgesNothingThatTheLensNeverSaw) {
  auto overrides = lens("0.3");
  overrides.push_back("vision.learning_frames=6");
  Pipeline pipeline(configuration(GetParam(), overrides));
  const BinaryMask seen = Undistorter(pipeline.rig().cameras[0]).valid();
  ASSERT_FALSE(seen.at(0, 0));
  std::mt19937 random(3);
  Microseconds utime = 0;
  const auto look_at = [&](const Image& image) {
    Observation observation = observation_of(pipeline, image, utime += 33'000);
    pipeline.segment(observation);
    return *observation.cameras[0];
  };
  CameraObservation room;
  for (int i = 0; i < 8; ++i) room = look_at(grey_room(random));
  EXPECT_EQ(room.mask.count(), 0u);
  EXPECT_EQ(room.valid, seen);
  // An arm that reaches in from the left border.
  Image image = grey_room(random);
  for (int v = 100; v < 140; ++v) std::fill(image.pixel(0, v), image.pixel(120, v), std::uint8_t{220});
  const auto arm = look_at(image);
  std::size_t covered = 0;
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const auto coverage = arm.coverage[static_cast<std::size_t>(v * 320 + u)];
      covered += coverage > 0;
      if (seen.at(u, v)) continue;
      ASSERT_FALSE(arm.valid.at(u, v) || arm.mask.at(u, v) || coverage > 0) << u << ", " << v;
    }
  }
  EXPECT_GT(arm.mask.count(), 3000u);
  EXPECT_GT(covered, 3000u);
  int u = 0;
  while (!seen.at(u, 120)) ++u;
  EXPECT_TRUE(arm.mask.at(u, 120)) << "no outline along the border of what was seen";
}

INSTANTIATE_TEST_SUITE_P(Methods, PipelineWithALens, testing::Values("learned_background", "single_colour"));

class PipelineWithAGivenBackground : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  [[nodiscard]] std::string file() const { return (folder_ / "room.png").string(); }
  [[nodiscard]] Configuration with_picture(std::vector<std::string> overrides = {}) const {
    overrides.insert(overrides.end(),
                     {"vision.background_pictures.left=" + file(), "vision.background_pictures.right=" + file()});
    return configuration("background_picture", overrides);
  }
  static Image checkerboard(std::uint8_t dark, std::uint8_t bright) {
    Image image(320, 240, 3);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const std::uint8_t level = (u / 16 + v / 16) % 2 == 0 ? dark : bright;
        std::fill_n(image.pixel(u, v), 3, level);
      }
    }
    return image;
  }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("bodyschema_pipeline_" + std::to_string(getpid()));
};

TEST_F(PipelineWithAGivenBackground, StraightensItAsTheCamerasPictures) {
  const Image room = checkerboard(40, 200);
  write_png(file(), room);
  for (const char* k1 : {"-0.3", "0.3"}) {
    Pipeline pipeline(with_picture(lens(k1)));
    Observation observation = observation_of(pipeline, room, 33'000);
    pipeline.segment(observation);
    EXPECT_EQ(observation.cameras[0]->mask.count(), 0u) << k1;
    EXPECT_EQ(observation.cameras[0]->valid, Undistorter(pipeline.rig().cameras[0]).valid()) << k1;
  }
}

TEST_F(PipelineWithAGivenBackground, TakesItFromTheFileAndNotFromThePipelineBefore) {
  write_png(file(), checkerboard(40, 200));
  Pipeline before(with_picture());
  Observation first = observation_of(before, checkerboard(40, 200), 33'000);
  before.segment(first);
  ASSERT_EQ(first.cameras[0]->mask.count(), 0u);
  const Image now = checkerboard(90, 140);
  write_png(file(), now);
  Pipeline after(with_picture());
  after.take_background_from(before);
  Observation second = observation_of(after, now, 66'000);
  after.segment(second);
  EXPECT_EQ(second.cameras[0]->mask.count(), 0u);
}

TEST_F(PipelineWithAGivenBackground, MissesTheOneOfACameraByItsKey) {
  write_png(file(), checkerboard(40, 200));
  EXPECT_THAT([&] { Pipeline(configuration("background_picture", {"vision.background_pictures.left=" + file()})); },
              testing::ThrowsMessage<ConfigurationError>(
                  HasSubstr("key 'vision.background_pictures.right' is missing; expected a file for each camera")));
}

/// Cameras of 1280x720.
std::vector<std::string> high_definition(std::vector<std::string> more = {}) {
  for (const std::string camera : {"left", "right"}) {
    for (const std::string value : {"width=1280", "height=720", "fx=1029.4", "fy=1029.4", "cx=639.5", "cy=359.5"}) {
      more.push_back("cameras." + camera + "." + value);
    }
  }
  return more;
}

/// A log that was imported with them is not what the configuration says.
TEST(Pipeline, RefusesAMappingToJointsAndCamerasThatAreNotThere) {
  const auto refuse = [](const std::string& override, const char* words) {
    EXPECT_THAT([&] { Pipeline(configuration("single_colour", {override})); },
                ::testing::ThrowsMessage<ConfigurationError>(HasSubstr(words)));
  };
  refuse("import.joints.A1=r_elbo",
         "key 'import.joints.A1' is 'r_elbo', no joint of robot 'icub_right'; did you mean 'r_elbow'?");
  refuse("import.cameras.lfet=zed",
         "key 'import.cameras.lfet': 'lfet' is no camera of the configuration; expected left");
}

TEST(Pipeline, ReadsNoMorePixelsThanAreNeeded) {
  const auto c = configuration("auto", high_definition());
  const Pipeline all(c), needed(c, std::nullopt, PictureReading::kAsNeeded);
  const PinholeIntrinsics sent = all.rig().cameras[0].intrinsics, read = needed.rig().cameras[0].intrinsics;
  EXPECT_EQ(sent.width, 1280);
  EXPECT_EQ(read.width, 640);
  EXPECT_EQ(read.height, 360);
  EXPECT_EQ(read.reduction, 2);
  EXPECT_NEAR(2.0 * read.cx + 0.5, sent.cx, 1e-12);

  // Messages are as large as the cameras' own pictures.
  for (const Pipeline* pipeline : {&all, &needed}) {
    auto stream = pipeline->make_stream();
    bot_core::images_t message;
    message.utime = 1;
    message.n_images = 1;
    message.image_types = {0};
    message.images = {to_message(Image(1280, 720, 3), 1)};
    stream.receive(stream.channels().cameras, encode(message));
    EXPECT_EQ(stream.statistics().images_malformed, 0u);
    message.images = {to_message(Image(640, 360, 3), 1)};
    stream.receive(stream.channels().cameras, encode(message));
    EXPECT_EQ(stream.statistics().images_malformed, 1u);
  }
}

// An estimate as good, of a quarter of the pixels.
TEST(Pipeline, PicturesThatAreReadReducedTellTheSame) {
  const auto c = configuration("learned_background", high_definition());
  const auto seen = observations(c);
  std::vector<Pose> hands;
  for (const auto reading : {PictureReading::kAsSent, PictureReading::kAsNeeded}) {
    Pipeline pipeline(c, std::nullopt, reading);
    const int n = pipeline.rig().cameras[0].intrinsics.reduction;
    Estimate last;
    for (Observation observation : seen) {
      for (auto& camera : observation.cameras) camera->image = reduced(camera->image, n);
      last = pipeline.process(observation);
    }
    ASSERT_EQ(last.X_CP.size(), 2u);
    EXPECT_GT((last.X_CP[0].translation() - last.X_CP_nominal[0].translation()).norm(), 5e-3) << "5 and 2 deg off";
    hands.push_back(last.X_CP[0]);
  }
  EXPECT_LT((hands[0].translation() - hands[1].translation()).norm(), 1e-3);
  EXPECT_LT(rotation_distance(hands[0].linear(), hands[1].linear()), radians(0.5));
}

TEST(Pipeline, ReadsAllPixelsWhereThatIsAskedForOrComparedWithWhatOthersMade) {
  const auto width = [](const std::string& method, std::vector<std::string> overrides) {
    const auto c = configuration(method, high_definition(std::move(overrides)));
    return Pipeline(c, std::nullopt, PictureReading::kAsNeeded).rig().cameras[0].intrinsics.width;
  };
  EXPECT_EQ(width("learned_background", {}), 640);
  EXPECT_EQ(width("auto", {"vision.picture_size=as_sent"}), 1280);
  EXPECT_EQ(width("auto", {"vision.edges=hard"}), 1280);
  EXPECT_EQ(width("auto", {"estimator.mode=paper"}), 1280);
  EXPECT_EQ(width("given", {}), 1280);
}

TEST(Pipeline, LeavesOutAPictureThatStaysTheSameWhileTheArmMoves) {
  Pipeline pipeline(configuration("single_colour"));
  std::mt19937 random(4);
  const Image image = grey_room(random);
  const auto with_mask = [&](Microseconds utime, double moved_rad) {
    Observation observation = observation_of(pipeline, image, utime);
    for (auto& seen : observation.cameras) seen->joints.q[0] += moved_rad;
    pipeline.segment(observation);
    return !observation.cameras[0]->mask.empty();
  };
  EXPECT_TRUE(with_mask(33'000, 0.0));
  EXPECT_TRUE(with_mask(66'000, 0.9 * kFrozenMotion_rad));
  EXPECT_FALSE(with_mask(99'000, 1.1 * kFrozenMotion_rad));
}

}  // namespace
}  // namespace bodyschema
