#include "bodyschema/vision/mask_picture.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

class MaskPicture : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("bodyschema_mask_picture_" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_;
};

TEST_F(MaskPicture, MaskReadsBack) {
  BinaryMask mask(70, 10), valid(70, 10);
  valid.fill(true);
  for (int v = 2; v < 8; ++v) {
    for (int u = 60; u < 69; ++u) mask.set(u, v);
  }
  valid.set(0, 0, false);
  write_mask_png(folder_ / "deep" / "mask.png", mask, valid);
  const auto read = read_picture(folder_ / "deep" / "mask.png");
  ASSERT_EQ(read.width, 70);
  ASSERT_EQ(read.channels, 1);
  EXPECT_EQ(*read.pixel(0, 0), 128);
  EXPECT_EQ(*read.pixel(1, 0), 0);
  EXPECT_EQ(*read.pixel(68, 7), 255);
}

/// Of pictures that are looked at reduced (1280x720) masks were written half as large, and could not be given back.
TEST_F(MaskPicture, AMaskOfAReducedPictureIsWrittenAsLargeAsTheCamerasOwn) {
  BinaryMask mask(6, 4);
  mask.set(2, 1);
  write_mask_png(folder_ / "mask.png", mask, {}, 2);
  const auto read = read_picture(folder_ / "mask.png");
  ASSERT_EQ(read.width, 12);
  ASSERT_EQ(read.height, 8);
  for (int v = 0; v < 8; ++v) {
    for (int u = 0; u < 12; ++u) EXPECT_EQ(*read.pixel(u, v), u / 2 == 2 && v / 2 == 1 ? 255 : 0) << u << ' ' << v;
  }
}

TEST_F(MaskPicture, ColoursAreReadAsRgb) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "colour.ppm", std::ios::binary) << "P6\n2 1\n255\n\xc8\x01\x02\x03\x04\x05";
  const auto read = read_picture(folder_ / "colour.ppm");
  ASSERT_EQ(read.channels, 3);
  EXPECT_EQ(read.data, (std::vector<std::uint8_t>{200, 1, 2, 3, 4, 5}));
}

TEST_F(MaskPicture, ErrorsNameTheFile) {
  const auto expect_named = [](const auto& action, const std::string& name) {
    try {
      action();
      FAIL() << "no error for " << name;
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  };
  expect_named([&] { read_picture(folder_ / "absent.png"); }, "absent.png");
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "broken.png") << "not a picture";
  expect_named([&] { read_picture(folder_ / "broken.png"); }, "broken.png");
  expect_named([&] { write_mask_png(folder_ / "empty.png", BinaryMask{}); }, "empty.png");
  expect_named([&] { write_mask_png(folder_ / "mask.nosuchformat", BinaryMask(4, 4)); }, "mask.nosuchformat");
}

}  // namespace
}  // namespace bodyschema
