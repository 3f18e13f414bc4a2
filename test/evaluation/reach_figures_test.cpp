#include "../../src/evaluation/reach_figures.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

/// A trial whose left eye saw the hand with these errors, mm and as many degrees; negative: no picture.
TrialRecord trial(const std::vector<double>& errors) {
  TrialRecord record;
  auto& frames = record.contestants.emplace_back().frames;
  for (const double error : errors) {
    frames.emplace_back().position_mm[kLeft] = error;
    frames.back().rotation_deg[kLeft] = error;
  }
  return record;
}

ReachResult result(const std::vector<double>& errors) {
  return reach_result({trial(errors)}, 0, kLeft);
}

TEST(ReachResult, CountsFramesUntilBothErrorsAreSmallForGood) {
  EXPECT_EQ(result({5.0, 0.5, 2.0, 0.5}).frames_to_converge.mean, 3.0);
  EXPECT_EQ(result({0.5, 0.5}).frames_to_converge.mean, 0.0);
  EXPECT_EQ(result({5.0, 0.5, 2.0}).never, 1u);
}

TEST(ReachResult, FramesWithoutAPictureAreNoConvergence) {
  EXPECT_EQ(result({5.0, 0.5, 2.0, -1.0, -1.0}).never, 1u);
  EXPECT_EQ(result({-1.0, -1.0}).never, 1u);
  EXPECT_EQ(result({5.0, -1.0, 0.5, -1.0}).frames_to_converge.mean, 1.0);
}

TEST(ReachResult, IsTheMeanOfTheLastTenFramesWithAPicture) {
  std::vector<double> errors(20, 8.0);
  for (std::size_t i = 10; i < 20; ++i) errors[i] = i % 2 == 0 ? 2.0 : -1.0;
  EXPECT_EQ(result(errors).position_mm.mean, 2.0);
}

}  // namespace
}  // namespace bodyschema
