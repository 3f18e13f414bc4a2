#include "eye_order.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(EyeOrder, OneClearFrameIsEnoughEitherWay) {
  EyeOrder order;
  EXPECT_TRUE(order.exchanged(0.5, 0.2));
  EXPECT_FALSE(order.exchanged(0.2, 0.5)) << "in order again";
}

TEST(EyeOrder, FramesThatSayLittleAddUp) {
  EyeOrder order;
  int frames = 1;
  while (!order.exchanged(0.4, 0.32)) ASSERT_LT(++frames, 10);
  EXPECT_EQ(frames, 5);
  EyeOrder right;
  for (frames = 1; !right.settled(); ++frames) {
    ASSERT_FALSE(right.exchanged(0.32, 0.4));
    ASSERT_LT(frames, 20);
  }
  EXPECT_EQ(frames, 10);
}

TEST(EyeOrder, AHandWithoutDisparitySaysNothing) {
  EyeOrder order;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(order.exchanged(0.3, 0.3));
  EXPECT_TRUE(order.settled()) << "a search every frame for ever";
  EXPECT_FALSE(order.exchanged(0.0, 0.0));
  EXPECT_FALSE(order.exchanged(1.0, 1.0)) << "nothing fits at all";
}

TEST(EyeOrder, WhatNoGuessComesNearSaysNothing) {
  EyeOrder order;
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(order.exchanged(0.99, i % 2 == 0 ? 0.9 : 0.5));
}

TEST(EyeOrder, SearchesOnlyWhereSomeGuessIsNear) {
  EXPECT_TRUE(EyeOrder::worth_searches(0.48, 0.95));
  EXPECT_TRUE(EyeOrder::worth_searches(0.95, 0.48));
  EXPECT_FALSE(EyeOrder::worth_searches(0.92, 0.96)) << "masks full of background";
}

// A reach that came into view from the side, before a background with a mark in one picture.
TEST(EyeOrder, AnArmThatIsComingInIsNotTakenForExchanged) {
  EyeOrder order;
  const double distances[][2] = {{1.0, 0.985},   {1.0, 0.813},   {0.999, 0.435}, {0.753, 0.335},
                                 {0.525, 0.461}, {0.317, 0.552}, {0.176, 0.619}};
  for (const auto& [as_they_are, exchanged] : distances) EXPECT_FALSE(order.exchanged(as_they_are, exchanged));
}

TEST(EyeOrder, IsNotSettledWhilePicturesAreExchanged) {
  EyeOrder order;
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(order.exchanged(0.5, 0.2));
  EXPECT_FALSE(order.settled());
}

TEST(EyeOrder, WhatWasExchangedForLongIsInOrderWithinTwoFrames) {
  EyeOrder order;
  for (int i = 0; i < 100; ++i) order.exchanged(0.5, 0.35);
  order.exchanged(0.35, 0.5);
  order.exchanged(0.3, 0.4);
  EXPECT_FALSE(order.exchanged(0.3, 0.4));
}

}  // namespace
}  // namespace bodyschema
