#include "bodyschema/simulator/trajectory.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema::simulator {
namespace {

TEST(MinimumJerk, StartsAndEndsAtRestWithoutAcceleration) {
  EXPECT_DOUBLE_EQ(minimum_jerk(0.0), 0.0);
  EXPECT_DOUBLE_EQ(minimum_jerk(1.0), 1.0);
  EXPECT_DOUBLE_EQ(minimum_jerk(0.5), 0.5);
  EXPECT_NEAR(minimum_jerk(0.3), 0.027 * (10 - 4.5 + 0.54), 1e-12);
  const double h = 1e-4;
  for (const double x : {0.0, 1.0}) {
    const double inside = x == 0.0 ? h : 1.0 - h;
    EXPECT_NEAR((minimum_jerk(inside) - minimum_jerk(x)) / h, 0.0, 1e-6);
    EXPECT_NEAR((minimum_jerk(inside) - minimum_jerk(x)) / (h * h), 0.0, 2e-3);
  }
  // The greatest speed of a minimum-jerk move is 1.875 times its mean, half-way.
  EXPECT_NEAR((minimum_jerk(0.5 + h) - minimum_jerk(0.5 - h)) / (2 * h), 1.875, 1e-6);
}

TEST(MinimumJerk, HasLessJerkThanItsNeighbours) {
  // Adding a x^3 (1-x)^3 keeps position, velocity and acceleration at both ends; the integral of
  // the squared jerk must grow in either direction.
  const auto cost = [](double a) {
    const double h = 1e-3;
    const auto s = [&](double x) { return minimum_jerk(x) + a * std::pow(x * (1 - x), 3); };
    double sum = 0.0;
    for (double x = 2 * h; x < 1.0 - 2 * h; x += h) {
      const double jerk = (s(x + 2 * h) - 2 * s(x + h) + 2 * s(x - h) - s(x - 2 * h)) / (2 * h * h * h);
      sum += jerk * jerk * h;
    }
    return sum;
  };
  EXPECT_LT(cost(0.0), cost(0.5));
  EXPECT_LT(cost(0.0), cost(-0.5));
}

TEST(Trajectory, MovesHoldsAndStaysAtItsEnds) {
  Trajectory t(Eigen::Vector2d(1.0, -1.0));
  t.move_to(Eigen::Vector2d(2.0, -3.0), 2.0);
  t.hold(1.0);
  t.move_to(Eigen::Vector2d(0.0, 0.0), 1.0);
  EXPECT_DOUBLE_EQ(t.duration_s(), 4.0);
  EXPECT_TRUE(t.position(-5.0).isApprox(Eigen::Vector2d(1.0, -1.0)));
  EXPECT_TRUE(t.position(1.0).isApprox(Eigen::Vector2d(1.5, -2.0)));
  EXPECT_TRUE(t.position(2.5).isApprox(Eigen::Vector2d(2.0, -3.0)));
  EXPECT_NEAR(t.position(9.0).norm(), 0.0, 1e-12);
  Trajectory both(t.first());
  both.hold(0.5);
  both.append(t);
  for (double x = 0.0; x < 5.0; x += 0.13) EXPECT_TRUE(both.position(x + 0.5).isApprox(t.position(x), 1e-12));
}

}  // namespace
}  // namespace bodyschema::simulator
