#include "bodyschema/diagnosis/block_statistics.hpp"

#include <gtest/gtest.h>

#include <random>

#include "diagnosis/regression_blocks.hpp"
#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema {
namespace {

/// Rows of an ordinary regression, gathered into blocks.
struct Regression {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;
  Eigen::Index blocks;

  [[nodiscard]] BlockStatistics statistics() const { return test::statistics_of(X, y, blocks); }
};

Regression regression(std::uint64_t seed, double noise, double block_noise) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Regression r{Eigen::MatrixXd(400, 3), Eigen::VectorXd(400), 20};
  for (Eigen::Index i = 0; i < 400; ++i) {
    r.X.row(i) << 1.0, normal(random), normal(random);
    r.y[i] = 2.0 - r.X(i, 1) + 0.5 * r.X(i, 2) + noise * normal(random);
  }
  for (Eigen::Index b = 0; b < 20; ++b) {
    r.y.segment(b * 20, 20).array() += block_noise * normal(random);
  }
  return r;
}

TEST(BlockStatistics, FitsLikeOrdinaryLeastSquares) {
  const auto r = regression(test::seed(), 0.3, 0.0);
  const auto fit = r.statistics().fit({{0}, {1}, {2}});
  ASSERT_TRUE(fit.usable);
  const Eigen::VectorXd expected = r.X.colPivHouseholderQr().solve(r.y);
  EXPECT_LT((fit.estimate - expected).norm(), 1e-9);
  EXPECT_NEAR(fit.loss, (r.y - r.X * expected).squaredNorm(), 1e-8);
}

TEST(BlockStatistics, HoldsOutWhatItSaysItHoldsOut) {
  const auto r = regression(test::seed(), 0.3, 0.2);
  const auto fit = r.statistics().fit({{0}, {1}, {2}});
  ASSERT_TRUE(fit.usable);
  for (const Eigen::Index b : {0, 7, 19}) {
    Eigen::MatrixXd X(380, 3);
    Eigen::VectorXd y(380);
    X << r.X.topRows(b * 20), r.X.bottomRows(380 - b * 20);
    y << r.y.head(b * 20), r.y.tail(380 - b * 20);
    const Eigen::VectorXd without = X.colPivHouseholderQr().solve(y);
    EXPECT_LT((fit.replicas.col(b) - without).norm(), 1e-9);
    EXPECT_NEAR(fit.heldout_loss[b], (r.y.segment(b * 20, 20) - r.X.middleRows(b * 20, 20) * without).squaredNorm(),
                1e-8);
  }
}

TEST(BlockStatistics, JackknifeSeesNoiseThatBlocksShare) {
  // The constant's error is that of 20 block means, not of 400 rows.
  double honest = 0.0, naive = 0.0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const auto fit = regression(test::seed() + i, 0.1, 0.5).statistics().fit({{0}, {1}, {2}});
    honest += std::sqrt(fit.covariance(0, 0)) / 20;
    naive += 0.1 * std::sqrt(fit.model_variance[0]) / 20;
  }
  EXPECT_NEAR(honest, 0.5 / std::sqrt(20.0), 0.03);
  EXPECT_LT(naive, 0.3 * honest);
}

TEST(BlockStatistics, DuplicatedRowsSharpenNothing) {
  const auto r = regression(test::seed(), 0.3, 0.2);
  auto twice = r;
  twice.X.resize(800, 3);
  twice.y.resize(800);
  for (Eigen::Index b = 0; b < 20; ++b) {
    for (const Eigen::Index copy : {0, 1}) {
      twice.X.middleRows(b * 40 + copy * 20, 20) = r.X.middleRows(b * 20, 20);
      twice.y.segment(b * 40 + copy * 20, 20) = r.y.segment(b * 20, 20);
    }
  }
  const auto one = r.statistics().fit({{0}, {1}, {2}}), two = twice.statistics().fit({{0}, {1}, {2}});
  EXPECT_LT((one.covariance - two.covariance).norm(), 1e-9 * one.covariance.norm() + 1e-12);
}

TEST(BlockStatistics, RefusesColumnsThatAreNotIndependent) {
  auto r = regression(test::seed(), 0.3, 0.0);
  r.X.col(2) = 2.0 * r.X.col(0) - r.X.col(1);
  EXPECT_FALSE(r.statistics().fit({{0}, {1}, {2}}).usable);
  r.X.col(2).setZero();
  EXPECT_FALSE(r.statistics().fit({{0}, {2}}).usable);
  // A column that lives in one block cannot be judged on that block.
  r.X.col(2).head(20).setOnes();
  EXPECT_FALSE(r.statistics().fit({{0}, {2}}).usable);
}

/// What is left of a column that begins in the last group is no zero but rounding, and its estimate without that
/// group anything.
TEST(BlockStatistics, RefusesAColumnThatLivesInOneGroup) {
  constexpr Eigen::Index kBlocks = 21, kRows = 20;
  for (std::uint64_t i = 0; i < 200; ++i) {
    std::mt19937_64 random(test::seed() + i);
    std::normal_distribution<double> normal;
    Eigen::MatrixXd X(kBlocks * kRows, 2);
    Eigen::VectorXd y(kBlocks * kRows);
    for (Eigen::Index r = 0; r < X.rows(); ++r) {
      X.row(r) << normal(random), normal(random);
      y[r] = X(r, 0) + normal(random);
    }
    const auto statistics = test::statistics_of(X, y, kBlocks);
    EXPECT_FALSE(statistics.fit({{0}, {1}, {0, 19}}, 3).usable) << "seed " << test::seed() + i;
    EXPECT_FALSE(NestedFits(statistics, {{0}, {1}}, 3).with({{0, 19}}).usable) << "seed " << test::seed() + i;
    // One that began a group before shows there too.
    EXPECT_TRUE(statistics.fit({{0}, {1}, {0, 17}}, 3).usable) << "seed " << test::seed() + i;
    EXPECT_TRUE(NestedFits(statistics, {{0}, {1}}, 3).with({{0, 17}}).usable) << "seed " << test::seed() + i;
  }
}

TEST(BlockStatistics, CountsTheBlocksInWhichSomethingWasSeen) {
  const auto r = regression(test::seed(), 0.3, 0.0);
  const auto seen = r.statistics();
  EXPECT_EQ(seen.seen_blocks(), 20u);
  EXPECT_EQ(seen.seen_blocks(3), 7u);
  std::vector<BlockStatistics::Block> blocks(seen.blocks().begin(), seen.blocks().end());
  for (const std::size_t b : {0u, 3u, 4u, 5u, 19u}) blocks[b] = test::unseen_block(3);
  const BlockStatistics some(std::move(blocks));
  EXPECT_EQ(some.block_count(), 20u);
  EXPECT_EQ(some.seen_blocks(), 15u);
  EXPECT_EQ(some.seen_blocks(3), 6u);  // of the second group nothing
}

TEST(BlockStatistics, AColumnCanBeginWithABlock) {
  auto r = regression(test::seed(), 0.1, 0.0);
  r.y.tail(200).array() += 3.0;
  const auto fit = r.statistics().fit({{0}, {1}, {2}, {0, 10}});
  ASSERT_TRUE(fit.usable);
  EXPECT_NEAR(fit.estimate[3], 3.0, 0.05);
}

TEST(NestedFits, AgreeWithFitsOfAllColumns) {
  const auto r = regression(test::seed(), 0.3, 0.2);
  const auto statistics = r.statistics();
  for (const std::size_t group : {std::size_t{1}, std::size_t{3}}) {
    const NestedFits nested(statistics, {{0}, {1}}, group);
    // A column of its own, and the constant once more from a block on.
    for (const Columns& more : {Columns{{2}}, Columns{{2}, {0, 9}}}) {
      auto all = Columns{{0}, {1}};
      all.insert(all.end(), more.begin(), more.end());
      const auto expected = statistics.fit(all, group), fit = nested.with(more);
      ASSERT_TRUE(expected.usable && fit.usable);
      EXPECT_LT((fit.estimate - expected.estimate).norm(), 1e-9);
      EXPECT_LT((fit.replicas - expected.replicas).norm(), 1e-8);
      EXPECT_LT((fit.covariance - expected.covariance).norm(), 1e-8 * expected.covariance.norm());
      EXPECT_LT((fit.model_variance - expected.model_variance).norm(), 1e-9);
      EXPECT_LT((fit.heldout_loss - expected.heldout_loss).norm(), 1e-7);
      EXPECT_NEAR(fit.loss, expected.loss, 1e-8);
    }
  }
}

TEST(NestedFits, SayHowMuchOfAColumnIsItsOwn) {
  auto r = regression(test::seed(), 0.3, 0.0);
  const Eigen::VectorXd own = r.X.col(2);
  r.X.col(2) = r.X.col(1) + 0.01 * own;
  const auto alike = r.statistics();
  const auto fit = NestedFits(alike, {{0}, {1}}).with({{2}});
  ASSERT_TRUE(fit.usable);
  EXPECT_NEAR(fit.independent, 1e-4, 5e-5);  // of its square
  r.X.col(2) = r.X.col(1);
  const auto equal = r.statistics();
  EXPECT_FALSE(NestedFits(equal, {{0}, {1}}).with({{2}}).usable);
}

TEST(EquivalentZ, AgreesWithChiSquareTables) {
  EXPECT_DOUBLE_EQ(equivalent_z(9.0, 1), 3.0);
  EXPECT_NEAR(equivalent_z(5.991, 2), 1.645, 0.02);  // 95 % one-sided
  EXPECT_NEAR(equivalent_z(11.070, 5), 1.645, 0.02);
  EXPECT_NEAR(equivalent_z(13.816, 2), 3.09, 0.05);  // 99.9 %
  EXPECT_LT(equivalent_z(100.0, 6), 10.0);
  EXPECT_GT(equivalent_z(100.0, 6), 6.0);
}

TEST(ZOfFew, IsAsUnlikelyAsOfMany) {
  EXPECT_DOUBLE_EQ(z_of_few(4.5, 30, 30), 4.5);
  EXPECT_DOUBLE_EQ(z_of_few(4.5, 300, 30), 4.5);
  EXPECT_DOUBLE_EQ(z_of_few(0.0, 5, 30), 0.0);
  // Two-sided 1 % of Student's t: 4.604 with 4 degrees of freedom, 3.250 with 9, 2.756 with 29.
  EXPECT_NEAR(z_of_few(4.604, 5, 30), 2.756, 0.05);
  EXPECT_NEAR(z_of_few(3.250, 10, 30), 2.756, 0.03);
  EXPECT_EQ(z_of_few(100.0, 1, 30), 0.0);
}

TEST(PairedT, IsTheUsualOne) {
  Eigen::VectorXd a(4), b = Eigen::VectorXd::Zero(4);
  a << 1, 2, 3, 4;
  EXPECT_NEAR(paired_t(a, b), 2.5 / (1.2909944 / 2.0), 1e-6);
  EXPECT_EQ(paired_t(b, b), 0.0);
}

}  // namespace
}  // namespace bodyschema
