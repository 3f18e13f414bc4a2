#include "../../src/evaluation/honesty_figures.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

/// One joint; errors and standard deviations of hand (mm) and offset (deg).
HonestyFrame frame(bool converged, double hand_mm, double hand_sd_mm, double offset_deg = 0.0,
                   double offset_sd_deg = 0.1) {
  HonestyFrame f;
  f.converged = converged;
  f.in_view = true;
  f.hand_error_mm = hand_mm;
  f.hand_sd_mm = hand_sd_mm;
  f.offset_error_deg = Eigen::VectorXd::Constant(1, offset_deg);
  f.offset_sd_deg = Eigen::VectorXd::Constant(1, offset_sd_deg);
  return f;
}

TEST(HonestyFigures, AFrameIsWrongBeyondThreeHandSdAndTwoMillimetresOrFiveSdOfAnOffset) {
  EXPECT_FALSE(frame(true, 1.9, 0.1).wrong()) << "below 2 mm";
  EXPECT_FALSE(frame(true, 2.9, 1.0).wrong()) << "below 3 sd";
  EXPECT_TRUE(frame(true, 3.1, 1.0).wrong());
  EXPECT_FALSE(frame(true, 0.1, 1.0, -0.49).wrong());
  EXPECT_TRUE(frame(true, 0.1, 1.0, -0.51).wrong());
}

TEST(HonestyFigures, OnlyWhatIsCalledConvergedIsDishonest) {
  const HonestyLog wrong_once = {frame(false, 9.0, 1.0), frame(true, 9.0, 1.0), frame(true, 1.0, 1.0),
                                 frame(true, 1.0, 1.0)};
  const HonestyLog right = {frame(false, 1.0, 1.0), frame(true, 0.5, 1.0)};
  const auto f = honesty_figures({&wrong_once, &right});
  EXPECT_DOUBLE_EQ(f.dishonest_frame_rate, 0.25);
  EXPECT_DOUBLE_EQ(f.dishonest_log_rate, 0.5);
  EXPECT_DOUBLE_EQ(f.converged_rate, 4.0 / 6.0);
  EXPECT_DOUBLE_EQ(f.unconverged_hand_coverage, 0.5);
  EXPECT_DOUBLE_EQ(f.sd_to_error_median, 1.0);
}

TEST(HonestyFigures, IntervalsCountInConvergedFramesAndWidthsAtTheEnd) {
  const HonestyLog log = {frame(false, 1.0, 1.0, 5.0), frame(true, 1.0, 1.0, 0.19, 0.1),
                          frame(true, 1.0, 1.0, 0.2, 0.1), frame(true, 1.0, 1.0, 0.0, 0.05)};
  const auto f = honesty_figures({&log});
  EXPECT_DOUBLE_EQ(f.coverage95, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(f.half_width95_median_deg, 1.96 * 0.05);
}

TEST(HonestyFigures, AFrameInViewWithoutAStandardDeviationIsNotPublished) {
  HonestyFrame away = frame(false, 1.0, 0.0);
  away.in_view = false;
  const HonestyLog log = {frame(false, 1.0, 0.0), frame(false, 1.0, 1.0), away};
  EXPECT_DOUBLE_EQ(honesty_figures({&log}).hand_sd_published_rate, 0.5);
}

TEST(HonestyFigures, LogsConvergeInTimeWithinFortyFiveFrames) {
  HonestyLog early(45, frame(false, 1.0, 1.0)), late(46, frame(false, 1.0, 1.0));
  early.back().converged = late.back().converged = true;
  EXPECT_DOUBLE_EQ(honesty_figures({&early, &late}).converged_within_45_rate, 0.5);
}

}  // namespace
}  // namespace bodyschema
