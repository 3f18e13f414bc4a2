#pragma once

#include <functional>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/outline_noise.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema {

struct DiagnosisOptions {
  /// Share of healthy logs in which something may be named, over all candidates together.
  double level = 0.01;
  /// What matters to a user, m: a cause that moves hand and outlines less than this, the joints' offsets fitted anew,
  /// is one of several small errors and not named.
  double matters_m = 0.0005;
  double block_s = 1.0;            ///< shortest block; longer ones where neighbours err alike
  double same_posture_rad = 0.05;  ///< a block ends only where the arm has moved by this
  double shortest_log_s = 8.0;     ///< of pictures; shorter and fewer still postures than `fewest_postures`: refused
  std::size_t fewest_postures = 5;
  double spacing_px = 3.0;          ///< of outline samples, px of a 320x240 picture
  OutlineNoise::Prior noise;        ///< of outlines, before any was seen
  std::size_t most_pictures = 400;  ///< that a fit looks at; tests look at all
  std::uint64_t seed = 1;           ///< of what chance makes of the blocks
  bool fit_only = false;            ///< what offsets and nuisances leave (report.before), and no causes are asked for
  /// Where the fit starts besides the beliefs' centre: values of the state's parameters, SI.
  std::vector<Eigen::VectorXd> starts{};
  std::function<void(double)> progress{};  ///< called with the share done
};

/// A belief about an effect so wide that it is none: what was found is fitted freely.
Belief wide_belief(const CauseName& cause, const JointRoles& roles);

/// Says what the model of a robot gets wrong, from the outlines in a log's pictures. One loop: fit what is believed
/// uncertain anyway (offsets, nuisances); ask of every cause of the catalogue, and of free curves over what a joint
/// does, whether the blocks of the log agree that it is there (blocks times random normals, the largest of all
/// candidates at `level`: Westfall and Young 1993); take the one that predicts blocks best which its fit has not seen;
/// fit again with it; until nothing is left. What it rests on is measured on the log itself.
/// @param beliefs  the state's: offsets and nuisances with their standard deviations
/// @param tolerances  of the robot: considered in every interval
/// Throws DataError saying what to record when the log cannot be used at all.
DiagnosisReport diagnose(LogFit& fit, const std::vector<Belief>& beliefs, const std::vector<Belief>& tolerances,
                         const DiagnosisOptions& options);

}  // namespace bodyschema
