#pragma once

#include "bodyschema/effects/effect.hpp"

namespace bodyschema {

/// The smallest size of a cause that is found in nine of ten logs of 50 s in which nothing else is wrong, in
/// the unit of its parameters; 0 where nobody has measured it, or where it does not show. Joints as on an arm
/// of seven, shoulder to wrist: another arm's are taken for the seven's that lie as far out.
/// @param name  an effect, or a fault outside the catalogue ("wobble", "velocity_lag", ...)
[[nodiscard]] double detectable_size(const std::string& name, const EffectTarget& target, const JointRoles& roles);

}  // namespace bodyschema
