#pragma once

#include <utility>
#include <vector>

#include "agreed_motion.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bounded_minimum.hpp"
#include "candidates.hpp"
#include "model_search.hpp"

namespace bodyschema::diagnosis {

/// A model's regression with some of its parameters taken out: the base without them, at their value zero, their
/// columns, and which of the base's parameters stay.
struct Reduced {
  BlockRegression base;
  AddedColumns own;
  std::vector<Eigen::Index> kept, out;
  Eigen::VectorXd value;  ///< that they had
};
Reduced without(const ModelSearch& search, const BlockRegression& all, const std::vector<Eigen::Index>& out);
/// A candidate's columns beside it.
AddedColumns beside(const AddedColumns& columns, const Reduced& reduced);

/// What the answer says of a model: sizes with their intervals, what else would explain the same, what is excluded, and
/// how well pictures are predicted.
class Findings {
 public:
  Findings(LogFit& fit, ModelSearch& search, const DiagnosisOptions& options, DiagnosisReport& report)
      : fit_(fit), search_(search), options_(options), report_(report) {}
  /// The model without any cause.
  void before(const LogAbout& log);
  /// The causes alone, and the effects that are estimated anyway.
  /// @param candidates  all that are not in the model, about it
  void name_causes(const LogAbout& log, const std::vector<Candidate>& candidates);
  /// The final one. @param candidates  all that are not in it, about it
  void conclude(const LogAbout& log, const std::vector<Candidate>& candidates);

 private:
  using Which = Remainder ResidualSample::*;
  void describe_log(const LogAbout& log);
  /// What is left of every picture, predicted from the other blocks.
  HeldoutError remainders(const LogAbout& log, const BlockRegression& base, Which which);
  /// ... of one. @param x  the base's parameters (steps) @return the gradient over all coordinates
  Eigen::VectorXd left_of(const LogAbout& log, std::size_t picture, const Eigen::VectorXd& x, Remainder& out);
  [[nodiscard]] AgreedMotionSettings motion_settings() const;
  /// Of a joint's reading, over all coordinates; nothing of the others.
  [[nodiscard]] Eigen::VectorXd encoder_variance() const;
  void describe_causes(const LogAbout& log, const BlockRegression& all, const std::vector<Candidate>& candidates);
  /// Whether a cause moves less than what matters, all else that was found of its joint together with it. Beside the
  /// final model: when it was taken in, others may have had a part of it that were dropped since.
  [[nodiscard]] bool is_small(const LogAbout& log, const BlockRegression& all, std::size_t cause);
  /// Nearer than this no picture places an outline: what moves them less has nothing in the pictures to stand on.
  [[nodiscard]] double floor_px() const;
  /// Whether a cause of this size is worth a name: it moves hand or outline by what matters, and outlines by more than
  /// any picture gets wrong.
  [[nodiscard]] bool matters(const Size& size) const;
  /// What columns of the base move by so much: offsets and nuisances fitted anew without them, as the answer would be
  /// then; nuisances no further than is believed of them (room_of). A principal point ten times as far off as any
  /// camera's is no answer to a camera that is turned. @param out  columns, these among them, that stay where they are
  [[nodiscard]] Size size_of(const LogAbout& log, const BlockRegression& all, const std::vector<Eigen::Index>& columns,
                             const Eigen::VectorXd& amount, const std::vector<Eigen::Index>& out);
  /// ... by what was found.
  [[nodiscard]] Size size_of(const LogAbout& log, const BlockRegression& all, const std::vector<Eigen::Index>& columns);
  /// How far parameters of the state can go from where they are, within what is believed of each but in one of
  /// 1 / `level` robots; offsets anywhere.
  [[nodiscard]] Bounds room_of(const BlockRegression& all, const std::vector<Eigen::Index>& kept) const;
  [[nodiscard]] const std::string& kind_asked(const std::string& effect) const;
  /// Which of the effects that are estimated anyway stand out (report.estimated).
  void name_estimated(const LogAbout& log, const BlockRegression& all, const std::vector<Candidate>& candidates);
  /// An effect of the state against a model that knows no effect of its kind: of joints of one kind that move the
  /// pictures alike the one is taken that explains most.
  void add_estimated(const LogAbout& log, const BlockRegression& all, const std::string& kind,
                     const std::vector<Candidate>& candidates);
  /// @param columns  of what `reduced` lacks those that are the cause's; `own` are their columns
  void find_class(const Reduced& reduced, const std::vector<Eigen::Index>& columns, const AddedColumns& own,
                  const std::vector<Candidate>& candidates, DiagnosedCause& cause);
  /// A cause that no fit has taken in is judged by what it moves while it is small. Per parameter, the share of its
  /// size that is not known for that: by how much more or less it moves at its size, block by block, which pictures
  /// weigh each in its own way.
  [[nodiscard]] std::vector<double> bend(const LogAbout& log, const FoundCause& found,
                                         const Eigen::VectorXd& size) const;
  [[nodiscard]] DiagnosedParameter parameter_of(const LogAbout& log, const EffectParameter& parameter, double value,
                                                double sd) const;
  void exclude(const LogAbout& log, const BlockRegression& all, const std::vector<Candidate>& candidates);
  /// Where outlines lie off on one side of one part, block after block, and how much is left for pixel noise.
  void check_outlines(const LogAbout& log);
  /// What the pictures show and the model lacks.
  void check_surplus(const LogAbout& log);
  [[nodiscard]] double quantile(const LogAbout& log) const;
  [[nodiscard]] ModelUncertainty uncertainty() const;

  LogFit& fit_;
  ModelSearch& search_;
  const DiagnosisOptions& options_;
  DiagnosisReport& report_;
  Eigen::MatrixXd covariance_;  ///< of the final model's parameters
};

}  // namespace bodyschema::diagnosis
