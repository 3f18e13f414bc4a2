#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/evidence/batch_fit.hpp"

namespace bodyschema {

/// What of the robot's predicted outline lies near an edge in the pictures.
struct FoundOutlines {
  double share = 0.0;             ///< of the outlines of parts that are seen at all
  double seen = 0.0;              ///< share of the whole outline that these parts make
  std::vector<std::string> lost;  ///< links of which next to nothing is found
  bool hand_is_lost = false;      ///< the same of the hand as a whole, with all that is fixed to it
  /// Of a lost hand: the share of where it is predicted that the masks show robot. A tool that covers it hides its
  /// outline all the same; of a hand that is elsewhere they show what is behind.
  double hand_covered = 0.0;
};

/// @param pictures  that are looked at
/// @param loose  parts that have no say; empty: none
FoundOutlines found_outlines(LogFit& fit, const BatchFit& batch, std::span<const std::size_t> pictures,
                             const std::vector<bool>& loose);

/// What speaks against an answer beside the fit's own figures.
struct Doubts {
  FoundOutlines found;
  std::string implausible;       ///< a cause that no robot has, as a diagnosis words it; empty: none
  bool helps = true;             ///< outlines of postures that were left out come nearer
  double heldout_mean_px = 0.0;  ///< how far off these are
  bool own_masks = false;        ///< masks were made about a prediction of the robot
  std::string unsettled;         ///< a joint whose offset depends on how far these masks look; empty: none
  double rival = std::numeric_limits<double>::infinity();  ///< misfit of the second best answer over the best one's
};

/// A parameter that the pictures ask to be further off than is believed possible, as a sentence; empty: none. How
/// hardly they tell it does not matter: PostureMemory::belief_innovation.
std::string beyond_belief(const BatchFit& batch);

/// Sets state and sentence of a calibration that is described otherwise, and adds what is to be remarked.
/// @param unit_px  picture_unit of the first camera
void judge(const BatchFit& batch, const Doubts& doubts, double unit_px, Calibration& result);

}  // namespace bodyschema
