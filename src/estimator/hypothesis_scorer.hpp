#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/silhouette/silhouette_scorer.hpp"
#include "frame_model.hpp"

namespace bodyschema {

/// Hammoude distances of hypotheses about the state to one frame's masks, equation (3) over all its
/// pictures. Where the estimate is no hypothesis but what the outline makes of the best ones, they are compared on a
/// SearchLevel, unless so little of the robot is in the pictures that every pixel counts. Hypotheses are placed in
/// slots and scored together; what they hold beyond the joints' offsets is that of the frame model's last `settle`. One
/// thread.
class HypothesisScorer {
 public:
  /// @param outlines  where hypotheses are only where a search begins: what full pictures are drawn from
  ///   (outline_level); null: hypotheses are the estimate, and all is drawn from `silhouettes`
  /// @param slots  hypotheses that can be scored at once
  /// Throws gl::ContextError when the engine cannot be had.
  HypothesisScorer(FrameModel& model, const SilhouetteModel& silhouettes, const SilhouetteModel* outlines,
                   std::vector<PinholeIntrinsics> cameras, const SilhouetteOptions& options, std::size_t slots);

  /// The frame that hypotheses are compared with until the next call; it and what it has seen must live as long. A
  /// camera without a mask is not used. False when less than this share of the pictures is robot.
  /// @param every_pixel  compares full pictures, whatever the scorer is for
  bool observe(const Frame& frame, double min_share, bool every_pixel = false);

  void place(const Eigen::VectorXd& x, std::size_t slot);
  /// Distances of slots 0 to n - 1; valid until the next call.
  const Eigen::VectorXd& score(std::size_t n);
  /// The distance of one state, settled for itself; slots and their distances stay as they are.
  double distance(const Eigen::VectorXd& x);

  /// Whether the frame has two pictures of one size: each could be the other eye's.
  [[nodiscard]] bool can_be_exchanged() const;

  /// The predicted silhouette of one pose of all parts in a camera.
  BinaryMask render(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) { return full_->render(X_CB, camera); }
  /// The engine that scores, and why it was taken.
  [[nodiscard]] std::string description() const;
  /// Wall clock spent drawing and counting since the last call.
  double take_scoring_ms();

 private:
  void score_slots(std::size_t begin, std::size_t n, Eigen::VectorXd& distances);

  FrameModel& model_;
  const Frame* frame_ = nullptr;
  std::vector<PinholeIntrinsics> cameras_;
  std::string engine_reason_, level_text_;
  int step_ = 1;                              ///< of the search's level
  std::unique_ptr<SilhouetteScorer> full_;    ///< every pixel, every triangle
  std::unique_ptr<SilhouetteScorer> search_;  ///< of the search's level; null: there is none
  SilhouetteScorer* scorer_ = nullptr;        ///< which of the two has the observation
  std::uint32_t camera_mask_ = 0;             ///< cameras that have a mask
  std::vector<ObservedSilhouette> observed_, coarse_;
  std::size_t slots_;                    ///< and one more behind them, for `distance`
  std::vector<Eigen::Isometry3f> X_CB_;  ///< [slot][camera][part]
  std::vector<SilhouetteCounts> counts_;
  Eigen::VectorXd distances_, one_distance_;
  double scoring_ms_ = 0.0;
};

}  // namespace bodyschema
