#include "bodyschema/robot/urdf_origin.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace bodyschema {
namespace {

TEST(UrdfOrigin, TextGoesThereAndBack) {
  const Eigen::Vector3d v(0.1, -2.5e-7, 1234.5);
  EXPECT_EQ(urdf_text(v), "0.1 -2.5e-07 1234.5");
  EXPECT_EQ(urdf_triple(urdf_text(v).c_str()), v);
  EXPECT_EQ(urdf_triple(nullptr, v), v);
}

TEST(UrdfOrigin, AnglesGoThereAndBackAlsoStraightUp) {
  constexpr double kQuarter = std::numbers::pi / 2.0;
  // Yaw by a quarter turn: x becomes y.
  EXPECT_LT((urdf_rotation({0, 0, kQuarter}).col(0) - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  for (const Eigen::Vector3d& rpy :
       {Eigen::Vector3d(0.3, -1.2, 2.9), Eigen::Vector3d(0.3, kQuarter, 0.8), Eigen::Vector3d(-3.0, -kQuarter, 1.0)}) {
    const Eigen::Matrix3d R = urdf_rotation(rpy);
    EXPECT_LT((urdf_rotation(urdf_rpy(R)) - R).norm(), 1e-8) << rpy.transpose();
  }
}

}  // namespace
}  // namespace bodyschema
