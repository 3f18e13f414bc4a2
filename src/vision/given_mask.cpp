#include "bodyschema/vision/given_mask.hpp"

#include <cmath>
#include <string>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {

void GivenMask::read(const Image& given, const Undistorter* lens, BinaryMask& mask, BinaryMask& valid,
                     std::vector<std::uint8_t>& coverage) {
  if (given.channels != 1) {
    throw DataError("mask with " + std::to_string(given.channels) + " channels, expected a gray picture");
  }
  constexpr std::uint8_t kFull = 255, kHalf = 128;
  // Apart, because straightening mixes neighbours: half robot is not the same as not known.
  Image robot(given.width, given.height, 1), known(given.width, given.height, 1);
  for (std::size_t i = 0; i < given.data.size(); ++i) {
    robot.data[i] = given.data[i] == kMaskRobot ? kFull : 0;
    known.data[i] = given.data[i] == kMaskUnknown ? 0 : kFull;
  }
  if (lens != nullptr) {
    robot = lens->apply(robot);
    known = lens->apply(known);
  }
  mask = BinaryMask(given.width, given.height);
  valid = BinaryMask(given.width, given.height);
  std::size_t i = 0;
  for (int v = 0; v < given.height; ++v) {
    for (int u = 0; u < given.width; ++u, ++i) {
      if (robot.data[i] >= kHalf) mask.set(u, v);
      if (known.data[i] == kFull) valid.set(u, v);
    }
  }
  BinaryMask specks = mask;
  const double least_px = setup_.min_piece_share * static_cast<double>(components_.largest_piece(mask));
  components_.remove_small(mask, static_cast<int>(std::ceil(least_px)));
  specks -= mask;
  valid -= specks;
  components_.fill_small_holes(mask, setup_.max_hole_px);
  coverage = std::move(robot.data);
  i = 0;
  for (int v = 0; v < given.height; ++v) {
    for (int u = 0; u < given.width; ++u, ++i) {
      if (mask.at(u, v) != (coverage[i] >= kHalf)) coverage[i] = mask.at(u, v) ? kFull : 0;
    }
  }
}

}  // namespace bodyschema
