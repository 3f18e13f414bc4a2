#include "bodyschema/camera/picture_reduction.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(PictureReduction, LeavesTwiceThePixelsOfASmallPicture) {
  EXPECT_EQ(picture_reduction(320, 240), 1);
  EXPECT_EQ(picture_reduction(640, 480), 1);
  EXPECT_EQ(picture_reduction(960, 540), 1);
  EXPECT_EQ(picture_reduction(1280, 720), 2);
  EXPECT_EQ(picture_reduction(1920, 1080), 2);
  EXPECT_EQ(picture_reduction(3840, 2160), 4);
}

TEST(PictureReduction, HalvesNothingThatHasNoHalf) {
  EXPECT_EQ(picture_reduction(1281, 720), 1);
  EXPECT_EQ(picture_reduction(3842, 2160), 2);
}

// Where a point appears is the same place of the picture: the mean of n pixels lies in their middle.
TEST(PictureReduction, ACameraSeesEachPointWhereItWas) {
  const PinholeIntrinsics camera{1280, 720, 900.0, 905.0, 640.3, 357.1};
  for (const int n : {2, 4}) {
    const PinholeIntrinsics small = reduced(camera, n);
    EXPECT_EQ(small.width, 1280 / n);
    EXPECT_EQ(small.height, 720 / n);
    EXPECT_EQ(small.reduction, n);
    const Eigen::Vector3d p_C(0.07, -0.04, 0.3);
    const Eigen::Vector2d middle = n * small.project(p_C) + Eigen::Vector2d::Constant(0.5 * (n - 1));
    EXPECT_LT((middle - camera.project(p_C)).norm(), 1e-9);
  }
  EXPECT_EQ(reduced(reduced(camera, 2), 2), reduced(camera, 4));
}

TEST(PictureReduction, EachPixelIsTheMeanOfItsOwn) {
  Image image(4, 2, 3);
  for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<std::uint8_t>(10 * i);
  const Image half = reduced(image, 2);
  EXPECT_EQ(half.width, 2);
  EXPECT_EQ(half.height, 1);
  // Of the first channel: 0, 30, 120, 150.
  EXPECT_EQ(half.pixel(0, 0)[0], 75);
  EXPECT_EQ(half.pixel(0, 0)[2], 95);
  EXPECT_EQ(half.pixel(1, 0)[0], 135);
}

}  // namespace
}  // namespace bodyschema
