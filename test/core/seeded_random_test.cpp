#include "bodyschema/core/seeded_random.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

// std::mt19937_64 is given by the C++ standard to the last bit; its 10,000th number from the usual seed is the
// standard's own check value.
TEST(SeededRandom, IsTheStandardsGenerator) {
  std::mt19937_64 standard;
  standard.discard(9999);
  ASSERT_EQ(standard(), 9981545732273789042ULL);
  SeededRandom random(std::mt19937_64::default_seed);
  for (int i = 0; i < 9999; ++i) random.below(1);
  EXPECT_EQ(random.uniform(0.0, 1.0), static_cast<double>(9981545732273789042ULL >> 11) * 0x1.0p-53);
}

TEST(SeededRandom, StaysWithinItsLimits) {
  SeededRandom random(3);
  for (int i = 0; i < 10000; ++i) {
    const double x = random.uniform(-2.0, 5.0);
    EXPECT_GE(x, -2.0);
    EXPECT_LT(x, 5.0);
    EXPECT_LT(random.below(7), 7u);
  }
}

TEST(SeededRandom, NormalNumbersHaveTheirMomentsToFiveStandardErrors) {
  SeededRandom random(4);
  const int n = 100000;
  double first = 0.0, second = 0.0, fourth = 0.0;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    first += x / n;
    second += x * x / n;
    fourth += x * x * x * x / n;
  }
  const double one = 5.0 / std::sqrt(n);
  EXPECT_NEAR(first, 0.0, one);
  EXPECT_NEAR(second, 1.0, one * std::sqrt(2.0));
  EXPECT_NEAR(fourth, 3.0, one * std::sqrt(96.0));
}

}  // namespace
}  // namespace bodyschema
