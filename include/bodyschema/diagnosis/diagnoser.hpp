#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/diagnosis/selection.hpp"

namespace bodyschema {

struct DiagnosisOptions {
  double block_s = 2.0;          ///< shortest block of the cross-validation
  double shortest_log_s = 10.0;  ///< below it the log is refused
  SelectionOptions selection;
  int baseline_iterations = 8;
  int refit_iterations = 4;
  /// Effects that every real robot has and that the baseline fits beside the offsets.
  std::vector<CauseName> nuisances;
  /// Sizes of nuisances and of slips, by effect name in the unit of its parameter, that are put up with: a
  /// picture's blur and threshold alone make a mask 0.1 px fatter, and not everywhere alike. The same
  /// 0.1 px at the fingertips, a hand's length from the origin of their link at 0.3 m, is 0.1 % of the
  /// mesh, at a forearm's flanks 0.4 %. (Detectable is 0.6 %.)
  std::map<std::string, double> tolerances = {{"silhouette_bias", 0.1}, {"mesh_scale", 0.2}};
  /// Instead of searching: exactly these causes are fitted (to measure what a known one is worth).
  std::optional<std::vector<CauseName>> fixed_causes;
  /// Where the fit of the offsets starts, rad by joint (encoder = true + offset); others at zero.
  std::map<std::string, double> start_offsets;
  /// Rms that noise alone leaves, px, and above which no name is trusted; the defaults are for
  /// sources whose noise is not known.
  double noise_rms_px = 1e9, trusted_rms_px = 1e9;
  /// Share of the outline that must have been found, below which no name is trusted.
  double trusted_outline = 0.0;
  /// One sigma, as a share of an estimate, of errors that all blocks have in common and that therefore
  /// do not show between them: how a picture's blur and threshold place an outline, what encoders did
  /// between two readings. Widens the intervals of causes.
  double systematic_share = 0.0;
  /// The same whatever the cause's size is, for those that masks imitate: by effect, one sigma in the unit of its
  /// parameter.
  std::map<std::string, double> systematic_error;
  std::function<void(double)> progress;  ///< called with the share done
};

/// The usual nuisances for a robot: finger curl, mesh scale, mask dilation, vergence, neck roll,
/// eye tilt and focal length.
std::vector<CauseName> usual_nuisances(const JointRoles& roles);

/// Says what the model gets wrong, from residuals. Steps: fit offsets and nuisances; compress;
/// test the catalogue on blocks; refit with the causes found; measure the gain on held-out blocks.
/// Throws DataError saying what to record when the log cannot be used at all.
DiagnosisReport diagnose(MeasurementSource& source, const DiagnosisOptions& options);

}  // namespace bodyschema
