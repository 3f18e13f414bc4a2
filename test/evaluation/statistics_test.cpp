#include "bodyschema/evaluation/statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

TEST(Statistics, WorkedByHand) {
  const Statistics s = Statistics::of({4.0, 1.0, 3.0, 8.0});
  EXPECT_DOUBLE_EQ(s.mean, 4.0);
  EXPECT_DOUBLE_EQ(s.median, 3.5);
  EXPECT_DOUBLE_EQ(s.worst, 8.0);
  EXPECT_DOUBLE_EQ(s.sd * s.sd, (0.0 + 9.0 + 1.0 + 16.0) / 3.0);
  EXPECT_DOUBLE_EQ(Statistics::of({2.0}).sd, 0.0);
  EXPECT_DOUBLE_EQ(Statistics::of({}).mean, 0.0);
}

TEST(DistanceSd, WorkedByHand) {
  Eigen::Matrix3d covariance = Eigen::Vector3d(4.0, 9.0, 1.0).asDiagonal();
  EXPECT_DOUBLE_EQ(distance_sd({2.0, 3.0, 0.0}, covariance), std::sqrt(2.0));
  covariance(2, 2) = 0.0;
  EXPECT_TRUE(std::isinf(distance_sd({0.0, 0.0, 1.0}, covariance)));
}

}  // namespace
}  // namespace bodyschema
