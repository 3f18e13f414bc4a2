#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>

#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/segmenter.hpp"
#include "compressed.hpp"
#include "scene.hpp"

namespace bodyschema {
namespace {

using test::compressed;
using test::Scene;
using test::Texture;

VisionSetup automatic() {
  VisionSetup setup;
  setup.method = SegmentationMethod::kAuto;
  return setup;
}

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

test::EdgeStatistics edges_of(const Scene& scene, const Output& out) {
  const auto edge = test::edge_statistics(scene.outline(), scene.width, scene.height, out.coverage, out.valid);
  std::printf("    outline: bias %+.3f px, sd %.3f px, worst %.2f px, found %.1f %%\n", edge.bias, edge.sd, edge.worst,
              100.0 * edge.found);
  return edge;
}

/// Of the size at which a robot's camera shows its hand at 0.35 m.
Scene large(Texture texture) {
  Scene scene;
  scene.width = 320;
  scene.height = 240;
  scene.texture = texture;
  scene.ambient = 0.7;
  scene.supersampling = 2;
  return scene;
}
std::vector<test::Capsule> large_hand(double u, double v) {
  auto shapes = test::hand(0.0, 0.0);
  for (auto& shape : shapes) {
    shape = {u + 2 * shape.u0, v + 2 * shape.v0, u + 2 * shape.u1, v + 2 * shape.v1, 2 * shape.radius};
  }
  return shapes;
}

/// A prediction that is off by this much.
BinaryMask prediction(const Scene& scene, double du, double dv) {
  Scene believed = scene;
  for (auto& shape : believed.shapes) {
    shape.u0 += du;
    shape.u1 += du;
    shape.v0 += dv;
    shape.v1 += dv;
  }
  return believed.true_mask();
}

Image times(Image image, double gain) {
  for (auto& level : image.data) level = static_cast<std::uint8_t>(std::min(255.0, gain * level + 0.5));
  return image;
}

TEST(AutomaticMasks, ACameraThatTurnsBeforeARoomNeedsNoBackground) {
  std::mt19937 random(14);
  Scene scene = large(Texture::kClutter);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  Output out;
  double worst_iou = 1.0, sd = 0.0, found = 0.0;
  constexpr int kFrames = 6;
  for (int i = 0; i < kFrames; ++i) {
    scene.shift_u = 37.0 * i;
    scene.shapes = large_hand(150.0 + 4.0 * i, 120.0);
    const auto predicted = prediction(scene, 2.0, -2.0);
    const auto picture = scene.picture(random);
    segmenter.camera_turned();
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0, i > 0});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0, i > 0});
    worst_iou = std::min(worst_iou, iou(out.mask, scene.true_mask()));
    const auto edge = edges_of(scene, out);
    sd += edge.sd / kFrames;
    found += edge.found / kFrames;
  }
  std::printf("    seed 14: worst IoU %.3f, outline sd %.2f px, found %.0f %%\n", worst_iou, sd, 100.0 * found);
  EXPECT_GT(worst_iou, 0.9);
  EXPECT_LT(sd, 0.6);
  EXPECT_GT(found, 0.6);
}

TEST(AutomaticMasks, FewStillsShowTheBackgroundBesideWhereTheRobotIs) {
  std::mt19937 random(33);
  Scene scene = large(Texture::kClutter);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  // At 150 in three pictures of five: what most of them show there is the robot.
  const std::array<double, 5> at_u = {150.0, 154.0, 146.0, 60.0, 240.0};
  std::vector<Image> frames;
  std::vector<BinaryMask> predicted, robots;
  for (const double u : at_u) {
    scene.shapes = large_hand(u, 120.0);
    frames.push_back(scene.picture(random));
    predicted.push_back(prediction(scene, 4.0, -3.0));
    robots.push_back(predicted.back());
    MaskMorphology().dilate(robots.back(), 8);
  }
  segmenter.learn(frames, robots);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    scene.shapes = large_hand(at_u[i], 120.0);
    Output out;
    segmenter.segment(frames[i], out.mask, out.valid, out.coverage, {&predicted[i], 8.0, false});
    EXPECT_GT(iou(out.mask, scene.true_mask()), 0.95) << i;
    const auto edge = edges_of(scene, out);
    EXPECT_LT(edge.sd, 0.5) << i;
    EXPECT_LT(std::abs(edge.bias), 0.15) << i;
    EXPECT_GT(edge.found, 0.6) << i;
  }
}

// Lengths that belong to the decision grow with the picture, all of them.
TEST(AutomaticMasks, AThingFurtherOffThanTheRobotMayBeIsNotTakenForItInLargePictures) {
  std::mt19937 random(5);
  Scene scene = large(Texture::kClutter);
  scene.width = 640;
  scene.height = 480;
  std::vector<Image> empty;
  for (int i = 0; i < 8; ++i) empty.push_back(scene.picture(random));
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  segmenter.learn(empty);
  scene.shapes = large_hand(250.0, 240.0);
  const auto robot = scene.true_mask();
  constexpr double kReach_px = 40.0;
  const auto box = bounding_box(robot);
  const double u = box.u1 + kReach_px + 25.0, v = 0.5 * (box.v0 + box.v1);
  scene.shapes.push_back({u, v, u, v, 12.0});
  Output out;
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, {&robot, kReach_px, false});
  EXPECT_GT(iou(out.mask, robot), 0.95);
  EXPECT_LT(bounding_box(out.mask).u1, box.u1 + kReach_px);
}

TEST(AutomaticMasks, APredictionThatIsFarOffIsPutRight) {
  for (const auto texture : {Texture::kPlain, Texture::kGradient, Texture::kClutter}) {
    std::mt19937 random(21);
    Scene scene = large(texture);
    scene.shapes = large_hand(150.0, 120.0);
    const auto predicted = prediction(scene, 20.0, -16.0);
    Segmenter segmenter(automatic(), "left", scene.width, scene.height);
    Output out;
    segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, {&predicted, 40.0});
    const double before = iou(predicted, scene.true_mask()), after = iou(out.mask, scene.true_mask());
    std::printf("    seed 21, texture %d: IoU of the prediction %.3f, of the mask %.3f\n", static_cast<int>(texture),
                before, after);
    EXPECT_LT(before, 0.6);
    EXPECT_GT(after, texture == Texture::kClutter ? 0.75 : 0.9);
  }
}

TEST(AutomaticMasks, ABackgroundThatHoldsIsUsedAsIfItHadBeenLearnedAlone) {
  std::mt19937 random(3);
  Scene scene;
  scene.texture = Texture::kClutter;
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> empty;
  for (int i = 0; i < 20; ++i) empty.push_back(scene.without_robot().picture(random));
  segmenter.learn(empty);
  scene.shapes = test::hand(78.0, 62.0);
  Output out;
  const auto predicted = prediction(scene, 8.0, 3.0);
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, {&predicted, 20.0});
  const auto edge = edges_of(scene, out);
  EXPECT_LT(std::abs(edge.bias), 0.1);
  EXPECT_LT(edge.sd, 0.3);
  EXPECT_GT(edge.found, 0.75);
  // ... and without any prediction.
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
  EXPECT_GT(iou(out.mask, scene.true_mask()), 0.97);
}

TEST(AutomaticMasks, LightThatDriftsAndWasLostComesBack) {
  std::mt19937 random(5);
  Scene scene;
  scene.texture = Texture::kClutter;
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> empty;
  for (int i = 0; i < 20; ++i) empty.push_back(scene.without_robot().picture(random));
  segmenter.learn(empty);
  scene.shapes = test::hand(78.0, 62.0);
  const auto predicted = prediction(scene, 2.0, 1.0);
  Output out;
  // Fainter by half at once, dark, and as it was: each picture for itself.
  for (const double gain : {1.0, 1.2, 0.8, 0.5, 0.02, 1.0}) {
    const auto picture = times(scene.picture(random), gain);
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 8.0});
    segmenter.adapt(picture, out.mask, {&predicted, 8.0});
    if (gain < 0.1) continue;
    const auto edge = edges_of(scene, out);
    std::printf("    seed 5, gain %.2f\n", gain);
    EXPECT_LT(std::abs(edge.bias), 0.15) << gain;
    EXPECT_LT(edge.sd, 0.4) << gain;
  }
}

TEST(AutomaticMasks, WhereColoursDoNotDifferNothingIsSaid) {
  std::mt19937 random(9);
  Scene scene;
  for (int c = 0; c < 3; ++c) scene.robot[c] = scene.base[c];
  scene.shapes = test::hand(78.0, 62.0);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  Output out;
  const auto predicted = scene.true_mask();
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage, {&predicted, 6.0});
  const auto edge = edges_of(scene, out);
  EXPECT_LT(edge.found, 0.1);
}

TEST(AutomaticMasks, ABackgroundOfAnotherLineOfSightIsForgotten) {
  std::mt19937 random(31);
  Scene scene;
  scene.texture = Texture::kClutter;
  scene.shapes = test::hand(78.0, 62.0);
  const auto predicted = scene.true_mask();
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  Output out;
  const auto look = [&](bool turned) {
    const auto picture = scene.picture(random);
    if (turned) segmenter.camera_turned();
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0});
    return iou(out.mask, scene.true_mask());
  };
  for (int i = 0; i < 10; ++i) look(false);
  scene.shift_u = 23.0;
  EXPECT_GT(look(true), 0.85);
  for (int i = 0; i < 10; ++i) look(false);
  EXPECT_GT(look(false), 0.85);
}

/// What JPEG does to chroma: each block of 4x4 pixels has one, luma stays.
Image bled(Image image) {
  for (int v = 0; v + 3 < image.height; v += 4) {
    for (int u = 0; u + 3 < image.width; u += 4) {
      std::array<double, 3> mean{};
      for (int k = 0; k < 16; ++k) {
        for (int c = 0; c < 3; ++c) mean[static_cast<std::size_t>(c)] += image.pixel(u + k % 4, v + k / 4)[c] / 16.0;
      }
      const double luma = (mean[0] + mean[1] + mean[2]) / 3.0;
      for (int k = 0; k < 16; ++k) {
        auto* pixel = image.pixel(u + k % 4, v + k / 4);
        const double own = (pixel[0] + pixel[1] + pixel[2]) / 3.0;
        for (int c = 0; c < 3; ++c) {
          pixel[c] =
              static_cast<std::uint8_t>(std::clamp(own + mean[static_cast<std::size_t>(c)] - luma + 0.5, 0.0, 255.0));
        }
      }
    }
  }
  return image;
}

TEST(AutomaticMasks, ColoursThatCompressionLetsBleedAreNoRobot) {
  std::mt19937 random(17);
  Scene scene = large(Texture::kPlain);
  const double wall[3] = {40, 110, 70};
  std::copy(wall, wall + 3, scene.base);
  scene.noise_levels = 0.7;  // what compression leaves of it in still areas
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> empty;
  for (int i = 0; i < 8; ++i) empty.push_back(bled(scene.without_robot().picture(random)));
  segmenter.learn(empty);
  Output out;
  test::EdgeStatistics edge;
  for (int i = 0; i < 8; ++i) {
    scene.shapes = large_hand(150.0 + i, 120.0);
    const auto predicted = scene.true_mask();
    const auto picture = bled(scene.picture(random));
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0, true});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0, true});
  }
  edge = edges_of(scene, out);
  std::printf("    seed 17: IoU %.3f\n", iou(out.mask, scene.true_mask()));
  EXPECT_LT(std::abs(edge.bias), 0.15);  // colours read beside the outline put it 0.2 px out
  EXPECT_GT(edge.found, 0.75);
}

/// A grey hand before a green wall: lit from above, it is brighter on one side and as dark as the wall on the other.
Scene shaded() {
  Scene scene = large(Texture::kPlain);
  const double wall[3] = {40, 110, 70}, grey[3] = {150, 145, 148}, lamp[3] = {-0.45, -0.6, 0.66};
  std::copy(wall, wall + 3, scene.base);
  std::copy(grey, grey + 3, scene.robot);
  std::copy(lamp, lamp + 3, scene.lamp);
  scene.ambient = 0.45;
  scene.noise_levels = 2.0;
  return scene;
}

/// Until a background was learned nobody knew that pictures were compressed: bled colours were robot.
TEST(AutomaticMasks, TheFirstPictureShowsThatItWasCompressed) {
  std::mt19937 random(41);
  Scene scene = shaded();
  for (int i = 0; i < 3; ++i) {
    scene.shapes = large_hand(150.0 + 5.3 * i, 120.0 + 2.7 * i);
    const auto predicted = scene.true_mask();
    Segmenter segmenter(automatic(), "left", scene.width, scene.height);
    Output out;
    segmenter.segment(compressed(scene.picture(random), 70), out.mask, out.valid, out.coverage, {&predicted, 6.0});
    const auto edge = edges_of(scene, out);
    EXPECT_LT(std::abs(edge.bias), 0.15) << i;
    EXPECT_GT(edge.found, 0.75) << i;
  }
}

/// Brightness is sharp in compressed pictures, and shading changes it up to the outline; colour is not.
TEST(AutomaticMasks, ShadingIsToldFromBledColours) {
  std::mt19937 random(43);
  Scene scene = shaded();
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> empty;
  for (int i = 0; i < 8; ++i) empty.push_back(compressed(scene.without_robot().picture(random), 70));
  segmenter.learn(empty);
  double bias = 0.0, sd = 0.0;
  constexpr int kFrames = 8;
  for (int i = 0; i < kFrames; ++i) {
    scene.shapes = large_hand(150.0 + 1.3 * i, 120.0 + 0.7 * i);
    const auto predicted = scene.true_mask();
    const auto picture = compressed(scene.picture(random), 70);
    Output out;
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0, true});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0, true});
    const auto edge = edges_of(scene, out);
    bias += edge.bias / kFrames;
    sd += edge.sd / kFrames;
  }
  std::printf("    seed 43: bias %+.3f px, sd %.3f px\n", bias, sd);
  EXPECT_LT(std::abs(bias), 0.1);
  EXPECT_LT(sd, 0.45);
}

/// The background of the first picture was learned from under the arm, too: the arm then was not seen where it had
/// been.
TEST(AutomaticMasks, TheArmOfTheFirstPictureLeavesNoGhost) {
  std::mt19937 random(23);
  Scene scene = large(Texture::kPlain);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  Output out;
  for (int i = 0; i < 6; ++i) {
    scene.shapes = large_hand(150.0 + 8.0 * i, 120.0);  // it comes to lie over a good part of where it was
    const auto predicted = scene.true_mask();
    const auto picture = scene.picture(random);
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0, i > 2});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0, i > 2});
    EXPECT_GT(iou(out.mask, scene.true_mask()), 0.95) << i;
  }
}

/// What differs from the background beside the robot was taken for compression: soon nothing differed by more, and the
/// hand had holes.
TEST(AutomaticMasks, AHeldThingBesideTheRobotIsNoNoise) {
  std::mt19937 random(29);
  Scene scene = large(Texture::kPlain);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> empty;
  for (int i = 0; i < 8; ++i) empty.push_back(scene.without_robot().picture(random));
  segmenter.learn(empty);
  scene.shapes = large_hand(150.0, 120.0);
  const auto predicted = scene.true_mask();
  std::size_t missing = 0;
  for (int i = 0; i < 15; ++i) {
    auto picture = scene.picture(random);
    for (int v = 60; v < 150; ++v) {
      for (int u = 100; u < 200; ++u) {
        if (predicted.at(u, v)) continue;
        const std::array<std::uint8_t, 3> brown = {190, 60, 40};
        std::copy(brown.begin(), brown.end(), picture.pixel(u, v));
      }
    }
    Output out;
    segmenter.segment(picture, out.mask, out.valid, out.coverage, {&predicted, 6.0, true});
    segmenter.adapt(picture, out.mask, {&predicted, 6.0, true});
    missing = 0;
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) missing += predicted.at(u, v) && !out.mask.at(u, v);
    }
  }
  EXPECT_LT(static_cast<double>(missing), 0.03 * static_cast<double>(predicted.count()));
}

/// What the robot takes the light from differs from its background as much as the robot does.
TEST(AutomaticMasks, TheRobotsShadowIsNoRobot) {
  std::mt19937 random(35);
  Scene scene = large(Texture::kPlain);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  std::vector<Image> frames;
  std::vector<BinaryMask> predicted, robots;
  SceneColourCounts colours;
  constexpr double kReach_px = 16.0;
  for (const double u : {60.0, 100.0, 150.0, 200.0, 240.0}) {
    scene.shapes = large_hand(u, 120.0);
    const BinaryMask robot = scene.true_mask();
    frames.push_back(scene.picture(random));
    for (int v = 12; v < scene.height; ++v) {
      for (int w = 12; w < scene.width; ++w) {
        if (robot.at(w, v) || !robot.at(w - 12, v - 12)) continue;
        for (int c = 0; c < 3; ++c)
          frames.back().pixel(w, v)[c] = static_cast<std::uint8_t>(0.75 * frames.back().pixel(w, v)[c]);
      }
    }
    predicted.push_back(prediction(scene, 4.0, -3.0));
    robots.push_back(predicted.back());
    MaskMorphology().dilate(robots.back(), static_cast<int>(kReach_px));
    colours.add(frames.back(), predicted.back(), 4.0, predicted.back());
  }
  segmenter.learn(frames, robots);
  Output out;
  const PredictedRobot about(&predicted.back(), kReach_px, false);
  segmenter.segment(frames.back(), out.mask, out.valid, out.coverage, about);
  EXPECT_LT(iou(out.mask, scene.true_mask()), 0.9);  // it is taken for robot where nothing is known of colours
  segmenter.know_colours(colours.shares());
  segmenter.segment(frames.back(), out.mask, out.valid, out.coverage, about);
  std::printf("    seed 35: IoU %.3f\n", iou(out.mask, scene.true_mask()));
  EXPECT_GT(iou(out.mask, scene.true_mask()), 0.95);
}

TEST(AutomaticMasks, WithoutPredictionAndBackgroundThereIsNothingToGoBy) {
  std::mt19937 random(1);
  Scene scene;
  scene.shapes = test::hand(78.0, 62.0);
  Segmenter segmenter(automatic(), "left", scene.width, scene.height);
  Output out;
  segmenter.segment(scene.picture(random), out.mask, out.valid, out.coverage);
  EXPECT_EQ(out.mask.count(), 0u);
  EXPECT_EQ(out.valid.count(), 0u);
}

}  // namespace
}  // namespace bodyschema
