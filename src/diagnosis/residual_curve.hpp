#pragma once

#include <cstddef>
#include <vector>

namespace bodyschema::diagnosis {

/// Something that is left of one picture, beside what it may follow.
struct ResidualPoint {
  double x = 0.0, y = 0.0;
  double time_s = 0.0;
  std::size_t camera = 0;  ///< 0 left, 1 right
};

/// How long what is left stays alike: pictures that err alike do not count twice.
struct ErrorMemory {
  double step_s = 1.0;  ///< from one picture of a camera to the next
  double kept = 0.0;    ///< correlation (of the signs: medians know no more) from one of them to the next
  double shared = 0.0;  ///< of the two cameras at one time
  double spread = 0.0;  ///< standard deviation of what is left, from its middle half; 0: not known
};
/// Of y about its median over the whole log, whatever x is. Points in order of time; too few: none.
ErrorMemory error_memory(const std::vector<ResidualPoint>& points);

/// Medians of y over bins of x that hold equally many points, with their 95 % intervals. Where a bin's points are worth
/// fewer than four that err independently, as in bins shorter than the memory, their own spread says little: that of
/// all stands in.
struct ResidualCurve {
  std::vector<double> x, y, low, high;
  std::vector<double> sd;  ///< standard errors of y
  /// Mean square of the medians over their standard errors: about one when y does not follow x.
  [[nodiscard]] double structure() const;
  /// Size of what follows x: the root mean square of the medians without their own noise.
  [[nodiscard]] double size() const;
};
/// Enough for a line whose shape nobody has named.
constexpr std::size_t kCurveBins = 14;
/// Points that are not finite are left out; empty where there are too few.
/// @param centred    about the median of all: a constant belongs to the offsets
/// @param most_bins  fewer where a bin would have less than a dozen points
ResidualCurve residual_curve(std::vector<ResidualPoint> points, const ErrorMemory& memory, bool centred = true,
                             std::size_t most_bins = kCurveBins);

}  // namespace bodyschema::diagnosis
