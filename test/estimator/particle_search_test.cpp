#include "particle_search.hpp"

#include <cmath>

#include "particles_of_own_robot.hpp"

namespace bodyschema {
namespace {

TEST_F(ParticlesOfOwnRobot, TheNearestComeFirst) {
  particles_->score(frame_, nothing_);
  const auto starts = particles_->nearest(nothing_, 5);
  ASSERT_EQ(starts.size(), 5u);
  for (std::size_t i = 1; i < starts.size(); ++i) EXPECT_GE(distance(starts[i]), distance(starts[i - 1]));
  EXPECT_LT(distance(starts.front()), distance(nothing_));
  EXPECT_EQ(particles_->nearest(nothing_, 1000).size(), options_.filter.particles);
}

TEST_F(ParticlesOfOwnRobot, FirstGuessesStayAsTheyWere) {
  const auto guesses = particles_->nearest_guesses(particles_->score_first_guesses(frame_), 3);
  for (int frame = 0; frame < 3; ++frame) {
    particles_->score(frame_, nothing_);
    EXPECT_GT(particles_->weigh(), 1.0);
    particles_->spread(paper_offsets_rad(), std::nullopt);
  }
  EXPECT_EQ(particles_->nearest_guesses(particles_->score_first_guesses(frame_), 3), guesses);
}

TEST_F(ParticlesOfOwnRobot, AnArmThatIsKnownKeepsParticlesNear) {
  particles_->score(frame_, nothing_);
  particles_->weigh();
  particles_->spread(paper_offsets_rad(), Eigen::VectorXd::Constant(7, radians(0.2)));
  particles_->score(frame_, nothing_);
  for (const auto& x : particles_->nearest(nothing_, 20)) {
    EXPECT_LT((x - paper_offsets_rad()).cwiseAbs().maxCoeff(), radians(1.5));
  }
}

TEST_F(ParticlesOfOwnRobot, TheJointThatSlippedIsFoundAmongSuspectedSlips) {
  Eigen::VectorXd before = paper_offsets_rad();
  before[0] += radians(6.0);
  particles_->score(frame_, before);
  EXPECT_FALSE(particles_->slipped_offset_rad(0));
  particles_->suspect_slips(frame_, before);
  for (Eigen::Index joint = 0; joint < 7; ++joint) {
    ASSERT_TRUE(particles_->slipped_offset_rad(joint));
    EXPECT_GT(std::abs(*particles_->slipped_offset_rad(joint) - before[joint]), radians(0.5)) << joint;
  }
  EXPECT_NEAR(*particles_->slipped_offset_rad(0), paper_offsets_rad()[0], radians(1.0));
  particles_->weigh();
  particles_->spread(before, std::nullopt);
  EXPECT_FALSE(particles_->slipped_offset_rad(0));
}

TEST_F(ParticlesOfOwnRobot, LikelihoodIsLargestAtTheTruthWhateverTheBatch) {
  const Eigen::Index n = static_cast<Eigen::Index>(options_.filter.particles) + 7;
  Eigen::MatrixXd offsets = Eigen::MatrixXd::Zero(7, n);
  for (Eigen::Index i = 0; i < n; ++i) offsets(0, i) = radians(0.05 * static_cast<double>(i));
  offsets.col(n - 2) = paper_offsets_rad();
  const Eigen::VectorXd likelihood = particles_->likelihood(frame_, offsets);
  Eigen::Index best = 0;
  EXPECT_GT(likelihood.maxCoeff(&best), 0.97);
  EXPECT_EQ(best, n - 2);
}

TEST_F(ParticlesOfOwnRobot, PaperEstimateIsOneOfThemAndTheCloudNarrows) {
  options_.mode = EstimatorMode::kPaper;
  const auto best = [&] {
    particles_->score(frame_, nothing_);
    particles_->weigh();
    return particles_->take_best();
  };
  const auto first = best();
  EXPECT_NEAR(first.likelihood, 1.0 - distance(first.offsets_rad), 1e-12);
  EXPECT_FALSE(first.narrowest);
  bool narrowest = false;
  for (int frame = 0; frame < 20; ++frame) narrowest = best().narrowest;
  EXPECT_TRUE(narrowest);
}

}  // namespace
}  // namespace bodyschema
