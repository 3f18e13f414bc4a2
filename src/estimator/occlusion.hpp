#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "frame_model.hpp"
#include "held_thing.hpp"
#include "hypothesis_scorer.hpp"

namespace bodyschema {

/// The points of an outline that show how the robot's own outline errs: without pieces that were left out and mostly
/// have no edge near, or edges here and there, which something hides. A piece that was left out but runs beside the
/// prediction is the model's error as likely as a thing's edge: it stays.
/// @param samples  all of the outline
/// @param points  those that were found, in their order
/// @param reach_px  between neighbours
/// @param parallel_px  standard deviation of the residuals of a piece that runs beside the prediction, at most
std::vector<OutlinePoint> without_hidden(std::span<const OutlineSample> samples, std::span<const OutlinePoint> points,
                                         double reach_px, double parallel_px);

/// What other things hide of the robot, frame by frame, and what the hand holds over many. One thread.
class Occlusion {
 public:
  Occlusion(FrameModel& model, HypothesisScorer& scorer, const StereoRig& rig, const std::string& hand_link);

  /// Marks in a frame where a held thing may be.
  /// @param hand_sd_m  how well the hand is known
  void cover(Frame& frame, const Eigen::VectorXd& x, double hand_sd_m);
  /// Learns from a frame that shows the arm at x what masks show beside it.
  void learn(const Frame& frame, const Eigen::VectorXd& x, double hand_sd_m);
  /// What a frame's outlines left out.
  [[nodiscard]] HiddenShare hidden(const Frame& frame, const FrameEvidence& seen) const;
  void forget() { held_.forget(); }

 private:
  FrameModel& model_;
  HypothesisScorer& scorer_;
  const StereoRig& rig_;
  std::vector<bool> of_hand_;  ///< by part
  HeldThing held_;
  MaskMorphology morphology_;
  std::vector<BinaryMask> robot_;  ///< per camera
  std::vector<Eigen::Isometry3f> X_CB_;
};

}  // namespace bodyschema
