#include "bodyschema/vision/vision_setup.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

VisionSetup VisionSetup::from(const Configuration& vision) {
  VisionSetup setup;
  const auto method = vision.choice_or(
      "method", "auto", {"auto", "single_colour", "background_picture", "learned_background", "statistics", "given"});
  if (method == "auto") setup.method = SegmentationMethod::kAuto;
  if (method == "single_colour") setup.method = SegmentationMethod::kSingleColour;
  if (method == "background_picture") setup.method = SegmentationMethod::kBackgroundPicture;
  if (method == "learned_background") setup.method = SegmentationMethod::kLearnedBackground;
  if (method == "statistics") setup.method = SegmentationMethod::kStatistics;
  if (method == "given") setup.method = SegmentationMethod::kGiven;
  setup.edges =
      vision.choice_or("edges", "blurred", {"blurred", "hard"}) == "hard" ? EdgeKind::kHard : EdgeKind::kBlurred;

  setup.reduces_pictures = vision.choice_or("picture_size", "as_needed", {"as_needed", "as_sent"}) == "as_needed";
  setup.noise_levels = vision.number_or("noise_levels", setup.noise_levels, 0.0, 64.0);
  setup.threshold_sigma = vision.number_or("threshold_sigma", setup.threshold_sigma, 1.0, 100.0);
  setup.threshold_levels = vision.number_or("threshold_levels", setup.threshold_levels, 0.0, 254.0);
  setup.least_contrast_sigma = vision.number_or("least_contrast_sigma", setup.least_contrast_sigma, 0.0, 100.0);
  setup.min_component_px =
      static_cast<int>(vision.integer_or("min_component_px", setup.min_component_px, 0, 1'000'000));
  setup.max_hole_px = static_cast<int>(vision.integer_or("max_hole_px", setup.max_hole_px, 0, 1'000'000));

  const auto rgb = vision.numbers_or("background_rgb", {});
  if (!rgb.empty()) {
    if (rgb.size() != 3) vision.fail("background_rgb", "three numbers, 0 to 255: [red, green, blue]");
    for (const double level : rgb) {
      if (!(level >= 0.0 && level <= 255.0)) vision.fail("background_rgb", "numbers from 0 to 255");
    }
    setup.background_rgb = {rgb[0], rgb[1], rgb[2]};
  }

  const auto pictures = vision.section("background_pictures");
  for (const auto& camera : pictures.keys()) {
    setup.background_pictures[camera] = pictures.path(camera);
  }
  if (setup.method == SegmentationMethod::kBackgroundPicture && setup.background_pictures.empty()) {
    vision.fail("background_pictures", "a file for each camera, as method is background_picture");
  }
  setup.black_is_unknown = vision.boolean_or("black_is_unknown", setup.black_is_unknown);

  setup.learning_frames = static_cast<int>(vision.integer_or("learning_frames", setup.learning_frames, 2, 10'000));
  setup.min_sightings = static_cast<int>(vision.integer_or("min_sightings", setup.min_sightings, 1, 64));
  setup.search_px = static_cast<int>(vision.integer_or("search_px", setup.search_px, 2, 64));
  setup.min_piece_share = vision.number_or("min_piece_share", setup.min_piece_share, 0.0, 1.0);
  if (vision.has("looks_file") && !vision.text("looks_file").empty()) setup.looks_file = vision.path("looks_file");
  return setup;
}

VisionSetup VisionSetup::in_pixels_of(int width, int height) const {
  const double unit = std::max(1.0, picture_unit(width, height)), area = unit * unit;
  VisionSetup setup = *this;
  setup.search_px = static_cast<int>(std::lround(search_px * unit));
  setup.min_component_px = static_cast<int>(std::min(min_component_px * area, 1e9));
  setup.max_hole_px = static_cast<int>(std::min(max_hole_px * area, 1e9));
  return setup;
}

}  // namespace bodyschema
