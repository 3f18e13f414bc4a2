#include "bodyschema/diagnosis/selection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bodyschema/core/error.hpp"
#include "diagnosis/regression_blocks.hpp"
#include "diagnosis/trial_robot.hpp"

namespace bodyschema {
namespace {

constexpr Eigen::Index kRows = 400;

Candidate candidate(const std::string& name, Eigen::Index column) {
  Candidate c;
  c.name = name;
  c.columns = {{column}};
  c.parameters = {0};
  return c;
}

/// An offset, a nuisance, and a cause of nearly the same shape, which is the true one.
struct Swapped {
  Eigen::MatrixXd X{kRows, 3};
  Eigen::VectorXd y{kRows};
  explicit Swapped(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (Eigen::Index i = 0; i < kRows; ++i) {
      const double cause = normal(random);
      X.row(i) << 1.0, cause + 0.06 * normal(random), cause;
      y[i] = 1.0 + 0.8 * cause + 0.5 * normal(random);
    }
  }
};

TEST(Selection, ACauseThatIsListedInPlaceOfAnotherHasItsOwnFigures) {
  const Columns always = {{0}};
  std::vector<Candidate> candidates = {candidate("nuisance", 1), candidate("cause", 2)};
  candidates[0].nuisance = true;
  int listed = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    const Swapped data(test::seed() + i);
    const auto statistics = test::statistics_of(data.X, data.y, 20);
    const auto found = select_causes(statistics, always, candidates);
    ASSERT_EQ(found.causes.size(), 1u);
    if (found.causes[0].candidate != 1 || found.model != std::vector<std::size_t>{0}) continue;
    ++listed;
    // In the place of the nuisance: against the offset alone.
    const auto without = statistics.fit(always), with = statistics.fit({{0}, {2}});
    const auto& score = found.causes[0].score;
    EXPECT_NEAR(score.t, paired_t(without.heldout_loss, with.heldout_loss), 1e-6);
    EXPECT_NEAR(score.gain, 1.0 - with.heldout() / without.heldout(), 1e-9);
    EXPECT_LE(score.z, std::abs(with.estimate[1]) / std::sqrt(with.covariance(1, 1)) + 1e-6);
  }
  EXPECT_GE(listed, 5);
}

TEST(Selection, AsksForMoreWhereEveryPostureIsPassedOnce) {
  const std::vector<Candidate> candidates = {candidate("cause", 2)};
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  // A cause that takes away a tenth of the loss, and one that takes away half.
  for (const auto& [size, found_in_one_pass] : {std::pair{0.35, false}, std::pair{1.0, true}}) {
    Eigen::MatrixXd X(kRows, 3);
    Eigen::VectorXd y(kRows);
    for (Eigen::Index i = 0; i < kRows; ++i) {
      X.row(i) << 1.0, 0.0, i % 2 == 0 ? 1.0 : -1.0;
      y[i] = 1.0 + size * X(i, 2) + normal(random);
    }
    const auto statistics = test::statistics_of(X, y, 20);
    SelectionOptions usual;
    usual.crowd_rest_t = 1e9;  // a single candidate is no crowd
    auto one_pass = usual;
    one_pass.one_pass = true;
    EXPECT_EQ(select_causes(statistics, {{0}}, candidates, usual).causes.size(), 1u) << size;
    EXPECT_EQ(select_causes(statistics, {{0}}, candidates, one_pass).causes.size(), found_in_one_pass ? 1u : 0u) << size;
  }
}

TEST(Selection, RefusesWhatCannotBeFitted) {
  const Swapped data(test::seed());
  const std::vector<Candidate> candidates = {candidate("cause", 2)};
  const auto refused = [](const char* why) {
    return testing::ThrowsMessage<DataError>(testing::AllOf(testing::HasSubstr(why), testing::HasSubstr("; record")));
  };
  // One block, as of an arm that never moves; and offsets that are one and the same.
  EXPECT_THAT([&] { select_causes(test::statistics_of(data.X, data.y, 1), {{0}, {1}}, candidates); }, refused("stands still"));
  EXPECT_THAT([&] { select_causes(test::statistics_of(data.X, data.y, 20), {{0}, {1}, {1}}, candidates); },
              refused("too little"));
}

}  // namespace
}  // namespace bodyschema
