#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "answers.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/imports/stills.hpp"
#include "bodyschema/pipeline/starter_configuration.hpp"
#include "picture_log.hpp"
#include "temporary_folder.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using Settings = simulator::SimulatorSettings;
using Plan = simulator::SimulationPlan;

TEST(LogDiagnosis, RefusesSwappedPictures) {
  const test::RenderedLog log([](Settings&, Plan& plan) { plan.seconds = 12.0; },
                              [](auto& frame, double) { std::swap(frame.cameras[0]->image, frame.cameras[1]->image); });
  EXPECT_THAT([&] { (void)log.diagnosis(); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("the left and right pictures are swapped")));
}

/// The answer was that nothing is wrong, held out 0.000 px.
TEST(LogDiagnosis, RefusesALogInWhichTheArmIsNowhereNearWhereTheModelHasIt) {
  const test::RenderedLog log([](Settings&, Plan& plan) { plan.seconds = 12.0; });
  const std::vector<std::string> elsewhere = {"cameras.left.link=root_link", "cameras.right.link=root_link"};
  EXPECT_THAT([&] { (void)log.diagnosis("learned_background", elsewhere); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("in no picture does the arm's outline lie near")));
}

/// No outline that the model predicts has a counterpart on the stick, so that no residual shows it: the answer was
/// none.
TEST(LogDiagnosis, AStickInTheHandIsSeen) {
  const test::RenderedLog log(
      [](Settings&, Plan& plan) { plan.faults = {simulator::FaultSpec::parse("held:thing=stick")}; });
  const auto report = log.diagnosis();
  EXPECT_EQ(report.verdict, "unexplained") << report.sentence;
  EXPECT_THAT(report.not_in_model, HasSubstr("beside the robot"));
  EXPECT_THAT(report.sentence, HasSubstr(report.not_in_model));
}

/// Of this log the forearm is asked for first, then all parts, and of the two neither can be taken out alone. Together
/// they say what the hand alone says: all parts 16 % larger, and the forearm smaller by as much.
TEST(LogDiagnosis, TwoCausesThatTogetherSayWhatOneSaysGiveWayToIt) {
  const test::RenderedLog log([](Settings& settings, Plan& plan) {
    settings.camera_rate_hz = 5.0;
    settings.supersampling = 2;
    plan.seed = 1795830186;
    plan.seconds = 35.0;
    plan.output = simulator::Output::kSilhouettes;
    plan.offsets_deg = {{"r_shoulder_pitch", 5.201486786}, {"r_shoulder_roll", -5.418527589},
                        {"r_shoulder_yaw", -4.780977065},  {"r_elbow", 1.705740027},
                        {"r_wrist_prosup", 1.993247263},   {"r_wrist_pitch", -2.932819275},
                        {"r_wrist_yaw", 3.974855751}};
    plan.faults = {simulator::FaultSpec::parse("mesh_scale:part=hand,value=16")};
  });
  const auto report = log.diagnosis("single_colour", {"vision.background_rgb=[0, 0, 0]"});
  EXPECT_TRUE(test::is_named(report)) << report.sentence;
  EXPECT_TRUE(test::names_only_part(report, "r_hand")) << report.sentence;
  test::expect_size(report, {"mesh_scale", "", "r_hand"}, "scale", 16.0);
}

/// The head turns before a room and pictures are JPEG: a learned background is of no use.
TEST(LogDiagnosis, DoesWithoutALearnedBackgroundWhereTheHeadTurnsAndWarnsOfPicturesNotUsed) {
  const test::RenderedLog log(
      [](Settings& settings, Plan&) {
        settings.clutter = settings.head_moves = true;
        settings.jpeg_quality = 70;
      },
      [](auto& frame, double share) {
        if (share > 0.8) frame.encoders.clear();
      });
  const auto report = log.diagnosis();
  EXPECT_THAT(report.warnings, Contains(HasSubstr("as by vision.method: statistics")));
  EXPECT_THAT(report.warnings, Contains(HasSubstr("pictures are not used: ")));
  EXPECT_EQ(report.verdict, "none") << report.sentence;
  EXPECT_LT(report.after.rms_px, 1.3) << "with a learned background it is 2";
}

TEST(LogDiagnosis, OfAHealthyLogSaysNothingOfMethodsAndLostPictures) {
  const test::RenderedLog log([](Settings&, Plan&) {});
  const auto report = log.diagnosis();
  EXPECT_EQ(report.verdict, "none") << report.sentence;
  EXPECT_THAT(report.warnings, Not(Contains(HasSubstr("vision.method"))));
  EXPECT_THAT(report.warnings, Not(Contains(HasSubstr("not used"))));
  EXPECT_TRUE(report.not_in_model.empty()) << report.not_in_model;
  // No picture places a flank nearer than the floor, however many there are.
  ASSERT_EQ(report.offsets_ci95_deg.size(), 7u);
  for (const auto& [joint, ci] : report.offsets_ci95_deg) EXPECT_GT(0.5 * (ci[1] - ci[0]), 0.02) << joint;
}

/// One sweep of a Panda, with a board on its gripper that no URDF shows: too little tells causes apart, and none is
/// named. It was refused as too short.
TEST(LogDiagnosis, NamesNothingInASweepOfARealArm) {
  SKIP_WITHOUT("real");
  const TemporaryFolder folder;
  const auto set = data_folder() / "real/panda_1";
  StarterOptions starter;
  starter.urdf = data_folder() / "real/robots/panda/panda.urdf";
  starter.stills = set;
  starter.camera_pose = set / "camera_pose.json";
  starter.out = folder.path() / "arm";
  ASSERT_TRUE(write_starter_configuration(starter).usable);
  const auto configuration = Configuration::load(starter.out / "estimator.yaml");
  LogDiagnosisOptions options;
  options.log = folder.path() / "log";
  options.quiet = true;
  (void)import_stills(set, ImportTarget::from(configuration), {}, options.log);
  const auto report = diagnose_log(configuration, options);
  EXPECT_EQ(report.verdict, "unexplained") << report.sentence;
}

}  // namespace
}  // namespace bodyschema
