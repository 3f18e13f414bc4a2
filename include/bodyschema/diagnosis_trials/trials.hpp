#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis_trials/synthetic_log.hpp"

namespace bodyschema {

/// The rows of the table in docs/diagnose.md.
enum class TrialRow { kNull, kBackground, kSingle, kLimit, kTwo, kOutside, kOutsideHard };
inline constexpr std::array<const char*, 7> kTrialRowNames = {"null", "background", "single",      "limit",
                                                              "two",  "outside",    "outside_hard"};
inline constexpr std::size_t kTrialRows = kTrialRowNames.size();
/// Logs per row.
using TrialCounts = std::array<int, kTrialRows>;
/// `singles` single-cause logs, other rows in proportion as in docs/diagnose.md; at least one.
TrialCounts trial_counts(int singles);

/// Where a cause can sit on this robot and the smallest size to be found 90 % of the time, value 0.
std::vector<TrialFault> trial_faults(const TrialRobot& robot, bool outside_catalogue);
/// The log of one row with hidden faults drawn from a seed. Every second null log has a burst of
/// noise, by its `number` in the row.
TrialOptions draw_trial(const TrialRobot& robot, TrialRow row, std::uint64_t seed, std::size_t number);

/// A log with hidden faults, diagnosed without their knowledge.
class TrialLog {
 public:
  virtual ~TrialLog() = default;
  /// @param fixed_causes  instead of searching, fit exactly these
  virtual DiagnosisReport diagnose(const std::optional<std::vector<CauseName>>& fixed_causes) = 0;
  /// What the arm's joints really were, minus the encoders, rad: views x arm joints; null where
  /// nobody kept it.
  virtual const Eigen::MatrixXd* true_corrections() const { return nullptr; }
};
/// Makes logs; called from several threads.
using TrialLogMaker = std::function<std::unique_ptr<TrialLog>(const TrialOptions& options, std::uint64_t seed)>;
/// Logs at the level of silhouettes (SyntheticMeasurement).
TrialLogMaker silhouette_logs(const TrialRobot& robot);

/// One trial in figures.
struct TrialOutcome {
  TrialRow row = TrialRow::kNull;
  std::uint64_t seed = 0;
  std::vector<TrialFault> truth;
  DiagnosisReport report;
  bool refused = false;  ///< no answer; `report.sentence` says why
  /// Share that the extension removed, on held-out blocks, of what fitting the true cause removes; none
  /// where that is nothing, or the cause no linear fit finds (the time of a slip).
  std::optional<double> removed_share;
  double offset_error_before_deg = 0.0, offset_error_after_deg = 0.0;
  double seconds = 0.0;
};

/// Runs trials of all rows on `threads` threads; results do not depend on their number. `each` is
/// called for every finished trial, in order.
std::vector<TrialOutcome> run_diagnosis_trials(
    const TrialRobot& robot, const TrialCounts& counts, std::uint64_t seed, int threads, const TrialLogMaker& make_log,
    const std::function<void(const TrialOutcome&, std::size_t done, std::size_t total)>& each = {});

/// The rates of the table in docs/diagnose.md. A rate without trials is NaN.
struct TrialRates {
  std::array<std::size_t, kTrialRows> trials{};
  std::array<std::size_t, kTrialRows> refused{};  ///< of them; in every row a refusal is a failure
  double null_false_alarm = 0.0;
  double background_named = 0.0;
  double single_in_class = 0.0, single_exact = 0.0, single_wrong = 0.0, single_mean_class = 0.0;
  double limit_wrong = 0.0;
  double two_both = 0.0, two_spurious = 0.0;
  double outside_unexplained = 0.0;
  double outside_hard_joint = 0.0, outside_hard_class_or_unexplained = 0.0;
  std::size_t parameters = 0;  ///< how many were estimated
  double sign = 0.0, error_median = 0.0, error_p90 = 0.0, coverage95 = 0.0;
  std::size_t gains = 0;  ///< logs of one cause of which the gain was measured
  double removable_excess_median = 0.0, offset_improvement_median = 0.0;
};
TrialRates rates(const std::vector<TrialOutcome>& outcomes);

/// Compares a report with the truth.
bool in_class(const DiagnosisReport& report, const TrialFault& truth);
/// Whether the first-listed cause is the true one.
bool named_exactly(const DiagnosisReport& report, const TrialFault& truth);
/// Whether the answer is wrong: causes, and the truth in none of their classes.
bool wrong_name(const DiagnosisReport& report, const TrialFault& truth);

}  // namespace bodyschema
