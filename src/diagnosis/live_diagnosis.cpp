#include "bodyschema/diagnosis/live_diagnosis.hpp"

#include <spdlog/spdlog.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <utility>
#include <vector>

#include "bodyschema/core/background_worker.hpp"
#include "bodyschema/core/thread_priority.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/evidence/log_fit.hpp"
#include "limits.hpp"
#include "look.hpp"

namespace bodyschema {
namespace {

constexpr int kNice = 10;                       // of the thread: less than the estimator's, more than the page's
constexpr double kEncoderPeriod_s = 0.008;      // what has a memory needs 100 Hz; more is thinned
constexpr std::ptrdiff_t kMostEncoders = 2000;  // samples kept beside
constexpr std::size_t kMostWaiting = 60;        // frames kept for a look that is late
constexpr std::size_t kMostChanges = 3;         // that slips are asked of, the last ones
constexpr double kNoisePictures = 100.0;        // after so many a picture's noise has faded

/// From one look to the next, s: at least the first, then a share of what was seen (what has seen hardly anything new
/// cannot say anything new), at most the last.
constexpr double kLeastPeriod_s = 5.0, kPeriodShare = 0.2, kMostPeriod_s = 20.0;
constexpr double kFirstLook_s = 10.0;     // of pictures, before the first look
constexpr double kPicturePeriod_s = 0.5;  // from one frame that is looked at to the next
constexpr double kWindow_s = 90.0;        // older pictures are forgotten
constexpr double kAnswer_s = 3.0;         // what a look found is said this much later, when it is surely known
/// In how many looks together anything may be named in a robot without a fault, ever: every look has its share.
constexpr double kLiveLevel = 0.01;

/// What a look works on.
struct Batch {
  std::vector<Observation> frames;    ///< new ones: masks, joints and encoders
  std::vector<Microseconds> changes;  ///< that the estimator saw meanwhile
  Eigen::VectorXd x;                  ///< what is estimated now
  bool anew = false;                  ///< what was seen before is of another time
};

double thread_time_s() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

Finding to_finding(const DiagnosedCause& cause) {
  const bool unexplained = cause.cause.name == "unexplained";
  Finding finding{cause.cause.name,
                  cause.cause.joint,
                  unexplained ? cause.variable : cause.cause.source,
                  cause.sentence,
                  {},
                  cause.z,
                  cause.hand_mm,
                  cause.outline_px};
  for (const auto& p : cause.parameters) {
    finding.parameters.push_back({p.parameter, p.unit, p.estimate, p.sd});
    if (p.from && !p.duration_s) finding.from = *p.from;
  }
  for (std::size_t i = 1; i < cause.same.size(); ++i) finding.alike.push_back(cause.same[i].text());
  return finding;
}

std::string name_of(const Finding& f) {
  return CauseName{f.effect, f.joint, f.source}.text();
}

/// Whether two looks mean the same: one names the other's cause, or counts it among those that look alike.
bool agree(const Finding& a, const Finding& b) {
  const auto names = [](const Finding& f, const std::string& name) {
    return name_of(f) == name || std::find(f.alike.begin(), f.alike.end(), name) != f.alike.end();
  };
  return names(a, name_of(b)) || names(b, name_of(a));
}

/// The window of pictures, and the looks at it. Used by the worker's thread alone.
class Window {
 public:
  explicit Window(const Pipeline& pipeline)
      : tolerances_(pipeline.beliefs().tolerances), state_(pipeline.known_effects(), pipeline.beliefs().state),
        log_(pipeline.shared_robot(), pipeline.setup(), pipeline.rig()), fit_(log_, 1) {
    diagnosis_.noise = pipeline.options().noise;
    diagnosis_.spacing_px = pipeline.options().outline_spacing_px;
    noise_.assign(pipeline.rig().cameras.size(), OutlineNoise(diagnosis_.noise));
    all_.resize(static_cast<std::size_t>(fit_.coordinates().size()));
    for (std::size_t i = 0; i < all_.size(); ++i) all_[i] = static_cast<std::uint32_t>(i);
    for (const auto joint : state_.model().roles().arm) {
      joints_.push_back(static_cast<std::uint32_t>(fit_.coordinates().find({Coordinate::Kind::kJoint, joint})));
    }
  }

  LiveFindings look(const Batch& batch) {
    if (batch.anew) forget();
    if (!take(batch)) return found_;
    LiveFindings found;
    const auto last = log_.pictures().back().joints.utime;
    found.utime = last;
    found.span_s = seconds(last - log_.pictures().front().joints.utime);
    found_ = found;
    if (found.span_s < kFirstLook_s) return found;
    // A share of what may be wrong for every look, all of them together (Lan and DeMets 1983): of the k-th 6 / (pi
    // k)^2.
    const double k = static_cast<double>(++looks_);
    diagnosis_.level = kLiveLevel * 6.0 / (kPi * kPi * k * k);
    const auto report = diagnosis::look(fit_, state_, at_, noise_, tolerances_, diagnosis_, changes_);
    found.blocks = report.blocks;
    found.z_threshold = report.z_threshold;
    if (std::any_of(report.causes.begin(), report.causes.end(), [](const auto& c) { return c.implausible; })) {
      return found;  // something stands in for what is not known
    }
    for (const auto& cause : report.causes) found.causes.push_back(to_finding(cause));
    // The offset follows already what the estimator saw slip.
    for (auto& finding : found.causes) finding.estimated = is_slip_at_change(finding);
    for (const auto& cause : report.estimated) {
      found.causes.push_back(to_finding(cause));
      found.causes.back().estimated = true;
    }
    for (const auto& f : found.causes) spdlog::debug("live diagnosis: {} (z {:.1f})", f.sentence, f.z);
    found_ = found;
    return found;
  }

 private:
  /// Slips are said of what the estimator saw change.
  void remember(const std::vector<Microseconds>& changes) {
    changes_.insert(changes_.end(), changes.begin(), changes.end());
    const auto begin = log_.pictures().front().joints.utime;
    std::erase_if(changes_, [&](auto time) { return time <= begin; });
    if (changes_.size() > kMostChanges) changes_.erase(changes_.begin(), changes_.end() - kMostChanges);
  }

  /// Pictures of the window date a slip no better than they follow each other.
  [[nodiscard]] bool is_slip_at_change(const Finding& finding) const {
    return finding.effect == "slip" && std::any_of(changes_.begin(), changes_.end(), [&](Microseconds change) {
             return std::abs(seconds(finding.from - change)) <= kPicturePeriod_s;
           });
  }

  void forget() {
    changes_.clear();
    log_.forget_before(INT64_MAX);
    at_.reset();
    found_ = {};
  }

  /// Measures what is new and moves what is known of the rest to the present estimate. False: there is nothing new.
  bool take(const Batch& batch) {
    state_.set(batch.x);
    const auto newest = at_ ? at_->instants.back().utime : 0;
    for (const auto& frame : batch.frames) log_.add(frame);
    if (log_.pictures().empty() || log_.pictures().back().joints.utime <= newest) return false;
    log_.forget_before(log_.pictures().back().joints.utime - microseconds(kWindow_s));
    remember(batch.changes);
    log_.finish();
    fit_.weigh_parts();
    std::vector<std::size_t> fresh;
    for (std::size_t p = 0; p < log_.pictures().size(); ++p) {
      if (log_.pictures()[p].joints.utime > newest) fresh.push_back(p);
    }
    linearise(fresh);
    log_.drop_outlines();
    return true;
  }

  void linearise(const std::vector<std::size_t>& fresh) {
    auto measured = fit_.predict(state_.model(), joints_);
    bring_near(measured, fresh);
    measured.coordinates = all_;
    OutlineSearch search{.search_px = diagnosis::limits::kSearch_px, .spacing_px = diagnosis_.spacing_px};
    for (const auto& noise : noise_) search.robust_px = std::max(search.robust_px, noise.robust_px());
    fit_.measure(measured, search, fresh, [&](std::size_t p, std::span<const OutlinePoint> points) {
      const auto camera = log_.pictures()[p].camera;
      noise_[camera].add(points, picture_unit(log_.rig().cameras[camera].intrinsics), kNoisePictures);
    });
    auto now = std::make_shared<LinearLog>(fit_.predict(state_.model(), all_));
    for (const auto p : fresh) move(measured, p, *now, p);
    if (at_) keep_old(*now);
    at_ = std::move(now);
  }

  /// Predictions of pictures as each of them has the arm's joints: outlines far off count little, and what pushes them
  /// there, a latency or a gain, would hardly be seen. What they say is kept about the state all the same.
  void bring_near(LinearLog& measured, const std::vector<std::size_t>& fresh) {
    constexpr double kSparse = 2.0;  // of the way there half the points tell
    for (const double search_px : {diagnosis::limits::kFrom_px, diagnosis::limits::kSearch_px}) {
      fit_.measure(
          measured,
          {.search_px = search_px, .spacing_px = kSparse * diagnosis_.spacing_px, .robust_px = 0.5 * search_px}, fresh);
      for (const auto p : fresh) {
        const auto& evidence = measured.evidence[p];
        if (evidence.weight <= 0.0) continue;
        const auto camera = log_.pictures()[p].camera;
        const double variance =
            noise_[camera].variance_px2() * std::pow(picture_unit(log_.rig().cameras[camera].intrinsics), 2);
        Eigen::MatrixXd precision = evidence.A / variance;
        precision.diagonal().array() += std::pow(diagnosis::limits::kOneFrame_rad, -2);
        const Eigen::VectorXd step = precision.ldlt().solve(evidence.b / variance);
        for (std::size_t i = 0; i < joints_.size(); ++i) {
          fit_.coordinates()[joints_[i]].in(measured.corrections[p]) += step[static_cast<Eigen::Index>(i)];
        }
      }
    }
  }

  /// What earlier looks measured of pictures that are still in the window.
  void keep_old(LinearLog& now) {
    std::size_t old = 0;
    for (std::size_t p = 0; p < now.instants.size(); ++p) {
      const auto same = [&](std::size_t o) {
        return at_->instants[o].utime == now.instants[p].utime && at_->instants[o].camera == now.instants[p].camera;
      };
      while (old < at_->instants.size() && !same(old)) ++old;
      if (old == at_->instants.size()) return;  // what follows is new
      move(*at_, old, now, p);
    }
  }

  /// Evidence about one prediction, about another: quadratics keep their shape.
  void move(LinearLog& from, std::size_t f, LinearLog& to, std::size_t t) {
    Eigen::VectorXd before(fit_.coordinates().size()), after(before.size());
    auto& evidence = to.evidence[t] = std::move(from.evidence[f]);
    fit_.coordinates().read(from.corrections[f], before);
    fit_.coordinates().read(to.corrections[t], after);
    const Eigen::VectorXd step = after - before;
    const Eigen::VectorXd pull = evidence.A * step;
    evidence.square += step.dot(pull) - 2.0 * step.dot(evidence.b);
    evidence.b -= pull;
  }

  DiagnosisOptions diagnosis_;
  std::vector<Belief> tolerances_;
  State state_;
  PictureLog log_;
  LogFit fit_;
  std::vector<std::uint32_t> all_, joints_;  ///< coordinates; those of the arm's joints
  std::vector<OutlineNoise> noise_;
  std::vector<Microseconds> changes_;
  std::shared_ptr<LinearLog> at_;  ///< the window about the estimate at the last look
  std::size_t looks_ = 0;
  LiveFindings found_;  ///< by the last look
};

}  // namespace

struct LiveDiagnosis::Impl {
  Impl(const Pipeline& pipeline, bool wait)
      : waits(wait), least_postures(pipeline.options().least_postures), window(pipeline) {}

  bool watch(const Observation& observation, Estimate& estimate) {
    if (observation.encoders_begin_anew) begin_anew();
    keep_change(observation, estimate);
    keep(observation, estimate);
    const bool news = answer(observation.utime);
    begin_look(observation.utime);
    estimate.findings = said;
    return news;
  }

  void begin_anew() {
    waiting = {};
    waiting.anew = true;
    encoders.clear();
    last.clear();
    said = {};
    kept_utime = look_utime = change_utime = 0;
  }

  /// Remembers when the estimator took something to have changed.
  void keep_change(const Observation& observation, const Estimate& estimate) {
    if (estimate.changed.empty() || estimate.postures == 0) return;
    change_utime = observation.utime;
    for (const auto& seen : observation.cameras) {
      if (seen) change_utime = std::min(change_utime, seen->joints.utime);
    }
    waiting.changes.push_back(change_utime);
  }

  void keep(const Observation& observation, const Estimate& estimate) {
    for (const auto& sample : observation.encoders) {
      if (encoders.empty() || seconds(sample.utime - encoders.back().utime) >= kEncoderPeriod_s) {
        encoders.push_back(sample);
      }
    }
    // While no frame is kept only the last motion matters.
    if (std::ssize(encoders) > kMostEncoders) encoders.erase(encoders.begin(), encoders.begin() + kMostEncoders / 2);
    // A state that nothing is known of yet is no place to ask from.
    if (estimate.postures < least_postures || estimate.cameras_swapped) return;
    x.resize(estimate.offset_rad.size() + static_cast<Eigen::Index>(estimate.effects.size()));
    x.head(estimate.offset_rad.size()) = estimate.offset_rad;
    for (std::size_t k = 0; k < estimate.effects.size(); ++k) {
      x[estimate.offset_rad.size() + static_cast<Eigen::Index>(k)] = estimate.effects[k].value;
    }
    if (estimate.state == EstimatorState::kHandNotInView || estimate.state == EstimatorState::kLearningBackground) {
      return;
    }
    if (kept_utime > 0 && seconds(observation.utime - kept_utime) < kPicturePeriod_s) return;
    if (waiting.frames.size() >= kMostWaiting) return;
    kept_utime = observation.utime;
    Observation frame;
    frame.utime = observation.utime;
    for (const auto& seen : observation.cameras) {
      auto& camera = frame.cameras.emplace_back();
      if (!seen) continue;
      camera.emplace();
      camera->utime = seen->utime;
      camera->joints = seen->joints;
      camera->mask = seen->mask;
      camera->valid = seen->valid;
      camera->coverage = seen->coverage;
    }
    frame.encoders = std::exchange(encoders, {});
    waiting.frames.push_back(std::move(frame));
  }

  /// Says what the look under way has found, once it is time.
  bool answer(Microseconds now) {
    if (!looking.valid() || seconds(now - look_utime) < kAnswer_s) return false;
    if (!waits && looking.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    LiveFindings found = looking.get();
    said = found;
    std::erase_if(said.causes, [&](const Finding& f) {
      // What the estimator saw happen has been seen twice.
      const bool seen = f.estimated && f.effect == "slip";
      return !seen && std::none_of(last.begin(), last.end(), [&](const Finding& g) { return agree(f, g); });
    });
    last = std::move(found.causes);
    return true;
  }

  void begin_look(Microseconds now) {
    if (waiting.frames.empty() || looking.valid()) return;
    if (look_utime == 0) first_utime = look_utime = now;
    const double period_s = std::clamp(kPeriodShare * seconds(now - first_utime), kLeastPeriod_s, kMostPeriod_s);
    // What has changed is looked at as soon as some pictures tell of it.
    const bool changed = change_utime > look_utime && seconds(now - change_utime) >= kLeastPeriod_s;
    if (!changed && seconds(now - look_utime) < period_s) return;
    look_utime = now;
    waiting.x = x;
    looking = worker.begin([this, batch = std::exchange(waiting, {})] {
      give_way(kNice);
      const double begin_s = thread_time_s();
      auto found = window.look(batch);
      used_s = used_s + thread_time_s() - begin_s;
      return found;
    });
  }

  bool waits;
  std::size_t least_postures;
  Window window;  ///< the worker's
  std::atomic<double> used_s{0.0};

  Batch waiting;
  std::vector<JointSample> encoders;  ///< since the last frame that was kept
  Eigen::VectorXd x;                  ///< the estimate; empty: there was none
  Microseconds kept_utime = 0, look_utime = 0, first_utime = 0, change_utime = 0;
  std::vector<Finding> last;  ///< by the last look
  LiveFindings said;
  std::future<LiveFindings> looking;
  BackgroundWorker worker;  ///< last: it ends before what it works on
};

LiveDiagnosis::LiveDiagnosis(const Pipeline& pipeline, bool waits) : impl_(std::make_unique<Impl>(pipeline, waits)) {}
LiveDiagnosis::~LiveDiagnosis() = default;

bool LiveDiagnosis::watch(const Observation& observation, Estimate& estimate) {
  return impl_->watch(observation, estimate);
}

double LiveDiagnosis::processor_s() const {
  return impl_->used_s;
}

}  // namespace bodyschema
