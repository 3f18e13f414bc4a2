#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/vision_setup.hpp"

namespace bodyschema {

/// The standard deviation of noise, levels, from a histogram of absolute differences rounded to
/// whole levels: the interpolated median of those within four standard deviations, so that a robot
/// that covers a good part of the picture does not count.
float noise_from_differences(const std::array<std::size_t, 256>& histogram);

/// Noise of one channel between two frames of a mostly still scene, levels.
float noise_between(const Image& a, const Image& b);

/// A bounded selection from any number of frames in which every stretch of movement has its share:
/// time runs by what changes in the picture, so that a resting robot does not outvote the
/// background behind it.
class FrameSelection {
 public:
  static constexpr std::size_t kCapacity = 64;
  void add(const Image& frame);
  void clear();
  [[nodiscard]] const std::vector<Image>& frames() const { return frames_; }
  /// Of the frames seen so far, levels; 0 before the second frame.
  [[nodiscard]] float noise_sd() const { return noise_sd_; }

 private:
  [[nodiscard]] double change(const Image& a, const Image& b) const;

  std::vector<Image> frames_;
  float noise_sd_ = 0.0f;
  std::vector<float> early_noise_;  // first estimates; their median counts
  Image previous_;
  double step_ = 0.0;             // change from one kept frame to the next
  std::size_t still_frames_ = 0;  // kept although nothing had changed
};

/// The background of a still camera, learned per pixel: the most frequent colour, within the noise.
///
/// Offline from a selection of frames. Where a pixel shows two colours about equally often, the
/// robot was in front of it half of the time: then the colour is taken with which the pixel is
/// uncovered when its neighbours are. Live frame by frame: a pixel's background is confirmed by
/// every frame near it; another colour must be seen longer than the background was before it takes
/// its place, and never where the robot is thought to be.
class LearnedBackground {
 public:
  LearnedBackground(const VisionSetup& setup, int width, int height);

  /// @param frames  at most FrameSelection::kCapacity
  void learn(std::span<const Image> frames, float noise_sd);
  /// From a few frames in which it is known about where the robot is: what two frames and most of those that do not
  /// have the robot there agree about.
  /// @param robots  one per frame: pixels that are not learned from
  void learn_beside(std::span<const Image> frames, std::span<const BinaryMask> robots);

  /// @param robot  pixels that must not be learned from; null: none
  /// @param full   every pixel; otherwise only every eighth row, in turn, as upkeep
  void update(const Image& frame, const BinaryMask* robot, bool full);

  [[nodiscard]] int frames_seen() const { return frames_seen_; }
  [[nodiscard]] const BackgroundModel& model() const { return model_; }

 private:
  void start(const Image& frame);
  template <int kChannels>
  void update_row(const Image& frame, int v, const BinaryMask* robot);
  /// One colour that a pixel showed, and in which of the frames.
  struct Candidate {
    std::uint64_t seen = 0;
    std::array<float, 3> mean{};
  };
  static constexpr std::size_t kCandidates = 3;
  using Candidates = std::array<Candidate, kCandidates>;  // most frequent first

  template <int kChannels>
  void cluster_row(std::span<const Image> frames, int v, std::vector<Candidates>& candidates) const;
  void choose(std::size_t frame_count, const std::vector<Candidates>& candidates,
              std::vector<std::uint8_t>& choice) const;
  template <int kChannels>
  void agree_row(std::span<const Image> frames, std::span<const BinaryMask> robots, int v);
  template <int kChannels>
  void average_row(std::span<const Image> frames, int v, const std::vector<Candidates>& candidates,
                   const std::vector<std::uint8_t>& choice);
  void set_precision(std::size_t i);

  VisionSetup setup_;
  BackgroundModel model_;
  int frames_seen_ = 0;
  Image first_;                         // until the second frame gives the noise
  BinaryMask first_robot_;              // where it must not be learned from; empty: nowhere
  std::vector<std::uint16_t> support_;  // sightings of the background
  std::vector<float> variance_;         // of one channel around the background
  std::vector<float> rival_;            // another colour, channels interleaved
  std::vector<std::uint16_t> rival_support_;
  int upkeep_row_ = 0;
  double innovation_sum_ = 0.0;  // of one frame's inliers, for the noise
  double innovation_count_ = 0.0;
};

}  // namespace bodyschema
