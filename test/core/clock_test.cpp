#include <gtest/gtest.h>

#include <chrono>
#include <ctime>
#include <thread>

#include "bodyschema/core/clock.hpp"

namespace bodyschema {
namespace {

TEST(Clock, MonotonicRunsForwardInMicroseconds) {
  const auto before = monotonic_us();
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const auto passed = monotonic_us() - before;
  EXPECT_GE(passed, 20'000);
  EXPECT_LT(passed, 20'000'000) << "another unit than microseconds";
}

TEST(Clock, WallCountsFromTheEpoch) {
  constexpr std::int64_t kDay_s = 86'400;
  const auto today = std::time(nullptr);
  EXPECT_NEAR(static_cast<double>(wall_us()) * 1e-6, static_cast<double>(today), kDay_s);
}

}  // namespace
}  // namespace bodyschema
