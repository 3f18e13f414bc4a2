#include "log_length.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::diagnosis {
namespace {

using testing::HasSubstr;

const DiagnosisOptions kOptions;

JointRoles two_joints() {
  JointRoles roles;
  roles.names = {"shoulder", "elbow"};
  roles.arm = {0, 1};
  return roles;
}

std::vector<JointSample> stills(const std::vector<double>& elbow_deg, double apart_s = 10.0) {
  std::vector<JointSample> pictures;
  for (const double elbow : elbow_deg) {
    pictures.push_back({microseconds(apart_s * static_cast<double>(pictures.size() + 1)),
                        Eigen::Vector2d(0.3, radians(elbow)), Eigen::Vector2d::Zero()});
  }
  return pictures;
}

std::vector<JointSample> film(double length_s, double deg_s, double rate_hz) {
  std::vector<JointSample> pictures;
  for (int i = 0; i <= static_cast<int>(length_s * rate_hz + 0.5); ++i) {
    const double t = i / rate_hz;
    pictures.push_back(
        {microseconds(t), Eigen::Vector2d(0.3, radians(deg_s * t)), Eigen::Vector2d(0.0, radians(deg_s))});
  }
  return pictures;
}

std::string refusal(const std::vector<JointSample>& pictures, const std::vector<NotTestable>& not_testable = {}) {
  return why_too_short(log_length(pictures, two_joints(), kOptions), not_testable, two_joints(), kOptions);
}

// Stills lie ten seconds apart where nobody said when they were taken: that is no ten seconds of motion.
TEST(LogLength, OfStillsCountsPosturesAndNotTheTimeBetweenThem) {
  const auto length = log_length(stills({10, 40, 70}), two_joints(), kOptions);
  EXPECT_EQ(length.seconds, 0.0);
  EXPECT_EQ(length.postures, 3u);
  EXPECT_THAT(refusal(stills({10, 40, 70})), HasSubstr("too short for a diagnosis: 0.0 s of pictures"));
  EXPECT_THAT(refusal(stills({10, 40, 70})), HasSubstr("5 distinct postures held still, of which it has 3"));
  EXPECT_EQ(refusal(stills({10, 40, 70, 20, 0})), "");
}

TEST(LogLength, APostureThatComesAgainIsNoOtherOne) {
  EXPECT_EQ(log_length(stills({10, 40, 10, 40, 11}), two_joints(), kOptions).postures, 2u);
  EXPECT_THAT(refusal(stills({10, 40, 10, 40, 11}, 1.0)), HasSubstr("of which it has 2"));
}

TEST(LogLength, OfAFilmIsItsTimeHoweverFastTheArmIs) {
  for (const double deg_s : {5.0, 20.0, 120.0}) {  // up to 30 deg from picture to picture
    const auto length = log_length(film(4.0, deg_s, 4.0), two_joints(), kOptions);
    EXPECT_NEAR(length.seconds, 4.0, 1e-6) << deg_s;
    EXPECT_EQ(length.postures, 0u) << deg_s;
    EXPECT_THAT(refusal(film(7.75, deg_s, 4.0)), HasSubstr("7.8 s of pictures; record 8 s in motion")) << deg_s;
    EXPECT_EQ(refusal(film(8.0, deg_s, 4.0)), "") << deg_s;
  }
}

TEST(LogLength, AnArmThatStandsStillIsRefusedHoweverLong) {
  EXPECT_THAT(refusal(stills(std::vector<double>(100, 20.0))), HasSubstr("stands still in every picture"));
}

TEST(LogLength, SaysWhatTheMotionLeavesUntestedOnEveryJoint) {
  const auto text = refusal(film(4.0, 20.0, 4.0), {{{"slip", "elbow", ""}, "a"},
                                                   {{"backlash", "elbow", ""}, "b"},
                                                   {{"slip", "shoulder", ""}, "a"},
                                                   {{"latency", "", ""}, "c"}});
  EXPECT_THAT(text, testing::EndsWith("; this motion leaves untested besides: latency, slip"));
  EXPECT_THAT(refusal(film(4.0, 20.0, 4.0)), testing::EndsWith("of which it has 0"));
}

TEST(LogLength, NoPicturesAtAll) {
  EXPECT_EQ(log_length({}, two_joints(), kOptions).postures, 0u);
}

}  // namespace
}  // namespace bodyschema::diagnosis
