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

}  // namespace
}  // namespace bodyschema
