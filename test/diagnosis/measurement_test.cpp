#include "bodyschema/diagnosis/measurement.hpp"

#include <gtest/gtest.h>

#include "bodyschema/effects/catalogue.hpp"
#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema {
namespace {

using test::robot;

/// Predicted place of a point of a link along its normal, for a set of corrections.
double along_normal(CorrectedKinematics& kinematics, const Eigen::VectorXd& q, const Corrections& c,
                    const PinholeIntrinsics& k, const Eigen::Vector3d& p_B, std::size_t link, std::size_t links,
                    const Eigen::Vector2d& normal) {
  std::vector<Pose> X(links);
  kinematics.compute(q, c, 0, X);
  const Eigen::Vector3d p = X[link] * ((1.0 + c.mesh_scale) * p_B);
  const Eigen::Vector2d x = p.head<2>() / p.z();
  const Eigen::Vector2d d = x * (1.0 + c.camera.k1 * x.squaredNorm());
  const Eigen::Vector2d pixel(k.fx * (1.0 + c.camera.focal_scale) * d.x() + k.cx + c.camera.cx_px,
                              k.fy * (1.0 + c.camera.focal_scale) * d.y() + k.cy + c.camera.cy_px);
  return normal.dot(pixel) + c.dilation_px;
}

TEST(ViewCompressor, DerivativesAgreeWithMovingTheRobot) {
  const auto& r = robot();
  const auto roles = JointRoles::of(r.model, r.setup, r.rig);
  const std::vector<std::string> links = {"r_forearm", "r_hand", "r_index_3"};
  const std::vector<std::string> cameras = {r.rig.cameras[0].link, r.rig.cameras[1].link};
  ViewCompressor compressor(r.model, roles, links, cameras);
  CorrectedKinematics kinematics(r.model, links, cameras);
  auto q = r.setup.default_joints(*r.model);
  q[roles.arm[0]] = -0.8;
  q[roles.arm[1]] = 0.3;
  q[roles.arm[3]] = 1.4;
  q[roles.head[0]] = -0.5;
  const Corrections none(q.size());
  const auto X = compressor.set_view(q, none, 0);
  const auto& k = r.rig.cameras[0].intrinsics;
  const Eigen::Vector2d normal(0.6, 0.8);
  const Eigen::Vector3d p_B(0.01, -0.02, 0.015);
  for (std::size_t link = 0; link < links.size(); ++link) {
    const Eigen::Vector3d p_C = X[link] * p_B;
    if (p_C.z() < 0.05) continue;
    const OutlinePoint point{link, p_C, normal, 1.0, 1.0};
    CompressedView view;
    compressor.compress(std::span(&point, 1), k, view);
    for (Eigen::Index i = 0; i < compressor.layout().size(); ++i) {
      const auto& entry = compressor.layout().entries()[static_cast<std::size_t>(i)];
      Corrections high = none, low = none;
      constexpr double kStep = 1e-4;
      CoordinateLayout::slot(entry, high) += kStep;
      CoordinateLayout::slot(entry, low) -= kStep;
      const double expected = (along_normal(kinematics, q, high, k, p_B, link, links.size(), normal) -
                               along_normal(kinematics, q, low, k, p_B, link, links.size(), normal)) /
                              (2 * kStep);
      // One point with residual and weight one: b is its row of derivatives.
      EXPECT_NEAR(view.vector[i], expected, 1e-3 * (1.0 + std::abs(expected)))
          << "coordinate " << i << " link " << links[link];
    }
  }
}

TEST(CoordinateLayout, HoldsWhatTheCatalogueMovesAndReadsIt) {
  const auto roles = JointRoles::of(robot().model, robot().setup, robot().rig);
  const CoordinateLayout layout(roles);
  const auto arm = static_cast<Eigen::Index>(roles.arm.size());
  const auto joints = arm + static_cast<Eigen::Index>(roles.head.size() + roles.fingers.size());
  const auto pairs = arm + static_cast<Eigen::Index>(effect_targets("axis_shift", roles).size());  // tilts and shifts
  const auto lengths = static_cast<Eigen::Index>(effect_targets("link_length", roles).size());
  constexpr Eigen::Index kBaseCameraAndParts = 3 + 5 + 2;
  EXPECT_EQ(layout.size(), joints + 2 * pairs + lengths + kBaseCameraAndParts);
  Corrections c(static_cast<Eigen::Index>(roles.names.size()));
  c.dq[roles.arm[3]] = 0.25;
  c.dilation_px = 0.5;
  Eigen::VectorXd x(layout.size());
  layout.read(c, x);
  EXPECT_EQ(x[layout.joint(roles.arm[3])], 0.25);
  EXPECT_EQ(x[layout.size() - 1], 0.5);
  EXPECT_EQ(x.cwiseAbs().sum(), 0.75);
}

}  // namespace
}  // namespace bodyschema
