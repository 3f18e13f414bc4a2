#include "bodyschema/core/rounded.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace bodyschema {
namespace {

std::string told(double value, double low, double high) {
  const auto r = rounded(value, low, high);
  return r.value + " (" + r.low + " to " + r.high + ")";
}

TEST(Rounded, AnIntervalSaysHowManyDigitsItsValueHas) {
  EXPECT_EQ(told(59.12, 58.83, 59.44), "59.1 (58.8 to 59.4)");
  EXPECT_EQ(told(0.755, -0.2, 1.71), "0.8 (-0.2 to 1.7)");
  EXPECT_EQ(told(4.0, 3.5, 4.5), "4 (3.5 to 4.5)");
  EXPECT_EQ(told(1234.5, 1130.0, 1330.0), "1230 (1130 to 1330)");
  EXPECT_EQ(told(3.0001, 2.9996, 3.0006), "3.0001 (2.9996 to 3.0006)");
  EXPECT_EQ(told(0.02, -0.04, 0.81), "0 (0 to 0.8)");
}

TEST(Rounded, WithoutAnIntervalThreeDigits) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(rounded(1.23456, kNone, kNone).value, "1.23");
  EXPECT_EQ(rounded(1.23456, 1.23456, 1.23456).value, "1.23");
}

/// "roughly 0.755 mm" contradicts itself.
TEST(Rounded, RoughlyHasOneDigit) {
  EXPECT_EQ(roughly(0.755), "0.8");
  EXPECT_EQ(roughly(1.56), "1.6");
  EXPECT_EQ(roughly(8.32), "8");
  EXPECT_EQ(roughly(131.2), "130");
  EXPECT_EQ(roughly(97.0), "100");
  EXPECT_EQ(roughly(0.0), "0");
}

}  // namespace
}  // namespace bodyschema
