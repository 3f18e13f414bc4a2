#pragma once

#include <span>

#include "bodyschema/evidence/log_fit.hpp"

namespace bodyschema {

/// How far the predicted outlines of a log's pictures lie from the observed ones: the median over all points of the
/// outlines, px of the picture. A point that finds no edge counts as far as was looked, 30 px of a 320x240 picture.
/// @param pictures  which; empty: all
double median_outline_distance_px(LogFit& fit, const ErrorModel& model, std::span<const std::size_t> pictures = {});

}  // namespace bodyschema
