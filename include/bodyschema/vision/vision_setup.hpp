#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// How the robot is told from what lies behind it.
enum class SegmentationMethod {
  kAuto,          ///< anything: backgrounds learned where they hold, colours on both sides of the predicted outline
  kSingleColour,  ///< background of one colour, with a slow gradient of light
  kBackgroundPicture,  ///< still cameras, a picture of the background is given
  kLearnedBackground,  ///< still cameras, the background is learned from noisy frames
  kStatistics,         ///< anything: colour statistics on both sides of the predicted outline
  kGiven,              ///< others find the robot and send masks beside the pictures
};

/// What the outline of the robot looks like in the pictures.
enum class EdgeKind {
  kBlurred,  ///< a pixel on the outline mixes robot and background: real cameras, antialiasing
  kHard,     ///< a pixel is either robot or background: simulators that draw without antialiasing
};

/// Settings of the section `vision`, shared by all cameras. Intensities are in levels, 0 to 255; lengths and areas in
/// pixels of a 320x240 picture.
struct VisionSetup {
  SegmentationMethod method = SegmentationMethod::kLearnedBackground;
  EdgeKind edges = EdgeKind::kBlurred;

  /// Whether a service reduces pictures with more pixels than it needs (picture_reduction).
  bool reduces_pictures = true;

  /// Standard deviation of the image noise, levels; 0: estimated from the frames.
  double noise_levels = 0.0;
  /// A difference counts from this many standard deviations of the noise ...
  double threshold_sigma = 4.0;
  /// ... and from more than this many levels.
  double threshold_levels = 2.0;
  /// Robot and background whose colours differ by fewer standard deviations of the noise cannot be
  /// told apart: such pixels of the outline are marked invalid.
  double least_contrast_sigma = 4.0;

  /// Connected pieces of robot with fewer pixels than this are dropped.
  int min_component_px = 40;
  /// Enclosed pieces of background with at most this many pixels are filled; in given masks so many of the picture
  /// itself.
  int max_hole_px = 6;

  /// single_colour: the colour, RGB; absent: the dominant colour of the first frame.
  std::optional<std::array<double, 3>> background_rgb;

  /// background_picture: one file per camera name, as the camera takes it, its lens's distortion included.
  std::map<std::string, std::filesystem::path> background_pictures;
  /// background_picture: exactly black pixels of the picture are unknown, not black.
  bool black_is_unknown = false;

  /// learned_background, live: frames that are only learned from before the first mask.
  int learning_frames = 20;
  /// learned_background: a pixel's background must be seen in at least this many frames.
  int min_sightings = 3;

  /// statistics and auto: how far from the predicted outline the robot is searched for, px.
  int search_px = 12;

  /// auto: where a service keeps the robot's colours for its next start; empty: nowhere.
  std::filesystem::path looks_file;

  /// given: pieces of robot with a smaller share of the largest one's pixels are taken for neither robot nor
  /// background.
  double min_piece_share = 0.05;

  /// The same with lengths and areas in pixels of pictures of this size, where these are larger than 320x240.
  [[nodiscard]] VisionSetup in_pixels_of(int width, int height) const;
  /// Reads and checks the section; throws ConfigurationError.
  static VisionSetup from(const Configuration& vision);
  friend bool operator==(const VisionSetup&, const VisionSetup&) = default;
};

}  // namespace bodyschema
