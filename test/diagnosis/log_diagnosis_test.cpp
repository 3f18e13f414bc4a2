#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/recording.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kBackground_s = 10.0;  ///< 40 pictures at 4 Hz before the arm moves

/// A log of 25 s whose head looks about in a room, with `missing_share` of its encoder readings missing, or with
/// left and right exchanged.
void record(const fs::path& file, bool clutter, double missing_share, bool swapped = false,
            const std::string& fault = "") {
  const Configuration c = Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml");
  const RobotSetup setup = RobotSetup::from(c.section("robot"));
  auto settings = simulator::SimulatorSettings::from(c.section("simulator"));
  settings.clutter = clutter;
  settings.head_moves = true;
  settings.supersampling = 1;
  settings.camera_rate_hz = 4.0;
  simulator::SimulationPlan plan;
  plan.seed = 5;
  plan.motion = simulator::Motion::kBabble;
  plan.seconds = 25.0;
  if (!fault.empty()) plan.faults = {simulator::FaultSpec::parse(fault)};
  simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")), settings, plan);
  LogWriter log(file);
  simulator::FramePublisher publisher(simulator.joint_names(), {});
  for (int i = 0; auto frame = simulator.next(); ++i) {
    if (i > (1.0 - missing_share) * simulator.frame_count()) frame->encoders.clear();
    if (swapped) std::swap(frame->cameras[0]->image, frame->cameras[1]->image);
    publisher.publish(*frame, log);
  }
}

DiagnosisReport diagnosis(const fs::path& log, const std::string& method = "learned_background") {
  Configuration c =
      Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                          {"silhouette.engine=contour", "filter.particles=50", "bus.max_image_gap_ms=1000",
                           "bus.max_encoder_gap_ms=1000", "vision.method=" + method});
  LogDiagnosisOptions options;
  options.log = log;
  options.quiet = true;
  return diagnose_log(c, options);
}

TEST(LogDiagnosis, DoesWithoutALearnedBackgroundWhereTheHeadTurnsBeforeARoomAndWarnsOfPicturesNotUsed) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_" + std::to_string(getpid()) + ".lcmlog");
  record(log, true, 0.2);
  const auto room = diagnosis(log);
  EXPECT_THAT(room.warnings, Contains(HasSubstr("as by vision.method: statistics")));
  EXPECT_TRUE(room.causes.empty()) << room.sentence;
  EXPECT_LT(room.after.rms_px, 0.8) << "with a learned background it is above 1";
  EXPECT_THAT(room.warnings, Contains(HasSubstr("pictures are not used: ")));
  record(log, false, 0.0);
  const auto wall = diagnosis(log);
  EXPECT_THAT(wall.warnings, Not(Contains(HasSubstr("vision.method"))));
  EXPECT_THAT(wall.warnings, Not(Contains(HasSubstr("not used"))));
  fs::remove(log);
}

/// A longer log knew the wrist's pitch to 0.015 deg, and erred by 0.04, like every other log.
TEST(LogDiagnosis, IntervalsOfOffsetsIncludeWhatAllPicturesPlaceAlike) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_offsets_" + std::to_string(getpid()) + ".lcmlog");
  record(log, false, 0.0);
  const auto report = diagnosis(log);
  ASSERT_EQ(report.offsets_ci95_deg.size(), 7u);
  for (const auto& [joint, ci] : report.offsets_ci95_deg) {
    EXPECT_GT(0.5 * (ci[1] - ci[0]), 1.96 * 0.03) << joint;
  }
  fs::remove(log);
}

/// `statistics` looks for the robot near where it is predicted. The prediction was that of the log's first seconds:
/// where the arm had slipped since, it was cut off.
TEST(LogDiagnosis, FollowsASlipWhereMasksNeedAPrediction) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_slip_" + std::to_string(getpid()) + ".lcmlog");
  record(log, true, 0.0, false, "slip:joint=r_shoulder_pitch,value=4,at=12");
  const auto report = diagnosis(log, "statistics");
  ASSERT_FALSE(report.causes.empty()) << report.sentence;
  EXPECT_EQ(report.causes.front().cause.text(), "slip of r_shoulder_pitch") << report.sentence;
  ASSERT_FALSE(report.causes.front().parameters.empty());
  EXPECT_NEAR(report.causes.front().parameters.front().estimate, 4.0, 0.2) << report.sentence;
  EXPECT_GT(report.after.outline_found, 0.8);
  fs::remove(log);
}

/// Offsets fitted one part of the log, the outlines of the other lay beyond the search, and the answer was that no
/// cause explains the log.
TEST(LogDiagnosis, NamesASlipThatCarriesTheOutlinesOutOfSight) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_far_slip_" + std::to_string(getpid()) + ".lcmlog");
  record(log, false, 0.0, false, "slip:joint=r_elbow,value=-12,at=15");
  const auto report = diagnosis(log);
  ASSERT_FALSE(report.causes.empty()) << report.sentence;
  EXPECT_EQ(report.causes.front().cause.text(), "slip of r_elbow") << report.sentence;
  ASSERT_FALSE(report.causes.front().parameters.empty());
  const auto& slip = report.causes.front().parameters.front();
  EXPECT_NEAR(slip.estimate, -12.0, 0.5) << report.sentence;
  ASSERT_TRUE(slip.from.has_value());
  EXPECT_NEAR(seconds(*slip.from - report.begin_utime), kBackground_s + 15.0, 0.5);
  EXPECT_LT(report.after.rms_px, 0.5);
  EXPECT_GT(report.after.outline_where_seen, 0.9);
  EXPECT_FALSE(report.out_of_sight.has_value());
  fs::remove(log);
}

/// A model that explains the rest to its noise may be wrong where nothing is seen: of a slip that nobody followed the
/// answer was that nothing is wrong.
TEST(LogDiagnosis, APartOutOfSightIsSaid) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_part_" + std::to_string(getpid()) + ".lcmlog");
  record(log, false, 0.0, false, "slip:joint=r_elbow,value=40,at=18");
  const auto report = diagnosis(log);
  EXPECT_TRUE(report.causes.empty()) << report.sentence;
  EXPECT_EQ(report.verdict, "unexplained") << report.sentence;
  ASSERT_TRUE(report.out_of_sight.has_value());
  EXPECT_NEAR(report.out_of_sight->from_s, kBackground_s + 18.0, 0.5);
  EXPECT_NEAR(report.out_of_sight->to_s, report.duration_s, 0.5);
  EXPECT_THAT(report.warnings, Contains(HasSubstr("out of the model's sight")));
  EXPECT_THAT(report.to_json(), HasSubstr("\"out_of_sight\": {"));
  fs::remove(log);
}

TEST(LogDiagnosis, RefusesSwappedPictures) {
  const fs::path log = fs::temp_directory_path() / ("log_diagnosis_swapped_" + std::to_string(getpid()) + ".lcmlog");
  record(log, false, 0.0, true);
  EXPECT_THAT([&] { (void)diagnosis(log); },
              ::testing::ThrowsMessage<DataError>(HasSubstr("the left and right pictures are swapped")));
  fs::remove(log);
}

}  // namespace
}  // namespace bodyschema
