#include "section_spread.hpp"

#include <gtest/gtest.h>

#include <random>

namespace bodyschema {
namespace {

constexpr int kSections = 5;

/// A mean of sections, each section's own value of deviation `spread`, left out in turn.
std::vector<Eigen::VectorXd> left_out(std::mt19937& random, double spread) {
  std::normal_distribution<double> value(0.0, spread);
  Eigen::VectorXd sections(kSections);
  for (auto& section : sections) section = value(random);
  std::vector<Eigen::VectorXd> without;
  for (const double section : sections) {
    without.push_back(Eigen::VectorXd::Constant(1, (sections.sum() - section) / (kSections - 1)));
  }
  return without;
}

/// Of the mean of all sections, where each has a deviation of 1.
const Eigen::VectorXd kClaimed = Eigen::VectorXd::Constant(1, 1.0 / std::sqrt(static_cast<double>(kSections)));

TEST(SectionSpread, WhatScattersAsIsClaimedIsHardlyEverWidened) {
  std::mt19937 random(17);
  int widened = 0;
  constexpr int kTrials = 5000;
  for (int i = 0; i < kTrials; ++i) widened += section_spread(left_out(random, 1.0), kClaimed)[0] > 1.0;
  EXPECT_NEAR(widened, 0.01 * kTrials, 25);
}

TEST(SectionSpread, WhatScattersByMoreIsWidenedByThat) {
  std::mt19937 random(18);
  double square = 0.0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    const double factor = section_spread(left_out(random, 6.0), kClaimed)[0];
    square += factor * factor / kTrials;
  }
  EXPECT_NEAR(std::sqrt(square), 6.0, 0.3);
}

TEST(SectionSpread, TwoSectionsSayNothing) {
  const std::vector<Eigen::VectorXd> without(2, Eigen::VectorXd::Constant(1, 100.0));
  EXPECT_EQ(section_spread(without, kClaimed)[0], 1.0);
}

TEST(SectionSpread, EachParameterForItself) {
  std::vector<Eigen::VectorXd> without;
  for (int i = 0; i < kSections; ++i) without.push_back(Eigen::Vector2d(i % 2 == 0 ? 3.0 : -3.0, 0.01 * i));
  const Eigen::VectorXd factor = section_spread(without, Eigen::Vector2d(0.1, 0.1));
  EXPECT_GT(factor[0], 10.0);
  EXPECT_EQ(factor[1], 1.0);
}

/// Sections that are told apart by several parameters at once: `kTold` of them, each with its own values.
constexpr int kTold = 5;
const std::vector<Eigen::Index> kAllTold = {0, 1, 2, 3, 4};
constexpr double kClaimCountsAs = 8.0;  // directions

std::vector<Eigen::VectorXd> left_out_of_all(std::mt19937& random, double spread) {
  std::vector<Eigen::VectorXd> without(kSections, Eigen::VectorXd::Zero(kTold));
  for (Eigen::Index k = 0; k < kTold; ++k) {
    const auto own = left_out(random, spread);
    for (std::size_t i = 0; i < without.size(); ++i) without[i][k] = own[i][0];
  }
  return without;
}

/// Twice what is claimed: one parameter alone is rarely convicted of that by five sections, five together are.
TEST(SectionSpread, ParametersThatAreToldAreLookedAtTogether) {
  std::mt19937 random(19);
  const Eigen::VectorXd claimed = kClaimed.replicate(kTold, 1);
  double alone = 0.0, together = 0.0, healthy = 0.0;
  constexpr int kTrials = 1000;
  for (int i = 0; i < kTrials; ++i) {
    const auto without = left_out_of_all(random, 2.0);
    alone += section_spread(without, claimed)[0] > 1.0 ? 1.0 / kTrials : 0.0;
    together += section_spread(without, claimed, kAllTold, kClaimCountsAs)[0] > 1.3 ? 1.0 / kTrials : 0.0;
    healthy += section_spread(left_out_of_all(random, 1.0), claimed, kAllTold, kClaimCountsAs)[0] / kTrials;
  }
  EXPECT_LT(alone, 0.6);
  EXPECT_GT(together, 0.9);
  EXPECT_LT(healthy, 1.1) << "what scatters as is claimed costs next to nothing";
}

}  // namespace
}  // namespace bodyschema
