#pragma once

#include <cstddef>

/// Every limit of the diagnosis. Statistical ones are quantiles of a stated distribution; physical ones are bounds that
/// a user can check on the robot; computational ones bound what is looked at and do not change what is right.
namespace bodyschema::diagnosis::limits {

// Physical.
constexpr double kFrom_px = 32.0;       ///< px of a 320x240 picture: outlines may lie so far off at first
constexpr double kSearch_px = 8.0;      ///< ... and once near
constexpr double kOneFrame_rad = 0.05;  ///< a joint's angle in one picture: 60 ms late at 50 deg/s
constexpr double kJump_rad = 0.14;      ///< between two pictures: the arm was moved from posture to posture
constexpr double kFloor_px = 0.1;       ///< no picture places a flank nearer (OutlineNoise::Prior::floor_px)
constexpr double kImplausible = 20.0;   ///< of an effect's typical size: no robot is so wrong
constexpr double kLeastFound = 0.6;     ///< share of the outline that must be found where the robot is seen at all
constexpr double kMostOfTheLog = 0.5;   ///< of the blocks: what is seen there beside the robot is no passer-by
constexpr double kFlankFloors = 3.0;    ///< times kFloor_px: so far off a whole flank is not where a picture may put it
constexpr double kNoiseRatio =
    1.3;                           ///< what is left over what of it differs between blocks: more is no noise of pixels
constexpr double kRough_px = 1.5;  ///< px of a 320x240 picture: the roughest outlines that segmentation makes
constexpr double kLostContrast = 0.5;  ///< between the shares of two parts of the log that are seen

// Statistical.
constexpr double kRivalTail = 0.02;   ///< two-sided, Student's t of paired blocks: clearly worse than the best
constexpr double kRivalShare = 0.5;   ///< of the best one's gain: less explains something else
constexpr double kAlikeShare = 0.1;   ///< of a gain: of causes that explain so much alike the simplest is taken
constexpr double kConfidence = 0.05;  ///< two-sided, of intervals
constexpr double kSameChange = 1e-3;  ///< share of a column that another cause cannot make up for: it is the same
constexpr double kOneChange = 1e-5;   ///< ... so little, and both say one change in two ways, wherever the joint goes
constexpr double kNeighboursAlike = 0.3;  ///< correlation of neighbouring blocks: they are made longer
constexpr double kLeastGain = 1e-3;       ///< share of the misfit: points of an outline come and go
constexpr double kGenericGain = 2.0;      ///< a free curve must explain so much more than any known cause

// Computational.
constexpr double kLeastPromise = 1e-4;  ///< share of the misfit: a step that promises less is not taken
constexpr double kRounding = 1e-7;      ///< share of a column beyond others: less is rounding
constexpr double kWide = 4.0;           ///< typical sizes: a belief that is none
constexpr std::size_t kMostCauses = 6;
constexpr std::size_t kMostRounds = 10;    ///< causes taken or dropped, blocks made longer
constexpr std::size_t kMostTried = 4;      ///< candidates a round that are fitted for real
constexpr double kWorthATrial_z = 2.5;     ///< less does not stand out even of one candidate's noise
constexpr std::size_t kFewestBlocks = 16;  ///< blocks are not made longer where fewer would be left
constexpr std::size_t kPicturesForSize = 60;
constexpr std::size_t kPicturesForSizeInALook = 20;
constexpr std::size_t kPicturesFromAfar = 120;  ///< several for each parameter of any state

}  // namespace bodyschema::diagnosis::limits
