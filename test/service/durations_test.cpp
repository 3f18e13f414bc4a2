#include "bodyschema/service/durations.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(RecentDurations, QuantilesAreNearestRank) {
  RecentDurations durations(100);
  EXPECT_EQ(durations.quantile_ms(0.5), 0.0);
  for (int i = 100; i >= 1; --i) durations.add(i);
  EXPECT_EQ(durations.quantile_ms(0.5), 50.0);
  EXPECT_EQ(durations.quantile_ms(0.99), 99.0);
  EXPECT_EQ(durations.quantile_ms(1.0), 100.0);
  EXPECT_EQ(durations.quantile_ms(0.0), 1.0);
}

TEST(RecentDurations, ForgetTheOldest) {
  RecentDurations durations(3);
  for (const double ms : {1000.0, 1.0, 2.0, 3.0}) durations.add(ms);
  EXPECT_EQ(durations.size(), 3u);
  EXPECT_EQ(durations.quantile_ms(1.0), 3.0);
  durations.clear();
  EXPECT_EQ(durations.size(), 0u);
}

TEST(DurationHistogram, BoundsBelongToTheLowerBin) {
  DurationHistogram histogram;
  for (const double ms : {0.0, 2.0, 2.1, 33.0, 1000.0, 1e9}) histogram.add(ms);
  EXPECT_THAT(histogram.counts(), testing::ElementsAre(2, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 1));
}

TEST(StageDurations, TableNamesEveryStage) {
  StageDurations stages(10);
  StageDurations::Frame frame{};
  frame[3] = 12.5;
  stages.add(frame);
  const std::string table = stages.table();
  for (const char* name : StageDurations::kNames) EXPECT_THAT(table, testing::HasSubstr(name));
  EXPECT_THAT(table, testing::HasSubstr("12.50"));
}

}  // namespace
}  // namespace bodyschema
