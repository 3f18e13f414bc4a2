#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <Eigen/Cholesky>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/diagnosis_page.hpp"
#include "bodyschema/diagnosis/image_measurement.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "joint_stream.hpp"
#include "log_pictures.hpp"

namespace bodyschema {
namespace {

/// Frames with the estimator before its offsets are taken as the start of the fit.
constexpr int kMostStartFrames = 150;
constexpr int kFramesAfterConvergence = 10;

using diagnosis::JointStream;
using diagnosis::LogPictures;

class LogDiagnosis {
 public:
  LogDiagnosis(const Configuration& configuration, const LogDiagnosisOptions& options)
      : options_(options), pipeline_(configuration),
        measurement_(pipeline_.shared_robot(), pipeline_.setup(), pipeline_.rig(), options.threads) {
    configuration.reject_unknown_keys();
    if (pipeline_.error_model()) {
      throw ConfigurationError("robot.extended_model: '" + pipeline_.setup().extended_model.string() +
                               "': diagnose starts from the URDF as it is; leave it out "
                               "(--set robot.extended_model='')");
    }
  }

  DiagnosisReport run() {
    learn();
    read();
    refuse_unusable();
    auto diagnosis = options_.diagnosis;
    if (diagnosis.nuisances.empty()) diagnosis.nuisances = usual_nuisances(measurement_.roles());
    if (diagnosis.start_offsets.empty()) diagnosis.start_offsets = fitted_offsets();
    std::optional<ProgressBar> bar;
    if (!options_.quiet) bar.emplace("diagnosis", 100);
    diagnosis.progress = [&](double share) {
      if (bar) bar->set(static_cast<std::uint64_t>(100.0 * share));
    };
    diagnosis.before_iteration = [this](int iteration) {
      constexpr double kSearch_px[] = {8.0, 6.0, 4.0};
      constexpr double kRefitSearch_px[] = {24.0, 18.0, 14.0, 10.0, 7.0, 5.0, 4.0};
      if (iteration >= kRefit && wide_refit_) {
        measurement_.set_search(kRefitSearch_px[std::min<std::size_t>(refits_++, std::size(kRefitSearch_px) - 1)]);
      } else {
        measurement_.set_search(kSearch_px[std::min(iteration, 2)]);
      }
    };
    auto report = diagnosed(diagnosis);
    if (report.before.rms_px > 0.0 && report.after.rms_px <= 0.0) {
      // Causes so large that their linear estimate lost the outlines: look for them further off.
      wide_refit_ = true;
      diagnosis.refit_iterations = std::max(diagnosis.refit_iterations, 12);
      report = diagnosed(diagnosis);
    }
    add_remarks(report);
    LogPictures::place_hand(pipeline_, measurement_.views(), report);
    if (!options_.out.empty()) {
      report.write(options_.out);
      diagnosis_page(report, options_.log.filename().string(),
                     pictures_.draw(pipeline_, measurement_.stream(), report))
          .write(options_.out / "report.html");
    }
    return report;
  }

 private:
  template <class Action>
  void for_each(const std::string& label, JointStream* recorder, Action action) {
    LogReader log(options_.log);
    auto stream = pipeline_.make_stream();
    const auto channels = stream.channels();
    std::optional<ProgressBar> bar;
    if (!options_.quiet) bar.emplace(label, log.size());
    LogEvent event;
    const auto drain = [&] {
      while (auto arrived = stream.next()) action(arrived->observation);
    };
    while (log.next(event)) {
      if (recorder != nullptr && event.channel == channels.joint_state) recorder->take(event.data);
      if (stream.receive(event.channel, event.data, event.time_us)) drain();
      if (bar) bar->set(log.position());
    }
    stream.finish();
    drain();
    facts_ = {stream.statistics(), stream.synchroniser().joints().missing_joints()};
  }

  /// Offsets that fit the whole log best when nothing else is wrong. The estimator's own are only
  /// the start: where the model errs much, head and cameras have taken up a part of them, and nuisances
  /// let loose on outlines tens of pixels away run off.
  std::map<std::string, double> fitted_offsets() {
    const auto& roles = measurement_.roles();
    const auto arm = static_cast<Eigen::Index>(roles.arm.size());
    Corrections corrections(static_cast<Eigen::Index>(roles.names.size()));
    for (const auto joint : roles.arm) {
      const auto start = start_offsets_.find(roles.names[static_cast<std::size_t>(joint)]);
      if (start != start_offsets_.end()) corrections.dq[joint] = -start->second;
    }
    std::vector<CompressedView> views;
    for (const double search_px : {40.0, 30.0, 24.0, 18.0, 14.0, 11.0, 9.0, 8.0}) {
      measurement_.set_search(search_px);
      measurement_.compress(std::vector<Corrections>(measurement_.views().size(), corrections), views);
      Eigen::MatrixXd A = Eigen::MatrixXd::Zero(arm, arm);
      Eigen::VectorXd b = Eigen::VectorXd::Zero(arm);
      for (const auto& view : views) {  // the arm's joints are the layout's first coordinates
        A += view.information.topLeftCorner(arm, arm);
        b += view.vector.head(arm);
      }
      A.diagonal().array() += 1e-6 * std::max(1e-9, A.diagonal().maxCoeff());
      const Eigen::VectorXd step = A.ldlt().solve(b);
      for (Eigen::Index j = 0; j < arm; ++j) {
        corrections.dq[roles.arm[static_cast<std::size_t>(j)]] += std::clamp(step[j], -kMostStep_rad, kMostStep_rad);
      }
    }
    std::map<std::string, double> offsets;
    for (const auto joint : roles.arm) offsets[roles.names[static_cast<std::size_t>(joint)]] = -corrections.dq[joint];
    return offsets;
  }

  /// What no regression says: that something is left which is no cause of the catalogue, and which
  /// motion is missing altogether.
  void add_remarks(DiagnosisReport& report) const {
    if (report.before.rms_px > 0.0 && report.after.rms_px <= 0.0) {
      report.verdict = "unexplained";
      report.sentence = "What was found could not be fitted to the log: with it the outlines are lost, so nothing is "
                        "named. The model is wrong in more than one way at once; mend what is known and diagnose again.";
      report.causes.clear();
      report.extended_model = report.baseline_model;
      report.after = report.before;
    }
    if (report.after.rms_px > kShapeError_px) {
      char text[200];
      std::snprintf(text, sizeof text,
                    " It still misses the outlines by %.1f px (rms); good meshes and masks leave 0.3 px. The parts "
                    "probably have another shape, and causes named here may stand in for it.",
                    report.after.rms_px);
      report.sentence += text;
    }
    const auto& roles = measurement_.roles();
    if (!roles.head.empty() && range_of(roles.head) < kStill_rad) {
      report.warnings.push_back(
          "the head stood still: errors of neck and eye tilt, a shifted base (base_shift), lengths between base and "
          "eyes and a common shift of the pictures look nearly alike; move the head by 20 to 30 deg");
    }
    if (!roles.fingers.empty() && range_of(roles.fingers) < kStill_rad) {
      report.warnings.push_back("the fingers stood still: of their encoders only a common error shows");
    }
    double speed = 0.0;
    for (const auto& view : measurement_.views()) {
      for (const auto joint : roles.arm) speed = std::max(speed, std::abs(view.joints.qdot[joint]));
    }
    if (speed < kStill_rad) {
      report.warnings.push_back("the arm stands still in every picture: nothing that depends on speed can be tested");
    }
  }

  /// Largest range of any of these joints over the pictures.
  [[nodiscard]] double range_of(const std::vector<Eigen::Index>& joints) const {
    double range = 0.0;
    for (const auto joint : joints) {
      double low = 1e9, high = -1e9;
      for (const auto& view : measurement_.views()) {
        low = std::min(low, view.joints.q[joint]);
        high = std::max(high, view.joints.q[joint]);
      }
      range = std::max(range, high - low);
    }
    return range;
  }

  /// The diagnosis; what it refuses is refused in the log's name.
  DiagnosisReport diagnosed(const DiagnosisOptions& diagnosis) {
    try {
      return diagnose(measurement_, diagnosis);
    } catch (const DataError& e) {
      throw DataError(options_.log.string() + ": " + e.what());
    }
  }

  /// Says in one sentence what the log lacks and what to record.
  void refuse_unusable() const {
    const auto channels = pipeline_.bus().channels();
    const std::string log = options_.log.string();
    const auto& sync = facts_.bus.synchroniser;
    if (sync.joint_messages == 0) {
      throw DataError(log + ": no encoder readings on channel " + channels.joint_state + "; record it together with " +
                      channels.cameras + kAdvice);
    }
    if (sync.images == 0) {
      const auto wrong_size = facts_.bus.faults[static_cast<std::size_t>(MessageFault::kWrongSize)];
      if (wrong_size > 0) {
        throw DataError(log + ": all " + std::to_string(wrong_size) + " pictures on " + channels.cameras +
                        " have another size than the configuration says (cameras.left.width, .height)");
      }
      throw DataError(log + ": no pictures on channel " + channels.cameras + "; record it together with " +
                      channels.joint_state + kAdvice);
    }
    if (!facts_.missing_joints.empty()) {
      throw DataError(log + ": no reading of joint '" + facts_.missing_joints.front() +
                      "'; publish and record it, or give it a value under robot.fixed_joints_deg");
    }
    if (pictures_seen_ == 0) {
      throw DataError(log + ": none of " + std::to_string(sync.images) +
                      " pictures has encoder readings around its time; record both with one clock" + kAdvice);
    }
    if (4 * pictures_with_arm_ < pictures_seen_) {
      throw DataError(log + ": the arm is seen in " + std::to_string(pictures_with_arm_) + " of " +
                      std::to_string(pictures_seen_) + " pictures; record it with the hand in view of both eyes" + kAdvice);
    }
  }

  void learn() {
    Microseconds last = -1;
    for_each("learning the background", nullptr, [&](Observation& o) {
      if (last >= 0 && o.utime - last < kLearnEvery) return;
      last = o.utime;
      pipeline_.learn_from(o);
    });
    pipeline_.finish_learning();
  }

  void read() {
    JointStream recorder(pipeline_.robot(), pipeline_.setup(), pipeline_.bus());
    const auto period = microseconds(1.0 / options_.picture_rate_hz);
    Microseconds due = -1;
    int frames = 0, converged = 0;
    bool started = false;
    for_each("masks", &recorder, [&](Observation& observation) {
      if (due >= 0 && observation.utime < due) return;
      // Keep to the raster, so that the mean rate is the wanted one whatever the cameras' is.
      due = due < 0 || observation.utime > due + period ? observation.utime + period : due + period;
      if (started) {
        pipeline_.segment(observation);
      } else {
        const auto estimate = pipeline_.process(observation);
        converged += estimate.state == EstimatorState::kConverged;
        started = ++frames >= kMostStartFrames || converged >= kFramesAfterConvergence;
        for (std::size_t j = 0; j < estimate.joint_names.size(); ++j) {
          start_offsets_[estimate.joint_names[j]] = estimate.offset_rad[static_cast<Eigen::Index>(j)];
        }
      }
      for (const auto& seen : observation.cameras) {
        if (!seen) continue;
        ++pictures_seen_;
        pictures_with_arm_ += !seen->mask.empty() && seen->mask.count() >= pipeline_.options().min_mask_px;
      }
      measurement_.add(observation);
      pictures_.offer(observation);
    });
    measurement_.set_stream(recorder.finish());
  }

  static constexpr Microseconds kLearnEvery = 90'000;
  static constexpr int kRefit = 1000;  ///< DiagnosisOptions::before_iteration counts the refit from here
  static constexpr double kMostStep_rad = 0.2;
  static constexpr double kShapeError_px = 0.8;  ///< rms after the extension; a good model leaves 0.3
  static constexpr double kStill_rad = 0.5 * kPi / 180.0;
  static constexpr const char* kAdvice =
      " for 60 to 120 s: slow and fast, the same postures in both directions, 15 s of rest";

  LogDiagnosisOptions options_;
  Pipeline pipeline_;
  ImageMeasurement measurement_;
  std::map<std::string, double> start_offsets_;
  LogPictures pictures_;
  struct {
    BusStatistics bus;
    std::vector<std::string> missing_joints;
  } facts_;  ///< of the last pass over the log
  bool wide_refit_ = false;
  std::size_t refits_ = 0;
  std::size_t pictures_seen_ = 0, pictures_with_arm_ = 0;
};

}  // namespace

DiagnosisReport diagnose_log(const Configuration& configuration, const LogDiagnosisOptions& options) {
  return LogDiagnosis(configuration, options).run();
}

}  // namespace bodyschema
