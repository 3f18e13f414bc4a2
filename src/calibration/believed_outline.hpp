#pragma once

#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema {

/// How far off the predicted outlines are believed to be before any picture was looked at: standard deviation along
/// their normals by what is believed of a state's parameters, mean over outlines and pictures, px of a 320x240 picture.
double believed_outline_sd_px(LogFit& fit, const State& state);

}  // namespace bodyschema
