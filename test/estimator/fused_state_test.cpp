#include "fused_state.hpp"

#include "outline/own_robot.hpp"

namespace bodyschema {
namespace {

/// Our own robot's offsets, each measured by every frame as it is; a posture a second.
class FusedStateOfOwnRobot : public OwnRobot {
 protected:
  FusedStateOfOwnRobot() {
    for (const auto& target : effect_targets("joint_offset", roles_)) {
      beliefs_.push_back({"joint_offset", target, {radians(5.0)}});
    }
  }
  [[nodiscard]] FusedState state() const {
    const State state(roles_, beliefs_);
    const Eigen::VectorXd sd = state.prior_sd();
    return {state, {state.prior_mean(), sd, std::vector<bool>(beliefs_.size(), true), {}}, {}, kLeast};
  }
  void see(FusedState& known, const Eigen::VectorXd& offsets_rad) {
    constexpr double kSd_rad = 1e-3;
    const auto n = known.x.size();
    const Quadratic frame{Eigen::MatrixXd::Identity(n, n) / (kSd_rad * kSd_rad), offsets_rad / (kSd_rad * kSd_rad)};
    time_s_ += 1.0;
    known.memory.add(time_s_, Eigen::VectorXd::Constant(n, 0.3 * time_s_), frame, known.memory.estimate().x);
    known.x = known.where_it_was();
  }
  static constexpr std::size_t kLeast = 3;
  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  std::vector<Belief> beliefs_;
  double time_s_ = 0.0;
};

TEST_F(FusedStateOfOwnRobot, IsYoungUntilEnoughPosturesWereSeenAndAfterForgetting) {
  FusedState known = state();
  for (std::size_t posture = 0; posture < kLeast; ++posture) {
    EXPECT_TRUE(known.young());
    see(known, paper_offsets_rad());
  }
  EXPECT_FALSE(known.young());
  EXPECT_LT((known.where_it_was() - paper_offsets_rad()).cwiseAbs().maxCoeff(), radians(0.1));
  known.forget();
  EXPECT_TRUE(known.young());
  EXPECT_EQ(known.x, Eigen::VectorXd::Zero(7));
}

/// A log of a cluttered room: a wrist 19 deg off in all of its 26 postures, most of the hand "hidden" in each, and once
/// called converged.
TEST_F(FusedStateOfOwnRobot, AHandThatMostPosturesDoNotShowIsLostAndNotHidden) {
  FusedState known = state();
  for (std::size_t posture = 0; posture < kLeast; ++posture) {
    see(known, paper_offsets_rad());
    EXPECT_FALSE(known.hand_is_lost()) << posture;
    known.hand_was_missed(0.9);
  }
  EXPECT_FALSE(known.young());
  EXPECT_TRUE(known.hand_is_lost());
  EXPECT_TRUE(known.hand_was_never_seen());
  EXPECT_TRUE(known.unsure());
  for (std::size_t posture = 0; posture < kLeast; ++posture) known.hand_was_missed(0.2);
  EXPECT_FALSE(known.hand_is_lost());
  for (std::size_t posture = 0; posture < 2 * kLeast; ++posture) known.hand_was_missed(0.6);
  EXPECT_TRUE(known.hand_is_lost());
  EXPECT_FALSE(known.hand_was_never_seen());
  known.forget();
  EXPECT_FALSE(known.hand_is_lost());
}

/// Thirty postures before the arm was found were held against it until thirty more had shown the hand.
TEST_F(FusedStateOfOwnRobot, AHandThatIsShownAgainIsNoLongerLost) {
  FusedState known = state();
  for (int posture = 0; posture < 30; ++posture) {
    see(known, paper_offsets_rad());
    known.hand_was_missed(0.9);
  }
  for (int posture = 0; posture < 5; ++posture) known.hand_was_missed(0.1);
  EXPECT_TRUE(known.hand_is_lost());  // by chance, perhaps
  for (int posture = 0; posture < 7; ++posture) known.hand_was_missed(0.1);
  EXPECT_FALSE(known.hand_is_lost());
  for (int posture = 0; posture < 7; ++posture) known.hand_was_missed(0.9);
  EXPECT_TRUE(known.hand_is_lost());
}

/// What hides the hand of an arm that is well known costs no knowledge.
TEST_F(FusedStateOfOwnRobot, AHandThatWasSeenLongEnoughMayBeHiddenForAsLong) {
  FusedState known = state();
  for (int posture = 0; posture < 20; ++posture) {
    see(known, paper_offsets_rad());
    known.hand_was_missed(0.1);
  }
  for (int posture = 0; posture < 20; ++posture) {
    known.hand_was_missed(0.9);
    EXPECT_FALSE(known.unsure()) << posture;
  }
}

TEST_F(FusedStateOfOwnRobot, AJointThatStepsUnderItsReadingIsWhereItWasLast) {
  FusedState known = state();
  Eigen::VectorXd reading = Eigen::VectorXd::Zero(7);
  known.read(reading, 0.0);
  for (int posture = 0; posture < 4; ++posture) see(known, paper_offsets_rad());
  known.stalled.stepped(3, radians(4.0), radians(2.0), time_s_);
  known.read(reading, time_s_);
  ASSERT_EQ(known.memory.loose().size(), 1u);
  known.x[3] = radians(2.0);
  EXPECT_EQ(known.where_it_was()[3], radians(2.0)) << "not what postures said of it";
  EXPECT_NEAR(known.where_it_was()[2], paper_offsets_rad()[2], radians(0.1));
  known.in_frame = known.memory.in_posture();
  known.in_frame.x[3] = radians(2.5);
  known.see_loose_joints();
  EXPECT_EQ(known.x[3], radians(2.5));

  // It went on: most encoders that stalled go on as they were. The next frame is about a joint of which all is open.
  known.stalled.stepped(3, radians(4.0), radians(6.5), time_s_);
  reading[3] = radians(10.0);
  known.begin_frame();
  known.read(reading, time_s_ + 0.1);
  EXPECT_TRUE(known.memory.loose().empty());
  EXPECT_NEAR(known.where_it_was()[3], radians(-2.0), 1e-12);
  known.begin_frame();
  EXPECT_NE(known.where_it_was()[3], radians(-2.0));
}

}  // namespace
}  // namespace bodyschema
