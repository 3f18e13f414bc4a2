#include "../../src/evaluation/recovery.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "../../src/evaluation/reach_figures.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Frames with these position errors in the left eye; negative: no picture.
std::vector<FrameRecord> frames_of(const std::vector<double>& errors_mm) {
  std::vector<FrameRecord> frames;
  for (const double error : errors_mm) {
    frames.emplace_back().position_mm[kLeft] = error;
    frames.back().rotation_deg[kLeft] = 0.0;
  }
  return frames;
}

TEST(Recovery, IsCountedFromTheEventAndOnlyWhereItHappened) {
  EXPECT_EQ(recovery(frames_of({9.0, 0.1, 0.2}), 1, kLeft).frames, 0.0);
  EXPECT_EQ(recovery(frames_of({0.1, 5.0, 0.5, 2.0, 0.5, -1.0}), 1, kLeft).frames, 3.0);
  EXPECT_FALSE(recovery(frames_of({0.1, 5.0, 0.5, 2.0, -1.0}), 1, kLeft).frames);
  EXPECT_FALSE(recovery(frames_of({0.1, -1.0}), 1, kLeft).frames);
}

TEST(Recovery, WhatNeverHappenedIsCalledNever) {
  const RecoveryFigures none = figures_of({{std::nullopt, 7.0}, {std::nullopt, 9.0}});
  EXPECT_EQ(describe(none, 20), "below 1 mm never in 2 of 2 trials, slowest seed 20, outside 99.9 %: 9");
  EXPECT_EQ(to_json(none)["recovered"], false);
  EXPECT_TRUE(to_json(none)["frames_to_recover"].is_null());
  const RecoveryFigures some = figures_of({{4.0, 0.0}, {std::nullopt, 0.0}, {2.0, 0.0}});
  EXPECT_THAT(describe(some, 20),
              HasSubstr("never in 1 of 3 trials, else within   4 frames (mean 3.0), slowest seed 21"));
  EXPECT_EQ(to_json(some)["never_recovered"], 1);
  const RecoveryFigures all = figures_of({{4.0, 0.0}, {2.0, 0.0}});
  EXPECT_THAT(describe(all, 20), Not(HasSubstr("never")));
  EXPECT_EQ(to_json(all)["recovered"], true);
  EXPECT_EQ(to_json(all)["trials"], 2);
  EXPECT_EQ(to_json(all)["frames_to_recover"]["max"], 4.0);
}

TEST(ReachFigures, ATrialThatNeverConvergesHasNoNumberOfFrames) {
  std::vector<TrialRecord> trials(2);
  trials[0].contestants = {{frames_of({5.0, 5.0, 0.5}), {}, 0.0}, {frames_of({5.0, 5.0, 5.0}), {}, 0.0}};
  trials[1].contestants = {{frames_of({5.0, 0.5, 5.0}), {}, 0.0}, {frames_of({0.5, 0.5, 1.0}), {}, 0.0}};
  const Json one = to_json(reach_result(trials, 0, kLeft));
  EXPECT_EQ(one["trials"], 2);
  EXPECT_EQ(one["frames_to_converge"], (Json{{"mean", 2.0}, {"never", 1}}));
  const Json none = to_json(reach_result(trials, 1, kLeft));
  EXPECT_EQ(none["frames_to_converge"], (Json{{"mean", nullptr}, {"never", 2}}));
}

/// Whatever the covariance, one error in a thousand that was drawn from it lies outside.
TEST(Recovery, TheRegionHoldsItsShare) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const auto drawn = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  Eigen::Matrix3d mixed;
  mixed << 3.0, 0.5, -2.0, 0.0, 0.7, 0.4, 0.0, 0.0, 0.05;
  for (const Eigen::Matrix3d& root : {Eigen::Matrix3d(0.4 * Eigen::Matrix3d::Identity()), mixed}) {
    constexpr int kFrames = 100'000;
    std::vector<FrameRecord> frames(kFrames);
    for (auto& frame : frames) {
      const Eigen::Vector3d error_mm = root * drawn();
      frame.position_mm[kLeft] = error_mm.norm();
      frame.position_sd[kLeft] = distance_sd(error_mm, root * root.transpose());
    }
    const double five_sigma = 5.0 * std::sqrt(1e-3 * (1.0 - 1e-3) / kFrames);
    EXPECT_NEAR(recovery(frames, 0, kLeft).frames_outside_999 / kFrames, 1e-3, five_sigma);
  }
}

}  // namespace
}  // namespace bodyschema
