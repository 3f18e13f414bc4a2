#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

CameraModel camera_with(const std::array<double, 5>& distortion) {
  CameraModel camera;
  camera.name = "left";
  camera.intrinsics = {160, 120, 130.0, 128.0, 78.5, 61.0};
  camera.distortion = distortion;
  return camera;
}

/// Where a lens with these coefficients puts a point that a pinhole would put at `pixel`
/// (Brown-Conrady, written out from its definition).
Eigen::Vector2d distorted(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const auto& k = camera.intrinsics;
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  const double x = (pixel.x() - k.cx) / k.fx, y = (pixel.y() - k.cy) / k.fy;
  const double r2 = x * x + y * y;
  const double radial = 1 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
  const double xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  return {k.fx * xd + k.cx, k.fy * yd + k.cy};
}

const std::array<double, 5> kBarrel = {-0.25, 0.08, 0.004, -0.003, -0.01};

TEST(Undistorter, LeavesPicturesOfAPinholeAlone) {
  const Undistorter undistorter(camera_with({}));
  Image image(160, 120, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = static_cast<std::uint8_t>(i * 7919 % 251);
  }
  EXPECT_EQ(undistorter.apply(image).data, image.data);
  EXPECT_EQ(undistorter.valid().count(), 160u * 120u);
}

TEST(Undistorter, TakesEachPixelFromWhereTheLensPutIt) {
  const CameraModel camera = camera_with(kBarrel);
  const Undistorter undistorter(camera);
  // A picture whose gray value is linear in position shows where every pixel came from.
  for (const bool along_x : {true, false}) {
    Image ramp(160, 120, 1);
    for (int v = 0; v < 120; ++v) {
      for (int u = 0; u < 160; ++u) *ramp.pixel(u, v) = static_cast<std::uint8_t>(along_x ? u : v);
    }
    const Image straight = undistorter.apply(ramp);
    double largest_move_px = 0.0;
    for (int v = 0; v < 120; v += 7) {
      for (int u = 0; u < 160; u += 7) {
        const Eigen::Vector2d from = distorted(camera, {u, v});
        if (from.x() < 0 || from.x() > 159 || from.y() < 0 || from.y() > 119) continue;
        const double expected = along_x ? from.x() : from.y();
        EXPECT_NEAR(*straight.pixel(u, v), expected, 0.6) << u << " " << v;  // rounded to whole gray
        largest_move_px = std::max(largest_move_px, (from - Eigen::Vector2d(u, v)).norm());
      }
    }
    EXPECT_GT(largest_move_px, 5.0);  // or nothing was tested
  }
}

TEST(Undistorter, KnowsWhichPixelsTheCameraSaw) {
  const CameraModel camera = camera_with({0.3, 0, 0, 0, 0});  // pincushion: corners from outside
  const BinaryMask valid = Undistorter(camera).valid();
  EXPECT_FALSE(valid.at(0, 0));
  EXPECT_FALSE(valid.at(159, 119));
  EXPECT_TRUE(valid.at(80, 60));
  for (int v = 0; v < 120; v += 5) {
    for (int u = 0; u < 160; u += 5) {
      const Eigen::Vector2d from = distorted(camera, {u, v});
      const double inside = std::min({from.x(), 159 - from.x(), from.y(), 119 - from.y()});
      if (std::abs(inside) < 1e-3) continue;
      EXPECT_EQ(valid.at(u, v), inside > 0) << u << " " << v;
    }
  }
}

TEST(Undistorter, BringsInNoColourThatIsNotInThePicture) {
  const Undistorter undistorter(camera_with({0.3, 0, 0, 0, 0}));
  Image image(160, 120, 1);
  std::fill(image.data.begin(), image.data.end(), std::uint8_t{120});
  EXPECT_EQ(undistorter.apply(image).data, image.data) << "nor where the camera did not look";
}

TEST(Undistorter, KeepsColoursApart) {
  const Undistorter undistorter(camera_with(kBarrel));
  Image image(160, 120, 3);
  for (int v = 0; v < 120; ++v) {
    for (int u = 0; u < 160; ++u) {
      image.pixel(u, v)[0] = 10;
      image.pixel(u, v)[1] = 100;
      image.pixel(u, v)[2] = 200;
    }
  }
  const Image straight = undistorter.apply(image);
  EXPECT_EQ(straight.channels, 3);
  EXPECT_EQ(straight.pixel(80, 60)[0], 10);
  EXPECT_EQ(straight.pixel(80, 60)[1], 100);
  EXPECT_EQ(straight.pixel(80, 60)[2], 200);
}

TEST(Undistorter, RefusesAPictureOfAnotherSize) {
  EXPECT_THROW(Undistorter(camera_with({})).apply(Image(320, 240, 1)), DataError);
  EXPECT_THROW(Undistorter(camera_with(kBarrel)).apply(Image()), DataError);
}

}  // namespace
}  // namespace bodyschema
