#pragma once

#include <string>

#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "frame_outcome.hpp"
#include "fused_state.hpp"
#include "hand_uncertainty.hpp"

namespace bodyschema {

/// How well the hand is to be known for `converged`, m: as configured, or as well as its distance and what is tolerated
/// allow.
/// @param pixel_m  what a pixel of a 320x240 picture shows at that distance
double hand_sd_limit_m(const EstimatorOptions& options, const State& state, const HandUncertainty& hand,
                       double pixel_m);

/// What is wrong by more than is believed possible, and what to do; empty: nothing.
std::string misfit(const PostureMemory& memory, const State& state);

/// Whether an estimate may be relied on: fills in its misfit.
/// @param estimate  with hand_sd_m and hand_sd_limit_m
/// @param knows_shape  whether it is known what outlines get wrong alike in all postures
EstimatorState conclude(const FrameOutcome& outcome, const FusedState& known, const State& state, bool knows_shape,
                        Estimate& estimate);

}  // namespace bodyschema
