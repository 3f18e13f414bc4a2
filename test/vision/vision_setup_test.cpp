#include "bodyschema/vision/vision_setup.hpp"

#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

TEST(VisionSetup, ReadsEveryKey) {
  const auto configuration = Configuration::parse(R"(
vision:
  method: background_picture
  edges: hard
  noise_levels: 1.5
  threshold_sigma: 5
  threshold_levels: 3
  least_contrast_sigma: 2
  min_component_px: 10
  max_hole_px: 2
  background_rgb: [1, 2, 3]
  background_pictures: {left: l.png, right: /data/r.png}
  black_is_unknown: true
  learning_frames: 7
  min_sightings: 4
  search_px: 9
)",
                                                  "/folder");
  const auto setup = VisionSetup::from(configuration.section("vision"));
  EXPECT_EQ(setup.method, SegmentationMethod::kBackgroundPicture);
  EXPECT_EQ(setup.edges, EdgeKind::kHard);
  EXPECT_EQ(setup.noise_levels, 1.5);
  EXPECT_EQ(setup.threshold_sigma, 5);
  EXPECT_EQ(setup.threshold_levels, 3);
  EXPECT_EQ(setup.least_contrast_sigma, 2);
  EXPECT_EQ(setup.min_component_px, 10);
  EXPECT_EQ(setup.max_hole_px, 2);
  EXPECT_EQ((*setup.background_rgb)[2], 3);
  EXPECT_EQ(setup.background_pictures.at("left"), "/folder/l.png");
  EXPECT_EQ(setup.background_pictures.at("right"), "/data/r.png");
  EXPECT_TRUE(setup.black_is_unknown);
  EXPECT_EQ(setup.learning_frames, 7);
  EXPECT_EQ(setup.min_sightings, 4);
  EXPECT_EQ(setup.search_px, 9);
  configuration.reject_unknown_keys();
}

TEST(VisionSetup, RefusesNonsense) {
  for (const char* text : {"vision: {method: magic}", "vision: {edges: soft}", "vision: {threshold_sigma: 0}",
                           "vision: {background_rgb: [1, 2]}", "vision: {background_rgb: [1, 2, 300]}",
                           "vision: {method: background_picture}", "vision: {learning_frames: 0}"}) {
    EXPECT_THROW(VisionSetup::from(Configuration::parse(text).section("vision")), ConfigurationError) << text;
  }
  EXPECT_NO_THROW(VisionSetup::from(Configuration::parse("{}").section("vision")));
}

TEST(VisionSetup, ShippedFilesAreReadInFull) {
  (void)data_folder();  // to which the recording's refers
  for (const char* name : {"vision.yaml", "icub_unity/vision.yaml"}) {
    const auto file = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config" / name;
    const auto configuration = Configuration::load(file);
    EXPECT_NO_THROW(VisionSetup::from(configuration.section("vision"))) << file;
    EXPECT_NO_THROW(configuration.reject_unknown_keys()) << file;
  }
}

}  // namespace
}  // namespace bodyschema
