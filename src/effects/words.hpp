#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

namespace bodyschema::effects {

/// "the upper arm", where the link's name says which part of an arm it is; else "the link NAME".
std::string part_in_words(const std::string& link);
/// A vector by the axes of its frame: "+y", "-z", or "(0.71, 0, -0.70)".
std::string direction_in_words(const Eigen::Vector3d& direction);
/// "3.1 mm (3 to 3.2) along ... and 1 mm (...) along ...": two sizes; one whose interval holds zero ("at most") is left
/// out beside one that is told.
std::string both(std::span<const std::string> amounts);

}  // namespace bodyschema::effects
