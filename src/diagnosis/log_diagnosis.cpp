#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/image_measurement.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "joint_stream.hpp"

namespace bodyschema {
namespace {

/// Frames with the estimator before its offsets are taken as the start of the fit.
constexpr int kMostStartFrames = 150;
constexpr int kFramesAfterConvergence = 10;

class LogDiagnosis {
 public:
  LogDiagnosis(const Configuration& configuration, const LogDiagnosisOptions& options)
      : options_(options), pipeline_(configuration),
        measurement_(pipeline_.shared_robot(), pipeline_.setup(), pipeline_.rig(), options.threads) {
    configuration.reject_unknown_keys();
  }

  DiagnosisReport run() {
    learn();
    read();
    auto diagnosis = options_.diagnosis;
    if (diagnosis.nuisances.empty()) diagnosis.nuisances = usual_nuisances(measurement_.roles());
    if (diagnosis.start_offsets.empty()) diagnosis.start_offsets = start_offsets_;
    std::optional<ProgressBar> bar;
    if (!options_.quiet) bar.emplace("diagnosis", 100);
    diagnosis.progress = [&](double share) {
      if (bar) bar->set(static_cast<std::uint64_t>(100.0 * share));
    };
    diagnosis.before_iteration = [this](int iteration) {
      constexpr double kSearch_px[] = {8.0, 6.0, 4.0};
      measurement_.set_search(kSearch_px[std::min(iteration, 2)]);
    };
    auto report = diagnose(measurement_, diagnosis);
    if (!options_.out.empty()) report.write(options_.out);
    return report;
  }

 private:
  template <class Action>
  void for_each(const std::string& label, diagnosis::JointStream* recorder, Action action) {
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
    diagnosis::JointStream recorder(pipeline_.robot(), pipeline_.setup(), pipeline_.bus());
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
      measurement_.add(observation);
    });
    measurement_.set_stream(recorder.finish());
  }

  static constexpr Microseconds kLearnEvery = 90'000;

  LogDiagnosisOptions options_;
  Pipeline pipeline_;
  ImageMeasurement measurement_;
  std::map<std::string, double> start_offsets_;
};

}  // namespace

DiagnosisReport diagnose_log(const Configuration& configuration, const LogDiagnosisOptions& options) {
  return LogDiagnosis(configuration, options).run();
}

}  // namespace bodyschema
