#pragma once

#include <optional>

#include "bodyschema/estimator/offset_fusion.hpp"
#include "bodyschema/estimator/pull_judge.hpp"

namespace bodyschema {

/// What earlier frames taught about the state, and whether to go on believing it: an information filter with
/// exponential forgetting (OffsetFusion) behind an innovation gate (PullJudge). A memory that frames contradict makes
/// way for what a new search finds, but stays on a shelf for 30 frames as a second hypothesis: where one of them agrees
/// with it, it was the contradiction that was wrong.
///
/// Sees no pictures. For every frame the caller asks `shelved` and `reconsider`s, then, where there is a memory, fits
/// the frame with it and `judge`s; what agrees is to be `learn`ed, what contradicts to be searched for anew and told
/// with `contradict`. One thread.
class OffsetMemory {
 public:
  enum class Verdict {
    kNothingKnown,  ///< there is no memory to compare with
    kAgrees,        ///< to be learned
    kDoubtful,      ///< neither to be learned, nor is the memory to be given up for it
    kContradicts,   ///< to be searched for anew
  };

  /// @param prior  without any frame
  /// @param memory_frames  after which a frame counts 1/e
  /// @param correlated_frames  so many neighbours err alike and count as one
  OffsetMemory(const OffsetFusion& prior, double memory_frames, double correlated_frames)
      : fusion_(prior), memory_frames_(memory_frames), correlated_frames_(correlated_frames) {}

  [[nodiscard]] const OffsetFusion& fusion() const { return fusion_; }
  [[nodiscard]] bool empty() const { return fusion_.frames() < 0.5; }
  /// Of so few frames that it may hold a wrong minimum, or a frame whose two pictures saw the arm before and after a
  /// slip.
  [[nodiscard]] bool young() const { return fusion_.frames() < kYoung_frames; }
  /// Of so many that `converged` may be said of it.
  [[nodiscard]] bool settled() const { return fusion_.frames() > kSettled_frames; }
  /// Whether there is a memory that the last frame did not agree with.
  [[nodiscard]] bool doubted() const { return !empty() && (pulls_.doubting() || surprised()); }
  /// Whether frames contradicted what was known and none has been learned since, be the memory still there or not.
  [[nodiscard]] bool surprised() const { return surprised_frames_ > 0; }

  /// What to make of a frame, of which there is a fit that the memory held.
  /// @param pull  chi-square, OutlineFitter::pull_of
  /// @param fits  whether enough of the outline was found, and near enough
  Verdict judge(double pull, bool fits);
  /// Adds a frame that agrees; what is there fades.
  /// @param x0, variance_px2  as OffsetFusion::add
  void learn(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2, double pull);
  /// A frame that contradicts, or follows upon nothing known. Where a search found another state that explains it, or
  /// the sixth frame in a row contradicts, the memory is given up.
  /// @param keep  whether it may come back from the shelf
  /// @return whether it was given up
  bool contradict(bool found_another, bool keep);
  /// Begins with the frame of a search.
  void begin(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2);
  void forget_all();

  /// The memory that the last contradiction cost; null: none, or too long ago.
  [[nodiscard]] const OffsetFusion* shelved() const { return shelf_ ? &shelf_->fusion : nullptr; }
  /// Takes it back if the frame, fitted with it, agrees.
  void reconsider(double pull, bool fits);
  void clear_shelf() { shelf_.reset(); }

 private:
  struct Shelf {
    OffsetFusion fusion;
    PullJudge pulls;  ///< what was usual for it
    int frames_left;
  };
  static constexpr double kYoung_frames = 3.5;
  static constexpr double kSettled_frames = 4.5;  ///< fewer may still hold a wrong minimum
  static constexpr int kPatience_frames = 5;
  static constexpr int kShelf_frames = 30;

  OffsetFusion fusion_;
  PullJudge pulls_;
  PullJudge pulls_before_;  ///< the last frame was judged
  std::optional<Shelf> shelf_;
  int surprised_frames_ = 0;
  double memory_frames_;
  double correlated_frames_;
};

}  // namespace bodyschema
