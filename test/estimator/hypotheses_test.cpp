#include "hypotheses.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "particles_of_own_robot.hpp"

namespace bodyschema {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// A frame that contradicts what is known, where not said otherwise.
class HypothesesAboutOwnRobot : public ParticlesOfOwnRobot {
 protected:
  HypothesesAboutOwnRobot() : known_(state(), layout(), {}, 3) {
    fit_.x = known_.x;
    fit_.quadratic = shows(known_.x);
    outcome_.verdict = FrameVerdict::kDoubtful;
    outcome_.near = true;
    particles_->score(frame_, known_.x);
  }
  [[nodiscard]] const State& state() const { return model_->state(); }
  [[nodiscard]] MemoryLayout layout() const {
    const auto sd = state().prior_sd();
    return {state().prior_mean(), sd, std::vector<bool>(static_cast<std::size_t>(sd.size()), true), {}};
  }
  static Quadratic shows(const Eigen::VectorXd& x) {
    constexpr double kPrecision = 1e6;
    return {kPrecision * Eigen::MatrixXd::Identity(x.size(), x.size()), kPrecision * x};
  }
  void see_postures(int count) {
    for (int i = 0; i < count; ++i) {
      known_.memory.add(i, Eigen::VectorXd::Constant(7, 0.3 * i), shows(known_.x), known_.x);
    }
  }
  [[nodiscard]] std::vector<Hypothesis> all() {
    return hypotheses(known_, state(), fit_, outcome_, frame_, *particles_);
  }

  FusedState known_;
  OutlineFit fit_;
  FrameOutcome outcome_;
};

TEST_F(HypothesesAboutOwnRobot, OfAYoungMemoryItIsAskedOnlyWhetherTheArmIsElsewhere) {
  see_postures(2);
  const auto list = all();
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].released.size(), 7u);
  EXPECT_TRUE(list[0].by_silhouette);
  EXPECT_EQ(list[0].starts.size(), 6u) << "the particles' best, and the first guesses'";
  outcome_.verdict = FrameVerdict::kAgrees;
  EXPECT_EQ(all()[0].starts.size(), 3u);
}

TEST_F(HypothesesAboutOwnRobot, EveryJointMayHaveSlippedAndTheOutlineSaysHowFar) {
  see_postures(4);
  Eigen::VectorXd slipped = known_.x;
  slipped[2] += radians(3.0);
  fit_.quadratic = shows(slipped);
  const auto list = all();
  ASSERT_EQ(list.size(), 8u) << "no camera's place is estimated";
  for (Eigen::Index joint = 0; joint < 7; ++joint) {
    const auto& slip = list[static_cast<std::size_t>(joint)];
    EXPECT_THAT(slip.released, ElementsAre(joint));
    ASSERT_EQ(slip.starts.size(), 1u);
    EXPECT_NEAR(slip.starts[0][joint], joint == 2 ? slipped[2] : 0.0, radians(0.3));
  }
  EXPECT_FALSE(list.back().by_silhouette);
}

TEST_F(HypothesesAboutOwnRobot, WhereNoOutlineIsNearSilhouettesSayHowFarAJointSlipped) {
  see_postures(4);
  particles_->suspect_slips(frame_, known_.x);
  const auto near = all();
  outcome_.near = false;
  const auto far = all();
  EXPECT_NEAR(near[0].starts[0][0], 0.0, radians(0.1));
  EXPECT_EQ(far[0].starts[0][0], *particles_->slipped_offset_rad(0));
}

TEST_F(HypothesesAboutOwnRobot, TheMemoryThatWasReplacedMayHoldAfterAllForAWhile) {
  known_.alternative = known_.memory;
  known_.alternative_s = frame_.time_s - 1.0;
  see_postures(1);
  const auto list = all();
  ASSERT_EQ(list.size(), 2u);
  EXPECT_EQ(list[0].instead, &*known_.alternative);
  EXPECT_THAT(list[0].starts, IsEmpty());
  EXPECT_EQ(list[0].known_instead, 7u);
  known_.alternative_s = frame_.time_s - 60.0;
  EXPECT_EQ(all().size(), 1u);
}

}  // namespace
}  // namespace bodyschema
