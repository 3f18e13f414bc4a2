#pragma once

#include <memory>
#include <vector>

#include "bodyschema/diagnosis/diagnoser.hpp"

namespace bodyschema::diagnosis {

struct Look {
  DiagnosisReport report;  ///< verdict, sentence and causes are filled in
  ErrorModel best;         ///< the model with what was found, where these pictures have it
};

/// What pictures ask for beside a model, from their linearisation alone: the search of `diagnose` without its fits, in
/// the time of a few frames.
/// @param state  the model, about which they were linearised
/// @param pictures  over all coordinates
/// @param noise  per camera
/// @param changes  times at which others saw that something happened: slips then need to stand out for themselves alone
Look look(LogFit& fit, State state, std::shared_ptr<const LinearLog> pictures, std::vector<OutlineNoise> noise,
          const std::vector<Belief>& tolerances, const DiagnosisOptions& options,
          const std::vector<Microseconds>& changes = {});

}  // namespace bodyschema::diagnosis
