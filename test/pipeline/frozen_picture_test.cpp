#include "bodyschema/pipeline/frozen_picture.hpp"

#include <gtest/gtest.h>

namespace bodyschema {
namespace {

TEST(FrozenPicture, TellsARepeatedPictureFromANewOneAndHowFarTheArmMoved) {
  Image image;
  image.width = 3;
  image.height = 3;
  image.channels = 1;
  image.data.assign(9, 7);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(2);
  FrozenPicture frozen;
  EXPECT_FALSE(frozen.look(image, q));
  q(1) = 0.2;
  EXPECT_TRUE(frozen.look(image, q));
  EXPECT_DOUBLE_EQ(frozen.moved_rad(), 0.2);
  q(1) = 0.1;
  EXPECT_TRUE(frozen.look(image, q));
  EXPECT_DOUBLE_EQ(frozen.moved_rad(), 0.2) << "the furthest counts";
  image.data[8] = 8;
  EXPECT_FALSE(frozen.look(image, q));
  EXPECT_DOUBLE_EQ(frozen.moved_rad(), 0.0);
}

}  // namespace
}  // namespace bodyschema
