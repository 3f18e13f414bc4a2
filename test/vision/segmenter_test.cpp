#include "bodyschema/vision/segmenter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/vision/mask_picture.hpp"
#include "vision/scene.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

/// @param picture  RGB
void write_ppm(const std::filesystem::path& file, const Image& picture) {
  std::ofstream(file, std::ios::binary) << "P6\n"
                                        << picture.width << ' ' << picture.height << "\n255\n"
                                        << std::string(picture.data.begin(), picture.data.end());
}

using test::Scene;
using test::Texture;

struct Output {
  BinaryMask mask, valid;
  std::vector<std::uint8_t> coverage;
};

double iou(const BinaryMask& a, const BinaryMask& b) {
  std::size_t in = 0, all = 0;
  for (int v = 0; v < a.height(); ++v) {
    for (int u = 0; u < a.width(); ++u) {
      in += a.at(u, v) && b.at(u, v);
      all += a.at(u, v) || b.at(u, v);
    }
  }
  return all == 0 ? 1.0 : static_cast<double>(in) / static_cast<double>(all);
}

VisionSetup setup_for(SegmentationMethod method) {
  VisionSetup setup;
  setup.method = method;
  return setup;
}

/// Pictures of one scene that differ by noise.
std::vector<Image> pictures(const Scene& scene, int count, std::mt19937& random) {
  const auto ideal = scene.ideal();
  std::vector<Image> result;
  for (int i = 0; i < count; ++i) result.push_back(scene.picture(ideal, random));
  return result;
}

/// Pictures without the robot, then the outline's error over a few places of the hand.
test::EdgeStatistics measure(Scene scene, const VisionSetup& setup, unsigned seed, double least_iou = 0.97) {
  std::mt19937 random(seed);
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  if (setup.method == SegmentationMethod::kLearnedBackground) {
    segmenter.learn(pictures(scene.without_robot(), 20, random));
  }
  test::EdgeStatistics total;
  constexpr int kPlaces = 3;
  Output out;
  for (int k = 0; k < kPlaces; ++k) {
    scene.shapes = test::hand(78.0 + 1.37 * k, 62.0 + 0.71 * k);
    segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
    EXPECT_GT(iou(out.mask, scene.true_mask()), least_iou);
    const auto edge = test::edge_statistics(scene.outline(), scene.width, scene.height, out.coverage, out.valid);
    total.bias += edge.bias / kPlaces;
    total.sd += edge.sd / kPlaces;
    total.found += edge.found / kPlaces;
    total.worst = std::max(total.worst, edge.worst);
  }
  std::printf("    outline: bias %+.3f px, sd %.3f px, worst %.2f px, found %.1f %%\n", total.bias, total.sd,
              total.worst, 100.0 * total.found);
  return total;
}

TEST(Segmenter, OutlineOnPlainBackgroundIsExactToAFractionOfAPixel) {
  for (const bool bright : {true, false}) {
    for (const int channels : {3, 1}) {
      Scene scene;
      scene.channels = channels;
      if (!bright) {
        for (int c = 0; c < 3; ++c) {
          scene.robot[c] = 40 + 5 * c;
          scene.base[c] = 150 + 10 * c;
        }
      }
      const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 1);
      EXPECT_LT(std::abs(edge.bias), 0.05) << "bright " << bright << ", channels " << channels;
      EXPECT_LT(edge.sd, 0.1);
      EXPECT_GT(edge.found, 0.99);
    }
  }
}

TEST(Segmenter, ShadingUpToTheOutlineDoesNotMoveIt) {
  // Lambert shading falls steeply towards the outline: the robot's colour there is neither that of
  // its middle nor seen unmixed anywhere.
  for (const bool from_the_side : {false, true}) {
    for (const double behind : {50.0, 220.0}) {
      Scene scene;
      scene.ambient = 0.5;
      for (int c = 0; c < 3; ++c) {
        scene.base[c] = behind + 5 * c;
        scene.robot[c] = (behind < 100.0 ? 220.0 : 160.0) - 5 * c;
      }
      if (from_the_side) {
        scene.lamp[0] = scene.lamp[1] = -0.6;
        scene.lamp[2] = 0.53;
      }
      const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 12);
      EXPECT_LT(std::abs(edge.bias), 0.05) << "side " << from_the_side << ", behind " << behind;
      EXPECT_LT(edge.sd, 0.12);
      EXPECT_GT(edge.found, 0.99);
    }
  }
}

TEST(Segmenter, AnOverexposedRobotIsNotPlacedWhereItsShadeLooksLikeTheBackground) {
  // White covers before a white wall, lit from the side: on the flanks away from the lamp the last pixels look like the
  // wall, and further in nothing shows that their shading begins.
  Scene scene;
  scene.ambient = 0.665;
  scene.rounding_px = 5.0;
  scene.lamp[0] = scene.lamp[1] = -0.6;
  scene.lamp[2] = 0.53;
  for (int c = 0; c < 3; ++c) {
    scene.robot[c] = 340.0 - c;
    scene.base[c] = scene.ambient * scene.robot[c];
  }
  const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 14, 0.7);
  EXPECT_LT(std::abs(edge.bias), 0.1);
  EXPECT_LT(edge.sd, 0.3);
}

TEST(Segmenter, AnOverexposedRobotIsPlacedBeforeWhatIsNoShadeOfIt) {
  for (const bool dark : {true, false}) {
    Scene scene;  // before a blue wall, or a dark grey one
    scene.ambient = 0.7;
    scene.rounding_px = 5.0;
    for (int c = 0; c < 3; ++c) {
      scene.robot[c] = 300.0 - c;
      scene.base[c] = dark ? 90.0 : 60.0 + 80.0 * c;
    }
    const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 15, 0.95);
    EXPECT_LT(std::abs(edge.bias), 0.2) << "dark " << dark;
    EXPECT_GT(edge.found, 0.95) << "dark " << dark;
  }
}

TEST(Segmenter, FaintRobotOnASingleColour) {
  // Nine standard deviations of the noise; the colours once counted as one.
  Scene scene;
  for (int c = 0; c < 3; ++c) {
    scene.base[c] = 150 + 10 * c;
    scene.robot[c] = 170 - 5 * c;
  }
  const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 13);
  EXPECT_LT(std::abs(edge.bias), 0.08);
  EXPECT_LT(edge.sd, 0.25);
  EXPECT_GT(edge.found, 0.97);
}

TEST(Segmenter, LightMayVarySlowlyOverASingleColour) {
  Scene scene;
  scene.texture = Texture::kGradient;
  const auto edge = measure(scene, setup_for(SegmentationMethod::kSingleColour), 2);
  EXPECT_LT(std::abs(edge.bias), 0.05);
  EXPECT_LT(edge.sd, 0.1);
}

TEST(Segmenter, OutlineOnClutterLearnedFromNoisyFrames) {
  for (const bool bright : {true, false}) {
    Scene scene;
    scene.texture = Texture::kClutter;
    if (!bright) {
      for (int c = 0; c < 3; ++c) scene.robot[c] = 40 + 5 * c;
    }
    const auto edge = measure(scene, setup_for(SegmentationMethod::kLearnedBackground), 3);
    // Borders in the background that run through the outline's pixels once threw it by a pixel.
    EXPECT_LT(std::abs(edge.bias), 0.05) << "bright " << bright;
    EXPECT_LT(edge.sd, 0.12);
    EXPECT_LT(edge.worst, 0.8);
    EXPECT_GT(edge.found, 0.98);
  }
}

TEST(Segmenter, EmptySceneGivesEmptyMaskWhateverTheNoise) {
  for (const double noise : {0.0, 1.0, 2.5, 6.0}) {
    for (const auto texture : {Texture::kPlain, Texture::kClutter}) {
      Scene scene;
      scene.texture = texture;
      scene.noise_levels = noise;
      std::mt19937 random(4);
      const auto ideal = scene.ideal();
      auto setup = setup_for(texture == Texture::kPlain ? SegmentationMethod::kSingleColour
                                                        : SegmentationMethod::kLearnedBackground);
      setup.learning_frames = 10;
      Segmenter segmenter(setup, "left", scene.width, scene.height);
      Output out;
      for (int i = 0; i < 20; ++i) {
        segmenter.segment(scene.picture(ideal, random), out.mask, out.valid, out.coverage);
        EXPECT_EQ(out.mask.count(), 0u) << "noise " << noise << ", frame " << i;
      }
      EXPECT_NEAR(segmenter.background().noise_sd, std::max(noise, 0.4), 0.1 + 0.1 * noise);
      EXPECT_EQ(out.valid.count(), static_cast<std::size_t>(scene.width * scene.height));
    }
  }
}

TEST(Segmenter, RobotThatFillsTheViewIsAllMask) {
  Scene scene;
  std::mt19937 random(5);
  auto setup = setup_for(SegmentationMethod::kSingleColour);
  setup.background_rgb = {60, 90, 120};
  scene.shapes = {{80, 60, 80, 60, 500}};
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  Output out;
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
  EXPECT_EQ(out.mask.count(), static_cast<std::size_t>(scene.width * scene.height));
}

TEST(Segmenter, LearnsBehindAMovingRobotOffline) {
  Scene scene;
  scene.texture = Texture::kClutter;
  scene.ambient = 0.6;
  scene.supersampling = 3;
  std::mt19937 random(6);
  const auto truth = scene.without_robot().ideal();
  // A reach that rests for as long as it moves, at both ends; never a frame without the robot.
  std::vector<Image> frames;
  for (int i = 0; i < 60; ++i) {
    const double t = std::clamp((i - 15) / 30.0, 0.0, 1.0);
    scene.shapes = test::hand(120 - 80 * t, 90 - 40 * t);
    frames.push_back(scene.picture(random));
  }
  Segmenter segmenter(setup_for(SegmentationMethod::kLearnedBackground), "left", scene.width, scene.height);
  segmenter.learn(frames);
  const auto& model = segmenter.background();
  std::size_t known = 0, wrong = 0;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const auto i = static_cast<std::size_t>(v * scene.width + u);
      if (model.precision[i] <= 0) continue;
      ++known;
      float worst = 0;
      for (int c = 0; c < 3; ++c) {
        worst =
            std::max(worst, std::abs(model.mean[3 * i + static_cast<std::size_t>(c)] - truth.at<cv::Vec3f>(v, u)[c]));
      }
      wrong += worst > 5.0f;
    }
  }
  std::printf("    known %zu, wrong %zu of %d\n", known, wrong, scene.width * scene.height);
  EXPECT_GT(known, 0.97 * scene.width * scene.height);
  EXPECT_LT(wrong, 0.01 * scene.width * scene.height);
}

TEST(Segmenter, LearnsLiveBeforeTheRobotComes) {
  Scene scene;
  scene.texture = Texture::kClutter;
  scene.supersampling = 4;
  std::mt19937 random(7);
  auto setup = setup_for(SegmentationMethod::kLearnedBackground);
  setup.learning_frames = 15;
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  const auto empty = scene.without_robot().ideal();
  Output out;
  for (int i = 0; i < 15; ++i) {
    EXPECT_FALSE(segmenter.ready());
    segmenter.segment(scene.picture(empty, random), out.mask, out.valid, out.coverage);
    EXPECT_EQ(out.valid.count(), 0u);
    EXPECT_EQ(out.mask.count(), 0u);
  }
  EXPECT_TRUE(segmenter.ready());
  // The robot enters and stays: it must not melt into the background.
  for (int i = 0; i < 8; ++i) {
    scene.shapes = test::hand(160 - 10 * i, 70);
    const Image picture = scene.picture(random);
    segmenter.segment(picture, out.mask, out.valid, out.coverage);
    segmenter.adapt(picture, out.mask);
    EXPECT_GT(iou(out.mask, scene.true_mask()), 0.97) << "frame " << i;
  }
  const auto resting = pictures(scene, 7, random);
  for (std::size_t i = 0; i < 700; ++i) {
    segmenter.segment(resting[i % resting.size()], out.mask, out.valid, out.coverage);
    segmenter.adapt(resting[i % resting.size()], out.mask);
  }
  EXPECT_GT(iou(out.mask, scene.true_mask()), 0.97);
}

TEST(Segmenter, WhatMovedInTheBackgroundIsLearnedAnewOutsideThePrediction) {
  Scene scene;
  std::mt19937 random(8);
  auto setup = setup_for(SegmentationMethod::kLearnedBackground);
  setup.learning_frames = 10;
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  Output out;
  const auto empty = scene.without_robot().ideal();
  for (int i = 0; i < 10; ++i) {
    segmenter.segment(scene.picture(empty, random), out.mask, out.valid, out.coverage);
  }
  Scene with_object = scene;
  with_object.shapes = {{30, 30, 30, 30, 10}};
  const auto frames = pictures(with_object, 7, random);
  const BinaryMask prediction(scene.width, scene.height);  // the robot is elsewhere
  segmenter.segment(frames[0], out.mask, out.valid, out.coverage);
  EXPECT_GT(out.mask.count(), 250u);
  for (std::size_t i = 0; i < 600; ++i) {
    segmenter.segment(frames[i % frames.size()], out.mask, out.valid, out.coverage);
    segmenter.adapt(frames[i % frames.size()], out.mask, &prediction);
  }
  EXPECT_EQ(out.mask.count(), 0u);
}

/// A search of 64 px of a 320x240 picture is one of 148 px here.
TEST(Segmenter, StatisticsLookFarInLargePictures) {
  auto setup = setup_for(SegmentationMethod::kStatistics);
  setup.search_px = 64;
  std::mt19937 random(15);
  Scene scene;
  scene.width = 740;
  scene.height = 555;
  scene.supersampling = 1;
  scene.shapes = {{370, 280, 370, 280, 90}};
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  Output out;
  const auto prediction = scene.true_mask();
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, &prediction);
  EXPECT_GT(iou(out.mask, prediction), 0.95);
}

TEST(Segmenter, StatisticsFollowThePredictionOnAMovingBackground) {
  // Every frame shows another part of the clutter; the prediction is four pixels off.
  auto setup = setup_for(SegmentationMethod::kStatistics);
  std::mt19937 random(14);
  Scene scene;
  scene.texture = Texture::kClutter;
  scene.ambient = 0.7;
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  Output out;
  double predicted_iou = 0.0, seen_iou = 0.0;
  constexpr int kFrames = 6;
  for (int i = 0; i < kFrames; ++i) {
    scene.shift_u = 37.0 * i;
    scene.shapes = test::hand(78.0 + 2.0 * i, 62.0);
    Scene believed = scene;
    believed.shapes = test::hand(78.0 + 2.0 * i + 3.0, 62.0 - 3.0);
    const auto prediction = believed.true_mask();
    segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, &prediction);
    predicted_iou += iou(prediction, scene.true_mask()) / kFrames;
    seen_iou += iou(out.mask, scene.true_mask()) / kFrames;
  }
  std::printf("    IoU with the truth: prediction %.3f, mask %.3f\n", predicted_iou, seen_iou);
  EXPECT_LT(predicted_iou, 0.8);
  EXPECT_GT(seen_iou, 0.92);
  // Without a prediction there is nothing to go by.
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
  EXPECT_EQ(out.mask.count(), 0u);
  EXPECT_EQ(out.valid.count(), 0u);
  const BinaryMask nowhere(scene.width, scene.height);
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, &nowhere);
  EXPECT_EQ(out.mask.count(), 0u);
  EXPECT_EQ(out.valid.count(), static_cast<std::size_t>(scene.width * scene.height));
}

TEST(Segmenter, LearnsAnewWhenPicturesTurnFromGrayToColour) {
  Scene scene;
  scene.texture = Texture::kClutter;
  scene.supersampling = 4;
  std::mt19937 random(11);
  auto setup = setup_for(SegmentationMethod::kLearnedBackground);
  setup.learning_frames = 15;
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  Output out;
  for (const int channels : {1, 3}) {
    scene.channels = channels;
    scene.shapes.clear();
    for (const Image& picture : pictures(scene, 15, random)) {
      segmenter.segment(picture, out.mask, out.valid, out.coverage);
      EXPECT_EQ(out.mask.count(), 0u);
      segmenter.adapt(picture, out.mask);
    }
    EXPECT_TRUE(segmenter.ready());
    scene.shapes = test::hand(120, 70);
    segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
    EXPECT_GT(iou(out.mask, scene.true_mask()), 0.9) << channels;
  }
}

TEST(Segmenter, RefusesPicturesThatDoNotFit) {
  Segmenter segmenter(setup_for(SegmentationMethod::kSingleColour), "left", 32, 24);
  Output out;
  const auto expect_refused = [&](const Image& image) {
    EXPECT_THROW(segmenter.segment(image, out.mask, out.valid, out.coverage), DataError);
    EXPECT_THROW(segmenter.learn_from(image), DataError);
  };
  expect_refused(Image{});
  expect_refused(Image(24, 32, 3));
  expect_refused(Image(32, 24, 2));
  Image cut(32, 24, 3);
  cut.data.pop_back();
  expect_refused(cut);
  EXPECT_NO_THROW(segmenter.segment(Image(32, 24, 1), out.mask, out.valid, out.coverage));
  EXPECT_THROW(Segmenter(VisionSetup{}, "left", 0, 24), ConfigurationError);
}

TEST(Segmenter, TinyPicturesDoNotBreakAnything) {
  for (const auto method : {SegmentationMethod::kSingleColour, SegmentationMethod::kLearnedBackground}) {
    for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {2, 2}, {65, 1}, {3, 64}}) {
      auto setup = setup_for(method);
      setup.learning_frames = 2;
      setup.min_component_px = 1;
      Segmenter segmenter(setup, "left", width, height);
      Output out;
      std::mt19937 random(9);
      for (int i = 0; i < 6; ++i) {
        Image image(width, height, 3);
        for (auto& byte : image.data) byte = static_cast<std::uint8_t>(random());
        segmenter.segment(image, out.mask, out.valid, out.coverage);
        EXPECT_EQ(out.coverage.size(), static_cast<std::size_t>(width * height));
      }
    }
  }
}

TEST(Segmenter, BackgroundPictureMustBeThereAndFit) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "background.png";
  write_mask_png(file, BinaryMask(10, 10));
  auto setup = setup_for(SegmentationMethod::kBackgroundPicture);
  setup.background_pictures["left"] = file;
  EXPECT_THROW(Segmenter(setup, "right", 10, 10), ConfigurationError);
  EXPECT_THROW(Segmenter(setup, "left", 10, 11), FileError);
  EXPECT_NO_THROW(Segmenter(setup, "left", 10, 10));
  // Refused for what its header says, before memory for 900 million pixels is taken.
  {
    std::ofstream large(file, std::ios::binary | std::ios::in);
    large.seekp(16);
    large.write("\0\0\x40\0\0\0\x40\0", 8);
  }
  EXPECT_THAT(
      [&] { Segmenter(setup, "left", 10, 10); },
      testing::ThrowsMessage<FileError>(testing::HasSubstr("background picture is 16384x16384, camera 'left'")));
  {
    std::ofstream larger(file, std::ios::binary | std::ios::in);
    larger.seekp(16);
    larger.write("\0\0\x75\x30\0\0\x75\x30", 8);
  }
  EXPECT_THAT([&] { Segmenter(setup, "left", 10, 10); },
              testing::ThrowsMessage<FileError>(testing::HasSubstr("header says 30000x30000 px")));
  setup.background_pictures["left"] = "/nonexistent/picture.png";
  EXPECT_THROW(Segmenter(setup, "left", 10, 10), FileError);
  std::filesystem::remove(file);
}

TEST(Segmenter, GivenCleanPictureAndNoisyFrames) {
  Scene scene;
  scene.texture = Texture::kClutter;
  std::mt19937 random(10);
  auto clean = scene.without_robot();
  clean.noise_levels = 0;
  const Image background = clean.picture(random);
  const TemporaryFolder folder;
  const auto file = folder.path() / "clean.ppm";
  write_ppm(file, background);
  auto setup = setup_for(SegmentationMethod::kBackgroundPicture);
  setup.background_pictures["left"] = file;
  Segmenter segmenter(setup, "left", scene.width, scene.height);
  std::filesystem::remove(file);
  scene.shapes = test::hand(78.3, 62.6);
  Output out;
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
  EXPECT_NEAR(segmenter.background().noise_sd, 2.5, 0.4);
  EXPECT_GT(iou(out.mask, scene.true_mask()), 0.98);
  EXPECT_THROW(segmenter.segment(Image(scene.width, scene.height, 1), out.mask, out.valid, out.coverage), DataError);
}

TEST(Segmenter, AGivenPictureIsStraightenedAndBesideUnknownPixelsNothingIsKnown) {
  CameraModel camera;
  camera.name = "left";
  camera.intrinsics = {160, 120, 130.0, 130.0, 79.5, 59.5};
  camera.distortion = {-0.3, 0.0, 0.0, 0.0, 0.0};
  const Undistorter lens(camera);
  Image behind(160, 120, 3);
  for (std::size_t i = 0; i < behind.data.size(); ++i) behind.data[i] = (i / 3 / 10 + i / 480 / 10) % 2 == 0 ? 60 : 190;
  // Where the arm never left, the picture is black.
  Image picture = behind;
  for (int v = 20; v < 100; ++v) std::fill(picture.pixel(20, v), picture.pixel(60, v), std::uint8_t{0});
  const TemporaryFolder folder;
  const auto file = folder.path() / "lens.ppm";
  write_ppm(file, picture);
  auto setup = setup_for(SegmentationMethod::kBackgroundPicture);
  setup.background_pictures["left"] = file;
  setup.black_is_unknown = true;
  for (const auto edges : {EdgeKind::kBlurred, EdgeKind::kHard}) {
    setup.edges = edges;
    setup.min_component_px = 1;
    Segmenter segmenter(setup, "left", 160, 120, &lens);
    Output out;
    segmenter.segment(lens.apply(behind), out.mask, out.valid, out.coverage);
    EXPECT_EQ(out.mask.count(), 0u);
    EXPECT_FALSE(out.valid.at(40, 60));
    EXPECT_TRUE(out.valid.at(100, 60));
    EXPECT_NEAR(static_cast<double>(out.valid.count()), 160 * 120 - 40 * 80, 1000);
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace bodyschema
