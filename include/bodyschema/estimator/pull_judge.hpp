#pragma once

namespace bodyschema {

/// Tells frames that agree with what earlier ones said from those that contradict it, as when a joint
/// slips. A frame's pull is how much better it would fit without the memory of the others, chi-square.
/// An error that is not in the model makes every frame pull; so it is the usual pull of this log that
/// the next frame is compared with. One frame alone may be a stray: it is doubted, two contradict.
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
