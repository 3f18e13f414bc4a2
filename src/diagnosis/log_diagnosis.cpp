#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>

#include "bodyschema/camera/require_places.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/diagnosis_page.hpp"
#include "bodyschema/pipeline/watched_log.hpp"
#include "log_exposures.hpp"
#include "log_length.hpp"
#include "log_motion.hpp"
#include "log_pictures.hpp"
#include "next_steps.hpp"
#include "telling_motion.hpp"

namespace bodyschema {
namespace {

constexpr double kTolerableLoss = 0.05;           // of all pictures
constexpr double kStill_rad = 0.5 * kPi / 180.0;  // and rad/s
constexpr const char* kAdvice = " for 60 to 120 s: slow and fast, the same postures in both directions, 15 s of rest";

class LogDiagnosis {
 public:
  LogDiagnosis(const Configuration& configuration, const LogDiagnosisOptions& options,
               std::optional<SegmentationMethod> method = std::nullopt)
      : options_(options), pipeline_(configuration, method), watched_(watch(configuration)) {
    // Said at once: it may well be why the log is refused.
    if (const auto turn = describe(pipeline_.background_turn()); !turn.empty()) {
      spdlog::warn("{}: {}", options_.log.string(), turn);
    }
  }
  /// Whether a learned background is of no use: the head turned before a room.
  [[nodiscard]] bool background_turned() const { return watched_.background_turned; }

  /// @param other_masks  the masks are not those of the configured method, which the head's motion spoilt
  DiagnosisReport conclude(bool other_masks) {
    refuse_unusable(watched_, options_.log, pipeline_.bus().channels(), kAdvice);
    std::optional<ProgressBar> bar;
    if (!options_.quiet) bar.emplace("diagnosis", 100);
    DiagnosisOptions diagnosis;
    diagnosis.noise = pipeline_.options().noise;
    diagnosis.spacing_px = pipeline_.options().outline_spacing_px;
    diagnosis.starts = starts();
    diagnosis.fit_only = options_.fit_only;
    diagnosis.progress = [&](double share) {
      if (bar) bar->set(static_cast<std::uint64_t>(100.0 * share));
    };
    LogFit fit(watched_.pictures, options_.threads);
    auto report = diagnosed(fit, diagnosis);
    // Nothing that was seen is explained then, nor is anything excluded: no answer is better than "none".
    if (!(report.before.rms_px > 0.0)) {
      throw DataError(
          options_.log.string() +
          ": in no picture does the arm's outline lie near where the model has it; is a camera's place or the "
          "direction of its axes wrong, or are the masks? Look at overlay_final.png of 'bodyschema replay'");
    }
    add_remarks(report);
    if (other_masks) report.warnings.insert(report.warnings.begin(), kReadWithoutBackground);
    if (!options_.out.empty()) {
      const auto motion = diagnosis::telling_motion(fit, report);
      report.next_steps = diagnosis::next_steps(report.verdict, options_, motion.has_value());
      report.write(options_.out);
      if (motion) motion->write(options_.out / "motion.csv");
      diagnosis_page(report, options_.log.filename().string(), diagnosis::draw_pictures(fit, watched_.kept, report))
          .write(options_.out / "report.html");
    }
    return report;
  }

 private:
  WatchedLog watch(const Configuration& configuration) {
    configuration.reject_unknown_keys();
    require_places(pipeline_.rig(), "a diagnosis");
    if (pipeline_.error_model()) {
      throw ConfigurationError(configuration.section("robot").place("extended_model") + ": '" +
                               pipeline_.setup().extended_model.string() +
                               "': diagnose starts from the URDF as it is; leave it out "
                               "(--set robot.extended_model='')");
    }
    refuse_short();
    return watch_log(pipeline_,
                     {.log = options_.log, .picture_rate_hz = options_.picture_rate_hz, .quiet = options_.quiet}, true);
  }

  /// Refuses a log that is too short before any picture is looked at. Of others no more is read than shows that they
  /// are long enough.
  void refuse_short() const {
    const DiagnosisOptions needed;
    auto stream = pipeline_.make_stream();
    std::size_t looked_at = 0;
    const auto roles = JointRoles::of(pipeline_.shared_robot(), pipeline_.setup(), pipeline_.rig());
    const auto log = diagnosis::LogExposures::read(
        options_.log, stream, JointStream(pipeline_.robot(), pipeline_.setup(), pipeline_.bus()),
        options_.picture_rate_hz, [&](const auto& pictures, std::uint64_t) {
          if (pictures.size() < 2 * looked_at || pictures.empty()) return true;
          looked_at = pictures.size();
          return !diagnosis::why_too_short(diagnosis::log_length(pictures, roles, needed), {}, roles, needed).empty();
        });
    if (log.pictures.empty()) return;  // refuse_unusable() says why
    const auto length = diagnosis::log_length(log.pictures, roles, needed);
    if (diagnosis::why_too_short(length, {}, roles, needed).empty()) return;
    const auto motion = diagnosis::log_motion(log.pictures, log.cameras, log.encoders, pipeline_.shared_robot(),
                                              pipeline_.setup(), roles);
    throw DataError(options_.log.string() + ": " +
                    diagnosis::why_too_short(length, diagnosis::untestable(roles, motion), roles, needed));
  }

  /// Where the estimator was at the last frame it looked at (WatchedLog::offsets_at_start).
  [[nodiscard]] std::vector<Eigen::VectorXd> starts() const {
    if (watched_.offsets_at_start.empty()) return {};
    return {at_start(watched_, State(watched_.pictures.roles(), pipeline_.beliefs().state))};
  }

  /// The diagnosis; what it refuses is refused in the log's name.
  DiagnosisReport diagnosed(LogFit& fit, const DiagnosisOptions& diagnosis) {
    try {
      return diagnose(fit, pipeline_.beliefs().state, pipeline_.beliefs().tolerances, diagnosis);
    } catch (const DataError& e) {
      throw DataError(options_.log.string() + ": " + e.what());
    }
  }

  [[nodiscard]] double range_of(const std::vector<Eigen::Index>& joints) const {
    double widest = 0.0;
    for (const auto joint : joints) {
      double low = 1e9, high = -1e9;
      for (const auto& picture : watched_.pictures.pictures()) {
        low = std::min(low, picture.joints.q[joint]);
        high = std::max(high, picture.joints.q[joint]);
      }
      widest = std::max(widest, high - low);
    }
    return widest;
  }

  /// What no regression says: which motion is missing altogether.
  void add_remarks(DiagnosisReport& report) const {
    if (auto turn = describe(pipeline_.background_turn()); !turn.empty()) {
      report.warnings.insert(report.warnings.begin(), turn + "; nothing found here holds until then");
    }
    if (const auto steps = watched_.bus.synchroniser.clock_steps; steps > 0) {
      report.warnings.push_back(
          fmt::format("the clock of the time stamps stepped {}: what depends on speed, or on when "
                      "it happened, may be wrong; record again with one steady clock",
                      steps == 1 ? "once" : fmt::format("{} times", steps)));
    }
    if (auto lost = watched_.bus.lost_pictures(kTolerableLoss); !lost.empty()) {
      report.warnings.push_back(std::move(lost));
    }
    const auto& roles = watched_.pictures.roles();
    if (!roles.neck.empty() && range_of(roles.neck) < kStill_rad) {
      report.warnings.push_back(
          "the head stood still: errors of neck and eye tilt, a shifted base (base_shift), lengths between base and "
          "eyes and a common shift of the pictures look nearly alike; move the head by 20 to 30 deg");
    }
    if (!roles.fingers.empty() && range_of(roles.fingers) < kStill_rad) {
      report.warnings.push_back("the fingers stood still: of their encoders only an offset shows");
    }
    double speed = 0.0;
    for (const auto& picture : watched_.pictures.pictures()) {
      for (const auto joint : roles.arm) speed = std::max(speed, std::abs(picture.joints.qdot[joint]));
    }
    if (speed < kStill_rad) {
      report.warnings.push_back("the arm stands still in every picture: nothing that depends on speed can be tested");
    }
  }

  LogDiagnosisOptions options_;
  Pipeline pipeline_;
  WatchedLog watched_;
};

}  // namespace

DiagnosisReport diagnose_log(const Configuration& configuration, const LogDiagnosisOptions& options) {
  {
    LogDiagnosis diagnosis(configuration, options);
    if (!diagnosis.background_turned()) return diagnosis.conclude(false);
    spdlog::warn("{}: once more: {}", options.log.string(), kReadWithoutBackground);
  }
  LogDiagnosis diagnosis(configuration, options, SegmentationMethod::kStatistics);
  return diagnosis.conclude(true);
}

LogComparison diagnose_logs(const Configuration& configuration, const LogDiagnosisOptions& options,
                            const std::vector<std::filesystem::path>& logs) {
  std::vector<DiagnosisReport> reports;
  std::vector<std::string> names;
  for (const auto& log : logs) {
    // Two logs of one name in two folders are told apart by a number.
    auto name = log.stem().string();
    if (std::find(names.begin(), names.end(), name) != names.end()) name += fmt::format("_{}", names.size() + 1);
    auto own = options;
    own.log = log;
    if (!own.out.empty()) own.out /= name;
    reports.push_back(diagnose_log(configuration, own));
    names.push_back(std::move(name));
  }
  const auto setup = RobotSetup::from(configuration.section("robot"));
  const auto rig = StereoRig::from(configuration.section("cameras"));
  const auto robot = load_robot(setup, rig);
  const auto roles = JointRoles::of(robot, setup, rig);
  auto comparison = compare(reports, std::move(names), roles, across_axes(robot, setup, roles));
  if (!options.out.empty()) comparison.write(options.out);
  return comparison;
}

}  // namespace bodyschema
