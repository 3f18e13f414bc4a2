#pragma once

#include <Eigen/Core>
#include <vector>

#include "bodyschema/diagnosis/measurement.hpp"

namespace bodyschema::diagnosis {

/// Which block each view belongs to. Blocks are held out; cells, parts of a block, are the times at
/// which a joint may have slipped.
struct BlockPlan {
  std::vector<std::size_t> block_of_view;
  std::vector<std::size_t> cell_of_view;          ///< within its block
  std::vector<double> weight_of_view;             ///< below one in a static hold, which repeats itself
  std::vector<std::vector<double>> cell_start_s;  ///< per block, per cell
  double length_s = 0.0;
  double correlation_s = 0.0;  ///< of the noise, measured in static holds; 0 when there is none
  double still_share = 0.0;
  [[nodiscard]] std::size_t block_count() const { return cell_start_s.size(); }
  /// Whether a view comes at or after the beginning of a cell.
  [[nodiscard]] bool reached(std::size_t view, std::size_t block, std::size_t cell) const {
    return block_of_view[view] > block || (block_of_view[view] == block && cell_of_view[view] >= cell);
  }
};

/// Blocks of at least `shortest_s` and five noise correlation times, measured where the arm stands
/// still. A static hold shows one posture again and again, so it counts as one block.
BlockPlan plan_blocks(const MeasurementSource& source, const std::vector<CompressedView>& views, double shortest_s);

/// A stretch of evenly spaced samples (columns) of several quantities (rows) that do not move.
struct StillStretch {
  Eigen::MatrixXd samples;
  double step_s = 0.0;
};
/// Integral of the noise's autocorrelation, seconds; 0 without stretches. Short stretches hide slow
/// noise in their means and trends: what is compared with the data is the autocovariance that slow
/// plus white noise shows after mean and trend are taken out.
double noise_correlation_s(const std::vector<StillStretch>& stretches);

}  // namespace bodyschema::diagnosis
