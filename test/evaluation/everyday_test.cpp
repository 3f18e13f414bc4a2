#include "bodyschema/evaluation/everyday.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "bodyschema/core/error.hpp"
#include "bodyschema/evaluation/evaluate.hpp"

namespace bodyschema {
namespace {

EverydayFrame frame(bool converged, double hand_mm, double hand_sd_mm = 0.5, double offset_sd = 1.0) {
  return {
      .in_view = true, .converged = converged, .hand_mm = hand_mm, .hand_sd_mm = hand_sd_mm, .offset_sd = offset_sd};
}

TEST(EverydayLog, CountsConvergedFramesWithTheHandInViewFromTheFirstThatCountsOn) {
  std::vector<EverydayFrame> frames(4, frame(true, 50.0));  // time to converge: not counted
  frames.push_back(frame(true, 0.2));
  frames.push_back(frame(true, 0.4));
  frames.push_back(frame(false, 30.0));
  frames.push_back(frame(true, 40.0));
  frames.back().in_view = false;
  const auto log = judge_everyday(frames, 4);
  EXPECT_EQ(log.counted, 3);
  EXPECT_EQ(log.converged, 2);
  EXPECT_EQ(log.dishonest, 0);
  EXPECT_DOUBLE_EQ(log.hand_mm, 0.3);
}

TEST(EverydayLog, AFrameIsWrongByItsOwnUncertaintyAndByMillimetresOrByAnOffset) {
  const std::vector<EverydayFrame> frames = {frame(true, 1.9, 0.1),         // many sd, but small
                                             frame(true, 9.0, 4.0),         // large, but it said so
                                             frame(true, 2.1, 0.5),         // wrong
                                             frame(true, 0.1, 0.5, 5.1),    // wrong: an offset
                                             frame(false, 9.0, 0.5, 9.0)};  // did not claim to be right
  EXPECT_EQ(judge_everyday(frames, 0).dishonest, 2);
}

TEST(EverydayLog, OneThatNeverConvergesIsJudgedByItsLastFiftyFrames) {
  std::vector<EverydayFrame> frames(100, frame(false, 80.0));
  for (std::size_t i = 50; i < 100; ++i) frames[i].hand_mm = 7.0;
  frames[60].hand_mm = -1.0;  // no estimate
  const auto log = judge_everyday(frames, 45);
  EXPECT_EQ(log.converged, 0);
  EXPECT_DOUBLE_EQ(log.hand_mm, 7.0);
}

TEST(Everyday, ARowThatDoesNotExistIsNamedWithTheNearest) {
  const auto configs = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config";
  EvaluationOptions options;
  options.experiment = "everyday";
  options.out = std::filesystem::path(testing::TempDir()) / "everyday";
  options.rows = {"plian"};
  try {
    evaluate(Configuration::load(configs / "icub_right/evaluation.yaml"), configs, options);
    FAIL() << "no error";
  } catch (const ConfigurationError& error) {
    EXPECT_STREQ(error.what(), "--rows: everyday has no row 'plian'; did you mean 'plain'?");
  }
}

/// Short: the whole chain, not its figures.
TEST(Everyday, ARowIsPlayedFromPictureToFigure) {
  const auto configs = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config";
  EvaluationOptions options;
  options.experiment = "everyday";
  options.out = std::filesystem::path(testing::TempDir()) / "everyday";
  options.rows = {"head"};
  options.trials = 1;
  options.everyday_s = 6.0;
  const auto table = evaluate(Configuration::load(configs / "icub_right/evaluation.yaml"), configs, options);
  std::printf("seed 7:%s", table.c_str());
  EXPECT_NE(table.find("head "), std::string::npos);
  EXPECT_EQ(table.find("plain"), std::string::npos);
}

}  // namespace
}  // namespace bodyschema
