#pragma once

#include <vector>

#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema {

/// How far off the predicted outlines are believed to be before any picture was looked at: standard deviation along
/// their normals by what is believed of a state's parameters, mean over outlines and pictures, px of a 320x240 picture.
/// @param left_out  parts that have no say; empty: all have
double believed_outline_sd_px(LogFit& fit, const State& state, const std::vector<bool>& left_out = {});

}  // namespace bodyschema
