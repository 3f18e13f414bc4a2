#include "bodyschema/pipeline/hand_errors.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(HandError, WorkedByHand) {
  TruthInstant truth;
  truth.X_CP = {Pose::Identity()};
  truth.X_CP[0].translation() = Eigen::Vector3d(0, 0, 0.5);
  truth.fingertips_P = {{0, 0, 0}, {0.1, 0, 0}};
  Pose estimated = truth.X_CP[0];
  estimated.translation() += Eigen::Vector3d(0.003, 0.004, 0);
  const PinholeIntrinsics camera{320, 240, 250, 250, 159.5, 119.5};
  const HandError error = hand_error(estimated, truth, 0, camera);
  EXPECT_NEAR(error.position_m, 0.005, 1e-12);
  EXPECT_NEAR(error.rotation_rad, 0.0, 1e-12);
  EXPECT_NEAR(error.fingertip_m, 0.005, 1e-12);
  EXPECT_NEAR(error.fingertip_px, 250 * 0.005 / 0.5, 1e-9);
}

TEST(HandError, RotationIsEquationEight) {
  TruthInstant truth;
  truth.X_CP = {Pose::Identity()};
  Pose estimated = Pose::Identity();
  estimated.linear() = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_NEAR(hand_error(estimated, truth, 0, {}).rotation_rad, 0.2, 1e-12);
}

}  // namespace
}  // namespace bodyschema
