#include "bodyschema/estimator/offset_fusion.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

/// A frame that measures `direction`'x = value with so many pixels of derivative, linearised at x0.
ContourEvidence measures(const Eigen::VectorXd& direction, double value, const Eigen::VectorXd& x0) {
  ContourEvidence evidence;
  evidence.A = direction * direction.transpose();
  evidence.b = direction * (value - direction.dot(x0));
  return evidence;
}

const Eigen::Vector2d kPrior(1.0, 1.0);
const Eigen::Vector2d kNoEncoderError = Eigen::Vector2d::Zero();

TEST(OffsetFusion, DirectionsThatOneFrameCannotSeeAreSeenByAnother) {
  OffsetFusion fusion(kPrior, kNoEncoderError);
  const Eigen::Vector2d x0(0.3, -0.2), truth(0.5, -0.4);
  const Eigen::Vector2d first(100.0, 100.0), second(100.0, -100.0);
  fusion.add(measures(first, first.dot(truth), x0), x0, 1.0, 1.0);
  EXPECT_GT(fusion.covariance()(0, 0), 0.4);  // only the sum is known
  fusion.add(measures(second, second.dot(truth), x0), x0, 1.0, 1.0);
  EXPECT_LT((fusion.mean() - truth).norm(), 1e-3);
  EXPECT_LT(fusion.covariance()(0, 0), 1e-4);
  EXPECT_EQ(fusion.frames(), 2.0);
}

TEST(OffsetFusion, ThePriorAloneWithoutFramesAndAfterForgetting) {
  OffsetFusion fusion(Eigen::Vector2d(0.5, 2.0), kNoEncoderError);
  const Eigen::Vector2d x0 = Eigen::Vector2d::Zero(), seen(50.0, 0.0);
  const auto is_prior = [&] {
    EXPECT_EQ(fusion.mean(), x0);
    EXPECT_NEAR(fusion.covariance()(0, 0), 0.25, 1e-12);
    EXPECT_NEAR(fusion.covariance()(1, 1), 4.0, 1e-12);
  };
  is_prior();
  fusion.add(measures(seen, 10.0, x0), x0, 1.0, 1.0);
  EXPECT_LT(fusion.covariance()(0, 0), 1e-3);
  fusion.forget_all();
  is_prior();
  EXPECT_EQ(fusion.frames(), 0.0);
}

// However many sharp pictures one frame has, it says no more about an offset than the encoder
// reading it is compared with; many frames do.
TEST(OffsetFusion, AFramesEncoderErrorIsIntegratedOut) {
  constexpr double kEncoderSd = 0.01;
  OffsetFusion fusion(kPrior, Eigen::Vector2d(kEncoderSd, 0.0));
  const Eigen::Vector2d x0 = Eigen::Vector2d::Zero(), seen(1e5, 0.0);
  fusion.add(measures(seen, 0.0, x0), x0, 1.0, 1.0);
  EXPECT_NEAR(std::sqrt(fusion.covariance()(0, 0)), kEncoderSd, 1e-4);
  for (int i = 1; i < 100; ++i) fusion.add(measures(seen, 0.0, x0), x0, 1.0, 1.0);
  EXPECT_NEAR(std::sqrt(fusion.covariance()(0, 0)), kEncoderSd / 10.0, 1e-5);
  // The state of one frame has that frame's error again, unless its picture says it.
  EXPECT_NEAR(fusion.frame_state().covariance(0, 0), 1.01 * kEncoderSd * kEncoderSd, 1e-7);
  const auto seen_now = fusion.frame_state(measures(seen, 1e5 * 0.005, x0), x0, 1.0);
  EXPECT_NEAR(seen_now.x(0), 0.005, 1e-6);
  EXPECT_LT(seen_now.covariance(0, 0), 1e-9);
}

TEST(OffsetFusion, FadedFramesSayLess) {
  OffsetFusion fusion(Eigen::Vector2d(1e3, 1e3), kNoEncoderError);
  const Eigen::Vector2d x0 = Eigen::Vector2d::Zero(), seen(10.0, 0.0);
  fusion.add(measures(seen, 10.0 * 1.0, x0), x0, 1.0, 1.0);
  fusion.fade(0.25);
  EXPECT_DOUBLE_EQ(fusion.frames(), 0.25);
  fusion.add(measures(seen, 10.0 * 2.0, x0), x0, 1.0, 1.0);
  EXPECT_NEAR(fusion.mean()(0), (0.25 * 1.0 + 2.0) / 1.25, 1e-6);
}

TEST(OffsetFusion, FramesThatErrAlikeCountAsOne) {
  OffsetFusion once(kPrior, kNoEncoderError), shared(kPrior, kNoEncoderError);
  const Eigen::Vector2d x0 = Eigen::Vector2d::Zero(), seen(10.0, 5.0);
  once.add(measures(seen, 1.0, x0), x0, 0.25, 1.0);
  for (int i = 0; i < 6; ++i) shared.add(measures(seen, 1.0, x0), x0, 0.25, 1.0 / 6.0);
  EXPECT_TRUE(once.mean().isApprox(shared.mean(), 1e-12));
  EXPECT_TRUE(once.covariance().isApprox(shared.covariance(), 1e-12));
}

}  // namespace
}  // namespace bodyschema
