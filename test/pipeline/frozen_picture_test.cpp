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
  EXPECT_FALSE(frozen.look(image, q).repeated);
  q(1) = 0.2;
  PictureChange change = frozen.look(image, q);
  EXPECT_TRUE(change.repeated);
  EXPECT_DOUBLE_EQ(change.moved_rad, 0.2);
  q(1) = 0.1;
  change = frozen.look(image, q);
  EXPECT_TRUE(change.repeated);
  EXPECT_DOUBLE_EQ(change.moved_rad, 0.2) << "the furthest counts";
  image.data[8] = 8;
  change = frozen.look(image, q);
  EXPECT_FALSE(change.repeated);
  EXPECT_DOUBLE_EQ(change.moved_rad, 0.0);
}

TEST(FrozenPicture, SeesAnyByteThatChanged) {
  Image image;
  image.width = 101;
  image.height = 1;
  image.channels = 1;
  image.data.assign(101, 7);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(2);
  FrozenPicture frozen;
  (void)frozen.look(image, q);
  for (auto& level : image.data) {
    level = 8;
    EXPECT_FALSE(frozen.look(image, q).repeated);
    EXPECT_TRUE(frozen.look(image, q).repeated);
  }
}

}  // namespace
}  // namespace bodyschema
