#include "bodyschema/pipeline/overlay.hpp"

#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

TEST(Overlay, DrawsBothOutlinesSideBySide) {
  Image gray(40, 30, 1);
  BinaryMask nominal(40, 30);
  BinaryMask corrected(40, 30);
  for (int v = 5; v < 15; ++v) {
    for (int u = 5; u < 15; ++u) {
      nominal.set(u, v);
      corrected.set(u + 15, v);
    }
  }
  const Image page = draw_overlay({{&gray, nominal, corrected}, {&gray, {}, {}}}, "test", 2);
  EXPECT_EQ(page.width, 2 * 2 * 40);
  EXPECT_GT(page.height, 2 * 30);
  int red = 0;
  int green = 0;
  for (int v = page.height - 60; v < page.height; ++v) {
    for (int u = 0; u < page.width; ++u) {
      const auto* p = page.pixel(u, v);
      red += p[0] > 150 && p[1] < 120 ? 1 : 0;
      green += p[1] > 150 && p[0] < 120 ? 1 : 0;
    }
  }
  EXPECT_GT(red, 40);
  EXPECT_GT(green, 40);
}

TEST(Overlay, UnwritableFileIsAnError) {
  EXPECT_THROW(write_png("/proc/none/overlay.png", Image(4, 4, 3)), FileError);
}

}  // namespace
}  // namespace bodyschema
