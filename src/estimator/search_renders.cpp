#include "search_renders.hpp"

#include <algorithm>

namespace bodyschema {

int search_renders(const EstimatorOptions& options, std::span<const PinholeIntrinsics> cameras) {
  if (options.search_renders > 0) return options.search_renders;
  // Of two such pictures two starts of a search in a frame. Of two of 320x240 all that is ever searched for at once:
  // twelve starts for each order of the eyes, six for the arm.
  constexpr int kRenders = 40, kMost = 100'000;
  constexpr double kPixels = 2.0 * 1280.0 * 720.0;
  // Of the pictures as they are sent: reduced, they are made into masks in less time, but looked at no faster.
  double pixels = 0.0;
  for (const auto& k : cameras) {
    pixels += static_cast<double>(k.width * k.reduction) * static_cast<double>(k.height * k.reduction);
  }
  return static_cast<int>(std::min(kRenders * kPixels / std::max(pixels, 1.0), static_cast<double>(kMost)));
}

}  // namespace bodyschema
