#include "bodyschema/evidence/posture_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bodyschema/evidence/shape_error.hpp"
#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr double kFarApart_rad = 0.3;

/// A memory of two numbers, no angles of joints unless said, that frames measure directly.
class MemoryOfTwo : public testing::Test {
 protected:
  explicit MemoryOfTwo(bool joints = false, std::vector<double> considered = {}) {
    layout_.prior_mean = Eigen::Vector2d::Zero();
    layout_.prior_sd = Eigen::Vector2d(1.0, 2.0);
    layout_.is_joint = {joints, joints};
    layout_.considered_root =
        Eigen::Map<Eigen::VectorXd>(considered.data(), static_cast<Eigen::Index>(considered.size())).asDiagonal();
  }
  [[nodiscard]] PostureMemory memory() const { return {layout_, options_}; }
  /// A frame that measures `direction`'(x, considered) = value with a standard deviation.
  static Quadratic measures(const Eigen::VectorXd& direction, double value, double sd) {
    return {direction * direction.transpose() / (sd * sd), direction * value / (sd * sd)};
  }
  static Quadratic both(const Eigen::VectorXd& one, double a, const Eigen::VectorXd& other, double b, double sd) {
    Quadratic q = measures(one, a, sd);
    q.add(measures(other, b, sd));
    return q;
  }
  /// Another posture, a second later.
  std::optional<std::uint64_t> next(PostureMemory& memory, const Quadratic& frame) {
    q_ += Eigen::Vector2d::Constant(kFarApart_rad);
    return memory.add(time_s_ += 1.0, q_, frame, memory.estimate().x);
  }
  /// One more frame of the posture that it stands in.
  std::optional<std::uint64_t> again(PostureMemory& memory, const Quadratic& frame) {
    return memory.add(time_s_ += 1.0, q_, frame, memory.estimate().x);
  }

  MemoryLayout layout_;
  MemoryOptions options_;
  Eigen::VectorXd q_ = Eigen::VectorXd::Zero(2);
  double time_s_ = 0.0;
  const Eigen::VectorXd first_ = Eigen::Vector2d(1.0, 0.0), second_ = Eigen::Vector2d(0.0, 1.0);
  const Eigen::VectorXd sum_ = Eigen::Vector2d(1.0, 1.0), difference_ = Eigen::Vector2d(1.0, -1.0);
};

TEST_F(MemoryOfTwo, BeforeAnyFrameAndAfterForgettingItIsWhatWasBelieved) {
  layout_.prior_mean = Eigen::Vector2d(0.1, -0.2);
  auto memory = this->memory();
  const auto is_prior = [&] {
    EXPECT_TRUE(memory.empty());
    EXPECT_EQ(memory.postures(), 0u);
    EXPECT_TRUE(memory.estimate().x.isApprox(layout_.prior_mean, 1e-12));
    EXPECT_NEAR(memory.estimate().covariance(0, 0), 1.0, 1e-12);
    EXPECT_NEAR(memory.estimate().covariance(1, 1), 4.0, 1e-12);
  };
  is_prior();
  EXPECT_TRUE(next(memory, measures(first_, 0.5, 0.01)));
  EXPECT_LT(memory.estimate().covariance(0, 0), 1e-3);
  EXPECT_NEAR(memory.beliefs().estimate().covariance(0, 0), 1.0, 1e-12);
  memory.forget_all();
  is_prior();
}

// A camera said to be known to 1 mm that sits 10 mm off: half of it went into offsets, sure of themselves.
TEST_F(MemoryOfTwo, ABeliefThatPicturesContradictOutrightGivesWay) {
  layout_.effect = {0, 0};
  const auto off = [&](double truth) {
    auto memory = this->memory();
    for (int posture = 0; posture < 3; ++posture) next(memory, measures(first_, truth, std::sqrt(1.5) * 0.7));
    return memory;
  };
  for (const double truth : {-10.0, 6.0, 20.0}) {
    SCOPED_TRACE(truth);
    const auto memory = off(truth);
    const auto& known = memory.estimate();
    EXPECT_NEAR(known.x[0], truth, 2.0 * std::sqrt(known.own(0, 0)));
    EXPECT_GT(memory.widening()[0], 2.0);
    EXPECT_DOUBLE_EQ(memory.widening()[0], memory.widening()[1]) << "one description: wrong in one, not trusted in all";
    EXPECT_NEAR(known.own(1, 1), std::pow(2.0 * memory.widening()[1], 2), 1e-6) << "of which pictures say nothing";
    EXPECT_NEAR(shape_covariance(memory, 0.1)(1, 1), known.own(1, 1), 1e-6) << "nor do shapes that err";
  }
  // What may be as believed is believed.
  for (const double truth : {0.0, 1.0, -1.4}) {
    SCOPED_TRACE(truth);
    const auto memory = off(truth);
    EXPECT_LT(memory.widening()[0], 1.05);
    EXPECT_NEAR(memory.estimate().x[0], truth * 2.0 / (2.0 + 0.49), 0.02);
  }
}

// One posture may be fitted to some other outline: photographs of an arm were, and what was believed gave way to that.
// A focal length 7.5 % wrong that was said to be known to 0.2 %: pictures that tell it to 1 % moved it by 1.4 of its
// standard deviations, and a hand 94 mm off was said to be known to 12 mm.
TEST_F(MemoryOfTwo, WhatPicturesHardlyTellMayContradictItsBeliefAllTheSame) {
  auto memory = this->memory();
  next(memory, measures(first_, 30.0, 5.0));
  EXPECT_LT(memory.estimate().x(0), 1.5 * layout_.prior_sd(0));
  EXPECT_NEAR(memory.belief_innovation()(0), 30.0 / std::hypot(5.0, 1.0), 1e-9);
  EXPECT_EQ(memory.belief_innovation()(1), 0.0) << "no picture tells it";
}

TEST_F(MemoryOfTwo, WhatIsAsBelievedContradictsNothing) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  constexpr int kTrials = 4000;
  double square = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    auto memory = this->memory();
    const Eigen::Vector2d truth = layout_.prior_sd.cwiseProduct(Eigen::Vector2d(normal(random), normal(random)));
    for (const auto& direction : {first_, sum_, difference_}) {
      const double sd = direction == first_ ? 3.0 : 1.0;
      next(memory, measures(direction, direction.dot(truth) + sd * normal(random), sd));
    }
    square += memory.belief_innovation().squaredNorm();
  }
  EXPECT_NEAR(square / (2.0 * kTrials), 1.0, 0.1);
}

TEST_F(MemoryOfTwo, BeliefsDoNotGiveWayToOneOrTwoPostures) {
  layout_.effect = {0, 0};
  auto memory = this->memory();
  for (int posture = 1; posture <= 3; ++posture) {
    next(memory, measures(first_, 10.0, 0.7));
    EXPECT_EQ(memory.widening()[0] > 1.0, posture > 2) << posture;
  }
}

TEST_F(MemoryOfTwo, OtherEffectsAndOffsetsStayAsBelieved) {
  for (const std::vector<Eigen::Index>& effect : {std::vector<Eigen::Index>{0, 1}, {0, -1}, {-1, 0}, {}}) {
    layout_.effect = effect;
    auto memory = this->memory();
    for (int posture = 0; posture < 3; ++posture) next(memory, both(first_, 8.0, second_, 1.0, 1.2));
    EXPECT_LT(memory.widening()[1], 1.05);
    EXPECT_EQ(memory.widening()[0] > 1.5, !effect.empty() && effect[0] == 0);
    memory.forget_all();
    EXPECT_DOUBLE_EQ(memory.widening()[0], 1.0);
    EXPECT_NEAR(memory.estimate().covariance(0, 0), 1.0, 1e-12);
  }
}

TEST_F(MemoryOfTwo, DirectionsThatOnePostureCannotTellAreToldByAnother) {
  auto memory = this->memory();
  const Eigen::Vector2d truth(0.5, -0.4);
  next(memory, measures(sum_, sum_.dot(truth), 1e-3));
  EXPECT_GT(memory.estimate().covariance(0, 0), 0.4) << "only the sum is known";
  next(memory, measures(difference_, difference_.dot(truth), 1e-3));
  EXPECT_LT((memory.estimate().x - truth).norm(), 1e-3);
  EXPECT_LT(memory.estimate().covariance(0, 0), 1e-5);
  EXPECT_EQ(memory.postures(), 2u);
}

/// What the model gets wrong in a posture it gets wrong in all of its pictures.
TEST_F(MemoryOfTwo, MorePicturesOfOnePostureNeverShrinkADeviation) {
  auto memory = this->memory();
  next(memory, both(first_, 0.5, second_, 0.1, 0.1));
  const auto once = memory.estimate();
  for (int i = 0; i < 1000; ++i) {
    EXPECT_FALSE(again(memory, both(first_, 0.5, second_, 0.1, 0.1)));
    ASSERT_GE(memory.estimate().covariance(0, 0), once.covariance(0, 0) * (1.0 - 1e-12));
    ASSERT_GE(memory.estimate().covariance(1, 1), once.covariance(1, 1) * (1.0 - 1e-12));
  }
  EXPECT_EQ(memory.postures(), 1u);
  // To and fro between two postures: each takes the place of what it said before.
  next(memory, both(first_, 0.5, second_, 0.1, 0.1));
  const auto two = memory.estimate();
  const Eigen::VectorXd there = q_, here = there - Eigen::Vector2d::Constant(kFarApart_rad);
  for (int i = 0; i < 50; ++i) {
    q_ = i % 2 == 0 ? here : there;
    again(memory, both(first_, 0.5, second_, 0.1, 0.1));
    EXPECT_EQ(memory.postures(), 2u);
    EXPECT_GE(memory.estimate().covariance(0, 0), two.covariance(0, 0) * 0.999);
  }
}

TEST_F(MemoryOfTwo, AQuarterOfASecondOfMotionIsOnePosture) {
  auto memory = this->memory();
  for (int frame = 0; frame < 30; ++frame) {  // a second at 30 Hz, 10 deg a frame
    q_ += Eigen::Vector2d::Constant(0.17);
    memory.add(frame / 30.0, q_, measures(first_, 0.5, 0.1), memory.estimate().x);
  }
  EXPECT_EQ(memory.postures(), 4u);
}

TEST_F(MemoryOfTwo, DistinctPosturesShrinkItByTheRootOfTheirNumber) {
  options_.memory_s = 1e9;
  auto memory = this->memory();
  for (int i = 0; i < 25; ++i) next(memory, measures(first_, 0.5, 0.05));
  EXPECT_NEAR(std::sqrt(memory.estimate().own(0, 0)), 0.05 / 5.0, 2e-4);
}

TEST_F(MemoryOfTwo, OldPosturesFade) {
  options_.memory_s = 10.0;
  layout_.prior_sd.setConstant(1e3);
  auto memory = this->memory();
  next(memory, measures(first_, 1.0, 0.1));
  time_s_ += 10.0 * std::log(4.0) - 1.0;  // so that a quarter of it is left
  next(memory, measures(first_, 2.0, 0.1));
  EXPECT_NEAR(memory.estimate().x(0), (0.25 * 1.0 + 2.0) / 1.25, 1e-5);
}

/// The oldest are summed up beyond `most_blocks`; what they told stays.
TEST_F(MemoryOfTwo, WhatIsSummedUpIsNotLost) {
  options_.memory_s = 1e9;
  auto whole = memory();
  options_.most_blocks = 4;
  auto few = memory();
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.1);
  for (int i = 0; i < 20; ++i) {
    const Quadratic frame = both(first_, 0.5 + noise(random), sum_, 0.3 + noise(random), 0.1);
    next(whole, frame);
    again(few, frame);
  }
  EXPECT_EQ(few.blocks().size(), 4u);
  EXPECT_EQ(few.postures(), 20u);
  EXPECT_LT((few.estimate().x - whole.estimate().x).norm(), 1e-6);
  EXPECT_LT((few.estimate().covariance - whole.estimate().covariance).norm(), 1e-6);
}

/// The chi-square of a frame that is as believed has the mean of its degrees of freedom.
TEST_F(MemoryOfTwo, InnovationsAreDistributedAsIsClaimed) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  double nis = 0.0, dof = 0.0;
  for (int trial = 0; trial < 2000; ++trial) {
    auto memory = this->memory();
    const Eigen::Vector2d truth(normal(random), 2.0 * normal(random));
    const auto frame = [&] {
      return both(first_, truth(0) + 0.1 * normal(random), sum_, truth.sum() + 0.1 * normal(random), 0.1);
    };
    next(memory, frame());
    const Innovation innovation = memory.innovation(frame());
    nis += innovation.nis;
    dof += innovation.dof;
  }
  EXPECT_EQ(dof, 2.0 * 2000);
  EXPECT_NEAR(nis / dof, 1.0, 0.07);
}

TEST_F(MemoryOfTwo, AnInnovationIsOfWhatTheFrameTellsAlone) {
  auto memory = this->memory();
  next(memory, both(first_, 0.0, second_, 0.0, 0.01));
  EXPECT_EQ(memory.innovation(measures(first_, 0.0, 0.01)).dof, 1.0);
  EXPECT_EQ(memory.innovation(measures(first_, 0.0, 100.0)).dof, 0.0) << "a frame that says nothing";
  // Two standard deviations of the difference of the two.
  EXPECT_NEAR(memory.innovation(measures(first_, 0.02 * std::sqrt(2.0), 0.01)).nis, 4.0, 0.01);
}

TEST_F(MemoryOfTwo, AStepIsFoundAndWhatIsLeftAgrees) {
  auto memory = this->memory();
  for (int i = 0; i < 5; ++i) next(memory, both(first_, 0.3, second_, -0.2, 0.01));
  const Quadratic slipped = both(first_, 0.8, second_, -0.2, 0.01);
  EXPECT_GT(memory.innovation(slipped).nis, 1000.0);
  const std::vector<Eigen::Index> the_first = {0}, the_second = {1};
  const auto step = memory.step(slipped, the_first);
  EXPECT_NEAR(step.size(0), 0.5, 1e-3);
  EXPECT_LT(step.left.nis, 1.0);
  EXPECT_EQ(step.left.dof, 1.0);
  EXPECT_GT(memory.step(slipped, the_second).left.nis, 1000.0) << "another one did not slip";
}

TEST_F(MemoryOfTwo, TheGainOfOneStepIsDistributedAsIsClaimedAndShowsOne) {
  std::mt19937 random(31);
  std::normal_distribution<double> noise(0.0, 0.05);
  auto memory = this->memory();
  for (int i = 0; i < 10; ++i) next(memory, both(sum_, 0.3 + noise(random), difference_, 0.1 + noise(random), 0.05));
  const std::vector<Eigen::Index> each = {0, 1};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  constexpr int kFrames = 4000;
  for (int i = 0; i < kFrames; ++i) {
    // What is known is drawn anew as well.
    auto known = this->memory();
    for (int k = 0; k < 2; ++k) {
      next(known, both(sum_, 0.3 + noise(random), difference_, 0.1 + noise(random), 0.05));
    }
    mean += known.agreement(both(sum_, 0.3 + noise(random), difference_, 0.1 + noise(random), 0.05), each).step_gain /
            kFrames;
  }
  // Chi-square with one degree of freedom; less by what beliefs, which are true to zero here, make of it.
  EXPECT_NEAR(mean[0], 1.0, 0.1);
  EXPECT_NEAR(mean[1], 1.0, 0.1);

  const Eigen::VectorXd gains = memory.agreement(both(sum_, 0.8, difference_, 0.6, 0.05), each).step_gain;
  EXPECT_GT(gains[0], 40.0) << "the first stepped by 0.5";
  EXPECT_LT(gains[1], 0.5 * gains[0]);
}

TEST_F(MemoryOfTwo, WhatIsReleasedIsAsBeforeAnyPictureAndTheRestStays) {
  auto memory = this->memory();
  // The first is known by itself, the second by the sum with it.
  for (int i = 0; i < 5; ++i) next(memory, both(first_, 0.3, sum_, 0.1, 0.01));
  const std::vector<Eigen::Index> the_second = {1};
  memory.release(the_second, time_s_ + 0.5);
  EXPECT_NEAR(memory.estimate().x(0), 0.3, 1e-3);
  EXPECT_LT(memory.estimate().covariance(0, 0), 1e-4);
  EXPECT_NEAR(memory.estimate().covariance(1, 1), 4.0, 1e-3);
  EXPECT_EQ(memory.postures(), 5u);
  // It is learned anew.
  next(memory, both(first_, 0.3, sum_, 1.3, 0.01));
  EXPECT_NEAR(memory.estimate().x(1), 1.0, 0.03);
  EXPECT_NEAR(memory.estimate().x(0), 0.3, 0.01);
}

TEST_F(MemoryOfTwo, WhatCameAfterTheChangeIsKept) {
  auto memory = this->memory();
  for (int i = 0; i < 3; ++i) next(memory, both(first_, 0.3, second_, 0.1, 0.01));
  const double changed_s = time_s_ + 0.5;
  next(memory, both(first_, 0.8, second_, 0.1, 0.01));
  const std::vector<Eigen::Index> the_first = {0};
  memory.release(the_first, changed_s);
  EXPECT_NEAR(memory.estimate().x(0), 0.8, 1e-3);
  EXPECT_NEAR(memory.estimate().covariance(0, 0), 1e-4, 2e-5) << "of one posture";
  EXPECT_LT(memory.estimate().covariance(1, 1), 5e-5) << "of four";
}

/// Quadratics of one posture about different places claim what no picture tells.
TEST_F(MemoryOfTwo, AStaleBlockIsNamedAndLinearisedAnew) {
  auto memory = this->memory();
  const Eigen::VectorXd start = Eigen::Vector2d(-0.9, 0.0);
  const auto block = memory.add(time_s_ += 1.0, q_, measures(first_, 0.6, 0.5), start);
  ASSERT_TRUE(block);
  EXPECT_EQ(memory.blocks(), std::vector{*block});
  for (int looks = 0; memory.most_stale(); ++looks) {
    ASSERT_LT(looks, 20);
    const auto stale = *memory.most_stale();
    EXPECT_EQ(stale.block, *block);
    memory.relinearise(stale.block, measures(first_, 0.2, 0.01), stale.x);
  }
  EXPECT_NEAR(memory.estimate().x(0), 0.2, 1e-3) << "what it says where it was linearised last";
}

/// The same numbers as angles of joints.
class MemoryOfTwoJoints : public MemoryOfTwo {
 protected:
  MemoryOfTwoJoints() : MemoryOfTwo(true) { layout_.prior_sd.setConstant(0.1); }
};

/// However sharp the pictures of one posture are: what it gets wrong they do not show.
TEST_F(MemoryOfTwoJoints, OnePostureIsNoBetterKnownThanPosturesAre) {
  options_.posture_sd_rad = 0.002;
  auto memory = this->memory();
  next(memory, measures(first_, 0.05, 1e-6));
  EXPECT_NEAR(std::sqrt(memory.estimate().covariance(0, 0)), 0.002, 1e-4);
  // This frame's own state is what its picture says.
  const auto frame = memory.in_posture(measures(first_, 0.052, 1e-6));
  EXPECT_NEAR(frame.x(0), 0.052, 1e-5);
  EXPECT_LT(frame.covariance(0, 0), 1e-9);
  EXPECT_NEAR(memory.in_posture().covariance(0, 0), memory.estimate().covariance(0, 0) + 4e-6, 1e-7);
}

TEST_F(MemoryOfTwoJoints, WhatPosturesDisagreeAboutIsLearned) {
  std::mt19937 random(9);
  for (const double sd : {0.0003, 0.006}) {
    auto memory = this->memory();
    std::normal_distribution<double> error(0.0, sd);
    for (int i = 0; i < 60; ++i) {
      next(memory, both(first_, 0.02 + error(random), second_, -0.01 + error(random), 1e-4));
    }
    const double least = std::max(sd, options_.encoder_sd_rad);
    EXPECT_NEAR(memory.posture_sd_rad(), least, 0.3 * least) << sd;
    EXPECT_NEAR(std::sqrt(memory.estimate().covariance(0, 0)), least / std::sqrt(60.0), 0.3 * least / std::sqrt(60.0));
    EXPECT_LT(std::abs(memory.estimate().x(0) - 0.02), 4.0 * std::sqrt(memory.estimate().covariance(0, 0)));
  }
}

// A neck that swayed by 1.5 px unseen made every joint of the arm a little less sure, and itself not enough.
TEST_F(MemoryOfTwoJoints, AHeadThatSwaysSaysNothingOfTheArm) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  layout_.is_head = {false, true};
  constexpr double kArm = 0.001, kHead = 0.006;
  auto memory = this->memory();
  for (int i = 0; i < 80; ++i) next(memory, both(first_, kArm * normal(random), second_, kHead * normal(random), 1e-4));
  EXPECT_NEAR(memory.posture_sd_rad(), kArm, 0.4 * kArm);
  EXPECT_NEAR(memory.head_posture_sd_rad(), kHead, 0.4 * kHead);
  const auto frame = memory.in_posture();
  EXPECT_GT(frame.covariance(1, 1), 9.0 * frame.covariance(0, 0));
}

/// While an encoder says nothing its joint is wherever a picture shows it: the other joint is told by what does not
/// depend on that, and neither is led astray.
TEST_F(MemoryOfTwoJoints, ALooseJointIsFoundAnewInEveryPosture) {
  auto memory = this->memory();
  for (int i = 0; i < 6; ++i) next(memory, both(sum_, 0.03, difference_, -0.01, 0.002));
  const Eigen::Vector2d truth(0.01, 0.02);
  ASSERT_NEAR((memory.estimate().x - truth).norm(), 0.0, 2e-3);
  const double sd = std::sqrt(memory.estimate().covariance(1, 1));

  memory.loosen(std::vector<Eigen::Index>{0});
  for (int i = 1; i <= 20; ++i) {
    const double moved = 0.02 * i;
    const auto frame = measures(sum_, 0.03 + moved, 0.002);
    EXPECT_LT(memory.innovation(frame).nis, 9.0) << "that the loose joint moves surprises nobody";
    EXPECT_NEAR(memory.in_posture(frame).x[0], 0.01 + moved, 0.01 + 0.001 * i);
    next(memory, frame);
  }
  EXPECT_NEAR((memory.estimate().x - truth).norm(), 0.0, 2e-3);
  EXPECT_GT(std::sqrt(memory.estimate().covariance(1, 1)), 0.9 * sd) << "these frames tell nothing of the other joint";

  memory.loosen({});
  EXPECT_GT(memory.innovation(measures(sum_, 0.13, 0.002)).nis, 25.0);
}

TEST_F(MemoryOfTwoJoints, PicturesThatAreDoubtedInRetrospectLeadNothingAstray) {
  auto memory = this->memory();
  for (int i = 0; i < 6; ++i) next(memory, both(sum_, 0.03, difference_, -0.01, 0.002));
  const double moving_s = time_s_ + 0.5;
  for (int i = 1; i <= 6; ++i) next(memory, measures(sum_, 0.03 + 0.004 * i, 0.002));
  const auto astray = memory.estimate().x;
  EXPECT_GT(std::abs(astray[1] - 0.02), 2e-3);

  auto doubted = memory;
  doubted.loosen_since(0, moving_s);
  EXPECT_NEAR(doubted.estimate().x[1], 0.02, 1e-3);
  doubted.tighten_since(0, moving_s);
  EXPECT_NEAR((doubted.estimate().x - astray).norm(), 0.0, 1e-12) << "believed again";
}

TEST_F(MemoryOfTwoJoints, ALooseJointIsLinearisedWhereItWas) {
  auto memory = this->memory();
  for (int i = 0; i < 3; ++i) next(memory, both(first_, 0.0, second_, 0.0, 0.001));
  memory.loosen(std::vector<Eigen::Index>{0});
  q_ += Eigen::Vector2d::Constant(kFarApart_rad);
  memory.add(time_s_ += 1.0, q_, both(first_, 0.4, second_, 0.0, 0.001), Eigen::Vector2d(0.4, 0.0));
  EXPECT_FALSE(memory.most_stale());
}

TEST_F(MemoryOfTwoJoints, DispersionTellsPosturesThatDisagreeFromThoseThatDoNot) {
  std::mt19937 random(10);
  const auto dispersion = [&](double sd) {
    auto memory = this->memory();
    std::normal_distribution<double> error(0.0, sd);
    for (int i = 0; i < 12; ++i) next(memory, both(first_, error(random), second_, error(random), 1e-4));
    return memory.dispersion();
  };
  double usual = 0.0;
  for (int i = 0; i < 20; ++i) usual += dispersion(options_.posture_sd_rad) / 20.0;
  EXPECT_NEAR(usual, 1.0, 0.4);
  EXPECT_GT(dispersion(20.0 * options_.posture_sd_rad), 4.0);
}

/// A third number that is not estimated but may be wrong all the same.
class MemoryWithTolerance : public MemoryOfTwo {
 protected:
  MemoryWithTolerance() : MemoryOfTwo(false, {0.05}) {}
  static Eigen::VectorXd with(double a, double b, double tolerance) { return Eigen::Vector3d(a, b, tolerance); }
};

/// It errs alike in all postures: no number of them makes it smaller.
TEST_F(MemoryWithTolerance, WhatIsConsideredDoesNotAverageOut) {
  auto memory = this->memory();
  for (int i = 0; i < 200; ++i) next(memory, measures(with(1.0, 0.0, 1.0), 0.3, 0.01));
  EXPECT_LT(std::sqrt(memory.estimate().own(0, 0)), 0.001);
  EXPECT_NEAR(std::sqrt(memory.estimate().covariance(0, 0)), 0.05, 1e-3);
  EXPECT_NEAR(memory.estimate().sensitivity(0, 0), -1.0, 1e-3);
  // Nor does it make a frame disagree that errs as the memory does.
  EXPECT_NEAR(memory.innovation(measures(with(1.0, 0.0, 1.0), 0.31, 0.01)).nis, 1.0, 0.05);
}

TEST_F(MemoryWithTolerance, WhatIsConsideredContradictsNoBelief) {
  layout_.prior_sd(0) = 1e-3;
  auto memory = this->memory();
  for (int i = 0; i < 20; ++i) next(memory, measures(with(1.0, 0.0, 1.0), 0.05, 0.01));
  EXPECT_GT(memory.estimate().x(0) / layout_.prior_sd(0), 5.0);
  EXPECT_NEAR(memory.belief_innovation()(0), 1.0, 0.05) << "as far off as the tolerance is";
}

/// Errors over many robots, each with a tolerance of its own, lie within what is claimed and are not far inside.
TEST_F(MemoryWithTolerance, ErrorsAreContainedWhateverTheToleranceWas) {
  std::mt19937 random(21);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  double nees = 0.0, own_nees = 0.0, innovation = 0.0, dof = 0.0;
  constexpr int kRobots = 600;
  for (int robot = 0; robot < kRobots; ++robot) {
    auto memory = this->memory();
    const Eigen::Vector3d truth(normal(random), 2.0 * normal(random), 0.05 * normal(random));
    for (int i = 0; i < 12; ++i) {
      const Eigen::VectorXd direction = with(uniform(random), uniform(random), 1.0 + uniform(random));
      const Quadratic frame = measures(direction, direction.dot(truth) + 0.01 * normal(random), 0.01);
      if (i > 2) {
        const auto agreement = memory.innovation(frame);
        innovation += agreement.nis;
        dof += agreement.dof;
      }
      next(memory, frame);
    }
    const Eigen::Vector2d error = memory.estimate().x - truth.head<2>();
    nees += error.dot(memory.estimate().covariance.inverse() * error);
    own_nees += error.dot(memory.estimate().own.inverse() * error);
  }
  EXPECT_NEAR(nees / (2.0 * kRobots), 1.0, 0.15);
  EXPECT_GT(own_nees / (2.0 * kRobots), 4.0) << "without the tolerance it would be claimed too well known";
  EXPECT_NEAR(innovation / dof, 1.0, 0.15);
}

/// What is considered may be asked about as if it had been estimated.
TEST_F(MemoryWithTolerance, PicturesTellOfIt) {
  std::mt19937 random(22);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const Eigen::Vector3d truth(0.4, -0.3, 0.11);
  options_.memory_s = 1e12;  // nothing fades
  auto memory = this->memory();
  Quadratic all = Quadratic::zero(3);
  all.A(0, 0) = 1.0 / std::pow(layout_.prior_sd[0], 2);
  all.A(1, 1) = 1.0 / std::pow(layout_.prior_sd[1], 2);
  for (int i = 0; i < 12; ++i) {
    const Eigen::VectorXd direction = with(uniform(random), uniform(random), uniform(random));
    const Quadratic frame = measures(direction, direction.dot(truth), 0.01);
    all.add(frame);
    next(memory, frame);
  }
  const Quadratic told = memory.of_considered();
  const Eigen::Matrix3d covariance = all.A.inverse();
  EXPECT_NEAR(1.0 / told.A(0, 0), covariance(2, 2) / (0.05 * 0.05), 1e-9);
  EXPECT_NEAR(told.b[0] / told.A(0, 0), (covariance * all.b)[2] / 0.05, 1e-6);
}

TEST_F(MemoryWithTolerance, AFramesOwnStateCarriesItThrough) {
  auto memory = this->memory();
  for (int i = 0; i < 50; ++i) next(memory, measures(with(1.0, 0.0, 1.0), 0.3, 0.01));
  const auto frame = memory.in_posture(measures(with(1.0, 0.0, 1.0), 0.3, 0.001));
  EXPECT_NEAR(std::sqrt(frame.covariance(0, 0)), 0.05, 2e-3) << "memory and frame err alike";
}

}  // namespace
}  // namespace bodyschema
