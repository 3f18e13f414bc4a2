#include "bodyschema/simulator/rasterizer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::simulator {
namespace {

CameraModel camera(int width = 101, int height = 101) {
  CameraModel c;
  c.name = "left";
  c.intrinsics = {width, height, 250.0, 250.0, 0.5 * (width - 1), 0.5 * (height - 1)};
  return c;
}

/// A square that faces a camera looking along +z, corners at +-half, in its own plane z = 0.
TriangleMesh square(float half) {
  TriangleMesh mesh;
  mesh.vertices = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}};  // outside is towards -z, where the camera is
  return mesh;
}

TriangleMesh disc(float radius, int corners = 720) {
  TriangleMesh mesh;
  mesh.vertices.push_back(Eigen::Vector3f::Zero());
  for (int i = 0; i < corners; ++i) {
    const double a = 2.0 * kPi * i / corners;
    mesh.vertices.emplace_back(static_cast<float>(radius * std::cos(a)), static_cast<float>(radius * std::sin(a)),
                               0.0f);
  }
  for (int i = 0; i < corners; ++i) {
    mesh.triangles.push_back({0, static_cast<std::uint32_t>(1 + (i + 1) % corners), static_cast<std::uint32_t>(1 + i)});
  }
  return mesh;
}

PaintedPart part(TriangleMesh mesh, bool cull = false, float albedo = 1.0f) {
  return {std::move(mesh), Eigen::Vector3f::Constant(albedo), cull};
}

std::vector<Eigen::Isometry3f> at(float x, float y, float z) {
  Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
  X.translation() = Eigen::Vector3f(x, y, z);
  return {X};
}

double area(const Rasterizer& r) {
  return std::accumulate(r.coverage().begin(), r.coverage().end(), 0.0);
}

TEST(Rasterizer, ASquareCoversThePixelsWhoseCentresItCovers) {
  // At 0.5 m a half side of 0.0506 m is 25.3 px: centres from 50 - 25 to 50 + 25.
  Rasterizer r({part(square(0.0506f))}, 101, 101, 3);
  r.draw(at(0, 0, 0.5f), camera(), {});
  const BinaryMask mask = r.mask();
  EXPECT_EQ(mask.count(), 51u * 51u);
  EXPECT_TRUE(mask.at(25, 25));
  EXPECT_TRUE(mask.at(75, 75));
  EXPECT_FALSE(mask.at(24, 50));
  EXPECT_FALSE(mask.at(50, 76));
  EXPECT_NEAR(area(r), 50.6 * 50.6, 50.6 * 0.7);  // samples are a third of a pixel apart
}

TEST(Rasterizer, CoverageOfADiscIsItsArea) {
  for (const int samples : {1, 2, 3, 4}) {
    Rasterizer r({part(disc(0.06f))}, 101, 101, samples);
    r.draw(at(0.0011f, -0.0007f, 0.5f), camera(), {});
    EXPECT_NEAR(area(r), kPi * 30.0 * 30.0, 0.006 * kPi * 900.0) << samples << " samples";
  }
}

TEST(Rasterizer, DilationMovesTheOutlineByThatMuch) {
  for (const float d : {-2.0f, -1.3f, -0.8f, 0.4f, 0.9f, 1.3f, 2.0f}) {
    // Mean over places on the grid: it was 1.33 px instead of 1.3, and diagnoses said so.
    double sum = 0.0;
    int count = 0;
    for (const float x : {0.0f, 1.1e-4f, 2.3e-4f, 3.7e-4f, 5.0e-4f}) {
      for (const float y : {0.0f, 1.7e-4f, 3.1e-4f, 4.7e-4f}) {
        Rasterizer r({part(disc(0.06f))}, 101, 101, 3);
        r.draw(at(x, y, 0.5f), camera(), {}, d);
        sum += std::sqrt(area(r) / kPi) - 30.0;
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, d, 0.015) << "dilation " << d;
  }
}

TEST(Rasterizer, NearerPartsHideFartherOnesWhicheverIsDrawnFirst) {
  const PaintedPart black = part(square(0.1f), false, 0.0f);
  const PaintedPart white = part(square(0.05f));
  const Lighting light{{0, 0, -1}, 1.0f, 0.0f};
  for (const bool white_first : {true, false}) {
    Rasterizer r(white_first ? std::vector{white, black} : std::vector{black, white}, 101, 101, 3);
    std::vector<Eigen::Isometry3f> poses(2, at(0, 0, 0.6f)[0]);
    poses[white_first ? 0 : 1] = at(0, 0, 0.4f)[0];
    r.draw(poses, camera(), light);
    EXPECT_EQ(r.part_at(50, 50), white_first ? 0 : 1);
    EXPECT_NEAR(r.colour()[3 * (50 * 101 + 50)], 255.0f, 0.5f);
    EXPECT_EQ(r.part_at(14, 50), white_first ? 1 : 0);
    // The next picture knows nothing of this one.
    poses[0] = poses[1] = at(5, 5, 0.6f)[0];
    r.draw(poses, camera(), light);
    EXPECT_EQ(area(r), 0.0);
    EXPECT_EQ(r.mask().count(), 0u);
  }
}

TEST(Rasterizer, CullingDropsTrianglesThatFaceAway) {
  TriangleMesh away = square(0.05f);
  for (auto& t : away.triangles) std::swap(t[0], t[1]);
  const auto drawn = [](TriangleMesh mesh, bool cull) {
    Rasterizer r({part(std::move(mesh), cull)}, 101, 101, 1);
    r.draw(at(0, 0, 0.5f), camera(), {});
    return area(r);
  };
  EXPECT_EQ(drawn(away, true), 0.0);
  EXPECT_GT(drawn(away, false), 2000.0);
  EXPECT_EQ(drawn(square(0.05f), true), drawn(away, false));
}

TEST(Rasterizer, CutsWhatReachesBehindTheCamera) {
  // A floor 0.1 m below the eye from 1 m behind to 1 km ahead fills the picture below the horizon.
  TriangleMesh floor;
  floor.vertices = {{-500, 0.1f, -1}, {500, 0.1f, -1}, {500, 0.1f, 1000}, {-500, 0.1f, 1000}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  Rasterizer r({part(floor)}, 101, 101, 3);
  r.draw(at(0, 0, 0), camera(), {});
  for (int u = 0; u < 101; u += 10) {
    EXPECT_EQ(r.part_at(u, 48), -1);
    EXPECT_EQ(r.part_at(u, 52), 0);
    EXPECT_EQ(r.part_at(u, 100), 0);
  }
  r.draw(at(0, 0, -2000), camera(), {});
  EXPECT_EQ(area(r), 0.0);
}

TEST(Rasterizer, DistortionAgreesWithOpenCv) {
  CameraModel c = camera(320, 240);
  c.distortion = {0.12, -0.05, 0.003, -0.002, 0.01};
  const auto& k = c.intrinsics;
  const cv::Matx33d K(k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1);
  const std::vector<double> d(c.distortion.begin(), c.distortion.end());
  for (const Eigen::Vector3f& p : {Eigen::Vector3f(0.2f, 0.12f, 0.5f), Eigen::Vector3f(-0.25f, -0.1f, 0.5f)}) {
    Rasterizer r({part(disc(0.004f, 60))}, 320, 240, 5);
    r.draw(at(p.x(), p.y(), p.z()), c, {});
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        centre += r.coverage()[static_cast<std::size_t>(v * 320 + u)] * Eigen::Vector2d(u, v);
      }
    }
    centre /= area(r);
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(std::vector<cv::Point3d>{{p.x(), p.y(), p.z()}}, cv::Vec3d(0, 0, 0), cv::Vec3d(0, 0, 0), K, d,
                      pixels);
    EXPECT_NEAR(centre.x(), pixels[0].x, 0.1);
    EXPECT_NEAR(centre.y(), pixels[0].y, 0.1);
  }
}

}  // namespace
}  // namespace bodyschema::simulator
