#include "keyframes.hpp"

#include "outlines_of_own_robot.hpp"

namespace bodyschema {
namespace {

class KeyframesOfOwnRobot : public OutlinesOfOwnRobot {
 protected:
  /// Remembers a posture as if it had been linearised a degree from where it was.
  void remember(const Frame& frame, bool shown) {
    const auto says = fitter_.about(frame, truth_);
    ASSERT_TRUE(says);
    const auto block =
        memory_.add(frame.time_s, posture(frame), *says, truth_ + Eigen::VectorXd::Constant(7, radians(1.0)));
    ASSERT_TRUE(block);
    keyframes_.keep(frame, *block, memory_, shown);
  }

  Keyframes keyframes_;
};

TEST_F(KeyframesOfOwnRobot, AreLookedAtAgainWhereTheEstimateHasMovedOn) {
  for (const double s : {0.1, 0.5, 0.9}) {
    const Frame frame = at(s);
    remember(frame, false);
  }
  ASSERT_TRUE(memory_.most_stale());
  for (int frame = 0; frame < 20 && memory_.most_stale(); ++frame) keyframes_.look_again(memory_, fitter_);
  EXPECT_FALSE(memory_.most_stale());
  EXPECT_LT((memory_.estimate().x - truth_).cwiseAbs().maxCoeff(), radians(0.5));
}

TEST_F(KeyframesOfOwnRobot, StayAsTheyWereOnceTheyAreForgotten) {
  remember(at(0.5), false);
  ASSERT_TRUE(memory_.most_stale());
  const Eigen::VectorXd before = memory_.estimate().x;
  keyframes_.forget();
  keyframes_.look_again(memory_, fitter_);
  EXPECT_EQ(memory_.estimate().x, before);
}

/// A posture whose outline is not found again is in nobody's way.
TEST_F(KeyframesOfOwnRobot, OneThatCannotBeLookedAtHoldsUpNoOther) {
  for (const double s : {0.1, 0.5, 0.9}) {
    const Frame frame = at(s);
    remember(frame, false);
  }
  const auto first = memory_.most_stale()->block;
  Frame empty = at(0.5);
  for (auto& seen : seen_.cameras) seen->valid = BinaryMask(seen->mask.width(), seen->mask.height());  // no pixel
  keyframes_.keep(empty, first, memory_, false);
  for (int frame = 0; frame < 20; ++frame) keyframes_.look_again(memory_, fitter_);
  ASSERT_TRUE(memory_.most_stale());
  EXPECT_EQ(memory_.most_stale()->block, first);
  EXPECT_FALSE(memory_.most_stale(std::vector{first}));
}

/// Their pictures are gone: whether an outline of which masks have too little is believed, is as the pictures said.
TEST_F(KeyframesOfOwnRobot, RememberWhetherPicturesShowedWhatMasksLack) {
  for (const bool shown : {false, true}) {
    memory_.forget_all();
    keyframes_.forget();
    Frame frame = at(0.5);
    remember(frame, shown);
    for (auto& seen : seen_.cameras) {  // what masks say is a strip
      seen->valid = BinaryMask(seen->mask.width(), seen->mask.height());
      for (int v = 0; v < seen->mask.height(); ++v) {
        for (int u = 0; u < seen->mask.width(); ++u) seen->valid.set(u, v, v < 60);
      }
    }
    keyframes_.keep(frame, memory_.blocks().front(), memory_, shown);
    const auto before = memory_.most_stale();
    ASSERT_TRUE(before);
    keyframes_.look_again(memory_, fitter_);
    const auto after = memory_.most_stale();
    EXPECT_EQ(after && after->x == before->x, !shown);
  }
}

}  // namespace
}  // namespace bodyschema
