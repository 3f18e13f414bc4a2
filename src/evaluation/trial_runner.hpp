#pragma once

#include <functional>
#include <string>
#include <vector>

#include "experiments.hpp"

namespace bodyschema {

/// "best" and "paper", in the order in which they are listed everywhere.
const std::vector<std::string>& modes();

/// The configured estimator in one of the modes.
EstimatorOptions options_for(const ExperimentContext& context, const std::string& mode);
/// One contestant for each mode, in the order of modes().
std::vector<Contestant> stereo_contestants(const ExperimentContext& context);

/// Conditions of the simulated experiments: the paper's offsets, the background learned first.
TrialSetting standard_setting(const ExperimentContext& context);
/// The same with a model that is a little off: focal length 0.3 %, principal points 0.5 px, size of
/// the meshes 0.5 %, fingers 2 deg, each with a sign drawn by the seed.
TrialSetting mismatch_setting(const ExperimentContext& context, std::uint64_t seed);

/// Runs `trials` seeded trials on all cores with a progress bar; the order of the results is that
/// of the seeds. `setting_of` may differ from trial to trial.
std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label, int trials,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants);
/// The same with seeds that are named.
std::vector<TrialRecord> run_trials(const ExperimentContext& context, const std::string& label,
                                    const std::vector<std::uint64_t>& seeds,
                                    const std::function<TrialSetting(std::uint64_t)>& setting_of,
                                    const std::vector<Contestant>& contestants);

}  // namespace bodyschema
