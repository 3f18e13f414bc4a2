#pragma once

#include <string>

#include "bodyschema/evidence/log_fit.hpp"
#include "candidates.hpp"

namespace bodyschema::diagnosis {

/// What a model leaves of the outlines themselves, where causes are told from each other only by how they change.
struct LeftOver {
  /// "the left outline of r_hand lies 0.8 px outside of where the model has it in the pictures of left"; empty: none.
  std::string side;
  double rms_px = 0.0;
  /// What of it differs from block to block, rms. The rest is alike in all of them at the same places of the robot's
  /// surface: pixels do not err so, a model does.
  double noise_px = 0.0;
};

struct LeftOverSettings {
  double level = 0.01;        ///< over all sides of all parts together
  double matters_m = 0.0005;  ///< less is no finding
  double depth_m = 0.0;       ///< of the hand: what that is in px; 0: not known
};

/// An error that is alike in every block moves no test between blocks. It shows where the outline lies off on one side
/// of one part (right, left, lower, upper in the picture) in the mean of all blocks, against how blocks differ.
LeftOver left_over(LogFit& fit, const LogAbout& log, const OutlineSearch& search, const LeftOverSettings& settings);

}  // namespace bodyschema::diagnosis
