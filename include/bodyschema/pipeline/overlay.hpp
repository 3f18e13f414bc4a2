#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/image.hpp"

namespace bodyschema {

class Pipeline;
struct Estimate;
struct Observation;

/// One camera's picture with two predicted outlines: the encoders as they are (red) and with the
/// estimated offsets taken off (green).
struct OverlayView {
  const Image* image = nullptr;
  BinaryMask nominal;
  BinaryMask corrected;
  BinaryMask marked{};  ///< pixels that are tinted orange; empty: none
  /// Left edge, top edge, width and height in px of the part that is shown; zero width: all.
  std::array<int, 4> part{};
};

/// Every camera that saw something, with the outlines that the pipeline's estimator predicts from one of its
/// estimates. Refers to the observation's pictures.
std::vector<OverlayView> overlay_views(Pipeline& pipeline, const Observation& observation, const Estimate& estimate);

/// What the outlines are, for the legend.
struct OverlayNames {
  std::string nominal = "encoders as they are";
  std::string corrected = "corrected";
};

/// Left and right side by side, enlarged, with a legend (none for an empty caption). RGB.
Image draw_overlay(const std::vector<OverlayView>& views, const std::string& caption, int enlargement = 2,
                   const OverlayNames& names = {});
/// Makes the folder too. Throws as write_file (core/write_file.hpp).
void write_png(const std::filesystem::path& file, const Image& image);

}  // namespace bodyschema
