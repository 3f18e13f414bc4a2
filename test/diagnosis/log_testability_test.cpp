#include "bodyschema/diagnosis/log_testability.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;

Configuration robot(const std::vector<std::string>& overrides = {}) {
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                             overrides);
}

const TemporaryFolder& folder() {
  static const TemporaryFolder folder;
  return folder;
}

/// The elbow swings 40 deg to and fro every four seconds, or goes one way; nothing else moves.
std::filesystem::path log_of(const std::string& name, double duration_s, bool to_and_fro) {
  const auto file = folder().path() / (name + ".lcmlog");
  LogWriter writer(file);
  const std::vector<std::string> joints = {"neck_pitch",       "neck_roll",      "neck_yaw",          "eyes_tilt",
                                           "l_eye_pan",        "r_eye_pan",      "r_shoulder_pitch",  "r_shoulder_roll",
                                           "r_shoulder_yaw",   "r_elbow",        "r_wrist_prosup",    "r_wrist_pitch",
                                           "r_wrist_yaw",      "r_thumb_oppose", "r_thumb_proximal",  "r_thumb_distal",
                                           "r_index_proximal", "r_index_distal", "r_middle_proximal", "r_middle_distal",
                                           "r_pinky"};
  const Image black(320, 240, 1);
  for (int i = 0; i < static_cast<int>(duration_s * 100.0); ++i) {
    const Microseconds utime = 1'700'000'000'000'000 + i * 10'000;
    bot_core::joint_state_t message;
    message.utime = utime;
    message.num_joints = static_cast<std::int16_t>(joints.size());
    message.joint_name = joints;
    message.joint_position.assign(joints.size(), 0.2f);
    const double t = 0.01 * i;
    message.joint_position[9] = static_cast<float>(1.0 + (to_and_fro ? 0.35 * std::sin(1.57 * t) : 0.05 * t));
    message.joint_velocity.assign(joints.size(), 0.0f);
    message.joint_velocity[9] = static_cast<float>(to_and_fro ? 0.35 * 1.57 * std::cos(1.57 * t) : 0.05);
    message.joint_effort.assign(joints.size(), 0.0f);
    writer.publish("ICUB_JOINT_STATE", utime, encode(message));
    if (i % 20 != 10) continue;
    bot_core::images_t pictures;
    pictures.utime = utime;
    pictures.n_images = 2;
    pictures.image_types = {bot_core::images_t::LEFT, bot_core::images_t::RIGHT};
    pictures.images = {to_jpeg_message(black, utime, 50), to_jpeg_message(black, utime, 50)};
    writer.publish("ICUB_CAMERAS", utime + 5000, encode(pictures));
  }
  return file;
}

bool contains(const std::vector<CauseName>& causes, const CauseName& cause) {
  return std::find(causes.begin(), causes.end(), cause) != causes.end();
}

TEST(LogTestability, FollowsTheMotion) {
  const auto result = testability_of(robot(), log_of("to_and_fro", 12.0, true));
  EXPECT_NEAR(result.duration_s, 11.8, 0.3);
  EXPECT_NEAR(static_cast<double>(result.pictures), 120.0, 4.0);
  EXPECT_TRUE(contains(result.testable, {"backlash", "r_elbow", ""}));
  EXPECT_TRUE(contains(result.testable, {"compliance", "r_elbow", ""}));
  EXPECT_FALSE(contains(result.testable, {"backlash", "r_wrist_yaw", ""}));
  EXPECT_TRUE(contains(result.testable, {"latency", "", ""}));
  EXPECT_FALSE(contains(result.testable, {"joint_place", "r_elbow", ""})) << "no diagnosis looks for it";
  EXPECT_THAT(result.text(), HasSubstr("backlash of r_elbow\n"));
  EXPECT_THAT(result.text(), HasSubstr("r_wrist_yaw moved 0.0 deg"));
  EXPECT_THAT(result.text(), HasSubstr("slip of every arm joint"));
}

TEST(LogTestability, OneWayTellsNoBacklash) {
  const auto result = testability_of(robot(), log_of("one_way", 12.0, false));
  EXPECT_FALSE(contains(result.testable, {"backlash", "r_elbow", ""}));
  EXPECT_THAT(result.text(), HasSubstr("backlash: r_elbow turned round never"));
}

TEST(LogTestability, AMistypedKeyIsRefusedByName) {
  for (const auto& [wrong, named] : {std::pair{"buss.channel_prefix=LAB", "unknown key 'buss'"},
                                     {"bus.channel_prefx=LAB", "unknown key 'bus.channel_prefx'"},
                                     {"robot.hand_lnk=r_hand", "unknown key 'robot.hand_lnk'"},
                                     {"cameras.left.distorsion=[0, 0, 0, 0, 0]", "unknown key 'cameras.left.disto"}}) {
    EXPECT_THAT([&] { (void)testability_of(robot({wrong}), "none.lcmlog"); },
                testing::ThrowsMessage<ConfigurationError>(HasSubstr(named)));
  }
}

// Before: 18 s of work on masks came first, and then other words than `log info` has.
TEST(LogTestability, ADiagnosisRefusesAShortLogAtOnceAndInTheSameWords) {
  const auto file = log_of("short", 4.0, true);
  const auto short_log = testability_of(robot(), file);
  EXPECT_THAT(short_log.refusal,
              HasSubstr("too short for a diagnosis: 3.8 s of pictures; record 8 s in motion, better 60 s, or 5 "
                        "distinct postures held still, of which it has 0; this motion leaves untested besides: "));
  EXPECT_THAT(short_log.refusal, HasSubstr("base_shift"));
  EXPECT_THAT(short_log.refusal, testing::Not(HasSubstr("backlash"))) << "the elbow's can be tested";
  EXPECT_EQ(short_log.text(), short_log.refusal + '\n');
  LogDiagnosisOptions options;
  options.log = file;
  options.quiet = true;
  // Every picture is black: had one been looked at, that would be the complaint.
  EXPECT_THAT([&] { (void)diagnose_log(robot({"silhouette.engine=contour"}), options); },
              testing::ThrowsMessage<DataError>(file.string() + ": " + short_log.refusal));
}

TEST(LogTestability, OfALogThatIsLongEnoughADiagnosisLooksAtThePictures) {
  LogDiagnosisOptions options;
  options.log = log_of("black", 12.0, true);
  options.quiet = true;
  EXPECT_EQ(testability_of(robot(), options.log).refusal, "");
  EXPECT_THAT([&] { (void)diagnose_log(robot({"silhouette.engine=contour"}), options); },
              testing::ThrowsMessage<DataError>(
                  testing::AllOf(HasSubstr("the arm is seen in 0 of "),
                                 HasSubstr("pictures; record it with the hand in view of all cameras"))));
}

// Before: "no pictures with encoders" here, and a camera 'left' there whatever the camera's name.
TEST(LogTestability, PicturesOfAnotherSizeAreSaidByTheCamerasNamesHereAsInADiagnosis) {
  const std::vector<std::string> wrong = {"silhouette.engine=contour", "cameras.left.width=640",
                                          "cameras.right.width=640"};
  LogDiagnosisOptions options;
  options.log = log_of("size", 2.0, true);
  options.quiet = true;
  const auto said = testing::ThrowsMessage<DataError>(
      testing::AllOf(HasSubstr("no picture can be used: 20 of 20 pictures are not used: 20 of another size"),
                     HasSubstr("camera 'right' is configured as 640x240 (cameras.right.width, .height)")));
  EXPECT_THAT([&] { (void)testability_of(robot(wrong), options.log); }, said);
  EXPECT_THAT([&] { (void)diagnose_log(robot(wrong), options); }, said);
}

TEST(LogTestability, EmptyLogs) {
  const auto file = folder().path() / "nothing.lcmlog";
  LogWriter(file).publish("OTHERS", 1, std::vector<std::uint8_t>(8, 0));
  EXPECT_THROW(testability_of(robot(), file), DataError);
}

}  // namespace
}  // namespace bodyschema
