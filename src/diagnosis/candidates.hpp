#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis/selection.hpp"
#include "regression.hpp"

namespace bodyschema::diagnosis {

/// Everything that is tested on a log: the columns of the regression and which belong to what.
struct CandidateSet {
  std::vector<SparseColumn> columns;
  Columns offsets;  ///< one per arm joint, always fitted
  std::vector<Candidate> candidates;
  [[nodiscard]] std::vector<const SparseColumn*> pointers() const;
};

/// The catalogue but for `excluded` causes, and the generic features per arm joint. Columns of
/// effects are secants from zero to their typical sizes.
CandidateSet make_candidates(MeasurementSource& source, const Linearisation& at, const BlockPlan& plan,
                             const CoordinateLayout& layout, const std::vector<CauseName>& nuisances,
                             const std::vector<NotTestable>& excluded);

/// When the hand came into view and when it was last seen, s: a log may begin with an empty room.
std::pair<double, double> seen_span(const MeasurementSource& source, const Linearisation& at);

/// Takes columns out of candidates that the offsets make up for exactly (one direction of a tilted
/// axis can be two offsets), so that the rest of the candidate can be tested.
void drop_aliased_columns(const BlockStatistics& statistics, CandidateSet& set);

/// What this log cannot test whatever the residuals are: joints that hardly moved or never turned
/// round, no masses, too slow, one camera, encoders too sparse.
std::vector<NotTestable> untestable(const MeasurementSource& source, const Linearisation& at);

/// Whether the arm passes every posture once: no joint turns round twice. Then whatever follows an angle
/// follows time as well.
bool passes_once(const MeasurementSource& source);

bool is_excluded(const std::vector<NotTestable>& excluded, const CauseName& cause);

/// What a cause looks like in every log of this kind, whatever its numbers say: while the head stands
/// still, lengths between base and eyes, errors of neck and eye tilt and a common shift of the pictures.
std::vector<CauseName> lookalikes(const MeasurementSource& source, const CauseName& cause);

/// The motion that would tell the causes of a class apart.
std::string splitting_motion(const std::vector<CauseName>& same);

}  // namespace bodyschema::diagnosis
