#include "offset_memory.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace bodyschema {
namespace {

using Verdict = OffsetMemory::Verdict;

constexpr double kVariance_px2 = 0.25;
constexpr double kAgreeing = 3.0, kDoubtful = 150.0, kContradicting = 1000.0;  // pulls

/// A memory of one number that frames say is something.
class OffsetMemoryOfOneNumber : public ::testing::Test {
 protected:
  static ContourEvidence saying(double value) {
    ContourEvidence evidence;
    evidence.A = Eigen::MatrixXd::Constant(1, 1, 100.0);
    evidence.b = evidence.A * Eigen::VectorXd::Constant(1, value);
    return evidence;
  }
  void begin(double value) { memory_.begin(saying(value), kZero, kVariance_px2); }
  void learn(double value, int frames) {
    for (int i = 0; i < frames; ++i) {
      ASSERT_EQ(memory_.judge(kAgreeing, true), Verdict::kAgrees);
      memory_.learn(saying(value), kZero, kVariance_px2, kAgreeing);
    }
  }
  [[nodiscard]] double mean() const { return memory_.fusion().mean()(0); }

  static inline const Eigen::VectorXd kZero = Eigen::VectorXd::Zero(1);
  OffsetMemory memory_{OffsetFusion(Eigen::VectorXd::Constant(1, 10.0), kZero), 300.0, 6.0};
};

TEST_F(OffsetMemoryOfOneNumber, GrowsUpFrameByFrame) {
  EXPECT_TRUE(memory_.empty());
  begin(2.0);
  EXPECT_FALSE(memory_.empty());
  learn(2.0, 2);
  EXPECT_TRUE(memory_.young());
  learn(2.0, 1);
  EXPECT_FALSE(memory_.young());
  EXPECT_FALSE(memory_.settled());
  learn(2.0, 1);
  EXPECT_TRUE(memory_.settled());
  EXPECT_FALSE(memory_.doubted());
  EXPECT_NEAR(mean(), 2.0, 1e-3);
}

TEST_F(OffsetMemoryOfOneNumber, FramesThatPullMakeItFadeFaster) {
  begin(2.0);
  OffsetMemory pulled = memory_;
  memory_.learn(saying(2.0), kZero, kVariance_px2, 5.0);
  pulled.learn(saying(2.0), kZero, kVariance_px2, 60.0);
  EXPECT_DOUBLE_EQ(memory_.fusion().frames(), 1.0 + std::exp(-1.0 / 300.0));
  EXPECT_DOUBLE_EQ(pulled.fusion().frames(), 1.0 + std::exp(-3.0 / 300.0));
}

TEST_F(OffsetMemoryOfOneNumber, AFrameThatDoesNotFitContradictsHoweverLittleItPulls) {
  begin(2.0);
  EXPECT_EQ(memory_.judge(kAgreeing, false), Verdict::kContradicts);
  EXPECT_EQ(memory_.judge(kAgreeing, true), Verdict::kAgrees);
  EXPECT_EQ(memory_.judge(kDoubtful, true), Verdict::kDoubtful);
  EXPECT_TRUE(memory_.doubted());
}

TEST_F(OffsetMemoryOfOneNumber, WithoutAnotherStateItIsGivenUpWithTheSixthContradiction) {
  begin(2.0);
  learn(2.0, 9);
  for (int frame = 1; frame <= 6; ++frame) {
    EXPECT_EQ(memory_.judge(kContradicting, true), Verdict::kContradicts);
    EXPECT_EQ(memory_.contradict(false, true), frame == 6) << frame;
    EXPECT_TRUE(memory_.surprised());
    EXPECT_EQ(memory_.doubted(), frame < 6);
  }
  EXPECT_TRUE(memory_.empty());
}

TEST_F(OffsetMemoryOfOneNumber, WhatAContradictionCostComesBackWithAFrameThatAgrees) {
  begin(2.0);
  learn(2.0, 9);
  const double known = mean();
  memory_.judge(kContradicting, true);
  EXPECT_TRUE(memory_.contradict(true, true));
  begin(5.0);
  ASSERT_NE(memory_.shelved(), nullptr);
  memory_.reconsider(kContradicting, true);
  memory_.reconsider(kAgreeing, false);
  EXPECT_NEAR(mean(), 5.0, 1e-2);
  memory_.reconsider(kAgreeing, true);
  EXPECT_EQ(mean(), known);
  EXPECT_EQ(memory_.shelved(), nullptr);
}

TEST_F(OffsetMemoryOfOneNumber, TheShelfHoldsItForThirtyFrames) {
  begin(2.0);
  learn(2.0, 9);
  memory_.judge(kContradicting, true);
  memory_.contradict(true, true);
  for (int frame = 0; frame < 30; ++frame) {
    ASSERT_NE(memory_.shelved(), nullptr) << frame;
    memory_.reconsider(kContradicting, true);
  }
  EXPECT_EQ(memory_.shelved(), nullptr);
}

TEST_F(OffsetMemoryOfOneNumber, AYoungOneOrOneNotToBeKeptIsNotShelved) {
  begin(2.0);
  learn(2.0, 2);
  memory_.judge(kContradicting, true);
  EXPECT_TRUE(memory_.contradict(true, true));
  EXPECT_EQ(memory_.shelved(), nullptr);
  begin(2.0);
  learn(2.0, 9);
  memory_.judge(kContradicting, true);
  EXPECT_TRUE(memory_.contradict(true, false));
  EXPECT_EQ(memory_.shelved(), nullptr);
}

}  // namespace
}  // namespace bodyschema
