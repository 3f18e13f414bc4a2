#include "bounded_minimum.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace bodyschema::diagnosis {
namespace {

constexpr double kFree = std::numeric_limits<double>::infinity();

const Eigen::Matrix2d kH = (Eigen::Matrix2d() << 2.0, 1.0, 1.0, 2.0).finished();

TEST(BoundedMinimum, WithinItsBoundsIsThatWithoutAny) {
  const Eigen::Vector2d g(3.0, -1.0), best(7.0 / 3.0, -5.0 / 3.0);
  EXPECT_LT((bounded_minimum(kH, g, {Eigen::Vector2d(-kFree, -kFree), Eigen::Vector2d(kFree, kFree)}) - best).norm(),
            1e-12);
  EXPECT_LT((bounded_minimum(kH, g, {Eigen::Vector2d(-5, -5), Eigen::Vector2d(5, 5)}) - best).norm(), 1e-12);
}

TEST(BoundedMinimum, WhatIsHeldLeavesTheRestTheirOwnBest) {
  const Eigen::Vector2d g(3.0, 0.0);  // the best is at (2, -1)
  const auto x = bounded_minimum(kH, g, {Eigen::Vector2d(-kFree, -kFree), Eigen::Vector2d(0.5, kFree)});
  EXPECT_DOUBLE_EQ(x[0], 0.5);
  EXPECT_DOUBLE_EQ(x[1], -0.25);
}

// Of a parameter that is as low as it may be, the least bound is zero: it went on downwards as far as it liked.
TEST(BoundedMinimum, WhatMayNotMoveAtAllStays) {
  const Eigen::Vector2d g(3.0, 0.0);
  const auto down = bounded_minimum(kH, g, {Eigen::Vector2d(-kFree, 0.0), Eigen::Vector2d(kFree, kFree)});
  EXPECT_DOUBLE_EQ(down[1], 0.0);
  EXPECT_DOUBLE_EQ(down[0], 1.5);
  const auto up = bounded_minimum(kH, -g, {Eigen::Vector2d(-kFree, -kFree), Eigen::Vector2d(kFree, 0.0)});
  EXPECT_DOUBLE_EQ(up[1], 0.0);
  EXPECT_DOUBLE_EQ(up[0], -1.5);
  const auto neither = bounded_minimum(kH, g, {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  EXPECT_EQ(neither, Eigen::VectorXd(Eigen::Vector2d::Zero()));
}

}  // namespace
}  // namespace bodyschema::diagnosis
