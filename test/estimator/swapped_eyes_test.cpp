#include "swapped_eyes.hpp"

#include <utility>

#include "outlines_of_own_robot.hpp"

namespace bodyschema {
namespace {

class EyesOfOwnRobot : public OutlinesOfOwnRobot {
 protected:
  EyesOfOwnRobot() : eyes_(*scorer_, fitter_, *particles_, options_.min_mask_share) {}
  /// The pictures come under each other's names.
  Frame exchanged(double s) {
    at(s);
    std::swap(seen_.cameras[0]->mask, seen_.cameras[1]->mask);
    std::swap(seen_.cameras[0]->valid, seen_.cameras[1]->valid);
    std::swap(seen_.cameras[0]->coverage, seen_.cameras[1]->coverage);
    Frame frame = model_->take(seen_, truth_);
    scorer_->observe(frame, options_.min_mask_share);
    return frame;
  }
  /// Asks frame after frame until it is known.
  std::optional<bool> ask(const Frame& frame) {
    std::optional<bool> answer;
    for (int i = 0; i < 20 && (i == 0 || eyes_.searching()); ++i) {
      fitter_.begin_frame();
      answer = eyes_.from_the_start(frame, memory_);
    }
    return answer;
  }

  SwappedEyes eyes_;
};

TEST_F(EyesOfOwnRobot, AreSeenToBeExchangedWhereTheArmIsKnown) {
  EXPECT_FALSE(eyes_.turned(at(0.5), truth_));
  EXPECT_TRUE(eyes_.turned(exchanged(0.5), truth_));
}

TEST_F(EyesOfOwnRobot, AreNotExchangedBecauseTheArmIsElsewhere) {
  const Eigen::VectorXd elsewhere = truth_ + Eigen::VectorXd::Constant(7, radians(8.0));
  EXPECT_FALSE(eyes_.turned(at(0.5), elsewhere));
}

TEST_F(EyesOfOwnRobot, AreFoundOutFromTheStart) {
  const Frame wrong = exchanged(0.5);
  EXPECT_EQ(ask(wrong), true);
}

TEST_F(EyesOfOwnRobot, AreFoundToBeRightFromTheStart) {
  const Frame right = at(0.5);
  EXPECT_EQ(ask(right), false);
}

TEST_F(EyesOfOwnRobot, LeaveTheScorerWithTheFrameThatWasAsked) {
  const Frame frame = at(0.5);
  const double before = distance(truth_);
  eyes_.turned(frame, truth_);
  EXPECT_EQ(distance(truth_), before);
  ask(frame);
  EXPECT_EQ(distance(truth_), before);
}

}  // namespace
}  // namespace bodyschema
