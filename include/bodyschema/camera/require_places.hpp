#pragma once

#include <string>

#include "bodyschema/camera/stereo_rig.hpp"

namespace bodyschema {

/// Throws ConfigurationError for a camera of whose place nothing is known, and says how to find it.
/// @param what  that needs it: "a replay"
void require_places(const StereoRig& rig, const std::string& what);

}  // namespace bodyschema
