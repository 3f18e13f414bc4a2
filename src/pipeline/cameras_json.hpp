#pragma once

#include <nlohmann/json.hpp>

#include "bodyschema/camera/stereo_rig.hpp"

namespace bodyschema {

/// The cameras as configured, under the keys of the configuration: what a result's intrinsics and places are based on.
nlohmann::ordered_json cameras_json(const StereoRig& rig);

/// The first key in which `there` differs from `here`, with both values: "cameras.left.fx 257.3, but ... 320.0";
/// empty: none does. Numbers are the same to what a text file keeps of them.
std::string difference_of_cameras(const nlohmann::ordered_json& there, const nlohmann::ordered_json& here);

}  // namespace bodyschema
