#pragma once

#include <string>
#include <vector>

#include "bodyschema/diagnosis/block_statistics.hpp"
#include "bodyschema/effects/effect.hpp"

namespace bodyschema {

/// A possible cause: an effect of the catalogue, or a generic feature that stands for "something
/// that follows this variable on this joint".
struct Candidate {
  std::string name;  ///< the effect's name; "unexplained" for a generic feature
  EffectTarget target;
  std::string variable;  ///< generic features: what the residual follows ("velocity")
  Columns columns;
  /// Which fitted parameter of the effect each column is; a parameter that this log cannot tell from
  /// the offsets has none.
  std::vector<std::size_t> parameters;
  bool nuisance = false;  ///< part of the baseline fit; reported when it is significant
  /// In units of its column: a nuisance below this is not worth a word; a slip below it is hardly one, unless it
  /// takes away much.
  double tolerance = 0.0;
  /// In units of its columns: what is found at all in a log with nothing else wrong; 0: not known. In a crowd of
  /// small errors what is smaller is one of them, however clearly it shows.
  double detectable = 0.0;
  bool slip = false;  ///< `columns` has one entry, switched on at its block
  /// Whether it is a matter of time, which slow noise looks like.
  [[nodiscard]] bool temporal() const { return slip || name == "drift" || variable == "time"; }
  [[nodiscard]] bool generic() const { return name == "unexplained"; }
  [[nodiscard]] std::string description() const;
};

struct SelectionOptions {
  double z_enter = 4.5;
  /// What z is asked for holds for so many blocks; fewer know their spread worse. (A minute with a rest has 24,
  /// so 4.7 is asked instead of 4.5; a minute of slow noise ten.)
  std::size_t usual_blocks = 30;
  double gain_floor = 0.006;  ///< of the held-out loss that the model so far leaves
  /// By this share of its size (one sigma) a cause's true shape differs from its column; beside a large one that
  /// looks like a small cause of another kind.
  double shape_error = 0.0;
  double generic_gain_floor = 0.015;  ///< a free curve has more ways to follow noise
  double t_enter = 1.5;               ///< paired over blocks
  std::size_t far_group = 3;          ///< blocks held out together for causes in time: noise may be slow
  double z_far = 3.5;                 ///< ... and the z they must keep then
  double gain_large = 0.25;           ///< what takes away that much of the loss is there ...
  double z_large = 3.0;               ///< ... even if its shape fits badly, as a walk's does
  double gain_far = 0.15;             ///< slow noise never takes away that much: no need to last
  double z_wander = 2.5;              ///< of a free curve in time beside a slip or drift of its joint
  /// A cause that has less of its own than this beside another (square, of itself) differs from it
  /// by no more than encoder noise: what tells them apart is not the cause.
  double alike = 1e-4;
  double z_same = 2.8;        ///< below it a cause counts as explained away by another
  double t_same = 2.0;        ///< an alternative worse by more than this is not in the class
  double least_worse = 1e-3;  ///< ... provided the loss grows by this share of the baseline's
  double t_generic = 2.0;     ///< a generic feature must beat named causes by this much
  int max_causes = 6;
  /// Many small errors may live together where so many causes were found, or several of which the largest is below
  /// Candidate::detectable, or where all others together, each a little, would still take away held-out loss (paired
  /// t above this; on a clean log it is below -1.5). Of 200 logs with fifteen small errors twelve were left with two
  /// names by the first and the last alone.
  std::size_t crowd = 3;
  double crowd_rest_t = 0.0;
  /// Then a cause must stand out: be of a size that is found without a crowd (Candidate::detectable), take away
  /// more than this share of what larger ones leave (unless few were found and all others together are worth less
  /// than a cause), and so many times what all smaller ones take away together. Of 60 logs with fifteen small
  /// errors the largest took 0.18, and where it took 0.15 or more, at most twice the others; a gain error of 4 %
  /// on a recording with small ones on every other joint took 0.2 and 2.6 times the others.
  double crowd_floor = 0.15;
  double crowd_ratio = 2.5;
  double crowd_worth = 0.05;  ///< a crowd that takes away less is not worth a word
  /// Causes that are there from the beginning; a search drops those that the data does not ask for
  /// and adds others. They are many because much is wrong, which makes no crowd of small errors.
  std::vector<std::size_t> given;
  bool search = true;  ///< false: `given` are the causes
  /// The log passes every posture once: whatever follows an angle follows time as well, and so does what
  /// masks and meshes get wrong in a posture. Only what takes away more than slow noise counts.
  bool one_pass = false;
  /// The z that is asked of a candidate which takes away this share of the loss.
  [[nodiscard]] double z_asked(const Candidate& candidate, double gain) const {
    return candidate.temporal() && gain > gain_large ? z_large : z_enter;
  }
};

/// How a candidate fared when tested against the model so far.
struct CandidateScore {
  double z = 0.0;
  /// Held-out loss it takes away, as a share of the baseline's; of a selected cause, of the loss of the
  /// baseline without nuisances that are selected.
  double gain = 0.0;
  double t = 0.0;  ///< the same over its standard error between blocks
  bool testable = true;
};

struct SelectedCause {
  std::size_t candidate = 0;
  CandidateScore score{};
  std::vector<std::size_t> same{};      ///< other candidates that this log cannot tell apart from it
  std::vector<std::size_t> replaced{};  ///< nuisances that it made superfluous, several at once
  bool wanders = false;                 ///< a slip or drift whose joint also moves otherwise over time
  double gain_judged = 0.0;             ///< `score.gain` as a share of the baseline's loss, as thresholds ask for it
};

struct Selection {
  std::vector<SelectedCause> causes;
  std::vector<std::size_t> model;            ///< candidates in the final fit: nuisances, then causes
  std::vector<CandidateScore> first_scores;  ///< all candidates against the baseline
  std::vector<CandidateScore> last_scores;   ///< all candidates against the final model
  std::vector<std::size_t> not_testable;     ///< candidates without independent information
  /// Held-out loss, as a share of the baseline's, that all other causes together would take away,
  /// each a little: small errors that live together. With its paired t.
  double rest_gain = 0.0, rest_t = 0.0;
  bool crowded = false;                  ///< many small errors live together, and not only in theory
  double gain_floor = 0.0;               ///< the least gain that was asked of a cause, but for a crowd
  std::vector<SelectedCause> set_aside;  ///< causes that did not stand out from the crowd
};

/// Decides which candidates the data asks for: greedy by held-out gain, with cluster-robust Wald z,
/// then backwards drop, then the class of each.
/// Throws DataError saying what to record where even the baseline cannot be fitted.
/// @param always  columns of the baseline that are not candidates (joint offsets)
Selection select_causes(const BlockStatistics& statistics, const Columns& always,
                        const std::vector<Candidate>& candidates, const SelectionOptions& options = {});

}  // namespace bodyschema
