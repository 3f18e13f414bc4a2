#pragma once

namespace bodyschema {

/// Whether left and right pictures are exchanged from the beginning, judged by how well an arm that is searched
/// for fits them as they are and exchanged: a wrong arm moves the hand alike in both pictures, an exchange moves
/// it against its disparity. A hand that is hardly in view, or far away, says little, so frames add up.
class EyeOrder {
 public:
  /// Whether to search at all. Nearer guesses than this the arm has had wherever it was found; where none is, masks
  /// are not the arm's, and searches would take long.
  /// @param as_they_are, exchanged  Hammoude distance of the nearest guess
  static bool worth_searches(double as_they_are, double exchanged) {
    return as_they_are < kHopeless || exchanged < kHopeless;
  }
  /// Whether this frame's pictures have to be taken for exchanged.
  /// @param as_they_are, exchanged  Hammoude distance of what was found, or of the nearest guess
  bool exchanged(double as_they_are, double exchanged);
  /// Whether there is nothing more to ask: they are in order, or this hand does not tell.
  [[nodiscard]] bool settled() const {
    return evidence_ <= kInOrder || (frames_ >= kPatience && evidence_ <= kExchanged);
  }

  /// Whether one frame alone tells that offsets fit the exchanged pictures and not those as they are.
  static bool clearly_exchanged(double as_they_are, double exchanged) { return exchanged < kClearly * as_they_are; }

 private:
  static constexpr double kClearly = 0.6;
  static constexpr double kExchanged = 1.0, kMost = 1.5, kInOrder = -2.0;
  static constexpr double kHopeless = 0.8;
  static constexpr int kPatience = 100;  ///< frames; each costs two searches
  int frames_ = 0;
  double evidence_ = 0.0;  ///< sum of logarithms of the distances' ratios
};

}  // namespace bodyschema
