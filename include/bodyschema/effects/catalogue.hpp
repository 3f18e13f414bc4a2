#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bodyschema/effects/effect.hpp"

namespace bodyschema {

/// Names of all effects, joint_offset first.
const std::vector<std::string>& effect_names();

/// An effect of the catalogue with all parameters zero. Throws ConfigurationError naming the
/// nearest effect or joint, or saying what target the effect needs.
std::unique_ptr<Effect> make_effect(const std::string& name, const EffectTarget& target, const JointRoles& roles);

/// Every target on which an effect makes sense for this robot: one per arm joint for most, pairs
/// for couplings, one empty target for the whole robot, none where the robot lacks the joints.
std::vector<EffectTarget> effect_targets(const std::string& name, const JointRoles& roles);

}  // namespace bodyschema
