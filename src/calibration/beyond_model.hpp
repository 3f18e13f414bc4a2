#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/observation/corrections.hpp"

namespace bodyschema {

/// What masks show beyond the model, or lack of it: a tool that no mesh of the robot has, somebody's arm that a network
/// took for the robot's, a piece that something hides. Where it begins, the outline is not the model's, and half of it
/// lies near enough to pull.
struct BeyondModel {
  std::vector<BinaryMask> where;  ///< of each picture of the log; no pixels: nothing there
  std::size_t pictures = 0;       ///< in which there is something
  /// The link to which something is fixed that no mesh shows: it is there in most pictures of the log. Empty: none.
  std::string on_link;
};

/// Looks for it about a fit that is near: pieces wider than outlines err.
/// @param corrections  of every picture of the log, as LinearLog::corrections
BeyondModel beyond_model(const PictureLog& log, std::span<const Corrections> corrections);

/// Of links beside which something shows in most pictures, the one beside which it shows in most of those that show
/// the link; none: there is none.
/// @param held, seen  pictures in which something is beside the link, and in which the link is
std::optional<std::size_t> link_that_holds(std::span<const double> held, std::span<const double> seen,
                                           std::size_t pictures);

/// Pixels there, and near there, no longer count.
void leave_out(PictureLog& log, const BeyondModel& beyond);

}  // namespace bodyschema
