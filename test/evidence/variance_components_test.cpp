#include "bodyschema/evidence/variance_components.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr Eigen::Index kEach = 15;

/// Two components and, last, a parameter of neither; seen through mixtures, more or less well.
class Components : public ::testing::Test {
 protected:
  const std::vector<VarianceComponent> components_ = {range(0), range(kEach)};

  static VarianceComponent range(Eigen::Index first) {
    VarianceComponent list;
    for (Eigen::Index k = 0; k < kEach; ++k) list.push_back(first + k);
    return list;
  }
  Eigen::MatrixXd normal(Eigen::Index rows, Eigen::Index columns) {
    std::normal_distribution<double> value;
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return value(random_); });
  }
  /// @param first, second  standard deviations of the two components
  Quadratic seen(double first, double second) {
    const Eigen::Index n = 2 * kEach + 1;
    Eigen::VectorXd x = normal(n, 1);
    x.head(kEach) *= first;
    x.segment(kEach, kEach) *= second;
    // Some directions are told to a tenth, others hardly at all.
    const Eigen::VectorXd precision = Eigen::VectorXd::LinSpaced(n, 10.0, 0.1);
    const Eigen::MatrixXd turned = Eigen::HouseholderQR<Eigen::MatrixXd>(normal(n, n)).householderQ();
    const Eigen::MatrixXd J = precision.asDiagonal() * turned;
    return {J.transpose() * J, J.transpose() * (J * x + normal(n, 1))};
  }

  std::mt19937_64 random_{test::seed() + 28};
};

TEST_F(Components, AreTheSizeThatTheyHaveEachByItself) {
  double first = 0.0, second = 0.0;
  constexpr int kLogs = 60;
  for (int log = 0; log < kLogs; ++log) {
    const auto measured = measure_components(seen(4.0, 1.0), components_);
    EXPECT_GT(measured.log_odds, 5.0);
    first += measured.sd[0] * measured.sd[0] / kLogs;
    second += measured.sd[1] * measured.sd[1] / kLogs;
  }
  EXPECT_NEAR(std::sqrt(first), 4.2, 0.5);
  EXPECT_NEAR(std::sqrt(second), 1.1, 0.25);
}

TEST_F(Components, ThatAreZeroAreNearItAndHaveTheOddsAgainstThem) {
  int for_them = 0;
  double square = 0.0;
  constexpr int kLogs = 200;
  for (int log = 0; log < kLogs; ++log) {
    const auto measured = measure_components(seen(0.0, 0.0), components_);
    for_them += measured.log_odds > std::log(3.0);
    square += measured.sd.squaredNorm() / (2 * kLogs);
  }
  EXPECT_LE(for_them, 6);
  EXPECT_LT(std::sqrt(square), 0.4) << "as well as the pictures tell it";
}

TEST_F(Components, OfWhichNothingIsSeenAreWhatIsBelieved) {
  const Eigen::Index n = 2 * kEach + 1;
  const auto measured = measure_components(Quadratic::zero(n), components_);
  EXPECT_NEAR(measured.log_odds, 0.0, 1e-9);
  EXPECT_GT(measured.sd.minCoeff(), 1.0) << "a half Cauchy distribution rules out nothing";
}

TEST_F(Components, AreNotBlamedForWhatIsBelievedBesides) {
  // One number is seen, of a parameter of no component and one of the first: far off, as the former may well be.
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(2 * kEach + 1);
  direction[0] = 0.1;
  direction[2 * kEach] = 1.0;
  const auto measured =
      measure_components({1e4 * direction * direction.transpose(), 1e4 * 1.5 * direction}, components_);
  EXPECT_LT(measured.log_odds, std::log(2.0));
}

/// Exponentials of it overflow.
TEST_F(Components, MayBeAsFarFromZeroAsTheyLike) {
  const auto measured = measure_components(seen(40.0, 40.0), components_);
  EXPECT_GT(measured.log_odds, 1000.0);
  EXPECT_NEAR(measured.sd[0], 40.0, 25.0);
}

TEST_F(Components, OfNoRobotAreNone) {
  const auto measured = measure_components(Quadratic::zero(3), {});
  EXPECT_EQ(measured.sd.size(), 0);
  EXPECT_EQ(measured.log_odds, 0.0);
}

}  // namespace
}  // namespace bodyschema
