#pragma once

namespace bodyschema {

/// Whether left and right pictures are exchanged from the beginning, judged by how well first guesses of the
/// offsets fit them as they are and exchanged: a wrong arm moves the hand alike in both pictures, an exchange
/// moves it against its disparity. A hand that is hardly in view, or far away, says little, so frames add up.
class EyeOrder {
 public:
  /// Whether this frame's pictures have to be taken for exchanged.
  /// @param as_they_are, exchanged  smallest Hammoude distance of the guesses
  bool exchanged(double as_they_are, double exchanged);
  /// Whether there is nothing more to ask: they are in order, or this hand does not tell.
  [[nodiscard]] bool settled() const { return evidence_ <= kInOrder || (frames_ >= kPatience && evidence_ <= kExchanged); }

  /// Whether one frame alone tells that offsets fit the exchanged pictures and not those as they are.
  static bool clearly_exchanged(double as_they_are, double exchanged) { return exchanged < kClearly * as_they_are; }

 private:
  static constexpr double kClearly = 0.6;
  static constexpr double kExchanged = 1.0, kMost = 1.5, kInOrder = -2.0;
  static constexpr int kPatience = 300;  ///< frames; each costs as much as scoring all particles twice
  int frames_ = 0;
  double evidence_ = 0.0;  ///< sum of logarithms of the distances' ratios
};

}  // namespace bodyschema
