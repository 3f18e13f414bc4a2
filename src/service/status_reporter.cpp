#include "status_reporter.hpp"

#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <limits>

namespace bodyschema {
namespace {

double age_ms(std::int64_t now_us, std::int64_t then_us) {
  return then_us < 0 ? -1.0 : 1e-3 * static_cast<double>(now_us - then_us);
}

std::int64_t resident_bytes() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  long long size = 0;
  long long resident = 0;
  const int read = std::fscanf(file, "%lld %lld", &size, &resident);
  std::fclose(file);
  return read == 2 ? resident * sysconf(_SC_PAGESIZE) : 0;
}

/// Of all threads since the start.
double processor_s() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Instants of a rig that `pictures` pictures make at least.
std::uint64_t instants(std::uint64_t pictures, std::size_t cameras) {
  return (pictures + cameras - 1) / cameras;
}

template <class Operation>
void combine(BusStatistics& into, const BusStatistics& other, Operation op) {
  const auto all = [&](auto& a, const auto& b) {
    for (std::size_t i = 0; i < a.size(); ++i) a[i] = op(a[i], b[i]);
  };
  SynchroniserStatistics& s = into.synchroniser;
  const SynchroniserStatistics& t = other.synchroniser;
  into.messages = op(into.messages, other.messages);
  into.messages_malformed = op(into.messages_malformed, other.messages_malformed);
  into.images_malformed = op(into.images_malformed, other.images_malformed);
  into.lost_in_queue = op(into.lost_in_queue, other.lost_in_queue);
  into.lost_incomplete = op(into.lost_incomplete, other.lost_incomplete);
  all(into.faults, other.faults);
  all(s.images_dropped, t.images_dropped);
  s.joint_messages = op(s.joint_messages, t.joint_messages);
  s.joint_messages_duplicate = op(s.joint_messages_duplicate, t.joint_messages_duplicate);
  s.joint_messages_out_of_order = op(s.joint_messages_out_of_order, t.joint_messages_out_of_order);
  s.joint_messages_without_known_joint = op(s.joint_messages_without_known_joint, t.joint_messages_without_known_joint);
  s.images = op(s.images, t.images);
  s.images_used = op(s.images_used, t.images_used);
  s.masks = op(s.masks, t.masks);
  s.masks_late = op(s.masks_late, t.masks_late);
  s.masks_unused = op(s.masks_unused, t.masks_unused);
  s.observations = op(s.observations, t.observations);
  s.mono_observations = op(s.mono_observations, t.mono_observations);
  s.gaps = op(s.gaps, t.gaps);
  s.clock_steps = op(s.clock_steps, t.clock_steps);
}

}  // namespace

void add_counts(BusStatistics& total, const BusStatistics& more) {
  combine(total, more, [](std::uint64_t a, std::uint64_t b) { return a + b; });
}

BusStatistics counts_since(const BusStatistics& now, const BusStatistics& before) {
  BusStatistics difference = now;
  combine(difference, before, [](std::uint64_t a, std::uint64_t b) { return a - std::min(a, b); });
  return difference;
}

offsets_status_t StatusReporter::report(const Receiver::Facts& received, const Progress& progress,
                                        const Recorder* recorder) {
  const std::int64_t now = monotonic_us();
  const BusStatistics& bus = received.bus;

  HealthFacts facts;
  facts.cameras_channel = identity_.cameras_channel;
  facts.joints_channel = identity_.joints_channel;
  facts.masks_channel = identity_.masks_channel;
  facts.picture_age_ms = age_ms(now, received.pictures_arrived_us);
  facts.joints_age_ms = age_ms(now, received.joints_arrived_us);
  facts.estimate_age_ms = age_ms(now, progress.last_estimate_us);
  facts.busy_ms = std::max(0.0, age_ms(now, progress.busy_since_us));
  facts.encoder_lag_ms = 1e-3 * static_cast<double>(bus.synchroniser.encoder_lag);
  facts.cameras = progress.cameras;
  for (std::size_t c = 0; c < facts.cameras.size(); ++c) {
    facts.cameras[c].age_ms = age_ms(now, progress.camera_seen_us[c]);
  }
  facts.missing_joints = received.missing_joints;
  facts.blocking_joint = received.blocking_joint;
  facts.since_last = counts_since(bus, last_bus_);
  facts.estimated_since_last = progress.estimated - last_estimated_;
  facts.shed_since_last = progress.shed - last_shed_;
  facts.failed_since_last = progress.failed - last_failed_;
  facts.frame_failure = progress.frame_failure;
  facts.estimates_failure = progress.estimates_failure;
  facts.refused = received.refused;
  facts.refused.messages -= std::min(facts.refused.messages, last_refused_);
  facts.estimate = progress.estimate;
  facts.reload_failure = progress.reload_failure;
  facts.engine_change = progress.engine_change;
  Recorder::State recording;
  if (recorder != nullptr) recording = recorder->state();
  facts.recording_failure = recording.failure;
  facts.recording_lost = recording.lost;
  const Health health = assess(facts);

  offsets_status_t m;
  m.utime = wall_us();
  m.uptime_us = now - start_us_;
  m.level = static_cast<std::int8_t>(health.level);
  m.sentence = health.sentence;
  m.state = to_string(progress.estimate.state);

  const SynchroniserStatistics& s = bus.synchroniser;
  const std::uint64_t lost_before_queue = instants(s.total_dropped() + bus.images_malformed, identity_.camera_count);
  m.frames_in = static_cast<std::int64_t>(s.observations + lost_before_queue);
  m.frames_estimated = static_cast<std::int64_t>(progress.estimated);
  m.frames_dropped = static_cast<std::int64_t>(progress.shed + progress.left + progress.failed + lost_before_queue);
  m.gaps = static_cast<std::int64_t>(s.gaps);
  const double elapsed_s = last_report_us_ < 0 ? seconds(m.uptime_us) : seconds(now - last_report_us_);
  m.frame_rate_hz = elapsed_s > 0.0 ? static_cast<double>(facts.estimated_since_last) / elapsed_s : 0.0;
  m.image_age_ms = facts.picture_age_ms;
  m.encoder_lag_ms = facts.encoder_lag_ms;

  const auto count = [&m](const std::string& name, std::uint64_t value) {
    m.counter_name.push_back(name);
    m.counter_value.push_back(static_cast<std::int64_t>(value));
  };
  // pictures.arrived is the sum of used, refused, all dropped.* and the few that wait; those used and once more
  // those of `mono` are two for every frame estimated, shed, failed, or left when the service stopped.
  count("messages", bus.messages);
  count("pictures.arrived", s.images + bus.images_malformed);
  count("pictures.used", s.images_used);
  count("pictures.refused", bus.images_malformed);
  for (const auto& [name, value] : bus.counters()) count(name, value);
  count("refused.second_source", received.refused.messages);
  count("shed.queue", progress.shed);
  count("left", progress.left);
  count("failed", progress.failed);
  count("mono", s.mono_observations);
  count("publishing_failed", progress.publishing_failures);
  count("recording.written", recording.written);
  count("recording.lost", recording.lost);
  count("processor_ms", static_cast<std::uint64_t>(1e3 * processor_s()));
  count("processor_ms.diagnosis", static_cast<std::uint64_t>(1e3 * progress.diagnosis_s));
  m.num_counters = static_cast<std::int32_t>(m.counter_name.size());

  m.latency_bin_upper_ms.assign(DurationHistogram::kUpper_ms.begin(), DurationHistogram::kUpper_ms.end());
  m.latency_bin_upper_ms.push_back(std::numeric_limits<double>::infinity());
  m.latency_count.assign(progress.latency.counts().begin(), progress.latency.counts().end());
  m.num_latency_bins = static_cast<std::int32_t>(m.latency_count.size());
  m.latency_median_ms = progress.latency_last_second.quantile_ms(0.5);
  m.latency_p99_ms = progress.latency_last_second.quantile_ms(0.99);
  for (std::size_t i = 0; i < StageDurations::kNames.size(); ++i) {
    m.stage_name.emplace_back(StageDurations::kNames[i]);
    m.stage_median_ms.push_back(progress.stages.stage(i).quantile_ms(0.5));
    m.stage_p99_ms.push_back(progress.stages.stage(i).quantile_ms(0.99));
  }
  m.num_stages = static_cast<std::int32_t>(m.stage_name.size());

  const std::size_t word = identity_.engine.find_first_of(" (");
  m.engine = identity_.engine.substr(0, word);
  m.renderer = identity_.engine;
  m.num_particles = identity_.particles;
  m.effective_sample_size = progress.estimate.effective_sample_size;
  m.best_likelihood = progress.estimate.best_likelihood;
  m.weakest_direction = progress.estimate.weakest.text;
  m.weakest_stddev_rad = progress.estimate.weakest.sd_rad;
  m.resident_bytes = resident_bytes();
  m.version = identity_.version;
  m.model_hash = identity_.model_hash;
  m.config_hash = identity_.config_hash;

  last_report_us_ = now;
  last_bus_ = bus;
  last_refused_ = received.refused.messages;
  last_estimated_ = progress.estimated;
  last_shed_ = progress.shed;
  last_failed_ = progress.failed;
  return m;
}

}  // namespace bodyschema
