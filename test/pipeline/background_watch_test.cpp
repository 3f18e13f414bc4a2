#include "bodyschema/pipeline/background_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/pipeline/replay.hpp"
#include "bodyschema/simulator/recording.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

const fs::path kConfig = fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml";

BinaryMask block(int u0, int v0, int u1, int v1) {
  BinaryMask mask(320, 240);
  for (int v = v0; v < v1; ++v) {
    for (int u = u0; u < u1; ++u) mask.set(u, v);
  }
  return mask;
}

class Watch : public ::testing::Test {
 protected:
  Watch() {
    const auto configuration = Configuration::load(kConfig);
    const auto setup = RobotSetup::from(configuration.section("robot"));
    robot_ = setup.load();
    std::vector<std::string> links;
    for (const auto& camera : StereoRig::from(configuration.section("cameras")).cameras) links.push_back(camera.link);
    watch_.emplace(robot_, links);
    q_ = setup.default_joints(*robot_);
  }
  Eigen::VectorXd with(const std::string& joint, double deg) const {
    Eigen::VectorXd q = q_;
    q[robot_->joint_index(joint)] += radians(deg);
    return q;
  }
  std::shared_ptr<const RobotModel> robot_;
  std::optional<BackgroundWatch> watch_;
  Eigen::VectorXd q_;
};

TEST_F(Watch, ATurnIsThatOfTheCameraWhateverTheArmDoes) {
  watch_->learned(0, q_);
  watch_->learned(0, with("neck_pitch", 20.0));  // it was learned at the first
  EXPECT_EQ(watch_->turned(0, with("r_elbow", 30.0)), 0.0);
  EXPECT_EQ(watch_->turned(0, with("neck_pitch", 0.4)), 0.0);
  EXPECT_NEAR(degrees(watch_->turned(0, with("neck_pitch", -3.0))), 3.0, 1e-6);
}

TEST_F(Watch, ACameraMovesFromWhereItStoodLast) {
  EXPECT_FALSE(watch_->moved_since_last(0, q_)) << "the first picture";
  EXPECT_FALSE(watch_->moved_since_last(0, with("neck_pitch", 0.2))) << "rounding of encoders";
  EXPECT_FALSE(watch_->moved_since_last(0, with("neck_pitch", -0.2)));
  EXPECT_TRUE(watch_->moved_since_last(0, with("neck_pitch", 0.4)));
  EXPECT_FALSE(watch_->moved_since_last(0, with("neck_pitch", 0.5))) << "it stands there now";
  EXPECT_TRUE(watch_->moved_since_last(0, q_)) << "and back";
  EXPECT_FALSE(watch_->moved_since_last(0, with("r_elbow", 30.0))) << "the arm is no camera";
}

TEST_F(Watch, CountsPicturesThatDifferFarFromTheArm) {
  const BinaryMask arm = block(100, 100, 140, 240), none;
  EXPECT_FALSE(watch_->count(0.1, block(80, 60, 160, 240), none, arm)) << "offsets may be wrong by as much";
  EXPECT_FALSE(watch_->count(0.0, block(0, 0, 320, 240), none, arm)) << "the head stands still";
  EXPECT_TRUE(watch_->count(0.1, block(200, 0, 320, 240), none, arm));
  EXPECT_FALSE(watch_->count(0.2, block(200, 0, 320, 240), block(0, 0, 190, 240), arm)) << "not judged there";
  EXPECT_TRUE(watch_->count(0.05, block(200, 0, 320, 240), none, BinaryMask()));
  EXPECT_EQ(watch_->total().pictures, 5u);
  EXPECT_EQ(watch_->total().changed, 2u);
  EXPECT_THAT(describe(watch_->total()), HasSubstr("turned by up to 5.7 deg"));
  EXPECT_THAT(describe(watch_->total()), HasSubstr("2 of 5 pictures"));
  EXPECT_EQ(describe({100, 0, 0.0}), "");
}

/// A babble in which the head looks about, before a room or a plain wall.
class LookingAbout : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("background_watch_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    record("room.log", true);
    record("wall.log", false);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static void record(const std::string& name, bool clutter) {
    const Configuration configuration = Configuration::load(kConfig);
    const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
    auto settings = simulator::SimulatorSettings::from(configuration.section("simulator"));
    settings.clutter = clutter;
    settings.head_moves = true;
    settings.supersampling = 1;
    settings.camera_rate_hz = 10.0;
    simulator::SimulationPlan plan;
    plan.seed = 3;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = 3.0;
    plan.offsets_deg = {{"r_shoulder_pitch", 3}, {"r_elbow", -2}};
    simulator::Simulator simulator(setup.load(), setup, StereoRig::from(configuration.section("cameras")), settings,
                                   plan);
    LogWriter log(folder_ / name);
    simulator::FramePublisher publisher(simulator.joint_names(), {});
    while (auto frame = simulator.next()) publisher.publish(*frame, log);
  }
  static std::string closing(const std::string& log, const std::string& method, bool online) {
    Configuration c =
        Configuration::load(kConfig, {"vision.method=" + method, "filter.particles=50", "silhouette.engine=contour"});
    (void)simulator::SimulatorSettings::from(c.section("simulator"));
    ReplayOptions options;
    options.log = folder_ / log;
    options.out = folder_ / "out";
    options.overlays = 0;
    options.learn_background_online = online;
    return replay(c, options);
  }
  static inline fs::path folder_;
};

TEST_F(LookingAbout, BeforeARoomIsSaidByReplay) {
  for (const bool online : {false, true}) {
    const std::string text = closing("room.log", "learned_background", online);
    EXPECT_THAT(text, HasSubstr("WARNING: the head turned by up to ")) << text;
    EXPECT_THAT(text, HasSubstr("set vision.method: auto"));
    const auto summary = nlohmann::json::parse(std::ifstream(folder_ / "out/summary.json"));
    EXPECT_THAT(summary["warnings"].at(0).get<std::string>(), HasSubstr("vision.method: auto"));
  }
}

TEST_F(LookingAbout, IsNoMatterToStatisticsOrBeforeAPlainWall) {
  EXPECT_THAT(closing("room.log", "statistics", false), Not(HasSubstr("WARNING")));
  for (const bool online : {false, true}) {
    const std::string text = closing("wall.log", "learned_background", online);
    EXPECT_THAT(text, Not(HasSubstr("WARNING"))) << text;
  }
}

}  // namespace
}  // namespace bodyschema
