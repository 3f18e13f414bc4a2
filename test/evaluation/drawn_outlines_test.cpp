#include "drawn_outlines.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"

namespace bodyschema {
namespace {

class DrawnOutlines : public testing::Test {
 protected:
  ~DrawnOutlines() override { std::filesystem::remove(file_); }
  std::vector<DrawnPicture> read(const std::string& text) {
    std::ofstream(file_) << text;
    return read_drawn_outlines(file_);
  }
  std::filesystem::path file_ =
      std::filesystem::temp_directory_path() / ("bodyschema_drawn_" + std::to_string(getpid()) + ".txt");
};

TEST_F(DrawnOutlines, EdgesOfOneArmAreCollectedByPicture) {
  const auto pictures = read("# by hand\nframe 4 51\nL 1,2 3,4.5\nR 5,6\nL 7,8\nframe 10 0\nR 9,9\n");
  ASSERT_EQ(pictures.size(), 2u);
  EXPECT_EQ(pictures[0].episode, 4);
  EXPECT_EQ(pictures[0].row, 51u);
  ASSERT_EQ(pictures[0].left.size(), 3u);
  EXPECT_EQ(pictures[0].left[1], Eigen::Vector2d(3.0, 4.5));
  EXPECT_EQ(pictures[0].left[2], Eigen::Vector2d(7.0, 8.0));
  EXPECT_EQ(pictures[0].right.size(), 1u);
  EXPECT_EQ(pictures[1].right.size(), 1u);
}

TEST_F(DrawnOutlines, WhatIsNoneIsRefusedWithItsLine) {
  for (const std::string text :
       {"L 1,2\n", "frame x 3\n", "frame 1 2\nM 1,2\n", "frame 1 2\nL 1;2\n", "frame 1 2\nL 1,2x\n"}) {
    try {
      read(text);
      FAIL() << text;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(text.starts_with("frame 1") ? ":2:" : ":1:"), std::string::npos)
          << error.what();
    }
  }
}

TEST_F(DrawnOutlines, DistanceIsToTheNearestPixelOfTheOutlineInsideThePicture) {
  BinaryMask mask(40, 30);
  for (int v = 10; v < 30; ++v) {
    for (int u = 20; u < 40; ++u) mask.set(u, v);
  }
  const auto distances = distances_to_outline({{20.0, 15.0}, {15.0, 15.0}, {30.0, 20.0}, {17.0, 6.0}}, mask);
  EXPECT_DOUBLE_EQ(distances[0], 0.0);
  EXPECT_DOUBLE_EQ(distances[1], 5.0);
  EXPECT_DOUBLE_EQ(distances[2], 10.0) << "the picture's border is no outline";
  EXPECT_DOUBLE_EQ(distances[3], 5.0);
  EXPECT_DOUBLE_EQ(distances_to_outline({{1.0, 1.0}}, BinaryMask(40, 30)).front(), 40.0);
}

TEST_F(DrawnOutlines, ThoseOfTheHumanoidLieInItsPictures) {
  const auto pictures = read_drawn_outlines(find_data_file("config/g1/drawn_outlines.txt"));
  EXPECT_EQ(pictures.size(), 48u);
  for (const auto& picture : pictures) {
    EXPECT_GT(picture.left.size() + picture.right.size(), 5u);
    for (const auto* points : {&picture.left, &picture.right}) {
      for (const auto& point : *points) {
        EXPECT_TRUE((point.array() >= 0.0).all() && point.x() < 640.0 && point.y() < 480.0)
            << picture.episode << " " << picture.row << ": " << point.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace bodyschema
