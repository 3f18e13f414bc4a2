#include "search_renders.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "bodyschema/camera/picture_reduction.hpp"

namespace bodyschema {
namespace {

std::vector<PinholeIntrinsics> two(int width, int height) {
  return {2, PinholeIntrinsics{width, height, 300.0, 300.0, 0.5 * (width - 1), 0.5 * (height - 1)}};
}

// Of small pictures all that is searched for at once, of large ones two starts: 30 and 2 of at most sixteen looks.
TEST(SearchRenders, LargerPicturesAreLookedAtLessOften) {
  const EstimatorOptions options;
  EXPECT_GE(search_renders(options, two(320, 240)), (2 * 12 + 6) * 16);
  EXPECT_GE(search_renders(options, two(1280, 720)), 2 * 16);
  EXPECT_LT(search_renders(options, two(1280, 720)), 3 * 16);
  EXPECT_GT(search_renders(options, two(640, 480)), search_renders(options, two(1280, 720)));
}

// An outline has as many points whatever the picture's size.
TEST(SearchRenders, ReducedPicturesAreLookedAtNoMoreOften) {
  const EstimatorOptions options;
  auto cameras = two(1280, 720);
  const int as_sent = search_renders(options, cameras);
  for (auto& camera : cameras) camera = reduced(camera, 2);
  EXPECT_EQ(search_renders(options, cameras), as_sent);
}

TEST(SearchRenders, AreAsConfigured) {
  EstimatorOptions options;
  options.search_renders = 64;
  EXPECT_EQ(search_renders(options, two(320, 240)), 64);
  EXPECT_EQ(search_renders(options, two(1280, 720)), 64);
}

}  // namespace
}  // namespace bodyschema
