#include "bodyschema/silhouette/contour_points.hpp"

#include <gtest/gtest.h>

#include <random>

#include "silhouette/reference.hpp"
#include "silhouette/synthetic_hand.hpp"

namespace bodyschema {
namespace {

// Whether the ray through a sub-pixel position meets any triangle: a camera of one pixel.
bool covered(const SilhouetteModel& model, const PinholeIntrinsics& camera, std::span<const Eigen::Isometry3f> X_CB,
             const Eigen::Vector2d& pixel) {
  PinholeIntrinsics one = camera;
  one.width = one.height = 1;
  one.cx -= pixel.x();
  one.cy -= pixel.y();
  return reference::silhouette(model, one, X_CB).at(0, 0);
}

struct Scene {
  SilhouetteModel model = synthetic::hand(2000);
  PinholeIntrinsics camera = synthetic::camera(320, 240);
};

TEST(ContourExtractor, PointsLieOnTheOutlineOfTheUnion) {
  Scene scene;
  ContourExtractor extractor(scene.model, std::vector{scene.camera});
  std::size_t count = 0;
  std::size_t wrong_at_20_mpx = 0;
  for (std::uint32_t seed = 31; seed < 37; ++seed) {
    const auto X_CB = synthetic::stereo_particles(1, 1, seed, 0.4f, 0.02f);
    const auto points = extractor.extract(X_CB, 0);
    ASSERT_GT(points.size(), 50u) << "seed " << seed;
    for (const auto& point : points) {
      const Eigen::Vector2d pixel = point.pixel.cast<double>();
      const Eigen::Vector2d normal = point.normal.cast<double>();
      EXPECT_NEAR(normal.norm(), 1.0, 1e-5);
      // The position is the projection of the surface point it names.
      EXPECT_LT((scene.camera.project(point.p_C.cast<double>()) - pixel).norm(), 2e-3);
      ++count;
      if (!covered(scene.model, scene.camera, X_CB, pixel - 0.02 * normal) ||
          covered(scene.model, scene.camera, X_CB, pixel + 0.02 * normal)) {
        ++wrong_at_20_mpx;
      }
    }
  }
  // A few may sit on a corner, where the normal of one side is no way out of the other.
  EXPECT_LE(wrong_at_20_mpx, count / 100) << "of " << count;
}

TEST(ContourExtractor, PointsBelongToTheirPart) {
  Scene scene;
  ContourExtractor extractor(scene.model, std::vector{scene.camera});
  const auto X_CB = synthetic::stereo_particles(1, 1, 41);
  for (const auto& point : extractor.extract(X_CB, 0)) {
    const auto& mesh = scene.model.parts.at(point.part);
    const Eigen::Vector3f p_B = X_CB[point.part].inverse() * point.p_C;
    float nearest = 1.0f;
    for (const auto& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {  // distance to the triangle's side
        const Eigen::Vector3f a = mesh.vertices[t[static_cast<std::size_t>(k)]];
        const Eigen::Vector3f b = mesh.vertices[t[static_cast<std::size_t>((k + 1) % 3)]];
        const float s = std::clamp((p_B - a).dot(b - a) / (b - a).squaredNorm(), 0.0f, 1.0f);
        nearest = std::min(nearest, (a + s * (b - a) - p_B).norm());
      }
    }
    EXPECT_LT(nearest, 1e-5f);
  }
}

TEST(ContourExtractor, OutlineIsCoveredAtTheSpacingAskedFor) {
  Scene scene;
  ContourExtractor extractor(scene.model, std::vector{scene.camera});
  const auto X_CB = synthetic::stereo_particles(1, 1, 42);
  const auto mask = reference::silhouette(scene.model, scene.camera, X_CB);
  for (const float spacing : {2.0f, 3.0f, 6.5f}) {
    const auto points = extractor.extract(X_CB, 0, spacing);
    std::size_t border = 0;
    std::size_t far_away = 0;
    for (int v = 5; v < 235; ++v) {
      for (int u = 5; u < 315; ++u) {
        if (!mask.at(u, v) || (mask.at(u - 1, v) && mask.at(u + 1, v) && mask.at(u, v - 1) && mask.at(u, v + 1))) {
          continue;
        }
        ++border;
        float nearest = 1e9f;
        for (const auto& point : points) {
          nearest = std::min(nearest, (point.pixel - Eigen::Vector2f(u, v)).norm());
        }
        far_away += nearest > spacing + 1.5f ? 1 : 0;
      }
    }
    ASSERT_GT(border, 300u);
    EXPECT_LE(far_away, border / 50) << "spacing " << spacing;
    EXPECT_NEAR(static_cast<double>(points.size()) * spacing / static_cast<double>(border), 1.0, 0.35);
  }
}

TEST(ContourExtractor, PicturesBorderIsNoOutline) {
  Scene scene;
  ContourExtractor extractor(scene.model, std::vector{scene.camera});
  auto X_CB = synthetic::stereo_particles(1, 1, 43);
  for (auto& X : X_CB) X = Eigen::Isometry3f(Eigen::Translation3f(-0.15f, 0.08f, -0.05f)) * X;
  const auto points = extractor.extract(X_CB, 0, 2.0f, 4.0f);
  EXPECT_GT(points.size(), 20u);
  for (const auto& point : points) {
    EXPECT_GE(point.pixel.x(), 3.5f);
    EXPECT_GE(point.pixel.y(), 3.5f);
    EXPECT_LE(point.pixel.x(), 315.5f);
    EXPECT_LE(point.pixel.y(), 235.5f);
    EXPECT_TRUE(covered(scene.model, scene.camera, X_CB, (point.pixel - 0.1f * point.normal).cast<double>()));
  }
}

TEST(ContourExtractor, OpenPartsWithBothCullings) {
  for (const auto culling : {FaceCulling::kNone, FaceCulling::kBack}) {
    auto tube = synthetic::lumpy_tube("cover", 0.12f, 0.05f, 0.04f, 800, 0.0f);
    tube.triangles.resize(tube.triangles.size() / 2);
    const SilhouetteModel model{{tube}, culling};
    const auto camera = synthetic::camera(320, 240);
    ContourExtractor extractor(model, std::vector{camera});
    std::mt19937 random(44);
    std::normal_distribution<float> normal;
    for (int i = 0; i < 10; ++i) {
      Eigen::Isometry3f X(Eigen::Translation3f(0.0f, 0.0f, 0.4f));
      X.rotate(Eigen::Quaternionf(normal(random), normal(random), normal(random), normal(random)).normalized());
      const std::vector X_CB{X};
      std::size_t wrong = 0;
      const auto points = extractor.extract(X_CB, 0);
      for (const auto& point : points) {
        const Eigen::Vector2d out = 0.05 * point.normal.cast<double>();
        const Eigen::Vector2d pixel = point.pixel.cast<double>();
        wrong += covered(model, camera, X_CB, pixel + out) || !covered(model, camera, X_CB, pixel - out) ? 1 : 0;
      }
      EXPECT_LE(wrong, points.size() / 20) << "seed 44, pose " << i;
    }
  }
}

TEST(ContourExtractor, NothingInViewGivesNoPoints) {
  Scene scene;
  ContourExtractor extractor(scene.model, std::vector{scene.camera});
  const std::vector<Eigen::Isometry3f> behind(17, Eigen::Isometry3f(Eigen::Translation3f(0, 0, -1)));
  EXPECT_TRUE(extractor.extract(behind, 0).empty());
  const std::vector<Eigen::Isometry3f> nan(17, Eigen::Isometry3f(Eigen::Translation3f(std::nanf(""), 0, 1)));
  EXPECT_TRUE(extractor.extract(nan, 0).empty());
}

TEST(ContourExtractor, NearPlaneIsNoOutline) {
  // A tube that starts behind the camera: its cut end is not an outline, its sides are.
  const SilhouetteModel model{{synthetic::lumpy_tube("across", 0.30f, 0.02f, 0.02f, 800)}, FaceCulling::kNone};
  const auto camera = synthetic::camera(320, 240);
  Eigen::Isometry3f X(Eigen::Translation3f(0.04f, 0.0f, -0.1f));
  X.rotate(Eigen::AngleAxisf(-1.5f, Eigen::Vector3f::UnitY()));
  ContourExtractor extractor(model, std::vector{camera});
  const std::vector X_CB{X};
  const auto points = extractor.extract(X_CB, 0);
  EXPECT_GT(points.size(), 10u);
  for (const auto& point : points) {
    EXPECT_GT(point.p_C.z(), 0.0101f);
    EXPECT_TRUE(covered(model, camera, X_CB, (point.pixel - 0.05f * point.normal).cast<double>()));
    EXPECT_FALSE(covered(model, camera, X_CB, (point.pixel + 0.05f * point.normal).cast<double>()));
  }
}

TEST(ContourExtractor, RejectsWhatItCannotUse) {
  Scene scene;
  EXPECT_THROW(ContourExtractor(SilhouetteModel{}, std::vector{scene.camera}), std::invalid_argument);
  EXPECT_THROW(ContourExtractor(scene.model, {}), std::invalid_argument);
}

}  // namespace
}  // namespace bodyschema
