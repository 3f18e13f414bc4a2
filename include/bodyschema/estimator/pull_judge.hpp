#pragma once

namespace bodyschema {

/// The innovation gate of the estimator: a chi-square test of each frame against the memory of earlier ones.
///
/// Tells frames that agree with what earlier ones said from those that contradict it, as when a joint slips. A frame's
/// pull is by how much its chi-square would fall without the memory, the innovation's likelihood ratio. Its degrees of
/// freedom are what one frame tells: six of the hand's pose and a few of the nuisances, about ten; by chance alone it
/// stays below 30 (99.9 %). But residuals are neither independent nor Gaussian, and an error that is not in the model
/// makes every frame pull by tens. So it is the usual pull of this log that the next frame is compared with, and the
/// limits are no quantiles: they lie far above them, and hold where the tests of Estimator let joints slip and encoders
/// jump, and in the experiments `slip` and `mismatch` of `bodyschema evaluate`. One frame alone may be a stray: it is
/// doubted, two contradict.
class PullJudge {
 public:
  enum class Verdict {
    kAgrees,       ///< worth remembering
    kDoubtful,     ///< not to be remembered, nor is the memory to be dropped for it
    kContradicts,  ///< the memory no longer holds
  };
  Verdict judge(double pull);
  /// Whether the last frame was doubtful.
  [[nodiscard]] bool doubting() const { return doubtful_frames_ > 0; }
  /// The memory is new: nothing is usual yet.
  void forget();

 private:
  double usual_ = 0.0;  ///< recent mean pull of frames that agreed
  int doubtful_frames_ = 0;
};

}  // namespace bodyschema
