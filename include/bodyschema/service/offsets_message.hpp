#pragma once

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/estimate.hpp"

namespace bodyschema {

/// An estimate as it is published. `sequence`, `latency_ms`, `num_particles` and the hashes are left
/// to the caller.
[[nodiscard]] joint_offsets_t to_message(const Estimate& estimate, const StereoRig& rig);
/// What was found beside the state.
findings_t to_message(const LiveFindings& findings);

}  // namespace bodyschema
