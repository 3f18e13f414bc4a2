#include "bodyschema/simulator/kitchen.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace bodyschema::simulator {
namespace {

CameraModel camera() {
  CameraModel c;
  c.intrinsics = {160, 120, 128.0, 128.0, 79.5, 59.5};
  return c;
}

/// OpenCV axes, looking along x of the room.
Pose ahead() {
  Pose X = Pose::Identity();
  X.linear().col(0) = -Eigen::Vector3d::UnitY();
  X.linear().col(1) = -Eigen::Vector3d::UnitZ();
  X.linear().col(2) = Eigen::Vector3d::UnitX();
  return X;
}

std::vector<float> look(const Kitchen& kitchen, const Pose& X_WC) {
  std::vector<float> picture;
  kitchen.paint(Lens(camera()), X_WC, 0, 120, picture);
  return picture;
}

double spread(const std::vector<float>& picture) {
  double sum = 0.0, square = 0.0;
  for (const float level : picture) {
    sum += level;
    square += level * level;
  }
  const auto n = static_cast<double>(picture.size());
  return std::sqrt(square / n - sum * sum / n / n);
}

TEST(Kitchen, IsRichOnAllSidesAndAnotherForEverySeed) {
  const Kitchen kitchen({}, {}, 1), other({}, {}, 2), same({}, {}, 1);
  EXPECT_EQ(look(kitchen, ahead()), look(same, ahead()));
  EXPECT_NE(look(kitchen, ahead()), look(other, ahead()));
  for (const double turn : {0.0, 1.5, 3.1, -1.5}) {
    const Pose X = Pose(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())) * ahead();
    EXPECT_GT(spread(look(kitchen, X)), 15.0) << turn;
  }
}

TEST(Kitchen, TurnsWithTheHeadAsARoomDoes) {
  const Kitchen kitchen({}, {}, 3);
  const auto before = look(kitchen, ahead());
  // About the vertical by d: the middle of the picture moves by f tan d.
  const Pose turned = ahead() * Pose(Eigen::AngleAxisd(std::atan(8.0 / 128.0), Eigen::Vector3d::UnitY()));
  const auto after = look(kitchen, turned);
  double still = 0.0, shifted = 0.0;
  for (int v = 40; v < 80; ++v) {
    for (int u = 60; u < 100; ++u) {
      for (int k = 0; k < 3; ++k) {
        const float now = after[static_cast<std::size_t>((v * 160 + u) * 3 + k)];
        still += std::abs(now - before[static_cast<std::size_t>((v * 160 + u) * 3 + k)]);
        shifted += std::abs(now - before[static_cast<std::size_t>((v * 160 + u + 8) * 3 + k)]);
      }
    }
  }
  EXPECT_LT(shifted, 0.4 * still);
}

TEST(Kitchen, HasDepth) {
  // A step aside by b moves what is d away by f b / d: the wall in front, 2.3 m away, by 128 * 0.144 / 2.3 = 8 px.
  const Kitchen kitchen({}, {}, 4);
  const auto before = look(kitchen, ahead());
  const auto after = look(kitchen, ahead() * Pose(Eigen::Translation3d(8.0 * 2.3 / 128.0, 0, 0)));
  double still = 0.0, shifted = 0.0;
  for (int v = 30; v < 60; ++v) {
    for (int u = 60; u < 100; ++u) {
      for (int k = 0; k < 3; ++k) {
        const float now = after[static_cast<std::size_t>((v * 160 + u) * 3 + k)];
        still += std::abs(now - before[static_cast<std::size_t>((v * 160 + u) * 3 + k)]);
        shifted += std::abs(now - before[static_cast<std::size_t>((v * 160 + u + 8) * 3 + k)]);
      }
    }
  }
  EXPECT_LT(shifted, 0.35 * still);
}

TEST(Kitchen, PaintsTheRowsAskedForOnly) {
  const Kitchen kitchen({}, {}, 5);
  const auto whole = look(kitchen, ahead());
  std::vector<float> band(whole.size(), -1.0f);
  kitchen.paint(Lens(camera()), ahead(), 30, 50, band);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    const std::size_t row = i / (3 * 160);
    EXPECT_EQ(band[i], row >= 30 && row < 50 ? whole[i] : -1.0f);
  }
}

TEST(Kitchen, SomeOfItIsPaintedInTheRobotsColours) {
  const Eigen::Vector3f pink(250, 90, 180);  // nothing else is
  const auto pinkish = [&](const Kitchen& kitchen) {
    int count = 0;
    for (const double turn : {0.0, 1.5, 3.1, -1.5}) {
      const auto picture = look(kitchen, Pose(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())) * ahead());
      for (std::size_t i = 0; i < picture.size(); i += 3) {
        const Eigen::Vector3f c(picture[i], picture[i + 1], picture[i + 2]);
        count += c.normalized().dot(pink.normalized()) > 0.998f ? 1 : 0;
      }
    }
    return count;
  };
  int with = 0, without = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    with += pinkish(Kitchen({}, {pink}, seed));
    without += pinkish(Kitchen({}, {}, seed));
  }
  EXPECT_GT(with, without + 300);
}

TEST(Kitchen, TheTableHasItsPatternInPlace) {
  RoomPlan plan;
  const Kitchen kitchen(plan, {}, 6);
  std::set<int> shades;
  for (double x = plan.table_near_x; x < plan.table_far_x; x += 0.01) {
    const Eigen::Vector3f p(static_cast<float>(x), 0.1f, static_cast<float>(plan.table_z));
    const Eigen::Vector3f albedo = kitchen.table_albedo(p, 0.001f);
    EXPECT_TRUE((albedo.array() >= 0.0f).all() && (albedo.array() <= 1.0f).all());
    EXPECT_EQ(albedo, kitchen.table_albedo(p, 0.001f));
    shades.insert(static_cast<int>(255.0f * albedo.x()));
  }
  EXPECT_GT(shades.size(), 15u);
}

}  // namespace
}  // namespace bodyschema::simulator
