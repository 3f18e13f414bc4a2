#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/simulator/fault.hpp"
#include "experiments.hpp"

/// Logs of rendered pictures in which the simulator's physics hides faults, and what the diagnosis says of them.
namespace bodyschema::diagnosis_trials {

struct LogSize {
  double seconds, rate_hz;
};
inline constexpr LogSize kPictures = {60.0, 10.0}, kMasks = {40.0, 5.0};
/// On which a fault is scaled before it is hidden in pictures; what it is worth is measured on these again.
inline constexpr LogSize kSizing = {40.0, 2.5};
/// A cause of this size is one that a user wants to know; those at the limit have a quarter to a half of it.
inline constexpr double kMatters_mm = 2.0, kMatters_px = 1.0;

enum Row { kNull, kBackground, kSingle, kTwo, kOutside, kRows };
/// For 60 logs with one cause. Those come in all sizes, so that of more of them some are at the limit.
inline constexpr std::array<double, kRows> kLogsOf60 = {100, 20, 90, 25, 20};
inline constexpr std::array<const char*, kRows> kNames = {"null", "background", "single", "two", "outside"};

/// What a fault of the simulator is called in a diagnosis: any of these is right.
using RightAnswers = std::vector<CauseName>;

struct Outcome {
  Row row = kNull;
  std::uint64_t seed = 0;
  bool official = false;  ///< the official iCub's, not our own robot's
  bool masks = false;     ///< not rendered pictures
  std::vector<simulator::FaultSpec> faults;
  std::vector<RightAnswers> answers;  ///< of each; none for a thing that is held: no cause names it
  DiagnosisReport report;
  double motion_s = 0.0;                                         ///< from its first picture of the motion to its last
  double size_mm = 0.0, size_px = 0.0;                           ///< left where offsets and nuisances are fitted
  double left_mm = 0.0;                                          ///< of the hand's error under the extended model
  double sizing_s = 0.0, simulation_s = 0.0, diagnosis_s = 0.0;  ///< of processor time that it took
};

struct Drawn {
  const char* spec;
  double value;  ///< in its unit, to begin with; 0: it has none
};
/// Single causes of covers, cameras and held things; a mask is the robot's alone, and no held thing shows in it.
std::vector<Drawn> covers_and_cameras(bool masks);

/// What the answer stands behind: the causes that it names, and of what is estimated in any case what it says that the
/// pictures ask for.
std::vector<DiagnosedCause> stated(const Outcome& o);
/// Whether there is any.
bool is_named(const Outcome& o);
/// The fault is in the class of some cause that is named; a thing that is held is said to be there.
bool is_found(const Outcome& o, std::size_t fault);
/// ... and stands first in it, as the cause with the largest gain.
bool is_first(const Outcome& o);
/// Something is named that is not there.
bool is_wrong(const Outcome& o);
/// For a fault that no cause describes: unexplained, or a class that holds its joint.
bool is_not_explained_away(const Outcome& o);

/// What was hidden, as the report tells it: a drift over the time in which the arm is seen, which is longer than the
/// motion by the arm's coming into view.
double hidden_size(const simulator::FaultSpec& fault, const DiagnosedParameter& told, double motion_s);

/// What the tables ask of one log: a line of trials.jsonl, so that a run that was stopped can be summed up.
struct Record {
  Row row = kNull;
  bool official = false;
  bool named = false, first = false, wrong = false;  ///< is_named(), ...
  bool not_explained_away = false, large_gain = false;
  std::vector<bool> found;  ///< of each fault
  std::string verdict;
  double size_mm = 0.0, size_px = 0.0, left_mm = 0.0;  ///< of the outlines the noise of healthy logs not yet taken off
  bool held = false;
  /// A single parameter that was found: its 95 % interval's width, estimate and truth, in its unit.
  struct Size {
    double estimate = 0.0, width = 0.0, truth = 0.0;
  };
  std::vector<Size> sizes;
  double seconds = 0.0;  ///< of processor time
  [[nodiscard]] double size() const;
};

/// A line of trials.jsonl: all of a record, and what people ask about a log.
Json line_of(const Outcome& o);
Record record_of(const Json& line);

/// Simulates and diagnoses all rows' logs, options.trials of 60; every fourth is of the official iCub where its data
/// is there. Rows take turns, and each log's line stands in trials.jsonl as soon as it is done.
/// @return lines of those that were done before options.minutes were over
std::vector<Json> run(ExperimentContext& context);

}  // namespace bodyschema::diagnosis_trials
