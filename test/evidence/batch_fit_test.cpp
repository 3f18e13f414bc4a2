#include "bodyschema/evidence/batch_fit.hpp"

#include "evidence/drawn_log.hpp"

namespace bodyschema {
namespace {

class BatchFitOfOwnRobot : public DrawnLog {
 protected:
  static constexpr int kPostures = 8;
  BatchFitOfOwnRobot() {
    if (seen_.empty()) seen_ = observe(kPostures, paper_offsets_rad());
  }
  static void TearDownTestSuite() { seen_.clear(); }
  [[nodiscard]] BatchFit fitted(LogFit& fit, const std::vector<Belief>& more = {},
                                const std::vector<Belief>& considered = {}) const {
    BatchFit batch(fit, State(roles_, beliefs(more)), considered, {});
    batch.run(30.0);
    return batch;
  }
  /// Offsets' errors in standard deviations.
  static Eigen::VectorXd in_sd(const BatchFit& batch) {
    return (batch.estimate().x.head(7) - paper_offsets_rad())
        .cwiseQuotient(batch.estimate().covariance.diagonal().head(7).cwiseSqrt());
  }
  static inline std::vector<Observation> seen_;
};

TEST_F(BatchFitOfOwnRobot, FindsTheOffsetsAndKnowsHowWell) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  const BatchFit batch = fitted(fit);
  EXPECT_LT((batch.estimate().x - paper_offsets_rad()).cwiseAbs().maxCoeff(), radians(0.3));
  EXPECT_LT(in_sd(batch).cwiseAbs().maxCoeff(), 4.0);
  EXPECT_LT(batch.estimate().covariance.diagonal().cwiseSqrt().maxCoeff(), radians(0.5));
  EXPECT_EQ(batch.state().x(), batch.estimate().x);
  EXPECT_EQ(batch.postures(), static_cast<std::size_t>(kPostures));
  EXPECT_EQ(batch.posture_by_picture().size(), 2u * kPostures);
  EXPECT_LT(batch.noise()[0].sd_px(), 0.3) << "drawn masks are smooth";
  EXPECT_LT(batch.at().rms_px(), 0.2);
  EXPECT_FALSE(batch.memory().most_stale()) << "all postures are linearised about the result";
}

/// The same postures again, with a hair of noise: no better known.
TEST_F(BatchFitOfOwnRobot, MorePicturesOfTheSamePosturesTeachNothing) {
  const auto once = log_of(seen_);
  std::vector<Observation> twice;
  for (const auto& observation : seen_) {
    for (int i = 0; i < 3; ++i) {
      twice.push_back(observation);
      twice.back().utime += 33'333 * i;
      for (auto& camera : twice.back().cameras) {
        camera->utime += 33'333 * i;
        camera->coverage[static_cast<std::size_t>(i)] = 1;
      }
    }
  }
  const auto thrice = log_of(twice);
  ASSERT_EQ(thrice->pictures().size(), 3u * once->pictures().size());
  LogFit fit(*once, 2), more(*thrice, 2);
  const BatchFit a = fitted(fit), b = fitted(more);
  EXPECT_EQ(b.postures(), static_cast<std::size_t>(kPostures));
  for (Eigen::Index k = 0; k < 7; ++k) {
    // The noise is measured on more of them, that is all.
    EXPECT_GT(b.estimate().covariance(k, k), 0.8 * a.estimate().covariance(k, k)) << k;
  }
}

/// A tolerance is part of how well offsets are known, and a robot that is off by it lies within.
TEST_F(BatchFitOfOwnRobot, WhatIsConsideredWidensAndContains) {
  const std::vector<Belief> tolerance = {{"link_length", {"r_wrist_pitch", ""}, {0.004}},
                                         {"camera_pair", {}, {0.001, 0.001, 0.001, 0.002, 0.002, 0.002}}};
  ErrorModel others(roles_);
  others.add("link_length", {"r_wrist_pitch", ""}).parameters()[0].value = 0.005;
  const auto parameters = others.add("camera_pair", {}).parameters();
  parameters[0].value = 0.001;
  parameters[4].value = 0.003;
  const auto log = log_of(observe(kPostures, paper_offsets_rad(), &others));
  LogFit fit(*log, 2);
  const BatchFit blind = fitted(fit), wary = fitted(fit, {}, tolerance);
  for (Eigen::Index k = 0; k < 7; ++k) {
    EXPECT_GT(wary.estimate().covariance(k, k), wary.estimate().own(k, k)) << k;
  }
  EXPECT_GT(in_sd(blind).cwiseAbs().maxCoeff(), 4.0) << "who believes the model is wrong by more than is claimed";
  EXPECT_LT(in_sd(wary).cwiseAbs().maxCoeff(), 4.0);
  // Estimated instead, it is found.
  const BatchFit found = fitted(fit, tolerance);
  EXPECT_LT(in_sd(found).cwiseAbs().maxCoeff(), 4.0);
  EXPECT_NEAR(found.estimate().x[found.state().find("link_length", {"r_wrist_pitch", ""}, 0)], 0.005, 0.001);
}

/// A hand that is larger than its mesh is so in all postures: their number does not make its joints better known.
TEST_F(BatchFitOfOwnRobot, WhatShapesGetWrongAlikeWidens) {
  ErrorModel larger(roles_);
  larger.add("mesh_scale", {"", roles_.segments.back().name}).parameters()[0].value = 0.15;
  const auto log = log_of(observe(3 * kPostures, paper_offsets_rad(), &larger));
  LogFit fit(*log, 2);
  const BatchFit batch = fitted(fit);
  EXPECT_LT(in_sd(batch).cwiseAbs().maxCoeff(), 3.0);
  const Eigen::VectorXd by_postures = batch.memory().estimate().covariance.diagonal().head(7).cwiseSqrt();
  EXPECT_GT((batch.estimate().x.head(7) - paper_offsets_rad()).cwiseQuotient(by_postures).cwiseAbs().maxCoeff(), 3.0)
      << "who takes every posture for a witness of its own believes it too well";
}

/// Another reading of the pictures that is as good lies as near to what is right.
TEST_F(BatchFitOfOwnRobot, MeetsAnotherReadingHalfWayAndKnowsItNoBetter) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  BatchFit batch = fitted(fit);
  const MemoryEstimate before = batch.memory().estimate();
  MemoryEstimate other = before;
  other.x[3] += radians(2.0);
  batch.meet(other);
  EXPECT_NEAR(batch.estimate().x[3], before.x[3] + radians(1.0), 1e-9);
  EXPECT_EQ(batch.state().x(), batch.estimate().x);
  EXPECT_NEAR(std::sqrt(batch.estimate().covariance(3, 3) - before.covariance(3, 3)), radians(1.0), radians(0.1));
  EXPECT_NEAR(batch.estimate().x[2], before.x[2], 1e-9);
  EXPECT_GT(batch.at().rms_px(), 0.3) << "pictures about where it is now";
}

TEST_F(BatchFitOfOwnRobot, AReadingThatKnowsNothingMovesNothing) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  BatchFit batch = fitted(fit);
  const MemoryEstimate before = batch.estimate();
  MemoryEstimate other = before;
  other.x.setZero();
  other.own = batch.memory().layout().prior_sd.cwiseAbs2().asDiagonal();
  batch.meet(other);
  EXPECT_LT((batch.estimate().x - before.x).cwiseAbs().maxCoeff(), radians(0.02));
}

/// Postures that were not looked at are explained all the same.
TEST_F(BatchFitOfOwnRobot, OfSomePicturesItPredictsTheOthers) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  BatchFit batch(fit, State(roles_, beliefs()), {}, {});
  std::vector<std::size_t> first, rest;
  for (std::size_t p = 0; p < log->pictures().size(); ++p) (p < 12 ? first : rest).push_back(p);
  batch.run(30.0, first);
  EXPECT_LT(fit.linearise(batch.state().model(), {}, {}, rest).rms_px(), 0.3);
}

TEST_F(BatchFitOfOwnRobot, PosturesAreToldByArmAndHead) {
  const Eigen::VectorXd q = posture(0);
  EXPECT_EQ(posture_of(q, roles_).size(), 13);
  Eigen::VectorXd fingers = q, neck = q;
  fingers(robot_->joint_index("r_index_proximal")) += 0.3;
  neck(robot_->joint_index("neck_yaw")) += 0.3;
  EXPECT_EQ(posture_of(fingers, roles_), posture_of(q, roles_));
  EXPECT_NEAR((posture_of(neck, roles_) - posture_of(q, roles_)).norm(), 0.3, 1e-12);
}

TEST_F(BatchFitOfOwnRobot, AMemorysLayoutIsThatOfStateAndTolerances) {
  const State state(roles_, beliefs({{"head_offset", {"neck_yaw", ""}, {0.05}}, {"mesh_scale", {}, {0.01}}}));
  const auto layout = memory_layout(
      state, Considered::beside(state, {{"baseline", {}, {0.001}}, {"base_shift", {}, {0.002, 0.003, 0.0}}}));
  EXPECT_EQ(layout.estimated(), 9);
  EXPECT_EQ(layout.size(), 13);
  const std::vector<bool> angles = {true, true, true, true, true, true, true, true, false};
  EXPECT_EQ(layout.is_joint, angles) << "offsets of arm and head";
  EXPECT_NEAR(layout.considered_root(2, 2), 0.003, 1e-15);
}

}  // namespace
}  // namespace bodyschema
