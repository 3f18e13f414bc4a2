#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace bodyschema {

/// One sample of a predicted outline, and what the picture shows there.
struct OutlineSample {
  std::size_t part = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();   ///< predicted, px
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  ///< unit, image, outwards
  std::optional<double> residual_px{};               ///< observed minus predicted; none: no edge within the search
  bool covered = false;                              ///< something else is known to be here: not looked for
  bool odd = false;                                  ///< the picture shows the edge of something else here
};

/// Decides which pieces of an outline show the edge of something else than the robot: a thing in front of it, a held
/// thing that makes one mask with it, a piece of it whose mask is missing.
///
/// One sample far off is noise, a run of them is an edge of something else; beside such a run a sample that would pass
/// alone does not. A field of two labels over neighbouring samples (on the same side of a body, no further apart than
/// a few samples): edges of the robot lie about the prediction as `sd_px` says, edges of something else anywhere within
/// the search or nowhere, and neighbours are mostly alike. Solved by mean field.
class OddPieces {
 public:
  /// @param sd_px  of a residual, px of the picture
  /// @param spacing_px  between samples, px of the picture
  /// @param search_px  how far edges were looked for
  /// Sets `odd` of every sample that is not covered.
  void find(std::span<OutlineSample> samples, double sd_px, double spacing_px, double search_px);

 private:
  void find_neighbours(std::span<const OutlineSample> samples, double reach_px);

  std::vector<std::uint32_t> in_order_;            ///< samples from the top of the picture down
  std::vector<std::vector<std::uint32_t>> lists_;  ///< neighbours of each sample
  std::vector<double> evidence_, belief_;
};

}  // namespace bodyschema
