#pragma once

#include <optional>
#include <string>

#include "bodyschema/camera/camera_info.hpp"
#include "bodyschema/camera/stereo_rig.hpp"

namespace bodyschema {

/// What a recording itself says of a camera, against what the configuration believes; nothing where they agree.
/// @param source  what says so, for the sentence
[[nodiscard]] std::optional<std::string> camera_difference(const CameraModel& camera, const CameraInfo& info,
                                                           const std::string& source);

}  // namespace bodyschema
