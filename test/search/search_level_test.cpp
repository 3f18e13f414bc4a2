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

// Pixels that differ over the outline's length, in poses all around: less than a tenth of a pixel of 720 rows, a
// thirtieth of 240. What is left of that at so few pixels is chance.
TEST(OutlineLevel, MovesOutlinesByNextToNothing) {
  const SilhouetteModel hand = synthetic::hand(150000);
  const std::vector<PinholeIntrinsics> cameras{synthetic::camera(1280, 720)};
  const SilhouetteModel light = outline_level(hand, cameras);
  std::size_t before = 0, after = 0;
  for (const auto& part : hand.parts) before += part.triangles.size();
  for (const auto& part : light.parts) after += part.triangles.size();
  if (after == before) GTEST_SKIP() << "built without meshoptimizer";
  EXPECT_LT(after, 0.7 * static_cast<double>(before));
  const auto full_scorer = make_silhouette_scorer(hand, cameras, {"contour", "auto", 1});
  const auto light_scorer = make_silhouette_scorer(light, cameras, {"contour", "auto", 1});
  constexpr std::size_t kPoses = 8;
  const auto X_CB = synthetic::stereo_particles(kPoses, 1, 1, 0.3f, 0.01f);
  for (std::size_t i = 0; i < kPoses; ++i) {
    const auto pose = std::span(X_CB).subspan(i * hand.parts.size(), hand.parts.size());
    const BinaryMask one = full_scorer->render(pose, 0), other = light_scorer->render(pose, 0);
    int different = 0, outline = 0;
    for (int v = 1; v < one.height(); ++v) {
      for (int u = 1; u < one.width(); ++u) {
        different += one.at(u, v) != other.at(u, v) ? 1 : 0;
        outline += (one.at(u, v) != one.at(u - 1, v) ? 1 : 0) + (one.at(u, v) != one.at(u, v - 1) ? 1 : 0);
      }
    }
    ASSERT_GT(outline, 500) << "the hand is not in the picture";
    EXPECT_LT(different, 0.1 * outline) << "pose " << i;
  }
}

TEST(OutlineLevel, MoreRowsAskForNoFinerMeshes) {
  const SilhouetteModel hand = synthetic::hand(60000);
  const auto triangles = [&](const PinholeIntrinsics& camera) {
    std::size_t sum = 0;
    for (const auto& part : outline_level(hand, std::vector{camera}).parts) sum += part.triangles.size();
    return sum;
  };
  EXPECT_EQ(triangles(synthetic::camera(1280, 720)), triangles(synthetic::camera(320, 240)));
  EXPECT_LE(triangles(synthetic::camera(160, 120)), triangles(synthetic::camera(320, 240)));
}

}  // namespace
}  // namespace bodyschema
