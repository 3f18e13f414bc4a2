#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "bodyschema/filter/hammoude.hpp"
#include "bodyschema/filter/kernel_density.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "bodyschema/filter/resampling.hpp"

namespace bodyschema {
namespace {

constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180.0;

TEST(Hammoude, Equation3WorkedByHand) {
  // Regions of 60 and 50 px that share 40: union 70, d = 30/70.
  EXPECT_DOUBLE_EQ(hammoude_distance(70, 40), 30.0 / 70.0);
  EXPECT_DOUBLE_EQ(hammoude_likelihood(hammoude_distance(70, 40)), 40.0 / 70.0);
  EXPECT_DOUBLE_EQ(hammoude_distance(10, 0), 1.0);
  EXPECT_DOUBLE_EQ(hammoude_distance(10, 10), 0.0);
}

TEST(Hammoude, StereoConcatenatesImages) {
  // Left 30/20 px, right 50/10 px of union and intersection: (80 - 30) / 80, not the mean of ratios.
  EXPECT_DOUBLE_EQ(hammoude_distance(30 + 50, 20 + 10), 50.0 / 80.0);
}

TEST(KernelDensity, Equation7LiteralNormalisation) {
  // sd 1 deg: 1/sqrt(2 pi) whatever the dimension; sd 2 deg, 7 joints: |Sigma| = 2^14.
  EXPECT_NEAR(kernel(0.0, 1.0, 7), 0.3989422804014327, 1e-15);
  EXPECT_NEAR(kernel(0.0, 2.0, 7), 0.3989422804014327 / 128.0, 1e-15);
  EXPECT_NEAR(kernel(2.0, 1.0, 7), 0.3989422804014327 * std::exp(-1.0), 1e-15);
}

TEST(KernelDensity, Equation6WorkedByHand) {
  // Three particles of one joint at 0, 1 and 3 degrees.
  Eigen::MatrixXd states(1, 3);
  states << 0.0, 1.0 * kRadiansPerDegree, 3.0 * kRadiansPerDegree;
  const Eigen::Vector3d likelihood(0.5, 0.8, 0.2);
  Eigen::VectorXd kde(3);
  kernel_density(states, likelihood, 1.0, kde);
  const double k0 = 0.3989422804014327;
  const double k1 = k0 * std::exp(-0.5);
  const double k2 = k0 * std::exp(-2.0);
  const double k3 = k0 * std::exp(-4.5);
  EXPECT_NEAR(kde(0), (0.5 * k0 + 0.8 * k1 + 0.2 * k3) / 3.0, 1e-14);
  EXPECT_NEAR(kde(1), (0.5 * k1 + 0.8 * k0 + 0.2 * k2) / 3.0, 1e-14);
  EXPECT_NEAR(kde(2), (0.5 * k3 + 0.8 * k2 + 0.2 * k0) / 3.0, 1e-14);
  // Equation 5: W = L + alpha KDE. Particle 1 has the densest neighbourhood.
  EXPECT_EQ(densest_particle(likelihood, kde, 500.0), 1);
  // Without smoothing the likelihood alone decides.
  EXPECT_EQ(densest_particle(Eigen::Vector3d(0.1, 0.2, 0.9), kde, 0.0), 2);
}

TEST(SystematicResampling, WorkedByHand) {
  // Cumulative 0.1 0.6 0.7 1.0; positions 0.125 0.375 0.625 0.875.
  const std::array<double, 4> weights = {0.1, 0.5, 0.1, 0.3};
  std::array<std::size_t, 4> ancestors{};
  systematic_resampling(weights, 0.5, ancestors);
  EXPECT_EQ(ancestors, (std::array<std::size_t, 4>{1, 1, 2, 3}));
}

TEST(SystematicResampling, TakesFloorOrCeilOfTheShareAndAlwaysWeightsAboveOneOverN) {
  const auto seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> weights(50);
  double total = 0.0;
  for (auto& weight : weights) total += weight = std::pow(uniform(random), 4.0);
  std::vector<std::size_t> ancestors(80);
  systematic_resampling(weights, uniform(random), ancestors);
  std::vector<int> taken(weights.size(), 0);
  for (const auto ancestor : ancestors) ++taken[ancestor];
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const double share = 80.0 * weights[i] / total;
    EXPECT_GE(taken[i], static_cast<int>(std::floor(share - 1e-9)));
    EXPECT_LE(taken[i], static_cast<int>(std::ceil(share + 1e-9)));
  }
}

TEST(EffectiveSampleSize, WorkedByHand) {
  EXPECT_DOUBLE_EQ(effective_sample_size(std::array<double, 4>{1, 1, 1, 1}), 4.0);
  EXPECT_DOUBLE_EQ(effective_sample_size(std::array<double, 2>{3, 1}), 16.0 / 10.0);
  EXPECT_DOUBLE_EQ(effective_sample_size(std::array<double, 2>{0, 0}), 0.0);
}

TEST(ParticleFilter, SpreadShrinksTwentyPerCentAFrameDownToItsLimit) {
  ParticleFilter filter(7, {});
  double expected_deg = 3.0;
  for (int frame = 0; frame < 40; ++frame) {
    EXPECT_NEAR(filter.spread_rad() / kRadiansPerDegree, expected_deg, 1e-4);
    filter.update(Eigen::VectorXd::Ones(200));
    filter.resample_and_spread();
    expected_deg = std::max(0.8 * expected_deg, 0.10);
  }
  EXPECT_NEAR(filter.spread_rad() / kRadiansPerDegree, 0.10, 1e-5);
}

TEST(ParticleFilter, InitialCloudHasTheStatedSpread) {
  ParticleFilterOptions options;
  options.particles = 20000;
  ParticleFilter filter(7, options);
  const Eigen::MatrixXd covariance = filter.covariance();
  for (int k = 0; k < 7; ++k) {
    EXPECT_NEAR(std::sqrt(covariance(k, k)) / kRadiansPerDegree, 5.0, 0.1);
    EXPECT_NEAR(filter.mean()(k) / kRadiansPerDegree, 0.0, 0.15);
  }
}

TEST(ParticleFilter, SameSeedSameCloud) {
  ParticleFilterOptions options;
  options.seed = 42;
  ParticleFilter a(7, options);
  ParticleFilter b(7, options);
  for (int frame = 0; frame < 3; ++frame) {
    for (auto* filter : {&a, &b}) {
      filter->update(filter->states().colwise().squaredNorm().transpose());
      filter->resample_and_spread();
    }
  }
  EXPECT_TRUE(a.states() == b.states());
  options.seed = 43;
  EXPECT_FALSE(a.states() == ParticleFilter(7, options).states());
}

TEST(ParticleFilter, FindsThePeakOfASharpLikelihood) {
  ParticleFilterOptions options;
  options.particles = 500;
  ParticleFilter filter(2, options);
  const Eigen::Vector2d truth(4.0 * kRadiansPerDegree, -3.0 * kRadiansPerDegree);
  for (int frame = 0; frame < 40; ++frame) {
    Eigen::VectorXd likelihood(500);
    for (Eigen::Index i = 0; i < 500; ++i) {
      const double r = (filter.states().col(i) - truth).norm() / kRadiansPerDegree;
      likelihood(i) = std::exp(-0.5 * r * r / 0.25);
    }
    filter.update(likelihood);
    if (frame < 39) filter.resample_and_spread();
  }
  EXPECT_LT((filter.estimate() - truth).norm() / kRadiansPerDegree, 0.3);
}

}  // namespace
}  // namespace bodyschema
