#include "bodyschema/evidence/shape_error.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "random_seed.hpp"

namespace bodyschema {
namespace {

constexpr double kFloor_px = 0.1;
constexpr double kRecent = 12.0;  ///< postures

/// Eight points of each of some parts, all with the part's residual, px.
std::vector<OutlinePoint> outline(const std::vector<double>& residual_px) {
  std::vector<OutlinePoint> points;
  for (std::size_t part = 0; part < residual_px.size(); ++part) {
    for (int i = 0; i < 8; ++i) {
      OutlinePoint point;
      point.part = part;
      point.residual_px = residual_px[part];
      points.push_back(point);
    }
  }
  return points;
}

TEST(ShapeError, IsWhatKeepsItsSignFromPostureToPosture) {
  ShapeError shape;
  for (int i = 0; i < 6; ++i) shape.add(outline({1.0, -1.0, 1.0}), 0, 1.0);
  // The mean square of the parts, times the points that err as one.
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), 8.0, 1e-9);
  EXPECT_NEAR(shape.variance_px2(kFloor_px, 0.0), 8.0 * (1.0 - kFloor_px * kFloor_px), 1e-9);
  EXPECT_EQ(shape.variance_px2(1.5, 0.0), 0.0) << "no nearer do pictures place outlines";
}

/// Of six parts two parameters take up as much as two parts have: what four leave is measured.
TEST(ShapeError, WhatAFitTookUpIsMadeUpFor) {
  ShapeError shape;
  for (int i = 0; i < 6; ++i) shape.add(outline({1.0, -1.0, 1.0, -1.0, 1.0, -1.0}), 0, 1.0);
  EXPECT_NEAR(shape.variance_px2(0.0, 2.0), 1.5 * shape.variance_px2(0.0, 0.0), 1e-9);
  EXPECT_NEAR(shape.variance_px2(0.0, 9.0), 2.0 * shape.variance_px2(0.0, 0.0), 1e-9) << "no more than half of it";
}

/// A fingertip beside the gap to the next one, whose edges the pictures lack: a fit has hardly listened to it.
TEST(ShapeError, WhatAFitSetAsideHardlyCounts) {
  ShapeError shape;
  auto points = outline({0.0, 0.0, 0.0, 1.0});
  for (auto& point : points) point.weight = point.part == 3 ? 0.1 : 1.0;
  for (int i = 0; i < 6; ++i) shape.add(points, 0, 1.0);
  // The square of what moves the fit by it, over all that holds it.
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), 0.8 * 0.8 / 24.8, 1e-9);
}

/// Of two parts a fit follows the larger: the smaller one's error is not the larger one's too.
TEST(ShapeError, ASmallPartThatIsFarOffDoesNotStandForALargeOne) {
  ShapeError shape;
  auto points = outline({0.0, 0.0, 0.0, 1.0});
  for (auto& point : points) point.part = point.part < 2 ? 0 : point.part;
  for (int i = 0; i < 6; ++i) shape.add(points, 0, 1.0);
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), 8.0 * 8.0 / 32.0, 1e-9);
}

/// What a fit follows shows no residual: where most of the parts are off, so is what they are off from.
TEST(ShapeError, APartThatAFitFollowsIsNotBetterThanMost) {
  ShapeError shape;
  for (int i = 0; i < 6; ++i) shape.add(outline({0.0, 1.0, -1.0, 1.0}), 0, 1.0);
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), 8.0, 1e-9);
}

TEST(ShapeError, OfAWholeLogNothingFades) {
  ShapeError shape;
  for (int i = 0; i < 30; ++i) shape.add(outline({1.0, -1.0, 1.0}), 0, 1.0);
  for (int i = 0; i < 30; ++i) shape.add(outline({0.0, 0.0, 0.0}), 0, 1.0);
  ShapeError half;
  for (int i = 0; i < 60; ++i) half.add(outline({0.5, -0.5, 0.5}), 0, 1.0);
  // Less by what differs between the postures, which leaves the mean so uncertain.
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), half.variance_px2(0.0, 0.0) - 8.0 * 0.25 / 59.0, 1e-9);
}

TEST(ShapeError, WhatDiffersFromPostureToPostureIsNone) {
  ShapeError shape;
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, 0.5);
  for (int i = 0; i < 60; ++i) shape.add(outline({normal(random), normal(random), normal(random)}), 0, 1.0);
  EXPECT_LT(shape.variance_px2(0.0, 0.0), 8.0 * 0.25 / 4.0);
}

TEST(ShapeError, FewPosturesDoNotTellItFromChance) {
  ShapeError shape;
  for (const double sign : {1.0, -1.0}) {
    EXPECT_FALSE(shape.known());
    shape.add(outline({sign, 0.5 * sign}), 0, 1.0);
  }
  EXPECT_FALSE(shape.known());
  shape.forget();
  shape.add(outline({1.0, 1.0}), 0, 1.0);
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), 8.0, 1e-9) << "all of it may be shape";
  for (int i = 0; i < 2; ++i) shape.add(outline({1.0, 1.0}), 0, 1.0);
  EXPECT_TRUE(shape.known());
}

/// What an earlier estimate left is no longer there once the estimate has moved.
TEST(ShapeError, EarlierPosturesFade) {
  ShapeError shape(kRecent);
  for (int i = 0; i < 5; ++i) shape.add(outline({2.0, -2.0}), 0, 1.0);
  for (int i = 0; i < 60; ++i) shape.add(outline({0.0, 0.0}), 0, 1.0);
  EXPECT_EQ(shape.variance_px2(kFloor_px, 0.0), 0.0);
}

/// A fingertip that was far off in the one posture that showed it, long ago, kept the whole hand's uncertainty up for
/// the rest of a log.
TEST(ShapeError, PartsThatAreNoLongerShownFadeAsWell) {
  ShapeError shape(kRecent);
  shape.add(outline({0.1, -0.1, 0.1, 2.0}), 0, 1.0);
  const double at_first = shape.variance_px2(0.0, 0.0);
  double before = at_first;
  for (int i = 0; i < 30; ++i) {
    shape.add(outline({0.1, -0.1, 0.1}), 0, 1.0);
    EXPECT_LE(shape.variance_px2(0.0, 0.0), before + 1e-12) << i;
    before = shape.variance_px2(0.0, 0.0);
  }
  EXPECT_LT(before, 0.1 * at_first);
  for (int i = 0; i < 200; ++i) shape.add(outline({0.1, -0.1, 0.1}), 0, 1.0);
  ShapeError without(kRecent);
  for (int i = 0; i < 231; ++i) without.add(outline({0.1, -0.1, 0.1}), 0, 1.0);
  EXPECT_NEAR(shape.variance_px2(0.0, 0.0), without.variance_px2(0.0, 0.0), 1e-6) << "as if it had not been seen";
}

/// Of what fades, a little more than one posture is left at some time: how its parts differ would be divided by next to
/// nothing.
TEST(ShapeError, WhatIsLeftOfAPartThatIsNoLongerShownIsNotTakenForChance) {
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> noise;
  constexpr int kRepeats = 200, kAfter = 30;
  std::vector<double> mean_px2(kAfter, 0.0);
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    ShapeError shape(kRecent);
    for (int i = 0; i < 3; ++i) shape.add(outline({noise(random), 0.0, 0.0, 0.0}), 0, 1.0);
    for (double& mean : mean_px2) {
      shape.add({}, 0, 1.0);
      mean += shape.variance_px2(0.0, 0.0) / kRepeats;
    }
  }
  EXPECT_LT(*std::max_element(mean_px2.begin(), mean_px2.end()), 8.0 / 3.0) << "of three postures' mean, eight points";
}

/// What parts show of a shape comes and goes with the postures: few that show little of it do not make it small. With
/// the variance as the last postures have it, a hand of which 3 mm were said to be open was known to 0.4 mm one posture
/// later.
TEST(ShapeError, LastsOverPosturesThatShowLittleOfIt) {
  ShapeError shape(kRecent);
  const auto add = [&shape](double residual_px) {
    shape.add(outline({residual_px, -residual_px, residual_px}), 0, 1.0);
    shape.end_posture(0.0, 0.0);
  };
  for (int i = 0; i < 12; ++i) {
    add(1.0);
    EXPECT_NEAR(shape.lasting_variance_px2(0.0, 0.0), 8.0, 1e-9) << i;
  }
  for (int i = 0; i < 3; ++i) {
    add(-2.0);
    EXPECT_GE(shape.lasting_variance_px2(0.0, 0.0), shape.variance_px2(0.0, 0.0));
  }
  EXPECT_LT(shape.variance_px2(0.0, 0.0), 2.0);
  EXPECT_GT(shape.lasting_variance_px2(0.0, 0.0), 4.0);
  for (int i = 0; i < 200; ++i) {
    add(0.0);
    EXPECT_GE(shape.lasting_variance_px2(0.0, 0.0), shape.variance_px2(0.0, 0.0));
  }
  EXPECT_LT(shape.lasting_variance_px2(0.0, 0.0), 1e-3) << "a mean over recent ones";
  shape.forget();
  EXPECT_EQ(shape.lasting_variance_px2(0.0, 0.0), 0.0);
}

TEST(ShapeError, LengthsAreThoseOfPicturesOf320x240) {
  ShapeError large, small;
  for (int i = 0; i < 4; ++i) {
    large.add(outline({2.0, 2.0}), 0, 2.0);
    small.add(outline({1.0, 1.0}), 0, 1.0);
  }
  EXPECT_NEAR(large.variance_px2(kFloor_px, 0.0), small.variance_px2(kFloor_px, 0.0), 1e-12);
}

}  // namespace
}  // namespace bodyschema
