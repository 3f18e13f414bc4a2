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

TEST(Overlay, CamerasMayDifferInSize) {
  Image low(40, 30, 1), high(30, 50, 1);
  const Image page = draw_overlay({{&low, {}, {}}, {&high, {}, {}}}, "", 2);
  EXPECT_EQ(page.width, 2 * (40 + 30));
  EXPECT_EQ(page.height, 2 * 50);
}

TEST(Overlay, ShowsTheArmAlone) {
  Image gray(400, 300, 1);
  BinaryMask left(400, 300), right(400, 300);
  for (int v = 100; v < 150; ++v) {
    for (int u = 200; u < 240; ++u) left.set(u, v);
    for (int u = 380; u < 400; ++u) right.set(u, v);  // at the edge of the picture
  }
  std::vector<OverlayView> views = {{&gray, left, {}}, {&gray, {}, right}};
  crop_to_arm(views);
  EXPECT_EQ(views[0].part[2], 40 + 2 * 6);
  EXPECT_EQ(views[0].part[3], 50 + 2 * 6);
  EXPECT_EQ(views[0].part[0], 194);
  EXPECT_EQ(views[1].part[2], views[0].part[2]) << "pictures side by side are of one size";
  EXPECT_EQ(views[1].part[0], 400 - views[1].part[2]);
  const Image page = draw_overlay(views, "", 0);
  EXPECT_NEAR(page.width, 1300, 650);
  std::vector<OverlayView> empty = {{&gray, {}, {}}};
  crop_to_arm(empty);
  EXPECT_EQ(empty[0].part[2], 400) << "no arm: the whole picture";
}

/// Columns of the row that are brighter than anything in the picture.
int white_in(const Image& page, int v) {
  int count = 0;
  for (int u = 0; u < page.width; ++u) count += page.pixel(u, v)[0] > 250 && page.pixel(u, v)[1] > 250 ? 1 : 0;
  return count;
}

TEST(Overlay, HasAScaleBarOfARoundLength) {
  Image gray(400, 300, 1);
  const auto longest = [&](double px_per_m) {
    std::vector<OverlayView> views = {{&gray, {}, {}}};
    views[0].px_per_m = px_per_m;
    const Image page = draw_overlay(views, "test", 2);
    int most = 0;
    for (int v = page.height / 2; v < page.height; ++v) most = std::max(most, white_in(page, v));
    return most;
  };
  EXPECT_NEAR(longest(1000.0), 2 * 100, 6);  // 10 cm; 20 cm would be half of the picture
  EXPECT_NEAR(longest(600.0), 2 * 120, 6);   // 20 cm
  EXPECT_EQ(longest(0.0), 0) << "no bar where the distance is not known";
}

TEST(Overlay, LinesAreSeenOnAPhone) {
  Image gray(400, 300, 1);
  BinaryMask mask(400, 300);
  for (int v = 100; v < 200; ++v) {
    for (int u = 100; u < 300; ++u) mask.set(u, v);
  }
  const Image page = draw_overlay({{&gray, {}, mask}}, "", 0);
  int green = 0;
  for (int v = 0; v < page.height / 2; ++v) green += page.pixel(page.width / 2, v)[1] > 150 ? 1 : 0;
  EXPECT_GE(green, page.width / 420) << "one of a phone's pixels";
}

TEST(Overlay, UnwritableFileIsAnError) {
  EXPECT_THROW(write_png("/proc/none/overlay.png", Image(4, 4, 3)), FileError);
}

}  // namespace
}  // namespace bodyschema
