#pragma once

#include <string>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/estimate.hpp"

namespace bodyschema {

/// One line of estimates.jsonl, as daemon and replay both write it: a JSON object with `utime`
/// (us), `state`, `offset_deg` and `stddev_deg` by joint, `hand_pose_<name>_camera` (4x4, metres),
/// `likelihood`, `effective_sample_size` (particles), `contour_rms_px`, `hand_sd_mm`, `told` (joints whose offset the
/// pictures tell), `effects` (each parameter that is estimated beside the offsets, with value, stddev and unit); where
/// the estimator has them `hidden` (shares of the outline of `hand` and `robot`, 0 to 1, that were left out, and
/// whether the hand `holds` something; absent: nothing), `findings` (what the pictures ask for beside: effect,
/// parameters with unit, z), `changed`, `misfit`, `stalled`, `cameras_swapped` (Estimate). Numbers are written so that
/// they read back exactly. Without the line's end.
[[nodiscard]] std::string estimate_line(const Estimate& estimate, const StereoRig& rig);

}  // namespace bodyschema
