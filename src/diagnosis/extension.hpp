#pragma once

#include <vector>

#include "bodyschema/diagnosis/selection.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "candidates.hpp"
#include "model_fit.hpp"

namespace bodyschema::diagnosis {

/// What a selection was made on.
struct Evidence {
  MeasurementSource& source;
  const CoordinateLayout& layout;
  const BlockPlan& plan;
  const Linearisation& at;                  ///< the candidates' columns were taken here
  const std::vector<CompressedView>& bare;  ///< its views as if nothing but offsets were fitted
  const CandidateSet& set;
  const BlockStatistics& statistics;
};

/// A model with the causes of a selection, at their linear estimates.
struct Extension {
  ErrorModel model;
  std::vector<const SparseColumn*> generic;  ///< columns of causes that no effect is
};

/// Puts the selection's causes into a model and takes out nuisances that they explain away.
Extension extend(ErrorModel model, const Selection& selection, const Evidence& evidence);

/// Takes the named cause that falls furthest short of the z asked of it, once it is fitted, out of selection and
/// model; one that is not in the model at all has none. Nuisances that no other cause explains away are back in
/// the model then, at zero. Whether there was one.
bool drop_weakest(Selection& selection, const CandidateSet& set, const ModelFit& after, const SelectionOptions& rules,
                  ErrorModel& model);

/// The views as if all fitted parameters but the offsets were zero, by linearity.
std::vector<CompressedView> only_offsets(const MeasurementSource& source, const CoordinateLayout& layout,
                                         const Linearisation& at, const ErrorModel& model);

}  // namespace bodyschema::diagnosis
