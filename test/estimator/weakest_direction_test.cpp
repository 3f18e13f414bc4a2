#include "bodyschema/estimator/weakest_direction.hpp"

#include <gtest/gtest.h>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

TEST(WeakestDirection, NamesTheJointsThatTradeAgainstEachOther) {
  // Two joints that nearly undo each other: their difference is known to 0.1 deg, their sum to 2.
  const double known = radians(0.1), unknown = radians(2.0);
  const Eigen::Vector3d sum(std::sqrt(0.5), std::sqrt(0.5), 0.0), difference(std::sqrt(0.5), -std::sqrt(0.5), 0.0);
  const Eigen::Matrix3d covariance = known * known * difference * difference.transpose() +
                                     unknown * unknown * sum * sum.transpose() +
                                     Eigen::Vector3d(0, 0, known * known).asDiagonal().toDenseMatrix();
  const WeakestDirection weakest = weakest_direction(covariance, {"prosup", "pitch", "yaw"});
  EXPECT_NEAR(weakest.sd_rad, unknown, 1e-9);
  EXPECT_NEAR(std::abs(weakest.direction.dot(sum)), 1.0, 1e-9);
  EXPECT_EQ(weakest.text, "0.71 prosup + 0.71 pitch: sd 2.00 deg");
}

TEST(WeakestDirection, TheLargestComponentIsPositive) {
  const Eigen::Vector2d direction(-0.6, 0.8);
  const WeakestDirection weakest =
      weakest_direction(direction * direction.transpose() * radians(1.0) * radians(1.0), {"a", "b"});
  EXPECT_GT(weakest.direction(1), 0.0);
  EXPECT_EQ(weakest.text, "-0.60 a + 0.80 b: sd 1.00 deg");
}

}  // namespace
}  // namespace bodyschema
