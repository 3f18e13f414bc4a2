#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"

namespace bodyschema {

/// Edges of a robot in one picture of a recording, drawn by hand by somebody who had not seen the model in it: what is
/// hidden, held or not in the model is left out.
struct DrawnPicture {
  std::int64_t episode = 0;
  std::size_t row = 0;                  ///< of its table of joint angles, and picture of its video
  std::vector<Eigen::Vector2d> left{};  ///< points on edges of the left arm, px, about one every 8
  std::vector<Eigen::Vector2d> right{};
};

/// Lines `frame EPISODE ROW`, each followed by its edges: `L` or `R`, then points `u,v`, px, OpenCV convention. `#`
/// begins a comment. Throws FileError with the number of the line.
std::vector<DrawnPicture> read_drawn_outlines(const std::filesystem::path& file);

/// How far each point lies from the nearest pixel of a mask that has another beside it, px; where the mask has no
/// outline within the picture: the picture's width.
std::vector<double> distances_to_outline(const std::vector<Eigen::Vector2d>& points, const BinaryMask& mask);

}  // namespace bodyschema
