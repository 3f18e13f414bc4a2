#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "bodyschema/effects/effect_kind.hpp"

namespace bodyschema::effects {

/// "the upper arm", where the link's name says which part of an arm it is; else "the link NAME".
std::string part_in_words(const std::string& link);
/// A vector by the axes of its frame: "+y", "-z", or "(0.71, 0, -0.70)".
std::string direction_in_words(const Eigen::Vector3d& direction);
/// "3.1 mm (3 to 3.2) along ... and 1 mm (...) along ...": two sizes; one whose interval holds zero ("at most") is left
/// out beside one that is told.
std::string both(std::span<const std::string> amounts);

/// Sentences (EffectKind) of a pattern: {joint} and {size} are the finding's own, of {more|less} the first stands where
/// its size is positive and the second where it is negative.
decltype(EffectKind::sentence) in_words(std::string pattern);

}  // namespace bodyschema::effects
