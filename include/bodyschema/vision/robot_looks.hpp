#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace bodyschema {

/// The robot's colours in one camera's pictures, as learned while its outline fitted: shares of coarse colour cells,
/// whatever the link.
struct RobotLooks {
  static constexpr int kBits = 4;  ///< per channel of a colour picture: cells of 16 levels
  static constexpr std::size_t kCells = std::size_t{1} << (3 * kBits);
  int channels = 0;          ///< of the pictures, 1 or 3; 0: nothing is known
  std::vector<float> share;  ///< kCells entries that sum to one; empty: nothing is known
  [[nodiscard]] bool known() const { return !share.empty(); }
  /// The cell of a pixel; gray pictures use their levels in full.
  static std::size_t cell(const std::uint8_t* pixel, int channels);
};

}  // namespace bodyschema
