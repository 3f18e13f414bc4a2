#include "bodyschema/pipeline/looks_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <numeric>

#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/scenes.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class LooksFile : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::temp_directory_path() / fs::path(std::string("looks_") + info->name() + "_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override {
    std::error_code none;
    fs::permissions(folder_, fs::perms::owner_all, none);
    fs::remove_all(folder_, none);
  }
  static RobotLooks of_two_colours() {
    RobotLooks looks;
    looks.channels = 3;
    looks.share.assign(RobotLooks::kCells, 0.0f);
    const std::uint8_t red[] = {200, 30, 10}, grey[] = {90, 90, 90};
    looks.share[RobotLooks::cell(red, 3)] = 0.25f;
    looks.share[RobotLooks::cell(grey, 3)] = 0.75f;
    return looks;
  }
  void write(const std::string& text) const { std::ofstream(file()) << text; }
  [[nodiscard]] fs::path file() const { return folder_ / "looks.json"; }
  fs::path folder_;
};

TEST_F(LooksFile, GivesBackWhatWasWritten) {
  RobotLooks gray;
  gray.channels = 1;
  gray.share.assign(RobotLooks::kCells, 0.0f);
  gray.share[77] = 1.0f;
  write_looks(file(), "abc", {{"left", of_two_colours()}, {"right", gray}});
  const auto read = read_looks(file(), "abc");
  ASSERT_EQ(read.size(), 2u);
  EXPECT_EQ(read.at("left").channels, 3);
  EXPECT_EQ(read.at("left").share, of_two_colours().share);
  EXPECT_EQ(read.at("right").share, gray.share);
}

TEST_F(LooksFile, SaysWhatIsWrongWithAFile) {
  const auto expect = [&](const std::string& text, const std::string& words) {
    write(text);
    EXPECT_THAT([&] { (void)read_looks(file(), "abc"); },
                ThrowsMessage<FileError>(AllOf(HasSubstr(file().string()), HasSubstr(words))))
        << text;
  };
  const std::string head = R"({"kind": "colours of a robot", "version": 1, "robot": "abc", "cameras": )";
  expect("", "not JSON");
  expect("[]", "kind");
  expect(R"({"kind": "colours of a robot", "version": 2})", "version: expected 1");
  expect(R"({"kind": "colours of a robot", "version": 1, "robot": "xyz"})", "robot: expected abc");
  expect(head + "3}", "cameras");
  expect(head + R"({"left": {"channels": 2}}})", "cameras.left.channels: expected 1 or 3");
  expect(head + R"({"left": {"channels": 3, "colours": [[0, 0, 300, 1]]}}})", "cameras.left.colours");
  expect(head + R"({"left": {"channels": 3, "colours": [[0, 0, 1]]}}})", "cameras.left.colours");
  expect(head + R"({"left": {"channels": 3, "colours": [[0, 0, 0, 0.5]]}}})", "sum to 1");
}

TEST_F(LooksFile, ABadOneIsAFreshStart) {
  write("{");
  setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
  EXPECT_TRUE(LooksKeeper(file(), "abc").read().empty());
  unsetenv("XDG_STATE_HOME");
}

TEST_F(LooksFile, GoesToTheUsersFolderWhereItCannotBeWritten) {
  setenv("XDG_STATE_HOME", (folder_ / "state").c_str(), 1);
  LooksKeeper keeper(folder_ / "no such folder" / "looks.json", "abc");
  keeper.write({{"left", of_two_colours()}});
  EXPECT_EQ(LooksKeeper(folder_ / "no such folder" / "looks.json", "abc").read().size(), 1u);
  EXPECT_TRUE(LooksKeeper(folder_ / "no such folder" / "looks.json", "xyz").read().empty()) << "another robot's";
  unsetenv("XDG_STATE_HOME");
}

/// A head that follows the hand before a room.
struct MovingHead {
  static Configuration configuration() {
    return Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml",
                               {"vision.method=auto", "silhouette.engine=contour"});
  }
  static std::vector<Observation> observations(const Pipeline& pipeline, const Configuration& configuration) {
    auto settings = simulator::SimulatorSettings::from(configuration.section("simulator"));
    settings.camera_rate_hz = 10.0;
    settings.motion.postures = 8;
    settings.entry_frames = settings.background_frames = 0;
    simulator::apply_scene(settings, "head");
    simulator::SimulationPlan plan;
    plan.seed = 11;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = 6.0;
    plan.offsets_deg = {{"r_shoulder_pitch", 4}, {"r_shoulder_yaw", -4}, {"r_elbow", 3}};
    simulator::Simulator simulator(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), settings, plan);
    std::vector<Observation> seen;
    std::vector<JointSample> history;
    while (auto frame = simulator.next()) {
      history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
      seen.push_back(simulator::to_observation(*frame, history));
    }
    return seen;
  }
  /// How well the mask of the first picture covers the robot: intersection over union.
  static double first_mask(Pipeline& pipeline, Observation seen, const BinaryMask& robot) {
    pipeline.segment(seen);
    const BinaryMask& mask = seen.cameras[0]->mask;
    int in = 0, all = 0;
    for (int v = 0; v < mask.height(); ++v) {
      for (int u = 0; u < mask.width(); ++u) {
        in += mask.at(u, v) && robot.at(u, v);
        all += mask.at(u, v) || robot.at(u, v);
      }
    }
    return all == 0 ? 0.0 : static_cast<double>(in) / all;
  }
};

TEST_F(LooksFile, ASecondStartBeforeARoomLocksAtOnce) {
  const auto configuration = MovingHead::configuration();
  Pipeline first(configuration);
  const auto seen = MovingHead::observations(first, configuration);
  auto frames = seen;
  for (auto& frame : frames) first.process(frame);
  ASSERT_FALSE(first.looks().empty()) << "nothing was learned in " << seen.size() << " frames";
  write_looks(file(), first.model_hash(), first.looks());
  const BinaryMask robot = first.estimator().predicted_silhouette(seen[0], 0, true);

  Pipeline stranger(configuration), second(configuration);
  second.know_looks(read_looks(file(), second.model_hash()));
  const double anew = MovingHead::first_mask(stranger, seen[0], robot);
  const double again = MovingHead::first_mask(second, seen[0], robot);
  std::printf("    first mask: %.3f of the robot, with its colours known %.3f\n", anew, again);
  EXPECT_GT(again, anew);
  EXPECT_GT(again, 0.9);
  auto next = seen[0], after = seen[1];
  second.process(next);
  EXPECT_EQ(second.process(after).verdict, FrameVerdict::kAgrees);
}

}  // namespace
}  // namespace bodyschema
