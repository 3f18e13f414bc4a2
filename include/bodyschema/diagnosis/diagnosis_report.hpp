#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bodyschema/effects/error_model.hpp"

namespace bodyschema {

/// A cause as people read it: an effect and what it acts on.
struct CauseName {
  std::string name;
  std::string joint;   ///< empty for the whole robot
  std::string source;  ///< second joint of a coupling, or which principal point
  friend bool operator==(const CauseName&, const CauseName&) = default;
  [[nodiscard]] std::string text() const;
};

struct DiagnosedParameter {
  std::string parameter;
  std::string unit;
  double estimate = 0.0;
  std::array<double, 2> ci95{};
  double sd = 0.0;
  /// Of a slip: when it happened; of a drift: when it begins, the first picture in which the arm is seen; us
  /// since the Unix epoch.
  std::optional<Microseconds> from{};
  std::optional<double> duration_s{};  ///< of a drift: until the last picture in which the arm is seen
  /// "48.7 s into the log", "from 3.5 to 54.0 s into the log" or nothing; where no log begins (0), "at 12:03:07 UTC".
  [[nodiscard]] std::string when(Microseconds log_begin) const;
};

struct DiagnosedCause {
  CauseName cause;       ///< name is "unexplained" for structure that no effect explains
  std::string variable;  ///< unexplained: what the residual follows
  std::string sentence;  ///< "pictures arrive 58 ms (57 to 59) late against the encoders"
  std::vector<DiagnosedParameter> parameters;
  /// Causes that this log cannot tell apart from it, itself first. One entry: named.
  std::vector<CauseName> same;
  std::string advice;  ///< the motion that would tell them apart; empty for a class of one
  double z = 0.0;
  double hand_mm = 0.0, outline_px = 0.0;  ///< what it moves (rms over the log), the offsets fitted anew; when found
  /// Larger than any robot is wrong by (more than twenty times the effect's typical size): it fits, and stands in for
  /// something else.
  bool implausible = false;
  /// Share that it takes away of the held-out loss of the model `before`: without any cause that the
  /// selection found.
  double heldout_gain = 0.0;
};

struct NotTestable {
  CauseName cause;
  std::string reason;
};

struct ExclusionLimit {
  CauseName cause;
  std::string parameter;
  std::string unit;
  double limit = 0.0;  ///< absolute value that is excluded with 95 % confidence
};

/// How well the model predicts blocks that its fit has not seen.
struct HeldoutError {
  double rms_px = 0.0;   ///< along the outline's normals
  double hand_mm = 0.0;  ///< rms of the hand's displacement that the residuals ask for
  double hand_deg = 0.0;
  /// Share of the predicted outline that has a counterpart in the pictures; `rms_px` speaks of that
  /// part alone. 1 where the source knows which point belongs to which.
  double outline_found = 1.0;
  double outline_where_seen = 1.0;  ///< the same in those pictures where enough of it was found to count
  /// The part of `rms_px` (in squares) by which pictures agree two by two that the arm stood elsewhere: something moves
  /// it that the model lacks, and no noise of pixels.
  double moved_px = 0.0;
  double encoders_px = 0.0;  ///< as much come from encoders' noise and steps, and from how near pictures place outlines
};

/// One bar of the chart of all candidates: the largest |z| of it.
struct CandidateBar {
  std::string label;
  bool generic = false;
  double z_before = 0.0;  ///< beside offsets and nuisances
  double z_after = 0.0;   ///< beside the extended model
};

/// What a model leaves of one picture, held out.
struct Remainder {
  double rms_px = 0.0;                                 ///< along the outline's normals; 0 where nothing was found
  double mean_px = 0.0;                                ///< mean along the outward normal
  std::vector<double> apparent_deg;                    ///< correction of each arm joint alone that it asks for
  Eigen::Vector3d hand_C_m = Eigen::Vector3d::Zero();  ///< where the model has the hand in the camera, m
};

/// One exposure, for the charts of structure.
struct ResidualSample {
  Microseconds utime = 0;
  double time_s = 0.0;
  std::size_t camera = 0;
  Remainder before, after;
  /// `after` without the free curves of an unexplained cause, which no model holds: what errs without being followed.
  Remainder noise;
  std::vector<double> angle_deg, velocity_deg_s, acceleration_deg_s2, torque_nm;  ///< per arm joint
  double image_radius_px = 0.0;  ///< of the hand's frame from the principal point
  double depth_m = 0.0;
};

/// The answer to "what does the model of this robot get wrong?".
struct DiagnosisReport {
  std::string verdict;   ///< "none", "named", "class" or "unexplained"
  std::string sentence;  ///< the same for people
  std::vector<DiagnosedCause> causes;
  std::vector<NotTestable> not_testable;
  std::vector<ExclusionLimit> exclusion_limits;
  /// What the log says of every cause that it tells and that is not in the answer: sizes beside the extended model. For
  /// comparing logs (log_comparison.hpp); in report.json they are the exclusion limits.
  std::vector<DiagnosedCause> estimates;
  /// What is left on one side of one part, in block after block: "the left outline of r_hand lies 0.8 px outside of
  /// where the model has it in the pictures of left". Empty: nothing.
  std::string side_left_over;
  /// What the final model leaves of the outlines, rms, and what of it differs from block to block. The rest is alike in
  /// all of them at the same places of the robot's surface: pixels do not err so, a model does.
  double left_px = 0.0, noise_px = 0.0;
  /// No outline of a robot whose model is right is rougher, px of these pictures; 0: not asked.
  double rough_px = 0.0;
  /// As many causes were found as are looked for, and the log asks for another one.
  bool more_asked = false;
  /// What the pictures show beside the robot through most of the log, where no outline is looked for: "14 cm2 beside
  /// the robot, in 96 % of the log". Something is held, or a part has no mesh. Empty: nothing.
  std::string not_in_model;
  /// Causes that are there, and in the extended model, and move hand and outlines by less than what matters.
  std::vector<DiagnosedCause> small_causes;
  /// Effects of the state, estimated in any case and in the extended model, that stand out of this log: against a model
  /// that knows none of their kind.
  std::vector<DiagnosedCause> estimated;
  double matters_mm = 0.5;  ///< what matters
  bool crowded = false;     ///< nothing else was found, and of those several
  /// Before: offsets and those nuisances that are not themselves found to be causes.
  HeldoutError before, after;
  std::map<std::string, double> offsets_deg_before, offsets_deg_after;
  std::map<std::string, std::array<double, 2>> offsets_ci95_deg;
  std::vector<std::string> warnings;
  std::vector<std::string> next_steps;  ///< what to do with the answer, with commands

  // For charts.
  std::vector<std::string> arm_joints;
  std::vector<CandidateBar> bars;
  double z_threshold = 0.0;  ///< the largest |z| of all candidates that chance alone reaches in one log of a hundred
  std::vector<ResidualSample> samples;
  Microseconds begin_utime = 0;  ///< first picture
  double duration_s = 0.0, block_s = 0.0;
  std::size_t views = 0, blocks = 0;

  /// Offsets, nuisances and causes with their estimates: the extended model.
  std::optional<ErrorModel> extended_model;
  std::optional<ErrorModel> baseline_model;

  /// The keys of report.json.
  [[nodiscard]] std::string to_json() const;
  /// Makes the folder for a report before the long work. Throws as write_file (core/write_file.hpp) where nothing can
  /// be written.
  static void prepare(const std::filesystem::path& directory);
  /// Writes report.json and extended_model.yaml. Throws likewise.
  void write(const std::filesystem::path& directory) const;
};

}  // namespace bodyschema
