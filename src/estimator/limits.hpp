#pragma once

#include <cstddef>

/// Every limit of the estimator that no configuration sets, with its unit and its kind: `physical`, a bound that
/// follows from what robots and pictures are; `statistical`, a quantile of a stated distribution.
namespace bodyschema::limits {

/// Physical. px of a 320x240 picture: outlines whose residuals are larger (robust rms) are somebody else's.
inline constexpr double kNear_px = 2.5;
/// Physical. A picture that shows less of the predicted outline shows something else as well.
inline constexpr double kLeastMatched = 0.5;
inline constexpr double kFewestPoints = 20.0;
/// Physical. rad; Gauss-Newton goes no further at once: sines are no longer linear.
inline constexpr double kMaxStep_rad = 0.2;
/// Physical. px of a 320x240 picture: by less than this no picture tells something else's edge from the robot's.
inline constexpr double kLeastOdd_px = 0.4;
/// Physical. Of an outline: neighbours on the same flank (cosine between their normals), px of a 320x240 picture apart.
inline constexpr double kSameSide = 0.5;
inline constexpr double kBeside_px = 7.0;
/// Physical. px of a 320x240 picture: what the edge of a wrong model keeps its distance from the prediction by, along a
/// finger; those of other things cross it.
inline constexpr double kParallel_px = 1.0;
/// Physical. A change of the robot explains what looked hidden only if no more than this share of it looks so still ...
inline constexpr double kLeastExplained = 0.5;
/// ... but for this share of the outline, which noise and thin fingers leave.
inline constexpr double kFewOdd = 0.1;
/// Physical. Share of the hand's outline; of a hand that is hidden by more too little is seen to claim where it is now.
inline constexpr double kMostHidden = 0.8;
/// Physical. Of the hand's outline that is not found: lies so much of it within masks that others made, a tool on the
/// flange hides it, and nothing says that the hand is not there.
inline constexpr double kWithinMasks = 0.8;
/// Statistical: where so much of what a robust fit is given does not belong to it, it may end anywhere (its breakdown
/// point).
inline constexpr double kBreakdown = 0.5;
/// Physical. px of a 320x240 picture: what masks show this far beside a robot that is known as well as this is not the
/// robot.
inline constexpr double kForeign_px = 4.0;
/// Physical. px of a 320x240 picture: a held thing's map is as coarse as this, its cubes apart.
inline constexpr double kCover_px = 1.5;
/// Physical. px of a 320x240 picture: no picture places an outline better, and a fit that moves it by less has arrived.
inline constexpr double kSettled_px = 0.1;
/// Computational. More steps than these towards it are not taken.
inline constexpr int kMostSteps = 8;
/// Physical. Pictures after which the measured noise has forgotten one: light and background change in minutes.
inline constexpr double kNoisePictures = 100.0;

/// Statistical. A frame whose innovation exceeds what this share of frames reach by chance is doubted: chi-square of
/// its degrees of freedom, times what is usual in this log.
inline constexpr double kDoubt_tail = 1e-4;
/// Statistical. Frames over which the usual innovation is the mean.
inline constexpr double kUsualFrames = 30.0;
/// Statistical. Chi-square by which another explanation must be better: a likelihood ratio of 1 : 1e5.
inline constexpr double kClearlyBetter = 23.0;
/// Physical. Hammoude distance of an arm found elsewhere against that of the one believed in: wrong arms are off by far
/// more, right ones by what masks get wrong.
inline constexpr double kNearer = 0.8;
/// Statistical. What one more free parameter must be better by: ln of prior over posterior variance, usually.
inline constexpr double kPerParameter = 9.0;

/// Statistical. Encoder readings after which their noise is told anew, from twice as many.
inline constexpr std::size_t kReadings = 200;

/// Statistical. Pairs of frames of a moving arm from which the noise of stamps is told: a busy network is not so for
/// ever; and how many what is believed of it counts as.
inline constexpr std::size_t kRecentStamps = 100;
inline constexpr double kStampsBelieved = 8.0;
/// Physical. s; in so short a time an arm goes on as it did: what is wrong besides moves two frames' times alike.
inline constexpr double kStampsBeside_s = 0.5;

/// Statistical. Postures after which what one showed of the parts' shapes, and of the hand, has faded to 1/e: the
/// estimate that left its residuals is no longer held.
inline constexpr double kRecentPostures = 12.0;

/// Statistical. A parameter further from what was believed than this many of its standard deviations contradicts it.
inline constexpr double kBeyondBelief_sd = 4.0;
/// Statistical. Postures that disagree by more than this times what is claimed (mean NIS per direction).
inline constexpr double kDisagreement = 4.0;

/// Physical. s; a single bad picture, a person passing, lasts shorter than what a robot does to itself; longer
/// contradictions without a better explanation are said.
inline constexpr double kPatience_s = 0.5;
/// Physical. s; a memory that another one replaced may prove right again within it.
inline constexpr double kAlternative_s = 3.0;
/// Physical. rad; the search's particles are never narrower: an arm's first picture knows no better.
inline constexpr double kSearchSpread_rad = 0.0349066;
/// Physical. rad; of slips that are searched for at once; larger ones take more frames.
inline constexpr double kLargestSlip_rad = 0.2094395;
/// Physical. Pixels of a 320x240 picture, at the hand's distance: how well hands are to be known where nobody says.
inline constexpr double kHand_px = 1.0;
/// Physical. ... or to this share of what the description of links and cameras leaves open, where that is more,
inline constexpr double kOfDescription = 0.25;
/// Physical. ... but no worse than this many pixels.
inline constexpr double kMostHand_px = 2.0;

}  // namespace bodyschema::limits
