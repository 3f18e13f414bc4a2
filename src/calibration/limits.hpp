#pragma once

#include <array>
#include <cstddef>

#include "bodyschema/geometry/pose.hpp"

/// Limits of a calibration as a whole; what belongs to one search alone stands with it. Statistical ones are quantiles
/// or ratios of what was measured on the log; physical ones are bounds that a user can check on the robot.
namespace bodyschema::calibration::limits {

// Physical.
constexpr double kFrom_px =
    40.0;  ///< px of a 320x240 picture: so far off are outlines where joints are some degrees off
constexpr double kSameAnswer_m = 0.02;  ///< of the hand in the camera's frame, mean over the pictures
constexpr double kLeastFound = 0.6;     ///< less of the outline found than this, and it is somebody else's
constexpr double kHardlyFound = 0.3;    ///< a link of which less is found is hidden in the pictures
/// Masks show robot in more than this of where a hand is predicted: nothing says that it is not there.
constexpr double kCovered = 0.8;
constexpr double kLeastSeen = 0.6;  ///< what is not hidden is most of the robot
constexpr double kNear_px = 2.5;    ///< px of a 320x240 picture: residuals of outlines that belong together
/// px of a 320x240 picture, median: masks that are made about a prediction follow it, right or wrong; those about the
/// right one end at the robot itself.
constexpr double kOwnMasks_px = 1.0;
constexpr double kSame_px = 0.2;      ///< px of a 320x240 picture: outlines that differ by less are alike
constexpr double kRough_px = 30.0;    ///< px of a 320x240 picture: outlines further off are looked for by what moved
constexpr double kAnywhere_px = 1e3;  ///< ... and these may be anywhere
constexpr double kHardlyKnown_rad = radians(3.0);  ///< so are those of a camera that may be turned by more
constexpr double kTold_rad = radians(0.5);         ///< a joint's standard deviation, at most

constexpr double kLost_px = 8.0;  ///< px of a 320x240 picture, median of a posture: its outlines are not the robot's

// Statistical.
/// A place of the camera is taken for the only one where the next best fits this much worse: silhouettes of a wrong
/// place are off by a third, of the right one by what masks get wrong.
constexpr double kOnly = 1.25;
/// Postures that were left out lie so many times as far off as those of the fit: they contradict each other. A fit of
/// few postures follows them by a quarter or so.
constexpr double kContradict = 1.5;
constexpr double kFarUntold_sd =
    3.0;  ///< belief_innovation of an offset that is hardly told and made up for all the same
/// A joint's standard deviation, as parts of the log scatter, over what was believed of it before: 1 where pictures say
/// nothing; in 116 good results of photographs of three physical arms (test/foreign_recordings) 1.4 at most.
constexpr double kScattered = 2.0;
constexpr double kToldShare = 1.0 / 3.0;  ///< of what was believed before
/// belief_innovation of what is no joint's offset: 1 of 16,000 by chance. In the good sets that are at hand it is 3.0
/// at most (`bodyschema evaluate real`).
constexpr double kBeyondBelief_sd = 4.0;
constexpr double kDisagreement = 4.0;  ///< mean NIS per direction
constexpr double kSettled_sd = 2.0;    ///< two answers about one state that are nearer are the same
constexpr double kWithin_sd = 4.0;     ///< masks never look less far: what lies beyond, they take for the other side
constexpr std::size_t kFewestPostures = 3;  ///< fewer cannot disagree

// Computational.
constexpr std::size_t kPlaces = 5;  ///< of a searched camera that are tried
/// Of pictures without masks: how far off their outlines may be, round by round, px of a 320x240 picture; first where
/// nothing is known but what is configured, then after a fit of what moved.
constexpr std::array kReaches = {40.0, 30.0, 20.0, 12.0, 8.0, 6.0, 5.0};
constexpr std::array kReachesMoved = {16.0, 12.0, 8.0, 6.0, 5.0, 4.0, 4.0};
static_assert(kReaches.size() == kReachesMoved.size());
constexpr double kWide_px = 12.0;  ///< ... and then once more, to see whether it makes a difference
constexpr std::array kReachesAgain = {6.0, 4.0, 4.0};
constexpr int kMostChecks = 3;
constexpr std::size_t kRawKept = 128;   ///< observations of such a log whose pictures are looked at
constexpr std::size_t kReadAgain = 32;  ///< ... of one with masks, to hold these against them
constexpr std::size_t kShown = 12;      ///< ... of any other, for the report alone
constexpr std::size_t kEnough = 24;     ///< pictures all over a log by which starts are compared
constexpr std::size_t kSections = 5;    ///< of a log that are left out in turn

}  // namespace bodyschema::calibration::limits
