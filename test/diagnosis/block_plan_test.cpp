#include "block_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema::diagnosis {
namespace {

/// Rests in which seven quantities shake with slow noise of this time constant beside white noise.
std::vector<StillStretch> rests(std::uint64_t seed, double time_s, double white_share, int count = 16,
                                Eigen::Index samples = 150) {
  constexpr double kStep_s = 0.1;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double decay = time_s > 0.0 ? std::exp(-kStep_s / time_s) : 0.0;
  std::vector<StillStretch> list;
  for (int stretch = 0; stretch < count; ++stretch) {
    StillStretch rest{Eigen::MatrixXd(7, samples), kStep_s};
    for (Eigen::Index row = 0; row < 7; ++row) {
      double slow = normal(random);
      for (Eigen::Index i = 0; i < samples; ++i) {
        slow = decay * slow + std::sqrt(1.0 - decay * decay) * normal(random);
        rest.samples(row, i) = std::sqrt(1.0 - white_share) * slow + std::sqrt(white_share) * normal(random);
      }
    }
    list.push_back(std::move(rest));
  }
  return list;
}

/// Mean over four draws, so that a fresh seed each run says the same.
double measured_s(double time_s, double white_share) {
  constexpr int kDraws = 4;
  double sum = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    sum += noise_correlation_s(rests(test::seed() + static_cast<std::uint64_t>(i), time_s, white_share));
  }
  return sum / kDraws;
}

TEST(NoiseCorrelation, IsTheIntegralOfTheAutocorrelation) {
  // Single draws gave 0.29 to 0.36 s and 0.75 to 1.18 s with 60 seeds.
  for (const double time_s : {0.3, 1.0}) {
    const double measured = measured_s(time_s, 0.0);
    EXPECT_GT(measured, 0.7 * time_s) << time_s;
    EXPECT_LT(measured, 1.3 * time_s + 0.05) << time_s;
  }
}

TEST(NoiseCorrelation, OfWhiteNoiseLengthensNoBlock) {
  // Of 60 seeds most gave 0.05 s, half a sample; a twentieth above 0.27 s, one 0.31 s: a hundredth of
  // slow noise cannot be told from none. Blocks of 2 s are lengthened from 0.4 s on.
  constexpr double kShortestBlock_s = 2.0;
  std::vector<double> measured;
  for (std::uint64_t i = 0; i < 15; ++i) measured.push_back(noise_correlation_s(rests(test::seed() + i, 0.0, 1.0)));
  std::sort(measured.begin(), measured.end());
  EXPECT_LT(measured[measured.size() / 2], 0.15);
  EXPECT_LT(5.0 * measured[measured.size() - 2], kShortestBlock_s);
  EXPECT_EQ(noise_correlation_s({}), 0.0);
}

TEST(NoiseCorrelation, CountsTheSlowShareOnly) {
  EXPECT_LT(measured_s(1.0, 0.5), 0.8 * measured_s(1.0, 0.0));
}

/// At once its covariance would take 26 GB.
TEST(NoiseCorrelation, TakesAnHourOfRestInPieces) {
  const double measured = noise_correlation_s(rests(test::seed(), 1.0, 0.0, 1, 36'000));
  EXPECT_GT(measured, 0.7);
  EXPECT_LT(measured, 1.3);
}

/// A log with fingers that shake by a degree.
class Shaking final : public MeasurementSource {
 public:
  Shaking(MeasurementSource& source, std::uint64_t seed)
      : source_(source), views_(source.views().begin(), source.views().end()) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> shake(0.0, 0.02);
    for (auto& view : views_) {
      for (const auto finger : source.roles().fingers) view.joints.q[finger] += shake(random);
    }
  }
  [[nodiscard]] const JointRoles& roles() const override { return source_.roles(); }
  [[nodiscard]] std::span<const ViewInput> views() const override { return views_; }
  [[nodiscard]] std::span<const JointSample> stream() const override { return source_.stream(); }
  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    source_.instant(view, offsets, out);
  }
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    source_.compress(corrections, out);
  }
  Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& corrections) override {
    return source_.hand_jacobian(view, corrections);
  }

 private:
  MeasurementSource& source_;
  std::vector<ViewInput> views_;
};

/// The Hall sensors of an iCub's fingers shake by more than an arm at rest does.
TEST(BlockPlan, ShakingFingersDoNotHideARest) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  std::vector<CompressedView> views;
  log->compress(
      std::vector<Corrections>(log->views().size(), Corrections(static_cast<Eigen::Index>(log->roles().names.size()))),
      views);
  const auto plan = plan_blocks(Shaking(*log, test::seed()), views, 2.0);
  EXPECT_NEAR(plan.still_share, 1.0 / 6.0, 0.08);
  EXPECT_GT(plan.correlation_s, 0.0);
}

TEST(BlockPlan, ARestIsOneBlockThatWeighsAsOne) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  std::vector<CompressedView> views;
  log->compress(
      std::vector<Corrections>(log->views().size(), Corrections(static_cast<Eigen::Index>(log->roles().names.size()))),
      views);
  const auto plan = plan_blocks(*log, views, 2.0);
  ASSERT_EQ(plan.block_of_view.size(), log->views().size());
  EXPECT_GE(plan.length_s, 2.0);
  EXPECT_GT(plan.correlation_s, 0.0);
  EXPECT_GE(plan.block_count(), 10u);
  EXPECT_NEAR(plan.still_share, 1.0 / 6.0, 0.08);  // the synthetic log rests a sixth of its time
  std::vector<double> weight(plan.block_count(), 0.0);
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (v > 0) {
      EXPECT_GE(plan.block_of_view[v], plan.block_of_view[v - 1]);
    }
    weight[plan.block_of_view[v]] += plan.weight_of_view[v];
  }
  // Without weights the rest's block would hold five times as much as another.
  const double typical = static_cast<double>(views.size()) * plan.length_s / 60.0;
  for (const double w : weight) EXPECT_LT(w, 2.2 * typical);
}

}  // namespace
}  // namespace bodyschema::diagnosis
