#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/clock.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/service/durations.hpp"
#include "bodyschema/service/health.hpp"
#include "bodyschema/service/recorder.hpp"
#include "receiver.hpp"

namespace bodyschema {

/// What the estimating thread has done since start; the other threads read copies.
struct Progress {
  std::uint64_t estimated = 0;
  std::uint64_t shed = 0;           ///< by the queue
  std::uint64_t left = 0;           ///< frames that still wait as the service stops
  std::int64_t busy_since_us = -1;  ///< monotonic_us() when the present frame was begun; -1: idle
  std::int64_t last_estimate_us = -1;
  Estimate estimate;
  std::vector<CameraFacts> cameras;          ///< ages are filled in by the reader ...
  std::vector<std::int64_t> camera_seen_us;  ///< ... from these; -1: never
  DurationHistogram latency;
  RecentDurations latency_last_second{256};
  StageDurations stages{300};
  std::string reload_failure;
  std::string engine_change;  ///< as in HealthFacts
  std::uint64_t publishing_failures = 0;
  std::uint64_t failed = 0;       ///< frames that could not be worked on
  std::string frame_failure;      ///< why, of the last
  std::string estimates_failure;  ///< as in HealthFacts
  double diagnosis_s = 0.0;       ///< processor time of the live diagnosis
};

/// What does not change between two loads of a configuration.
struct Identity {
  std::string version;
  std::string engine;  ///< Estimator::engine_description()
  std::string model_hash;
  std::string config_hash;
  std::string cameras_channel;
  std::string joints_channel;
  std::string masks_channel;
  int particles = 0;
  std::size_t camera_count = 1;
};

/// Counts of all receivers of this process, the present one's included, with the newest arrivals.
void add_counts(BusStatistics& total, const BusStatistics& more);
/// Counts of `now` less those of `before`.
[[nodiscard]] BusStatistics counts_since(const BusStatistics& now, const BusStatistics& before);

/// Composes the status message. Call once a second, from one thread: rates are since the last call.
class StatusReporter {
 public:
  explicit StatusReporter(Identity identity) : identity_(std::move(identity)), start_us_(monotonic_us()) {}

  /// After a reload.
  void set_identity(Identity identity) { identity_ = std::move(identity); }
  /// @param recorder  may be null
  [[nodiscard]] offsets_status_t report(const Receiver::Facts& received, const Progress& progress,
                                        const Recorder* recorder);

 private:
  Identity identity_;
  std::int64_t start_us_;
  std::int64_t last_report_us_ = -1;
  BusStatistics last_bus_;
  std::uint64_t last_estimated_ = 0;
  std::uint64_t last_shed_ = 0;
  std::uint64_t last_refused_ = 0;
  std::uint64_t last_failed_ = 0;
};

}  // namespace bodyschema
