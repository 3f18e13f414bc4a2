#pragma once

#include <optional>
#include <span>

#include "bodyschema/geometry/image.hpp"
#include "bodyschema/outline/odd_pieces.hpp"
#include "frame_model.hpp"

namespace bodyschema {

/// How many samples of a predicted outline were looked at in pictures, and how many of these the pictures show.
struct ShownSteps {
  double looked = 0.0, shown = 0.0;
};

/// Asks a picture itself, not its mask, whether a predicted outline is there: a sample is shown where the largest step
/// of colour along its normal, within 5 px of a 320x240 picture, lies on the outline to a pixel. Wherever an outline is
/// put that the picture knows nothing of, chance shows 3 of 11. Masks are looked for near what was predicted, and prove
/// it right where background has the robot's colours or a part of the robot the background's; a picture does not.
/// @param image  gray or RGB
/// @param samples  pixels of the picture; those nearer to its border than is looked are left out
/// @param unit_px  the length that one pixel of a 320x240 picture has
ShownSteps shown_steps(const Image& image, std::span<const OutlineSample> samples, double unit_px);

/// Share of a frame's outline, 0 to 1, that its pictures show.
/// @param evidence  with samples
/// @return nothing without pictures, or where too little of the outline is in them
std::optional<double> shown_share(const Frame& frame, const FrameEvidence& evidence);

}  // namespace bodyschema
