#include "bodyschema/search/search_level.hpp"

#include <gtest/gtest.h>

#include "silhouette/reference.hpp"
#include "silhouette/synthetic_hand.hpp"

namespace bodyschema {
namespace {

TEST(SearchLevel, HasAboutAsManyRowsWhateverThePicture) {
  const SilhouetteModel hand = synthetic::hand(2000);
  for (const auto& [width, height, step] : {std::tuple{160, 120, 1}, {320, 240, 2}, {640, 480, 4}, {1280, 720, 6}}) {
    const std::vector<PinholeIntrinsics> cameras{synthetic::camera(width, height)};
    const SearchLevel level = search_level(hand, cameras);
    EXPECT_EQ(level.step, step);
    EXPECT_GE(level.cameras[0].height, 120);
    EXPECT_LE(level.cameras[0].height, 180);
  }
}

TEST(SearchLevel, TheSmallestPictureDecidesForAllCameras) {
  const SilhouetteModel hand = synthetic::hand(2000);
  const std::vector<PinholeIntrinsics> cameras{synthetic::camera(1280, 720), synthetic::camera(320, 240)};
  EXPECT_EQ(search_level(hand, cameras).step, 2);
}

// The level is the same rays, fewer of them: drawing it gives exactly every step-th pixel of the full drawing.
TEST(SearchLevel, ItsCameraSeesEveryNthPixel) {
  const SilhouetteModel hand = synthetic::hand(2000);
  const auto X_CB = synthetic::stereo_particles(1, 1, 1, 0.05f, 0.01f);
  for (const int step : {2, 3, 4, 6}) {
    const PinholeIntrinsics camera = synthetic::camera(322, 243);  // sizes that no step divides
    const auto full = reference::silhouette(hand, camera, std::span(X_CB).first(hand.parts.size()));
    const auto coarse =
        reference::silhouette(hand, every_nth_pixel(camera, step), std::span(X_CB).first(hand.parts.size()));
    const BinaryMask expected = every_nth_pixel(full, step);
    ASSERT_GT(expected.count(), 50u);
    ASSERT_EQ(coarse.width(), expected.width());
    ASSERT_EQ(coarse.height(), expected.height());
    int different = 0;  // a ray along an outline may round to either side
    for (int v = 0; v < coarse.height(); ++v) {
      for (int u = 0; u < coarse.width(); ++u) different += coarse.at(u, v) != expected.at(u, v) ? 1 : 0;
    }
    EXPECT_LE(different, 2) << "step " << step;
  }
}

TEST(SearchLevel, AnEmptyMaskStaysEmpty) {
  EXPECT_TRUE(every_nth_pixel(BinaryMask(), 4).empty());
}

// The largest part at the distance where it fills the shorter side: 0.1 px there.
TEST(SearchLevel, MeshesMayMoveOutlinesByATenthOfItsPixels) {
  SilhouetteModel model;
  TriangleMesh part;
  part.vertices = {{0, 0, 0}, {0.12f, 0, 0}, {0.06f, 0.02f, 0}};
  part.triangles = {{0, 1, 2}};
  model.parts.push_back(part);
  const PinholeIntrinsics camera = synthetic::camera(160, 120);
  const std::vector<PinholeIntrinsics> cameras{camera};
  const double radius = 0.5 * std::hypot(0.12, 0.02), depth = camera.fy * 2.0 * radius / 120.0;
  EXPECT_NEAR(camera.fy * search_mesh_bound_m(model, cameras) / depth, 0.1, 1e-6);
}

}  // namespace
}  // namespace bodyschema
