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
  /// Length in px of a metre across the line of sight, as far away as the hand; 0: not known, no scale bar.
  double px_per_m = 0.0;
};

/// Every camera that saw something, with the outlines that the pipeline's estimator predicts from one of its
/// estimates. Refers to the observation's pictures.
std::vector<OverlayView> overlay_views(Pipeline& pipeline, const Observation& observation, const Estimate& estimate);

/// Leaves of every view the arm (both outlines) and a margin around it; all views keep one size.
void crop_to_arm(std::vector<OverlayView>& views);

/// What the outlines are, for the legend.
struct OverlayNames {
  std::string nominal = "encoders as they are";
  std::string corrected = "corrected";
};

/// Left and right side by side, enlarged, with caption, legend and a scale bar in each (none of them for an empty
/// caption). Lines and letters are as wide as it takes to see them where the page is as wide as a phone. RGB.
/// @param enlargement  pixels of the page for one of the picture; 0: what makes the page some 1300 px wide
Image draw_overlay(const std::vector<OverlayView>& views, const std::string& caption, int enlargement = 0,
                   const OverlayNames& names = {});
/// Makes the folder too. Throws as write_file (core/write_file.hpp).
void write_png(const std::filesystem::path& file, const Image& image);

}  // namespace bodyschema
