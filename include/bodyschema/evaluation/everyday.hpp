#pragma once

#include <vector>

namespace bodyschema {

/// What the chain said in one frame of an everyday log, against the truth.
struct EverydayFrame {
  bool in_view = false;  ///< by the truth: the hand's centre lies in the first camera's picture
  bool converged = false;
  double hand_mm = -1.0;    ///< error of the hand in the first camera; negative: no estimate
  double hand_sd_mm = 0.0;  ///< as published
  double offset_sd = 0.0;   ///< the worst joint's error in its published standard deviations
};

/// One log in figures.
struct EverydayLog {
  int counted = 0;       ///< frames with the hand in view, from the first that counts on
  int converged = 0;     ///< of them
  int dishonest = 0;     ///< converged, and the hand off by more than 3 sd and 2 mm, or an offset by more than 5 sd
  double hand_mm = 0.0;  ///< mean over converged frames; of a log without any, over its last 50 frames
};

/// @param first_counted  frames before it are time to converge
EverydayLog judge_everyday(const std::vector<EverydayFrame>& frames, int first_counted);

}  // namespace bodyschema
