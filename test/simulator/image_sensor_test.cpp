#include "bodyschema/simulator/image_sensor.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/simulator/background.hpp"

namespace bodyschema::simulator {
namespace {

TEST(Random, IsStandardNormalAndUniform) {
  Random random(5, "test");
  double sum = 0, square = 0, fourth = 0, uniform = 0;
  const int n = 200000;
  for (int i = 0; i < n; ++i) {
    const double x = random.normal();
    sum += x;
    square += x * x;
    fourth += x * x * x * x;
    uniform += random.uniform();
  }
  EXPECT_NEAR(sum / n, 0.0, 0.01);
  EXPECT_NEAR(square / n, 1.0, 0.015);
  EXPECT_NEAR(fourth / n, 3.0, 0.1);
  EXPECT_NEAR(uniform / n, 0.5, 0.003);
}

TEST(Random, StreamsOfOneSeedDiffer) {
  EXPECT_NE(Random(1, "a").bits(), Random(1, "b").bits());
  EXPECT_NE(Random(1, "a").bits(), Random(2, "a").bits());
  EXPECT_NE(Random(1, "a", 0).bits(), Random(1, "a", 1).bits());
  EXPECT_EQ(Random(1, "a", 1).bits(), Random(1, "a", 1).bits());
}

TEST(ImageSensor, NoiseHasTheStatedSpreadAndNoMean) {
  for (const double sd : {2.0, 2.5, 5.0}) {
    ImageSensor sensor(200, 150, 0.0, sd);
    Random random(3, "noise");
    std::vector<float> light(200 * 150 * 3, 100.25f);
    Image image;
    sensor.expose(light, 1.0, random, image);
    double sum = 0, square = 0;
    for (const auto level : image.data) {
      sum += level - 100.25;
      square += (level - 100.25) * (level - 100.25);
    }
    const auto n = static_cast<double>(image.data.size());
    EXPECT_NEAR(sum / n, 0.0, 0.05);
    EXPECT_NEAR(std::sqrt(square / n), std::sqrt(sd * sd + 1.0 / 12.0), 0.02 * sd);
  }
}

TEST(ImageSensor, BlurHasTheStatedWidthAndKeepsTheLight) {
  for (const double sd : {0.4, 0.6, 1.5}) {
    ImageSensor sensor(41, 41, sd, 0.0);
    Random random(3, "noise");
    std::vector<float> light(41 * 41 * 3, 0.0f);
    light[(20 * 41 + 20) * 3 + 1] = 200.0f;  // one green point
    Image image;
    sensor.expose(light, 1.0, random, image);
    // `light` now holds the blurred picture before rounding.
    double sum = 0, xx = 0, yy = 0;
    for (int v = 0; v < 41; ++v) {
      for (int u = 0; u < 41; ++u) {
        const double w = light[static_cast<std::size_t>((v * 41 + u) * 3 + 1)];
        sum += w;
        xx += w * (u - 20) * (u - 20);
        yy += w * (v - 20) * (v - 20);
        EXPECT_EQ(light[static_cast<std::size_t>((v * 41 + u) * 3)], 0.0f);
      }
    }
    EXPECT_NEAR(sum, 200.0, 1e-3);
    EXPECT_NEAR(std::sqrt(xx / sum), sd, 0.02 * sd);
    EXPECT_NEAR(std::sqrt(yy / sum), sd, 0.02 * sd);
  }
}

TEST(ImageSensor, BlurLeavesAnEvenPictureEvenUpToTheBorder) {
  for (const double sd : {0.4, 0.9}) {
    ImageSensor sensor(9, 7, sd, 0.0);
    Random random(3, "noise");
    std::vector<float> light(9 * 7 * 3, 77.0f);
    Image image;
    sensor.expose(light, 0.5, random, image);
    for (const float level : light) EXPECT_NEAR(level, 77.0f, 1e-3f);
    for (const auto level : image.data) EXPECT_NEAR(level, 38.5, 0.51);
  }
}

TEST(Background, ClutterIsRichAndTurnsWithTheHead) {
  CameraModel camera;
  camera.intrinsics = {160, 120, 128.0, 128.0, 79.5, 59.5};
  const auto background = Background::clutter({Eigen::Vector3f(170, 165, 160)}, 4);
  Pose X_WC = Pose::Identity();
  X_WC.translation() = Eigen::Vector3d(0, 0, 0.3);
  std::vector<float> ahead, again, turned;
  background.paint(camera, X_WC, ahead);
  background.paint(camera, X_WC, again);
  EXPECT_EQ(ahead, again);
  // A turn about the vertical by d moves the middle of the picture by f tan d.
  X_WC.rotate(Eigen::AngleAxisd(std::atan(8.0 / 128.0), Eigen::Vector3d::UnitY()));
  background.paint(camera, X_WC, turned);
  double still = 0, shifted = 0;
  for (int v = 40; v < 80; ++v) {
    for (int u = 60; u < 100; ++u) {
      for (int k = 0; k < 3; ++k) {
        const float now = turned[static_cast<std::size_t>((v * 160 + u) * 3 + k)];
        still += std::abs(now - ahead[static_cast<std::size_t>((v * 160 + u) * 3 + k)]);
        shifted += std::abs(now - ahead[static_cast<std::size_t>((v * 160 + u + 8) * 3 + k)]);
      }
    }
  }
  EXPECT_LT(shifted, 0.4 * still);
  double sum = 0, square = 0;
  for (const float level : ahead) {
    sum += level;
    square += level * level;
  }
  const auto n = static_cast<double>(ahead.size());
  EXPECT_GT(std::sqrt(square / n - sum * sum / n / n), 30.0) << "clutter should differ from itself";
}

}  // namespace
}  // namespace bodyschema::simulator
