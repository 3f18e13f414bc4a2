// The recorded iCub: masks against the recipe that the data's README states. Skipped without data.

#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <algorithm>

#include "bodyschema/vision/mask_picture.hpp"
#include "bodyschema/vision/segmenter.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

/// "|image - background| > 2 levels in any channel, less components under 40 px", black ignored.
BinaryMask recipe(const Image& image, const Image& background) {
  BinaryMask raw(image.width, image.height), kept(image.width, image.height);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      const auto* p = image.pixel(u, v);
      const auto* b = background.pixel(u, v);
      bool differs = false;
      for (int c = 0; c < 3; ++c) differs |= std::abs(int{p[c]} - int{b[c]}) > 2;
      raw.set(u, v, differs && (b[0] | b[1] | b[2]) != 0);
    }
  }
  BinaryMask seen(image.width, image.height);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (!raw.at(u, v) || seen.at(u, v)) continue;
      std::vector<std::pair<int, int>> piece{{u, v}};
      seen.set(u, v);
      for (std::size_t i = 0; i < piece.size(); ++i) {
        for (int dv = -1; dv <= 1; ++dv) {
          for (int du = -1; du <= 1; ++du) {
            const int a = piece[i].first + du, b = piece[i].second + dv;
            if (a < 0 || b < 0 || a >= image.width || b >= image.height) continue;
            if (!raw.at(a, b) || seen.at(a, b)) continue;
            seen.set(a, b);
            piece.push_back({a, b});
          }
        }
      }
      if (piece.size() < 40) continue;
      for (const auto& [a, b] : piece) kept.set(a, b);
    }
  }
  return kept;
}

class Recording : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    root_ = data_folder() / "eyehand-sim";
    SKIP_WITHOUT("eyehand-sim");
    for (const auto& entry : std::filesystem::directory_iterator(root_ / "yarp" / "images" / GetParam())) {
      if (entry.path().extension() == ".ppm") files_.push_back(entry.path());
    }
    std::sort(files_.begin(), files_.end());
    ASSERT_GT(files_.size(), 100u);
    background_file_ = root_ / ("background_" + GetParam() + ".png");
  }
  std::filesystem::path root_, background_file_;
  std::vector<std::filesystem::path> files_;
};

TEST_P(Recording, GivenBackgroundFollowsTheRecipe) {
  VisionSetup setup;
  setup.method = SegmentationMethod::kBackgroundPicture;
  setup.edges = EdgeKind::kHard;
  setup.background_pictures[GetParam()] = background_file_;
  setup.black_is_unknown = true;
  setup.max_hole_px = 0;
  Segmenter segmenter(setup, GetParam(), 320, 240);
  const Image background = read_picture(background_file_);
  std::size_t unknown = 0;
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const auto* b = background.pixel(u, v);
      unknown += (b[0] | b[1] | b[2]) == 0;
    }
  }
  EXPECT_EQ(unknown, GetParam() == "left" ? 185u : 250u);
  BinaryMask mask, valid;
  std::vector<std::uint8_t> coverage;
  for (std::size_t i = 0; i < files_.size(); i += 12) {
    const Image image = read_picture(files_[i]);
    segmenter.segment(image, mask, valid, coverage);
    EXPECT_EQ(mask, recipe(image, background)) << files_[i];
    EXPECT_EQ(valid.count(), 320u * 240u - unknown);
    EXPECT_GT(mask.count(), 6000u);
  }
}

TEST_P(Recording, BackgroundIsLearnedFromTheMovingArm) {
  // Only what the robot uncovers now and then can be learned; there it must agree with the picture.
  VisionSetup setup;
  setup.method = SegmentationMethod::kLearnedBackground;
  setup.edges = EdgeKind::kHard;
  Segmenter segmenter(setup, GetParam(), 320, 240);
  for (std::size_t i = 0; i < files_.size(); i += 3) segmenter.learn_from(read_picture(files_[i]));
  segmenter.finish_learning();
  const Image background = read_picture(background_file_);
  const auto& model = segmenter.background();
  std::size_t wrong = 0, known = 0;
  for (std::size_t i = 0; i < model.pixels(); ++i) {
    const auto* b = &background.data[3 * i];
    if ((b[0] | b[1] | b[2]) == 0 || model.precision[i] <= 0.0f) continue;
    ++known;
    float worst = 0.0f;
    for (std::size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(model.mean[3 * i + c] - b[c]));
    wrong += worst > 3.0f;
  }
  std::printf("    known %zu, wrong %zu\n", known, wrong);
  EXPECT_GT(known, 74000u);
  EXPECT_LT(wrong, 50u);
}

INSTANTIATE_TEST_SUITE_P(Cameras, Recording, ::testing::Values("left", "right"),
                         [](const auto& camera) { return camera.param; });

}  // namespace
}  // namespace bodyschema
