#include "left_over.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "limits.hpp"
#include "model_search.hpp"
#include "simulated_log.hpp"

namespace bodyschema::diagnosis {
namespace {

/// What offsets and nuisances leave of a short log.
LeftOver left_by_offsets(const std::vector<std::string>& faults) {
  test::Simulated what{.seconds = 14.0, .rate_hz = 4.0};
  what.faults = faults;
  test::SimulatedLog log(what);
  const DiagnosisOptions options;
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto about = search.about(options.block_s);
  return left_over(log.fit(), about, search.search(), {options.level, options.matters_m, 0.3});
}

TEST(LeftOver, OfAHealthyLogDiffersFromBlockToBlock) {
  const auto left = left_by_offsets({});
  EXPECT_TRUE(left.side.empty()) << left.side;
  EXPECT_GT(left.noise_px, 0.1);
  EXPECT_LE(left.noise_px, left.rms_px);
  EXPECT_LT(left.rms_px, limits::kNoiseRatio * left.noise_px);
}

/// A cover that is thicker all the time, in every block alike.
TEST(LeftOver, OfAnotherShapeIsAlikeInAllBlocks) {
  const auto left = left_by_offsets({"cover_dilation:part=forearm,value=4"});
  EXPECT_THAT(left.side, testing::HasSubstr("r_forearm"));
  EXPECT_GT(left.rms_px, limits::kNoiseRatio * left.noise_px);
}

}  // namespace
}  // namespace bodyschema::diagnosis
