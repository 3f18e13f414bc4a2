#include <gtest/gtest.h>

#include "answers.hpp"
#include "random_seed.hpp"
#include "simulated_log.hpp"

/// More of hidden_fault_test.cpp, for those who have the time.
namespace bodyschema {
namespace {

using test::expect_size;

DiagnosisReport answer(const std::vector<std::string>& faults, test::Simulated what = {}) {
  what.seed += test::seed() - 1;
  what.faults = faults;
  return test::SimulatedLog(what).diagnosis();
}

TEST(ManyHiddenFaults, HealthyLogsNameNothing) {
  int named = 0;
  for (std::uint64_t i = 0; i < 6; ++i) {
    test::Simulated what;
    what.seed = 11 + i;
    what.head_moves = i % 2 == 1;
    const auto report = answer({}, what);
    EXPECT_NE(report.verdict, "unexplained") << report.sentence;
    named += !report.causes.empty();
  }
  EXPECT_LE(named, 1) << "one in a hundred is promised";
}

TEST(ManyHiddenFaults, AWanderingJointIsNeverNothing) {
  for (const char* fault :
       {"random_walk:joint=r_elbow,value=2", "random_walk:joint=r_wrist_pitch,value=3",
        "wobble:joint=r_wrist_pitch,value=1.5,period=4", "wobble:joint=r_elbow,value=0.8,period=9"}) {
    const auto report = answer({fault});
    EXPECT_NE(report.verdict, "none") << fault << ": " << report.sentence;
  }
}

/// Nuisances could make up for each of them, were they free. To the side the depth of the arm makes up for some of it.
TEST(ManyHiddenFaults, CamerasThatLookElsewhereAreNamed) {
  const struct {
    const char* fault;
    CauseName cause;
  } kCases[] = {{"camera_rotation:source=left,axis=y,value=0.9", {"first_camera", "", ""}},
                {"principal_point:source=left,axis=y,value=4", {"principal_point", "", "left"}},
                {"vergence:value=1", {"vergence", "", ""}}};
  for (const auto& c : kCases) {
    const auto report = answer({c.fault});
    EXPECT_TRUE(test::is_named(report)) << report.sentence;
    ASSERT_EQ(report.causes.size(), 1u) << report.sentence;
    EXPECT_NE(test::found(report, c.cause), nullptr) << report.sentence;
  }
}

TEST(ManyHiddenFaults, EachIsNamedWithItsSize) {
  const struct {
    const char* fault;
    CauseName cause;
    const char* parameter;
    double value;
  } kCases[] = {{"backlash:joint=r_elbow,value=1.5", {"backlash", "r_elbow", ""}, "width", 1.5},
                {"encoder_gain:joint=r_elbow,value=4", {"encoder_gain", "r_elbow", ""}, "gain", 4.0},
                {"latency:value=40", {"latency", "", ""}, "delay", 40.0},
                {"slip:joint=r_elbow,value=5,at=17", {"slip", "r_elbow", ""}, "step", 5.0},
                // Judged when they were taken in, beside what was dropped since, these were too small to matter.
                {"camera_skew:value=-75", {"camera_skew", "", ""}, "skew", -75.0},
                {"mesh_scale:part=hand,value=2.9", {"mesh_scale", "", "r_hand"}, "scale", 2.9}};
  for (const auto& c : kCases) {
    const auto report = answer({c.fault});
    EXPECT_EQ(report.causes.size(), 1u) << report.sentence;
    expect_size(report, c.cause, c.parameter, c.value);
  }
}

TEST(ManyHiddenFaults, AFrozenJointLeavesTheRestTestable) {
  test::Simulated what;
  what.frozen = {"r_wrist_pitch"};
  const auto report = answer({"encoder_gain:joint=r_elbow,value=4"}, what);
  EXPECT_TRUE(std::any_of(report.not_testable.begin(), report.not_testable.end(), [](const NotTestable& n) {
    return n.cause == CauseName{"encoder_gain", "r_wrist_pitch", ""};
  }));
  EXPECT_NE(test::found(report, {"encoder_gain", "r_elbow", ""}), nullptr) << report.sentence;
}

/// Small ones of several joints: no single one stands for them.
TEST(ManyHiddenFaults, ACrowdOfSmallErrorsIsNoLargeCause) {
  const auto report =
      answer({"encoder_gain:joint=r_shoulder_pitch,value=0.2", "encoder_gain:joint=r_shoulder_roll,value=-0.3",
              "backlash:joint=r_wrist_yaw,value=0.1", "backlash:joint=r_elbow,value=0.08", "latency:value=1.5",
              "eccentricity:joint=r_wrist_pitch,value=0.15", "axis_tilt:joint=r_wrist_yaw,value=0.1",
              "finger_posture:value=0.5", "mesh_scale:value=0.2"});
  EXPECT_NE(report.verdict, "unexplained") << report.sentence;
  EXPECT_LE(
      std::count_if(report.causes.begin(), report.causes.end(), [](const auto& c) { return c.heldout_gain > 0.05; }), 1)
      << report.sentence;
}

}  // namespace
}  // namespace bodyschema
