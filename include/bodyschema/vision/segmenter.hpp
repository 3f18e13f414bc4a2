#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/robot_looks.hpp"
#include "bodyschema/vision/scene_colours.hpp"
#include "bodyschema/vision/vision_setup.hpp"

namespace bodyschema {

class Undistorter;

/// Where the robot is thought to be in a picture, and how well that is known.
struct PredictedRobot {
  const BinaryMask* silhouette = nullptr;  ///< of the picture's size, or it does not count; null: unknown
  double reach_px = 0.0;                   ///< how far off its outline may be, px; 0: as configured
  bool trusted = false;                    ///< the estimate has converged: what lies inside is robot

  PredictedRobot() = default;
  PredictedRobot(const BinaryMask* robot, double reach = 0.0, bool is_trusted = false)
      : silhouette(robot), reach_px(reach), trusted(is_trusted) {}
};

/// Tells the robot from the background in the pictures of one camera.
///
/// For every picture it gives
///   mask      pixels whose coverage is at least one half, without small pieces and holes
///   valid     pixels that can be judged: the background there is known and, on the outline,
///             different enough from the robot. Empty when all pixels count.
///   coverage  share of each pixel covered by the robot, 0 to 255, row order. On a blurred outline
///             it is the projection of the pixel's colour onto the line from the background's
///             colour B to the robot's colour F next to it, (I-B).(F-B) / |F-B|^2, so that its
///             half level lies on the outline to a fraction of a pixel. Exactly 0 or 255 farther
///             than about two pixels from an outline.
///
/// Learning: `single_colour` and `background_picture` work from the first frame on;
/// `learned_background` needs either `learn` (offline, all frames of a log) or, live, its first
/// `learning_frames` frames (better without the robot in view; while learning nothing is valid)
/// and keeps adapting where the robot is not: `adapt`. `statistics` needs a prediction with every
/// picture. `auto` works from the first frame on with a prediction, and learns: the background as
/// `learned_background`, as long as the camera stands still before it; the robot's colours while the prediction is
/// trusted; how the light has changed since, from picture to picture.
///
/// A picture of another number of channels than before starts all learning anew.
///
/// Throws DataError for an empty picture, one of another size, or one of another number of channels than
/// a given background has; otherwise `segment` and `adapt` neither throw nor allocate once warm. One segmenter per
/// camera and thread.
class Segmenter {
 public:
  /// @param camera  name under which the background picture of this camera is configured
  /// @param lens  what straightens the pictures that come: the background picture is as the camera takes it and
  ///   is straightened alike; null: they come as the camera takes them
  /// Throws FileError for a background picture that is missing or of another size,
  /// ConfigurationError when none is configured for this camera.
  Segmenter(const VisionSetup& setup, const std::string& camera, int width, int height,
            const Undistorter* lens = nullptr);
  ~Segmenter();
  Segmenter(Segmenter&&) noexcept;
  Segmenter& operator=(Segmenter&&) noexcept;

  /// Offline: learns the background from frames in which the robot moves or is absent.
  /// Replaces what was known. No effect for a given picture.
  void learn(std::span<const Image> frames);
  /// The same where it is known about where the robot is in each frame: that is not learned from, and what is left of
  /// few frames is enough, a background that two of them show.
  /// @param robots  one per frame, of the picture's size
  void learn(std::span<const Image> frames, std::span<const BinaryMask> robots);
  /// The same for frames that come one by one: any number, in order, then `finish_learning`.
  /// A bounded selection is kept in which every stretch of movement has its share.
  void learn_from(const Image& frame);
  void finish_learning();
  /// Whether masks are to be had; false while a live background is still being learned.
  [[nodiscard]] bool ready() const;

  /// @param predicted  where the robot is thought to be: `statistics` and `auto` need it, others do not look
  void segment(const Image& image, BinaryMask& mask, BinaryMask& valid, std::vector<std::uint8_t>& coverage,
               const PredictedRobot& predicted = {});

  /// `learned_background`, `auto`: follows slow changes of the background, once `segment` has found `mask` in
  /// this picture and before the next one is segmented. No effect with other methods and while still
  /// learning.
  /// @param predicted  where the robot is thought to be, which protects a resting robot from being
  ///   learned as background; null: where the mask is
  void adapt(const Image& image, const BinaryMask& mask, const PredictedRobot& predicted = {});
  /// `auto`: the camera has turned since the background was learned; that is forgotten unless it looks the same.
  void camera_turned();

  /// `auto`: the robot's colours as learned, or as told: those of an earlier run, of pictures with as many channels.
  [[nodiscard]] const RobotLooks& looks() const;
  void know_looks(RobotLooks looks);
  /// What both sides look like in pictures to come (`auto`): a background that differs is not taken for the robot where
  /// it has the colours of the rest, a shadow, and nothing that hides the robot is split between both.
  void know_colours(SceneColours colours);

  /// The background as now known; empty before anything is.
  [[nodiscard]] const BackgroundModel& background() const;

 private:
  struct Impl;
  void admit(const Image& image);
  std::unique_ptr<Impl> impl_;
};

}  // namespace bodyschema
