#include "bodyschema/vision/mask_operations.hpp"

#include <gtest/gtest.h>

#include <random>

namespace bodyschema {
namespace {

BinaryMask random_mask(int width, int height, double density, std::mt19937& random) {
  BinaryMask mask(width, height);
  std::bernoulli_distribution set(density);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) mask.set(u, v, set(random));
  }
  return mask;
}

// The definition, pixel by pixel; beyond the border the nearest pixel counts.
BinaryMask brute_force(const BinaryMask& in, bool erode) {
  BinaryMask out(in.width(), in.height());
  for (int v = 0; v < in.height(); ++v) {
    for (int u = 0; u < in.width(); ++u) {
      bool all = true, any = false;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          const bool bit = in.at(std::clamp(u + du, 0, in.width() - 1), std::clamp(v + dv, 0, in.height() - 1));
          all = all && bit;
          any = any || bit;
        }
      }
      out.set(u, v, erode ? all : any);
    }
  }
  return out;
}

// Flood fill from every pixel; slow and obvious.
std::size_t piece_size(const BinaryMask& mask, int u, int v, bool value, bool eight, bool& on_border) {
  BinaryMask seen(mask.width(), mask.height());
  std::vector<std::pair<int, int>> stack{{u, v}};
  seen.set(u, v);
  std::size_t n = 0;
  on_border = false;
  while (!stack.empty()) {
    const auto [x, y] = stack.back();
    stack.pop_back();
    ++n;
    on_border |= x == 0 || y == 0 || x == mask.width() - 1 || y == mask.height() - 1;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (!eight && dx != 0 && dy != 0) continue;
        const int a = x + dx, b = y + dy;
        if (a < 0 || b < 0 || a >= mask.width() || b >= mask.height()) continue;
        if (seen.at(a, b) || mask.at(a, b) != value) continue;
        seen.set(a, b);
        stack.push_back({a, b});
      }
    }
  }
  return n;
}

// Many steps at once are taken another way than few.
TEST(MaskOperations, ManyStepsAreAsManySingleOnes) {
  std::mt19937 random(13);
  MaskMorphology morphology;
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 200}, {64, 30}, {65, 12}, {300, 90}}) {
    for (const double density : {0.001, 0.02, 0.98, 0.999}) {
      for (const int steps : {3, 4, 17, 63, 64, 65, 140}) {
        const auto mask = random_mask(width, height, density, random);
        auto eroded = mask, dilated = mask, eroded_singly = mask, dilated_singly = mask;
        morphology.erode(eroded, steps);
        morphology.dilate(dilated, steps);
        for (int i = 0; i < steps; ++i) {
          morphology.erode(eroded_singly);
          morphology.dilate(dilated_singly);
        }
        EXPECT_EQ(eroded, eroded_singly) << width << "x" << height << ", " << steps << " steps";
        EXPECT_EQ(dilated, dilated_singly) << width << "x" << height << ", " << steps << " steps";
      }
    }
  }
}

TEST(MaskOperations, ErosionAndDilationMatchTheDefinition) {
  std::mt19937 random(11);
  MaskMorphology morphology;
  for (const auto& [width, height] : {std::pair{1, 1}, {2, 3}, {63, 5}, {64, 7}, {65, 4}, {130, 9}}) {
    for (const double density : {0.1, 0.5, 0.9}) {
      const auto mask = random_mask(width, height, density, random);
      auto eroded = mask, dilated = mask;
      morphology.erode(eroded);
      morphology.dilate(dilated);
      EXPECT_EQ(eroded, brute_force(mask, true)) << width << "x" << height;
      EXPECT_EQ(dilated, brute_force(mask, false)) << width << "x" << height;
    }
  }
  BinaryMask nothing;
  morphology.erode(nothing);
  morphology.dilate(nothing, 9);
  EXPECT_TRUE(nothing.empty());
}

TEST(MaskOperations, SmallPiecesAndHolesMatchFloodFill) {
  std::mt19937 random(12);
  ComponentFilter filter;
  for (const auto& [width, height] : {std::pair{1, 1}, {64, 12}, {70, 20}, {129, 16}}) {
    for (const double density : {0.25, 0.5, 0.7}) {
      const auto mask = random_mask(width, height, density, random);
      auto large = mask, filled = mask;
      filter.remove_small(large, 6);
      filter.fill_small_holes(filled, 3);
      for (int v = 0; v < height; ++v) {
        for (int u = 0; u < width; ++u) {
          bool border = false;
          if (mask.at(u, v)) {
            EXPECT_EQ(large.at(u, v), piece_size(mask, u, v, true, true, border) >= 6);
            EXPECT_TRUE(filled.at(u, v));
          } else {
            const auto size = piece_size(mask, u, v, false, false, border);
            EXPECT_EQ(filled.at(u, v), !border && size <= 3);
            EXPECT_FALSE(large.at(u, v));
          }
        }
      }
    }
  }
}

TEST(MaskOperations, BoundingBox) {
  BinaryMask mask(200, 50);
  EXPECT_TRUE(bounding_box(mask).empty());
  mask.set(63, 7);
  mask.set(130, 40);
  const auto box = bounding_box(mask);
  EXPECT_EQ(box.u0, 63);
  EXPECT_EQ(box.u1, 130);
  EXPECT_EQ(box.v0, 7);
  EXPECT_EQ(box.v1, 40);
  const auto grown = box.grown(20, 200, 50);
  EXPECT_EQ(grown.v0, 0);
  EXPECT_EQ(grown.v1, 49);
  EXPECT_EQ(grown.u0, 43);
  EXPECT_EQ(grown.u1, 150);
}

}  // namespace
}  // namespace bodyschema
