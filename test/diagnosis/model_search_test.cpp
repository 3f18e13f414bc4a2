#include "model_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "simulated_log.hpp"

namespace bodyschema::diagnosis {
namespace {

/// An arm that stands shows the same posture in all its pictures, which err alike: they weigh as much as those of one
/// block of the shortest length, however long it stands.
TEST(ModelSearch, PicturesOfOnePostureCountAsOneBlock) {
  test::Simulated what;
  what.seconds = 10.0;
  test::SimulatedLog log(what);
  DiagnosisOptions options;
  options.block_s = 0.5;
  options.same_posture_rad = 10.0;  // all of the log
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto sum = [&](double block_s) {
    const auto about = search.about(block_s);
    EXPECT_EQ(about.blocks, 1u);
    return std::accumulate(about.precision.begin(), about.precision.end(), 0.0);
  };
  const auto pictures = log.pictures().pictures();
  const double span_s = seconds(pictures.back().joints.utime - pictures.front().joints.utime);
  ASSERT_GT(span_s, 9.0);
  EXPECT_NEAR(sum(1.0) * span_s, sum(20.0), 1e-6 * sum(20.0));
}

/// What moves is told as before.
TEST(ModelSearch, PicturesOfAnArmThatMovesCountInFull) {
  test::Simulated what;
  what.seconds = 14.0;
  test::SimulatedLog log(what);
  const DiagnosisOptions options;
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto about = search.about(1.0);
  ASSERT_GT(about.blocks, 8u);
  const double most = *std::max_element(about.precision.begin(), about.precision.end());
  const auto full =
      std::count_if(about.precision.begin(), about.precision.end(), [&](double p) { return p > 0.7 * most; });
  EXPECT_GT(full, 0.6 * static_cast<double>(about.precision.size()));
}

}  // namespace
}  // namespace bodyschema::diagnosis
