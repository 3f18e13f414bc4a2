#include "bodyschema/service/daemon.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <unistd.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "bodyschema/camera/require_places.hpp"
#include "bodyschema/core/clock.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/diagnosis/live_diagnosis.hpp"
#include "bodyschema/pipeline/estimate_line.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/service/health.hpp"
#include "bodyschema/service/live_page.hpp"
#include "bodyschema/service/notifier.hpp"
#include "bodyschema/service/offsets_message.hpp"
#include "bodyschema/service/start_up_checks.hpp"
#include "receiver.hpp"
#include "signals.hpp"
#include "status_reporter.hpp"

namespace bodyschema {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPoll{50};
constexpr milliseconds kStatusPeriod{1000};
constexpr milliseconds kLooksPeriod{60'000};
constexpr std::size_t kTimingsWindow = 100'000;
constexpr int kEngineCheckFrames = 8;

double ms_between(std::int64_t from_us, std::int64_t to_us) {
  return 1e-3 * static_cast<double>(to_us - from_us);
}

/// Called before there are threads. glibc would give each of some ten threads an arena of its own (up to eight per
/// core), and each would keep the room for the most that was ever waiting in it: two are enough. Pictures come from
/// these: from the system each would come in pages that are found empty one by one, a tenth of a frame's time at
/// 1280x720. What is freed stays for the next frame.
void keep_memory_for_frames() {
#ifdef __GLIBC__
  constexpr int kLargestPicture_bytes = 32 << 20, kKept_bytes = 256 << 20;
  mallopt(M_ARENA_MAX, 2);
  mallopt(M_MMAP_THRESHOLD, kLargestPicture_bytes);
  mallopt(M_TRIM_THRESHOLD, kKept_bytes);
#endif
}

/// After a reload: the next one must not come on top of what this one left.
void give_memory_back() {
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

double brightness_of(const Image& image) {
  constexpr std::size_t kStep = 61;  // every channel and column gets its turn
  std::uint64_t sum = 0;
  std::uint64_t n = 0;
  for (std::size_t i = 0; i < image.data.size(); i += kStep, ++n) sum += image.data[i];
  return n == 0 ? 0.0 : static_cast<double>(sum) / static_cast<double>(n);
}

/// This file, or the first of "name.1.ext", "name.2.ext", ... that holds nothing yet: what a service
/// recorded before it was killed and started again must not be written over.
std::filesystem::path free_name(const std::filesystem::path& wanted) {
  const auto holds_something = [](const std::filesystem::path& file) {
    std::error_code none;
    return std::filesystem::is_regular_file(file, none) && std::filesystem::file_size(file, none) > 0;
  };
  std::filesystem::path file = wanted;
  for (int n = 1; holds_something(file); ++n) {
    file = wanted;
    file.replace_filename(wanted.stem().string() + "." + std::to_string(n) + wanted.extension().string());
  }
  if (file != wanted) {
    spdlog::warn("{} holds something already and is kept; writing to {}", wanted.string(), file.string());
  }
  return file;
}

/// Throws DeviceError where the file cannot be created for a reason that passes, a full disk for one: who restarts
/// the service then is to try again. A folder that is not there is wrong input and said by who opens it.
void try_to_create(const std::filesystem::path& file) {
  std::error_code none;
  if (std::filesystem::exists(file, none) && !std::filesystem::is_regular_file(file, none)) return;  // a pipe or device
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor >= 0) {
    ::close(descriptor);
    return;
  }
  const int reason = errno;
  if (write_failure_passes(reason)) {
    throw DeviceError(file.string() + ": cannot be created: " + std::strerror(reason));
  }
}

/// Bytes that may wait to be recorded: beside what is usual two instants of raw pictures, however large these are.
std::size_t room_to_wait(const StereoRig& rig) {
  std::size_t instant = 0;
  for (const auto& camera : rig.cameras) {
    const auto& k = camera.intrinsics;  // pictures are recorded as they are sent
    const auto along = [&](int size) { return static_cast<std::size_t>(size * k.reduction); };
    instant += 3 * along(k.width) * along(k.height);
  }
  return Recorder::kWaiting_bytes + 2 * instant;
}

/// Everything that belongs to one load of the configuration. Takes in messages once its receiver is started.
struct Session {
  Session(std::unique_ptr<Pipeline> loaded, const std::string& lcm_url, Recorder* recorder)
      : pipeline(std::move(loaded)), queue(static_cast<std::size_t>(pipeline->bus().queue_frames)),
        link(lcm_url, pipeline->bus().one_source_silence_s,
             pipeline->bus().longest_message_bytes(pipeline->rig().cameras.size())),
        receiver(link, pipeline->make_stream(), queue, recorder), picture_since_us(pipeline->rig().cameras.size(), -1) {
    const VisionSetup& vision = pipeline->vision();
    if (vision.method == SegmentationMethod::kAuto && !vision.looks_file.empty()) {
      looks.emplace(vision.looks_file, pipeline->model_hash());
      pipeline->know_looks(looks->read());
    }
    if (pipeline->options().live_diagnosis) diagnosis = std::make_unique<LiveDiagnosis>(*pipeline);
  }

  std::unique_ptr<Pipeline> pipeline;
  std::optional<LooksKeeper> looks;          ///< absent: not asked for
  std::unique_ptr<LiveDiagnosis> diagnosis;  ///< null: not asked for
  ObservationQueue queue;
  LcmLink link;
  Receiver receiver;
  std::vector<std::int64_t> picture_since_us;  ///< of each camera, when its picture was a new one
  /// Taken from the queue early, so that its masks are found while the frame before is estimated.
  std::optional<ArrivedObservation> next;

  [[nodiscard]] std::size_t waiting() const { return queue.size() + (next ? 1 : 0); }

  std::optional<ArrivedObservation> take(milliseconds timeout) {
    if (!next) return queue.pop(timeout);
    return std::exchange(next, std::nullopt);
  }
};

class Daemon {
 public:
  Daemon(const std::function<Configuration()>& load_configuration, const DaemonOptions& options)
      : load_configuration_(load_configuration), options_(options), lcm_url_(with_receive_buffer(options.lcm_url)),
        all_stages_(options.timings ? kTimingsWindow : 1) {}
  /// After an error: what loads must not outlive what it loads from.
  ~Daemon() {
    if (reloading_.valid()) reloading_.wait();
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  void run() {
    keep_memory_for_frames();
    const Signals signals;
    auto pipeline = load(load_configuration_);
    open_files(pipeline->rig());
    for (const auto& complaint : check_network(options_.lcm_url)) spdlog::warn("{}", complaint);
    if (options_.page_port) {
      page_ = std::make_unique<LivePage>(*options_.page_port, camera_names(*pipeline));
      spdlog::info("live page: {}", page_->url());
    }
    start_session(std::move(pipeline));
    spdlog::info("waiting for encoders and pictures on {} and {} ({})", channels().joint_state, channels().cameras,
                 options_.lcm_url);
    {
      const std::jthread reporter([this](const std::stop_token& stop) { report_every_second(stop); });
      loop(signals);
    }
    notifier_.stopping();
    keep_looks();
    session_->receiver.finish();
    {
      const std::lock_guard progress_lock(progress_mutex_);
      progress_.left = session_->waiting();
    }
    report();  // the last word, with the final counts
    finish_files();
    const auto facts = received();
    spdlog::info("stopped after {} estimates; {} pictures came in, {} were dropped, {} frames shed, {} left",
                 progress_.estimated, facts.bus.synchroniser.images, facts.bus.synchroniser.total_dropped(),
                 progress_.shed, progress_.left);
    if (options_.timings) std::fputs(all_stages_.table().c_str(), stdout);
    if (loading()) {  // which cannot be broken off: all else is done, so the process ends under it
      spdlog::default_logger()->flush();
      std::fflush(stdout);  // not all files: the load may hold one
      std::_Exit(0);
    }
  }

 private:
  // --- setting up -----------------------------------------------------------------------------

  static std::unique_ptr<Pipeline> load(const std::function<Configuration()>& load_configuration) {
    const Configuration configuration = load_configuration();
    auto pipeline = std::make_unique<Pipeline>(configuration, std::nullopt, PictureReading::kAsNeeded);
    configuration.reject_unknown_keys();
    require_places(pipeline->rig(), "the service");
    return pipeline;
  }

  void open_files(const StereoRig& rig) {
    std::filesystem::path record_file;
    if (options_.record) try_to_create(record_file = free_name(*options_.record));
    if (options_.estimates) try_to_create(estimates_file_ = free_name(*options_.estimates));
    std::error_code none;  // where one of them is not asked for, or cannot be created
    if (std::filesystem::equivalent(record_file, estimates_file_, none)) {
      throw ConfigurationError("--record and --estimates would both write to " + record_file.string() +
                               "; expected two files");
    }
    if (options_.record) recorder_ = std::make_unique<Recorder>(record_file, room_to_wait(rig));
    if (!options_.estimates) return;
    estimates_.open(estimates_file_);
    if (!estimates_) throw FileError(estimates_file_.string() + ": cannot be written");
  }

  void finish_files() {
    recorder_.reset();
    if (!options_.estimates) return;
    estimates_.flush();
    if (!estimates_) throw DeviceError(estimates_file_.string() + ": cut short, is the disk full?");
  }

  /// Puts a loaded pipeline to work in place of the present one, which stays where that fails.
  void start_session(std::unique_ptr<Pipeline> pipeline) {
    const std::lock_guard lock(session_mutex_);
    if (session_) session_->receiver.stop();  // or what comes now would be taken in twice
    std::unique_ptr<Session> fresh;
    try {
      fresh = std::make_unique<Session>(std::move(pipeline), lcm_url_, recorder_.get());
    } catch (...) {
      if (session_) session_->receiver.start();
      throw;
    }
    if (session_) {
      // What still waits is lost with the session, but not without being counted.
      session_->receiver.finish();
      const Receiver::Facts facts = session_->receiver.facts();
      add_counts(earlier_bus_, facts.bus);
      earlier_refused_ += facts.refused.messages;
      earlier_shed_ += session_->queue.shed() + session_->waiting();
      if (session_->diagnosis) earlier_diagnosis_s_ += session_->diagnosis->processor_s();
      fresh->pipeline->take_background_from(*session_->pipeline);
    }
    session_ = std::move(fresh);
    if (recorder_) recorder_->set_room(room_to_wait(session_->pipeline->rig()));
    session_->receiver.start();
    Pipeline& loaded = *session_->pipeline;
    engine_ = loaded.estimator().engine_description();
    spdlog::info("silhouettes: {}", engine_);
    if (loaded.error_model()) spdlog::info("extended model: {}", describe(*loaded.error_model()));
    reporter_.set_identity(identity());
    const std::lock_guard progress_lock(progress_mutex_);
    progress_.engine_change.clear();
    progress_.estimate = {};
    progress_.last_estimate_us = -1;
    progress_.cameras.clear();
    for (const auto& name : camera_names(loaded)) progress_.cameras.push_back({.name = name});
    progress_.camera_seen_us.assign(progress_.cameras.size(), -1);
    if (page_) page_->start_anew(camera_names(loaded));
  }

  [[nodiscard]] Identity identity() const {
    const Pipeline& pipeline = *session_->pipeline;
    return {options_.version,
            engine_,
            pipeline.model_hash(),
            pipeline.configuration_hash(),
            channels().cameras,
            channels().joint_state,
            channels().masks,
            static_cast<int>(pipeline.options().filter.particles),
            pipeline.rig().cameras.size()};
  }

  static std::vector<std::string> camera_names(const Pipeline& pipeline) {
    std::vector<std::string> names;
    for (const auto& camera : pipeline.rig().cameras) names.push_back(camera.name);
    return names;
  }

  [[nodiscard]] Channels channels() const { return session_->pipeline->bus().channels(); }

  // --- the estimating thread ------------------------------------------------------------------

  void loop(const Signals& signals) {
    while (!signals.stop_requested() && !done()) {
      notifier_.alive();
      // One that comes during a reload waits for its end: the configuration may have changed since.
      if (!reloading_.valid() && signals.take_reload_request()) begin_reload();
      finish_reload();
      if (auto arrived = session_->take(kPoll)) estimate(*arrived);
      if (monotonic_us() - looks_kept_us_ > 1000 * kLooksPeriod.count()) keep_looks();
    }
  }

  /// What the robot looks like, for the next start.
  void keep_looks() {
    looks_kept_us_ = monotonic_us();
    if (session_->looks) session_->looks->write(session_->pipeline->looks());
  }

  bool done() {
    if (const std::string failure = session_->receiver.facts().failure; !failure.empty()) {
      throw DeviceError(failure);
    }
    if (options_.frames > 0 && progress_.estimated >= options_.frames) return true;
    if (options_.stop_after_idle_s <= 0.0) return false;
    const std::int64_t newest = session_->receiver.newest_arrival_us();
    if (newest < 0 || 1e-3 * ms_between(newest, monotonic_us()) < options_.stop_after_idle_s) return false;
    // The end of what was played: the last pictures may still wait for a partner or for us.
    session_->receiver.finish();
    while (auto arrived = session_->take(milliseconds(0))) estimate(*arrived);
    return true;
  }

  /// Whatever is wrong with one frame, memory that is short included, the next may be good.
  void estimate(ArrivedObservation& arrived) {
    Estimate estimate;
    try {
      work_on(arrived, estimate);
    } catch (const std::exception& e) {
      const std::lock_guard lock(progress_mutex_);
      progress_.busy_since_us = -1;
      if (progress_.failed++ % 100 == 0) spdlog::error("a frame could not be worked on: {}", e.what());
      progress_.frame_failure = e.what();
      return;
    }
    try {
      if (page_) show(arrived.observation, estimate);
      if (++frames_since_engine_check_ == kEngineCheckFrames) note_engine();
    } catch (const std::exception& e) {
      if (shows_failed_++ % 100 == 0) spdlog::error("a picture could not be shown: {}", e.what());
    }
    if (!ready_) {
      ready_ = true;
      notifier_.ready();
      spdlog::info("ready: the first pictures and encoders came together");
    }
  }

  void work_on(ArrivedObservation& arrived, Estimate& estimate) {
    const std::int64_t begin = monotonic_us();
    {
      const std::lock_guard lock(progress_mutex_);
      progress_.busy_since_us = begin;
      progress_.shed = earlier_shed_ + session_->queue.shed();
    }
    Observation& observation = arrived.observation;
    Pipeline& pipeline = *session_->pipeline;
    session_->next = session_->queue.pop(milliseconds(0));
    std::int64_t published = begin;
    pipeline.process(observation, session_->next ? &session_->next->observation : nullptr, [&](const Estimate& made) {
      estimate = made;
      const bool news = session_->diagnosis && session_->diagnosis->watch(observation, estimate);
      published = publish(estimate, arrived.arrival_us);
      if (news) send(channels().findings, encode(to_message(estimate.findings)));
    });
    if (estimates_.is_open()) write(estimate);

    const StageTimes& t = estimate.times;
    const double latency_ms = ms_between(arrived.arrival_us, published);
    const StageDurations::Frame stages = {ms_between(arrived.arrival_us, begin),
                                          pipeline.segmentation_ms(),
                                          t.kinematics_ms,
                                          t.scoring_ms,
                                          t.filter_ms,
                                          t.refinement_ms,
                                          ms_between(begin, published) - pipeline.segmentation_ms() - t.total_ms,
                                          latency_ms};
    if (options_.timings) all_stages_.add(stages);
    const std::lock_guard lock(progress_mutex_);
    progress_.estimate = estimate;
    if (session_->diagnosis) progress_.diagnosis_s = earlier_diagnosis_s_ + session_->diagnosis->processor_s();
    progress_.latency.add(latency_ms);
    progress_.latency_last_second.add(latency_ms);
    progress_.stages.add(stages);
    note_cameras(observation, published);
    progress_.busy_since_us = -1;
    progress_.last_estimate_us = published;
    ++progress_.estimated;  // last: what throws before counts as failed
  }

  void write(const Estimate& estimate) {
    if (!estimates_) return;
    estimates_ << estimate_line(estimate, session_->pipeline->rig()) << std::endl;
    if (estimates_) return;
    const std::string failure = estimates_file_.string() + ": cut short, is the disk full?";
    spdlog::error("writing of estimates has ended: {}", failure);
    const std::lock_guard lock(progress_mutex_);
    progress_.estimates_failure = failure;
  }

  /// A GL context can be lost; the silhouettes are drawn by other means then.
  void note_engine() {
    frames_since_engine_check_ = 0;
    std::string engine = session_->pipeline->estimator().engine_description();
    if (engine == engine_) return;
    engine_ = std::move(engine);
    const std::string change = "silhouettes are now drawn by " + engine_;
    spdlog::warn("{}", change);
    const std::lock_guard lock(session_mutex_);
    reporter_.set_identity(identity());
    const std::lock_guard progress_lock(progress_mutex_);
    progress_.engine_change = change;
  }

  /// Copies for the page, after the estimate has gone out; the outlines are predicted here, because
  /// only this thread may ask the estimator.
  void show(Observation& observation, const Estimate& estimate) {
    page_->add(estimate);
    if (!page_->wants_pictures(session_->waiting() == 0)) return;
    std::vector<CameraPicture> pictures;
    Estimator& estimator = session_->pipeline->estimator();
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (!observation.cameras[c]) continue;
      pictures.push_back({c,
                          {},
                          estimator.predicted_silhouette(observation, c, false),
                          estimator.predicted_silhouette(observation, c, true),
                          is_frozen(progress_.cameras[c])});
      pictures.back().image = std::move(observation.cameras[c]->image);
    }
    page_->set_pictures(std::move(pictures));
  }

  /// monotonic_us() when the message was out.
  std::int64_t publish(const Estimate& estimate, std::int64_t arrival_us) {
    const Pipeline& pipeline = *session_->pipeline;
    joint_offsets_t message = to_message(estimate, pipeline.rig());
    message.sequence = sequence_++;
    message.num_particles = static_cast<std::int32_t>(pipeline.options().filter.particles);
    message.model_hash = pipeline.model_hash();
    message.config_hash = pipeline.configuration_hash();
    message.latency_ms = ms_between(arrival_us, monotonic_us());
    send(channels().joint_offsets, encode(message));
    return monotonic_us();
  }

  void note_cameras(const Observation& observation, std::int64_t now) {
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (!observation.cameras[c]) continue;
      const CameraObservation& seen = *observation.cameras[c];
      CameraFacts& facts = progress_.cameras[c];
      progress_.camera_seen_us[c] = now;
      facts.mask_px = seen.mask.empty() ? 0 : seen.mask.count();
      facts.brightness = brightness_of(seen.image);
      const PictureChange& picture = session_->pipeline->picture(c);
      std::int64_t& since_us = session_->picture_since_us[c];
      if (!picture.repeated || since_us < 0) since_us = now;
      facts.unchanged_ms = ms_between(since_us, now);
      facts.moved_meanwhile_rad = picture.moved_rad;
      facts.background_turned_rad = session_->pipeline->background_turned_rad(c);
    }
  }

  // --- reloading: the new robot is loaded by a thread of its own while the old one works on -------

  [[nodiscard]] bool loading() const {
    return reloading_.valid() && reloading_.wait_for(milliseconds(0)) != std::future_status::ready;
  }

  void begin_reload() {
    spdlog::info("reloading the configuration");
    if (ready_) notifier_.reloading();
    // Not std::async, whose future waits for the end of the load when it goes, which a stop cannot.
    std::packaged_task<std::unique_ptr<Pipeline>()> task([from = load_configuration_] { return load(from); });
    try {
      auto loaded = task.get_future();
      std::thread(std::move(task)).detach();
      reloading_ = std::move(loaded);
    } catch (const std::exception& e) {  // no thread to be had
      reload_failed(e.what());
    }
  }

  void finish_reload() {
    if (!reloading_.valid() || loading()) return;
    try {
      start_session(reloading_.get());
      give_memory_back();
      spdlog::info("configuration reloaded; estimating starts anew");
    } catch (const std::exception& e) {  // whatever is wrong with what was loaded, the old works on
      return reload_failed(e.what());
    }
    {
      const std::lock_guard lock(progress_mutex_);
      progress_.reload_failure.clear();
    }
    if (ready_) notifier_.ready();
  }

  void reload_failed(const std::string& failure) {
    spdlog::error("reload refused, going on as before: {}", failure);
    {
      const std::lock_guard lock(progress_mutex_);
      progress_.reload_failure = failure;
    }
    if (ready_) notifier_.ready();
  }

  // --- messages out, from both threads ----------------------------------------------------------

  void send(const std::string& channel, const std::vector<std::uint8_t>& message) {
    const Microseconds now = wall_us();
    if (recorder_) recorder_->record(channel, now, message);
    try {
      session_->link.publish(channel, now, message);
    } catch (const Error& e) {
      const std::lock_guard lock(progress_mutex_);
      if (progress_.publishing_failures++ % 100 == 0) spdlog::error("{}", e.what());
    }
  }

  // --- the reporting thread ---------------------------------------------------------------------

  void report_every_second(const std::stop_token& stop) {
    auto next = std::chrono::steady_clock::now() + kStatusPeriod;
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(
          std::min<std::chrono::steady_clock::duration>(kPoll, next - std::chrono::steady_clock::now()));
      if (std::chrono::steady_clock::now() < next) continue;
      // After a pause of the whole process one report is due, not one for each second missed.
      next = std::max(next + kStatusPeriod, std::chrono::steady_clock::now());
      report();
    }
  }

  void report() {
    try {
      compose_report();
    } catch (const std::exception& e) {  // the next may be possible again
      if (reports_failed_++ % 100 == 0) spdlog::error("the status could not be reported: {}", e.what());
    }
  }

  void compose_report() {
    const std::lock_guard lock(session_mutex_);
    if (!session_) return;
    const Receiver::Facts facts = received();
    Progress progress;
    {
      const std::lock_guard progress_lock(progress_mutex_);
      progress_.shed = earlier_shed_ + session_->queue.shed();
      progress = progress_;
      progress_.latency_last_second.clear();
    }
    const offsets_status_t status = reporter_.report(facts, progress, recorder_.get());
    send(channels().offsets_status, encode(status));
    if (page_) page_->set_status(status);
    const auto level = static_cast<HealthLevel>(status.level);
    notifier_.status(std::string(to_string(level)) + ": " + status.sentence);
    if (level != logged_level_) {
      logged_level_ = level;
      spdlog::log(level == HealthLevel::kOk ? spdlog::level::info : spdlog::level::warn, "{}: {}", to_string(level),
                  status.sentence);
    }
  }

  /// Of all sessions so far. Needs session_mutex_ off the estimating thread.
  [[nodiscard]] Receiver::Facts received() const {
    Receiver::Facts facts = session_->receiver.facts();
    add_counts(facts.bus, earlier_bus_);
    facts.refused.messages += earlier_refused_;
    return facts;
  }

  const std::function<Configuration()> load_configuration_;
  const DaemonOptions options_;
  const std::string lcm_url_;
  Notifier notifier_;
  std::unique_ptr<Recorder> recorder_;
  std::filesystem::path estimates_file_;
  std::ofstream estimates_;
  std::unique_ptr<LivePage> page_;

  std::mutex session_mutex_;  ///< held to replace the session, and by the reporter to use it
  std::unique_ptr<Session> session_;
  BusStatistics earlier_bus_;  ///< of sessions before a reload
  std::uint64_t earlier_refused_ = 0;
  std::uint64_t earlier_shed_ = 0;
  double earlier_diagnosis_s_ = 0.0;  ///< processor time

  std::mutex progress_mutex_;  ///< taken after session_mutex_ where both are
  Progress progress_;

  StatusReporter reporter_{{}};
  std::string engine_;  ///< what draws silhouettes, in words
  int frames_since_engine_check_ = 0;
  std::uint64_t shows_failed_ = 0;
  std::uint64_t reports_failed_ = 0;
  HealthLevel logged_level_ = HealthLevel::kOk;
  StageDurations all_stages_;
  std::int64_t sequence_ = 0;
  bool ready_ = false;
  std::future<std::unique_ptr<Pipeline>> reloading_;
  std::int64_t looks_kept_us_ = monotonic_us();
};

}  // namespace

void run_daemon(const std::function<Configuration()>& load_configuration, const DaemonOptions& options) {
  Daemon(load_configuration, options).run();
}

}  // namespace bodyschema
