#include "bodyschema/pipeline/watched_log.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/pipeline/joint_stream.hpp"

namespace bodyschema {
namespace {

constexpr Microseconds kLearnEvery = 90'000;
/// Frames with the estimator before its offsets are taken as a start.
constexpr int kMostStartFrames = 150;
constexpr int kFramesAfterConvergence = 10;
constexpr double kTolerableLoss = 0.05;  ///< of all pictures

/// Picks frames on a raster, so that their mean rate is the wanted one whatever the cameras' is.
class Raster {
 public:
  explicit Raster(double rate_hz) : period_(microseconds(1.0 / rate_hz)) {}
  bool takes(Microseconds utime) {
    if (due_ >= 0 && utime < due_ && due_ - utime <= period_) return false;
    due_ = due_ < 0 || std::abs(utime - due_) > period_ ? utime + period_ : due_ + period_;  // or a clock stepped back
    return true;
  }

 private:
  Microseconds period_, due_ = -1;
};

/// Keeps one observation in so many that a bounded number stays, spread over the log.
class Kept {
 public:
  explicit Kept(std::size_t most) : most_(most) {}
  void offer(const Observation& observation) {
    if (most_ == 0 || offered_++ % every_ != 0) return;
    list.push_back(observation);
    if (list.size() <= most_) return;
    for (std::size_t i = 1; 2 * i < list.size(); ++i) list[i] = std::move(list[2 * i]);
    list.resize((list.size() + 1) / 2);
    every_ *= 2;
  }
  std::vector<Observation> list;

 private:
  std::size_t most_, every_ = 1, offered_ = 0;
};

class Watcher {
 public:
  Watcher(Pipeline& pipeline, const WatchOptions& options)
      : pipeline_(pipeline),
        options_(options), result_{
                               PictureLog(pipeline.shared_robot(), pipeline.setup(), pipeline.rig()), {}, {}, {}, {}} {}

  WatchedLog run(bool estimate_first) {
    if (pipeline_.learns_background()) {
      learn();
      result_.pictures.learned_background();
    }
    read(estimate_first);
    return std::move(result_);
  }

 private:
  /// @param action  of every observation; whether to go on
  template <class Action>
  void for_each(const std::string& label, JointStream* recorder, Action action) {
    LogReader log(options_.log);
    auto stream = pipeline_.make_stream();
    const auto channels = stream.channels();
    std::optional<ProgressBar> bar;
    if (!options_.quiet) bar.emplace(label, log.size());
    LogEvent event;
    bool wanted = true;
    const auto drain = [&] {
      while (auto arrived = wanted ? stream.next() : std::nullopt) wanted = action(arrived->observation);
    };
    while (wanted && log.next(event)) {
      if (recorder != nullptr && event.channel == channels.joint_state) recorder->take(event.data);
      if (stream.receive(event.channel, event.data, event.time_us)) drain();
      if (bar) bar->set(log.position());
    }
    stream.finish();
    drain();
    result_.bus = stream.statistics();
    result_.missing_joints = stream.synchroniser().joints().missing_joints();
  }

  void learn() {
    Microseconds last = -1;
    Raster raster(options_.picture_rate_hz);
    for_each("learning the background", nullptr, [&](Observation& o) {
      if (raster.takes(o.utime)) {
        pictures_to_see_ += static_cast<std::size_t>(
            std::count_if(o.cameras.begin(), o.cameras.end(), [](const auto& camera) { return camera.has_value(); }));
      }
      if (last >= 0 && std::abs(o.utime - last) < kLearnEvery) return true;
      last = o.utime;
      pipeline_.learn_from(o);
      return true;
    });
    pipeline_.finish_learning();
  }

  void read(bool estimate_first) {
    JointStream recorder(pipeline_.robot(), pipeline_.setup(), pipeline_.bus());
    Raster raster(options_.picture_rate_hz);
    Kept kept(options_.kept);
    int frames = 0, converged = 0;
    bool started = !estimate_first;
    for_each("masks", &recorder, [&](Observation& observation) {
      if (!raster.takes(observation.utime)) return true;
      if (!started) {
        const auto estimate = pipeline_.process(observation);
        if (estimate.state != EstimatorState::kHandNotInView) {
          ++result_.frames_looked_at;
          result_.frames_swapped += estimate.cameras_swapped;
        }
        converged += estimate.state == EstimatorState::kConverged;
        started = ++frames >= kMostStartFrames || converged >= kFramesAfterConvergence;
        for (std::size_t j = 0; j < estimate.joint_names.size(); ++j) {
          result_.offsets_at_start[estimate.joint_names[j]] = estimate.offset_rad[static_cast<Eigen::Index>(j)];
        }
      } else if (pipeline_.masks_need_estimates()) {
        pipeline_.process(observation);
      } else {
        pipeline_.segment(observation);
      }
      for (const auto& seen : observation.cameras) {
        if (!seen) continue;
        ++result_.pictures_seen;
        const double pixels = static_cast<double>(seen->mask.width()) * static_cast<double>(seen->mask.height());
        result_.pictures_with_robot += !seen->mask.empty() && static_cast<double>(seen->mask.count()) >=
                                                                  pipeline_.options().min_mask_share * pixels;
      }
      result_.pictures.add(observation);
      kept.offer(observation);
      const auto& turn = pipeline_.background_turn();
      const auto pictures = std::max<std::size_t>(turn.pictures, pictures_to_see_);
      result_.background_turned = pipeline_.learns_background() &&
                                  static_cast<double>(turn.changed) > kTolerableLoss * static_cast<double>(pictures);
      return !result_.background_turned;  // these masks are not used then
    });
    result_.pictures.set_encoders(recorder.finish());
    result_.pictures.finish();
    result_.kept = std::move(kept.list);
  }

  Pipeline& pipeline_;
  WatchOptions options_;
  WatchedLog result_;
  std::size_t pictures_to_see_ = 0;  ///< of the whole log, counted where a background is learned
};

}  // namespace

Eigen::VectorXd at_start(const WatchedLog& log, const State& state) {
  Eigen::VectorXd x = state.x();
  for (const auto& [joint, offset] : log.offsets_at_start) {
    if (const auto at = state.find("joint_offset", {joint, ""}, 0); at >= 0) x[at] = offset;
  }
  return x;
}

WatchedLog watch_log(Pipeline& pipeline, const WatchOptions& options, bool estimate_first) {
  return Watcher(pipeline, options).run(estimate_first);
}

std::string why_no_picture(const BusStatistics& bus, const StereoRig& rig, const Channels& channels) {
  const std::string lost = bus.lost_pictures(0.0);
  if (lost.empty()) return "";
  std::string text = "no picture can be used: " + lost;
  if (bus.faults[static_cast<std::size_t>(MessageFault::kWrongSize)] > 0) {
    for (const auto& camera : rig.cameras) {
      const auto& k = camera.intrinsics;
      text += "; camera '" + camera.name + "' is configured as " + std::to_string(k.width * k.reduction) + "x" +
              std::to_string(k.height * k.reduction) + " (cameras." + camera.name + ".width, .height)";
    }
  }
  if (bus.synchroniser.dropped(DropReason::kNoMask) > 0) {
    text += "; vision.method: given needs masks on " + channels.masks +
            ", each with its picture's stamp: " + std::to_string(bus.synchroniser.masks) + " came";
  }
  return text;
}

void refuse_unusable(const WatchedLog& log, const std::filesystem::path& file, const Channels& channels,
                     const std::string& advice) {
  const std::string name = file.string();
  const auto& sync = log.bus.synchroniser;
  if (sync.joint_messages == 0) {
    throw DataError(name + ": no encoder readings on channel " + channels.joint_state + "; record it together with " +
                    channels.cameras + advice);
  }
  if (sync.images == 0) {
    const auto why = why_no_picture(log.bus, log.pictures.rig(), channels);
    if (!why.empty()) throw DataError(name + ": " + why);
    throw DataError(name + ": no pictures on channel " + channels.cameras + "; record it together with " +
                    channels.joint_state + advice);
  }
  if (!log.missing_joints.empty()) {
    throw DataError(name + ": no reading of joint '" + log.missing_joints.front() +
                    "'; publish and record it, or give it a value under robot.fixed_joints_deg");
  }
  if (log.pictures_seen == 0 && sync.dropped(DropReason::kNoMask) > 0) {
    throw DataError(name + ": " + why_no_picture(log.bus, log.pictures.rig(), channels));
  }
  if (log.pictures_seen == 0) {
    throw DataError(name + ": none of " + std::to_string(sync.images) +
                    " pictures has encoder readings around its time; record both with one clock" + advice);
  }
  if (4 * log.pictures_with_robot < log.pictures_seen) {
    throw DataError(name + ": the arm is seen in " + std::to_string(log.pictures_with_robot) + " of " +
                    std::to_string(log.pictures_seen) + " pictures; record it with the hand in view of all cameras" +
                    advice);
  }
  if (2 * log.frames_swapped > log.frames_looked_at) {
    throw DataError(name +
                    ": the left and right pictures are swapped: each shows what the other eye sees; exchange "
                    "them where they are published or imported, and record again");
  }
}

}  // namespace bodyschema
