#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "block_regression.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema::diagnosis {

/// What may be wrong: an effect of the catalogue, a nuisance beyond what is believed of it, or a free curve over what a
/// joint does ("unexplained").
struct Candidate {
  CauseName cause;
  std::string variable;                        ///< of a free curve: what it follows
  std::vector<std::size_t> parameters;         ///< positions among the effect's fitted parameters
  Microseconds from = 0;                       ///< of a slip: the first picture after it
  bool stated = false;                         ///< others saw it happen: it stands for itself, not for all candidates
  std::vector<std::vector<double>> amounts{};  ///< of a free curve: [column][picture], rad of the joint
  AddedColumns columns{};
  Scores scores{};
  [[nodiscard]] bool generic() const { return !variable.empty(); }
  [[nodiscard]] double z() const { return scores.u.rows() == 0 ? 0.0 : scores.z(); }
};

/// A log about one state: what every picture says about the state's parameters and about everything else that may be
/// wrong, summed up in blocks.
struct LogAbout {
  LogAbout(State s, std::shared_ptr<const LinearLog> pictures)
      : state(std::move(s)), linear(std::move(pictures)), at(*linear) {}
  State state;
  std::shared_ptr<const LinearLog> linear;
  const LinearLog& at;  ///< over all coordinates
  /// Per picture: 1 / variance of a residual, 1/px^2, less where an arm stands still; 0: nothing seen.
  std::vector<double> precision;
  /// [picture][column]: the state's parameters, the free curves that were found, and what is not estimated but may be
  /// wrong within the robot's tolerances or a picture's sharpness.
  std::vector<std::vector<Direction>> base;
  std::vector<double> considered_sd;  ///< of the last columns
  std::vector<std::size_t> block_of;  ///< per picture
  std::size_t blocks = 0;
  double block_s = 0.0;
  std::vector<CauseName> found;  ///< causes that are in the state already
};

/// Values of a direction against a picture's evidence.
double gradient(const OutlineEvidence& evidence, const Direction& direction);
double product(const OutlineEvidence& evidence, const Direction& a, const Direction& b);

/// What a picture says of every coordinate together with each column of the base, times its precision: all sums about
/// the log are made of these.
class AgainstBase {
 public:
  explicit AgainstBase(const LogAbout& log) : log_(log) {}
  /// Base x coordinates; until the next call.
  const Eigen::MatrixXd& of(std::size_t picture);

 private:
  const LogAbout& log_;
  Eigen::MatrixXd columns_, rows_;
};

/// Sums over blocks of the base's own directions.
std::vector<BaseBlock> base_blocks(const LogAbout& log);
/// Of others. @param directions  [picture][column]
/// @param widths  how many of the columns are each candidate's, one after the other
std::vector<AddedColumns> added_columns(const LogAbout& log, const std::vector<std::vector<Direction>>& directions,
                                        const std::vector<std::size_t>& widths);
/// Of one.
AddedColumns added_columns(const LogAbout& log, const std::vector<std::vector<Direction>>& directions);

/// Every candidate that this log can test beside the state, with its columns.
/// @param untestable  by the motion alone; left out
std::vector<Candidate> catalogue_candidates(LogFit& fit, const LogAbout& log,
                                            const std::vector<NotTestable>& untestable);
/// Free curves of every arm joint over time, angle, velocity, acceleration and torque.
std::vector<Candidate> free_curves(LogFit& fit, const LogAbout& log);
/// How a candidate's columns move each picture: [picture][column].
std::vector<std::vector<Direction>> directions_of(LogFit& fit, const LogAbout& log, const Candidate& candidate);
/// How a joint's correction by these amounts moves the pictures: [picture][column].
std::vector<std::vector<Direction>> along_joint(const LogFit& fit, Eigen::Index joint,
                                                const std::vector<std::vector<double>>& amounts);
/// A slip of every arm joint at every picture (or where every block begins), scored. `best` keeps of every joint the
/// time at which one explains most.
struct Slips {
  std::vector<Scores> all;
  std::vector<Candidate> best;
};
Slips slips(const LogAbout& log, const BlockRegression& base, const std::vector<NotTestable>& untestable,
            bool at_every_picture = true);

/// A slip of every arm joint at times at which others saw that something happened, scored. Joints that are found
/// already are left out.
std::vector<Candidate> stated_slips(const LogAbout& log, const BlockRegression& base,
                                    const std::vector<Microseconds>& times);

/// The largest size of a parameter that is found on any robot, SI: a multiple of the typical one. How far a joint gives
/// way under each Nm says little where it carries little: such a joint may turn by as much as the largest offset.
double largest_plausible(const LogAbout& log, const Effect& effect, const EffectParameter& parameter);

/// Whether a cause would stand out of a log, with this threshold of z, before it is larger than on any robot.
bool is_told(const LogAbout& log, const Candidate& candidate, double threshold);

/// First and last picture in which the robot was found, s since the Unix epoch.
std::pair<double, double> seen_span(const LogFit& fit, const LinearLog& at);

}  // namespace bodyschema::diagnosis
