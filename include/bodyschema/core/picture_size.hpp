#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace bodyschema {

struct PictureSize {
  int width = 0;  ///< px; 0: the header does not say
  int height = 0;
  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};

/// What the header of a picture says of its size, before a decoder takes memory for it: PNG, JPEG, or PBM,
/// PGM and PPM of either kind. Nothing for what is none of these. Sizes beyond 1e9 are given as 1e9.
std::optional<PictureSize> picture_size(std::span<const std::uint8_t> file);

}  // namespace bodyschema
