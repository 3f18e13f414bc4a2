#include "block_regression.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "bodyschema/evidence/distributions.hpp"
#include "random_seed.hpp"

namespace bodyschema::diagnosis {
namespace {

/// An ordinary regression y = X b + Z c in blocks of equal length, for columns X of a base and Z that are added.
struct Rows {
  Eigen::MatrixXd X, Z;
  Eigen::VectorXd y;
  Eigen::Index blocks = 20;

  [[nodiscard]] Eigen::Index length() const { return X.rows() / blocks; }
  [[nodiscard]] std::vector<BaseBlock> base() const {
    std::vector<BaseBlock> list;
    for (Eigen::Index b = 0; b < blocks; ++b) {
      const Eigen::MatrixXd x = X.middleRows(b * length(), length());
      const Eigen::VectorXd r = y.segment(b * length(), length());
      list.push_back({x.transpose() * x, x.transpose() * r, r.squaredNorm()});
    }
    return list;
  }
  [[nodiscard]] AddedColumns added() const {
    AddedColumns columns(static_cast<std::size_t>(blocks), X.cols(), Z.cols());
    for (Eigen::Index b = 0; b < blocks; ++b) {
      const Eigen::MatrixXd x = X.middleRows(b * length(), length()), z = Z.middleRows(b * length(), length());
      const auto at = static_cast<std::size_t>(b);
      columns.B[at] = x.transpose() * z;
      columns.C[at] = z.transpose() * z;
      columns.d[at] = z.transpose() * y.segment(b * length(), length());
    }
    return columns;
  }
  /// @param precision  of the beliefs; empty: nothing is believed
  [[nodiscard]] BlockRegression regression(Eigen::VectorXd precision = {}, Eigen::VectorXd away = {}) const {
    if (precision.size() == 0) precision = Eigen::VectorXd::Zero(X.cols());
    if (away.size() == 0) away = Eigen::VectorXd::Zero(X.cols());
    return {base(), precision, away};
  }
  [[nodiscard]] Eigen::MatrixXd both() const {
    Eigen::MatrixXd all(X.rows(), X.cols() + Z.cols());
    all << X, Z;
    return all;
  }
};

Eigen::VectorXd least_squares(const Eigen::MatrixXd& X, const Eigen::VectorXd& y) {
  return X.colPivHouseholderQr().solve(y);
}

/// Columns of noise; y is noise too, white with unit deviation, and what all rows of a block err in alike.
Rows noise(std::mt19937_64& random, Eigen::Index blocks, Eigen::Index base, Eigen::Index added, double alike) {
  std::normal_distribution<double> normal;
  constexpr Eigen::Index kLength = 20;
  const auto draw = [&] { return normal(random); };
  Rows rows{Eigen::MatrixXd::NullaryExpr(blocks * kLength, base, draw),
            Eigen::MatrixXd::NullaryExpr(blocks * kLength, added, draw),
            Eigen::VectorXd::NullaryExpr(blocks * kLength, draw), blocks};
  for (Eigen::Index b = 0; b < blocks; ++b) rows.y.segment(b * kLength, kLength).array() += alike * normal(random);
  return rows;
}

TEST(BlockRegression, AgreesWithOrdinaryLeastSquares) {
  std::mt19937_64 random(test::seed());
  const auto rows = noise(random, 20, 3, 2, 0.5);
  const auto base = rows.regression();
  EXPECT_LT((base.step() - least_squares(rows.X, rows.y)).norm(), 1e-6);
  const Eigen::VectorXd all = least_squares(rows.both(), rows.y);
  EXPECT_LT((base.heldout(rows.added()).estimate - all).norm(), 1e-6);
  const auto scores = base.score(rows.added());
  EXPECT_LT((scores.estimate() - all.tail(2)).norm(), 1e-6);
  EXPECT_LT((scores.u.rowwise().sum() - scores.total).norm(), 1e-6) << "every block has its say";
  const Eigen::VectorXd own =
      (rows.Z - rows.X * least_squares(rows.X, rows.Z.col(0)) * Eigen::RowVector2d(1, 0)).col(0);
  EXPECT_NEAR(scores.independent[0], own.squaredNorm() / rows.Z.col(0).squaredNorm(), 1e-6);
}

TEST(BlockRegression, WhatIsHeldOutIsHeldOut) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 20, 3, 2, 0.5);
  const auto held = rows.regression().heldout(rows.added());
  const auto n = rows.length();
  for (const Eigen::Index block : {Eigen::Index{0}, Eigen::Index{7}, Eigen::Index{19}}) {
    Eigen::MatrixXd X(rows.X.rows() - n, 5);
    Eigen::VectorXd y(rows.X.rows() - n);
    X << rows.both().topRows(block * n), rows.both().bottomRows(rows.X.rows() - (block + 1) * n);
    y << rows.y.head(block * n), rows.y.tail(rows.X.rows() - (block + 1) * n);
    const Eigen::VectorXd without = least_squares(X, y);
    EXPECT_LT((held.replicas.col(block) - without).norm(), 1e-5);
    const Eigen::VectorXd left = (rows.y - rows.both() * without).segment(block * n, n);
    EXPECT_NEAR(held.loss[block], left.squaredNorm(), 1e-4 * left.squaredNorm());
  }
  // Whatever a block says, the fit without it stays.
  rows.y.segment(7 * n, n).array() += 1000.0;
  EXPECT_LT((rows.regression().heldout(rows.added()).replicas.col(7) - held.replicas.col(7)).norm(), 1e-5);
}

TEST(BlockRegression, AColumnThatLivesInOneBlockGainsNothingThere) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 20, 2, 1, 0.0);
  const auto n = rows.length();
  rows.Z.setZero();
  rows.Z.middleRows(4 * n, n).setOnes();
  rows.y.segment(4 * n, n).array() += 5.0;
  const auto held = rows.regression().heldout(rows.added());
  EXPECT_NEAR(held.estimate[2], 5.0, 1.0);
  EXPECT_NEAR(held.replicas(2, 4), 0.0, 1e-3);
  EXPECT_NEAR(held.loss[4], rows.regression().heldout().loss[4], 0.01 * held.loss[4]);
}

TEST(BlockRegression, BeliefsPull) {
  std::mt19937_64 random(test::seed());
  const auto rows = noise(random, 20, 2, 0, 0.0);
  Eigen::VectorXd precision(2), away(2);
  precision << 300.0, 0.0;
  away << 2.0, 7.0;  // the second is not believed to be anything
  const auto base = rows.regression(precision, away);
  // The belief is one more row, of the first parameter as it is after the step.
  Eigen::MatrixXd X(rows.X.rows() + 1, 2);
  Eigen::VectorXd y(rows.X.rows() + 1);
  X << rows.X, std::sqrt(precision[0]), 0.0;
  y << rows.y, -std::sqrt(precision[0]) * away[0];
  const Eigen::VectorXd expected = least_squares(X, y);
  EXPECT_LT((base.step() - expected).norm(), 1e-6);
  EXPECT_LT(base.step()[0], -0.5) << "pulled towards where it is believed to be";
  EXPECT_NEAR(base.heldout().beliefs, precision[0] * std::pow(expected[0] + away[0], 2), 1e-3);
}

/// Pictures shown twice, and blocks that err alike within: only what differs between blocks counts.
TEST(BlockRegression, RowsShownTwiceSharpenNothing) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 20, 2, 2, 2.0);
  rows.X.col(0).setOnes();
  for (Eigen::Index b = 0; b < rows.blocks; ++b) {
    rows.Z.middleRows(b * rows.length(), rows.length()).rowwise() = rows.Z.row(b * rows.length()).eval();
  }
  auto twice = rows;
  twice.X.resize(2 * rows.X.rows(), 2);
  twice.Z.resize(2 * rows.X.rows(), 2);
  twice.y.resize(2 * rows.X.rows());
  for (Eigen::Index r = 0; r < rows.X.rows(); ++r) {
    for (const Eigen::Index copy : {2 * r, 2 * r + 1}) {
      twice.X.row(copy) = rows.X.row(r);
      twice.Z.row(copy) = rows.Z.row(r);
      twice.y[copy] = rows.y[r];
    }
  }
  const auto one = rows.regression(), two = twice.regression();
  const auto a = one.score(rows.added()), b = two.score(twice.added());
  EXPECT_NEAR(a.z(), b.z(), 1e-6);
  EXPECT_LT((a.estimate() - b.estimate()).norm(), 1e-6);
  EXPECT_LT((one.covariance(a) - two.covariance(b)).norm(), 1e-6 * one.covariance(a).norm());
  EXPECT_NEAR(one.covariance()(0, 0), two.covariance()(0, 0), 1e-6);
  // The constant's error is that of 20 blocks, not of 400 rows.
  EXPECT_NEAR(std::sqrt(one.covariance()(0, 0)), 2.0 / std::sqrt(20.0), 0.25);
}

TEST(BlockRegression, NoBlocksAgreeBetterThanWhiteNoise) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 20, 2, 1, 0.0);
  rows.y.setZero();  // by chance
  const auto base = rows.regression();
  const auto scores = base.score(rows.added());
  EXPECT_NEAR(scores.sd[0], std::sqrt(scores.S(0, 0)), 1e-6 * scores.sd[0]);
  const Eigen::Matrix2d least = (rows.X.transpose() * rows.X).inverse();
  EXPECT_NEAR(base.covariance()(0, 0), least(0, 0), 1e-6 * least(0, 0));
  EXPECT_NEAR(base.covariance(scores)(0, 0), 1.0 / scores.S(0, 0), 1e-6);
}

/// What the model lets vary anyway is a finding only where it departs from what is believed of it: so many standard
/// deviations of the belief, however well the log knows it.
/// A few blocks know most, and a base of many columns follows them: what is left of them there says little of how they
/// err.
TEST(BlockRegression, StandardDeviationsHoldWhereFewBlocksKnowMost) {
  constexpr int kLogs = 400;
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  int outside = 0;
  for (int i = 0; i < kLogs; ++i) {
    auto rows = noise(random, 30, 8, 0, 0.0);
    for (Eigen::Index b = 0; b < rows.blocks; ++b) {
      auto own = rows.X.middleRows(b * rows.length(), rows.length());
      own *= std::exp(normal(random));
      rows.y.segment(b * rows.length(), rows.length()) +=
          own * Eigen::VectorXd::NullaryExpr(8, [&] { return 0.3 * normal(random); });
    }
    const auto base = rows.regression();
    const double sd = std::sqrt(base.covariance()(0, 0));
    outside += std::abs(base.step()[0]) > 2.05 * sd;  // of 95 %, Student's with 29 degrees of freedom
  }
  EXPECT_LT(outside, 0.13 * kLogs);
  EXPECT_GT(outside, 0.01 * kLogs) << "nor wider than they need to be";
}

TEST(BlockRegression, AColumnEqualToANuisanceIsJudgedByItsBelief) {
  for (const double departs : {0.5, 6.0}) {
    std::mt19937_64 random(test::seed());
    auto rows = noise(random, 40, 2, 1, 0.0);
    rows.Z.col(0) = rows.X.col(1);
    constexpr double kSd = 3.0;  // a hundred times what the rows leave open
    rows.y += departs * kSd * rows.X.col(1);
    Eigen::VectorXd precision(2);
    precision << 0.0, 1.0 / (kSd * kSd);
    const auto scores = rows.regression(precision).score(rows.added());
    EXPECT_NEAR(std::abs(scores.t()[0]), departs, 0.1) << departs;
  }
}

/// Candidates as they are in a log: free curves and causes that say much the same. Standard deviations of a rate.
struct Rate {
  double share, sd;
};
Rate false_alarms(Eigen::Index blocks, double level, int logs, double alike) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  int alarms = 0;
  for (int i = 0; i < logs; ++i) {
    auto rows = noise(random, blocks, 3, 40, alike);
    for (Eigen::Index c = 1; c < rows.Z.cols(); ++c) {
      // Every fourth is nearly the one before; many live in a part of the log alone.
      if (c % 4 == 0) rows.Z.col(c) = rows.Z.col(c - 1) + 0.1 * rows.Z.col(c);
      if (c % 4 == 1) rows.Z.col(c).head(rows.Z.rows() * (c % 7) / 7).setZero();
    }
    const auto base = rows.regression();
    std::vector<Scores> scores;
    double largest = 0.0;
    for (Eigen::Index c = 0; c < rows.Z.cols(); ++c) {
      auto one = rows;
      one.Z = rows.Z.col(c);
      scores.push_back(base.score(one.added()));
      largest = std::max(largest, scores.back().z());
    }
    alarms += largest > chance_threshold(scores, level, test::seed() + static_cast<std::uint64_t>(i));
  }
  const double n = logs;
  return {alarms / n, std::sqrt(level * (1.0 - level) / n)};
}

TEST(ChanceThreshold, HoldsItsLevelOverCandidatesThatAreAlike) {
  constexpr double kLevel = 0.1;
  const auto many = false_alarms(40, kLevel, 300, 0.0);
  EXPECT_LT(many.share, kLevel + 3.0 * many.sd);
  EXPECT_GT(many.share, 0.3 * kLevel) << "a threshold that nothing reaches holds any level";
  const auto alike = false_alarms(40, kLevel, 300, 0.7);
  EXPECT_LT(alike.share, kLevel + 3.0 * alike.sd) << "what all rows of a block err in alike is no finding";
}

TEST(ChanceThreshold, FewBlocksAreAsHonest) {
  constexpr double kLevel = 0.1;
  for (const Eigen::Index blocks : {Eigen::Index{6}, Eigen::Index{10}}) {
    const auto few = false_alarms(blocks, kLevel, 200, 0.7);
    EXPECT_LT(few.share, kLevel + 3.0 * few.sd) << blocks;
  }
}

TEST(ChanceThreshold, OfNoCandidatesIsZeroAndOfOneThatOfTheNormalDistribution) {
  EXPECT_EQ(chance_threshold({}, 0.01, 1), 0.0);
  std::mt19937_64 random(test::seed());
  const auto rows = noise(random, 40, 2, 1, 0.0);
  const std::vector<Scores> one = {rows.regression().score(rows.added())};
  EXPECT_NEAR(chance_threshold(one, 0.05, 1), 1.96, 0.2);
  EXPECT_EQ(chance_threshold(one, 0.05, 1), chance_threshold(one, 0.05, 1));
}

/// Levels that a thousand draws do not tell: of one candidate the normal distribution's, of several more.
TEST(ChanceThreshold, RareLevelsGoOnWhereDrawsEnd) {
  std::mt19937_64 random(test::seed());
  const auto rows = noise(random, 40, 2, 1, 0.0);
  const std::vector<Scores> one = {rows.regression().score(rows.added())};
  EXPECT_NEAR(chance_threshold(one, 1e-5, 1), 4.417, 0.35);
  const auto many = noise(random, 40, 2, 30, 0.0);
  const std::vector<Scores> several = {many.regression().score(many.added())};
  double before = 0.0;
  for (const double level : {0.1, 0.01, 0.0099, 1e-3, 1e-4}) {
    const double z = chance_threshold(several, level, 1);
    EXPECT_GE(z, before - 1e-3) << level;
    before = z;
  }
  EXPECT_GT(before, chance_threshold(one, 1e-4, 1));
}

TEST(AddedColumns, SomeOfThem) {
  std::mt19937_64 random(test::seed());
  const auto rows = noise(random, 40, 2, 3, 0.0);
  const auto some = rows.added().only({2, 0});
  EXPECT_EQ(some.size(), 2);
  const auto all = rows.regression().score(rows.added()), own = rows.regression().score(some);
  EXPECT_NEAR(own.total[0], all.total[2], 1e-9);
  EXPECT_NEAR(own.S(0, 1), all.S(2, 0), 1e-9);
}

TEST(Scores, AreAsUnlikelyAsANormalVariable) {
  // Two-sided 1 % of Student's t: 4.604 with 4 degrees of freedom, 3.250 with 9, 2.756 with 29; normal: 2.576.
  for (const auto& [t, dof] : {std::pair{4.604, 4.0}, {3.250, 9.0}, {2.756, 29.0}}) {
    Scores scores;
    scores.even_t = Eigen::VectorXd::Constant(1, -t);
    scores.even_dof = Eigen::VectorXd::Constant(1, dof);
    EXPECT_NEAR(scores.z(), 2.576, 0.03) << dof;
  }
}

TEST(Scores, CountTheBlocksThatCarryAColumn) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 40, 2, 1, 0.0);
  EXPECT_NEAR(rows.regression().score(rows.added()).dof[0], 37.0, 3.0);
  rows.Z.bottomRows(35 * rows.length()).setZero();
  EXPECT_NEAR(rows.regression().score(rows.added()).dof[0], 4.0, 1.0);
}

/// Blocks of one column that know it differently well, and each of which errs by what the model gets wrong in its
/// posture.
/// @param value, differ  of the column's coefficient: its mean, and by how much blocks differ about it
Rows uneven(std::mt19937_64& random, double value, double differ) {
  std::normal_distribution<double> normal;
  auto rows = noise(random, 30, 2, 1, 0.0);
  for (Eigen::Index b = 0; b < rows.blocks; ++b) {
    rows.Z.middleRows(b * rows.length(), rows.length()) *= std::exp(1.5 * normal(random));
    if (b == 7) rows.Z.middleRows(b * rows.length(), rows.length()) *= 30.0;  // a fast motion close to the camera
    rows.y.segment(b * rows.length(), rows.length()) +=
        (value + differ * normal(random)) * rows.Z.col(0).segment(b * rows.length(), rows.length());
  }
  return rows;
}

TEST(Scores, ABlockThatKnowsMostIsOneWitnessAndNotAllOfThem) {
  std::mt19937_64 random(test::seed());
  std::vector<double> z, dof;
  for (int i = 0; i < 51; ++i) {
    const auto rows = uneven(random, 1.0, 0.3);
    const auto scores = rows.regression().score(rows.added());
    z.push_back(scores.z());
    dof.push_back(scores.even_dof[0]);
  }
  std::sort(z.begin(), z.end());
  std::sort(dof.begin(), dof.end());
  EXPECT_GT(z[25], 6.0) << "thirty blocks agree";
  EXPECT_GT(z[2], 4.0);
  EXPECT_GT(dof[25], 15.0);
}

TEST(Scores, UnevenBlocksThatDisagreeAreNoFinding) {
  constexpr int kLogs = 1000;
  constexpr double kLevel = 0.01;
  std::mt19937_64 random(test::seed());
  for (const double differ : {0.0, 0.3}) {
    int alarms = 0;
    for (int i = 0; i < kLogs; ++i) {
      const auto rows = uneven(random, 0.0, differ);
      alarms += rows.regression().score(rows.added()).z() > normal_quantile(kLevel / 2.0);
    }
    EXPECT_LT(alarms, kLevel * kLogs + 3.0 * std::sqrt(kLevel * kLogs)) << differ;
  }
}

TEST(Blocks, ThatErrAlikeBesideEachOtherAreSeen) {
  std::mt19937_64 random(test::seed());
  auto rows = noise(random, 200, 2, 20, 0.0);
  const auto base = rows.regression();
  EXPECT_NEAR(neighbours_alike({base.score(rows.added())}), 0.0, 0.08);
  // Half of what a block errs by is what the one before erred by.
  std::normal_distribution<double> normal;
  double slow = 0.0;
  rows.Z.setOnes();
  rows.Z.rightCols(19).setRandom();
  for (Eigen::Index b = 0; b < rows.blocks; ++b) {
    slow = 0.8 * slow + 0.6 * normal(random);
    rows.y.segment(b * rows.length(), rows.length()).setConstant(slow);
  }
  auto constant = rows;
  constant.Z = rows.Z.col(0);
  EXPECT_NEAR(neighbours_alike({constant.regression().score(constant.added())}), 0.8, 0.15);
}

TEST(PairedT, IsTheUsualOne) {
  Eigen::VectorXd a(4), b = Eigen::VectorXd::Zero(4);
  a << 1, 2, 3, 4;
  EXPECT_NEAR(paired_t(a, b), 2.5 / (1.2909944 / 2.0), 1e-6);
  EXPECT_EQ(paired_t(b, b), 0.0);
}

}  // namespace
}  // namespace bodyschema::diagnosis
