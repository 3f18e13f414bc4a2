#include "bodyschema/diagnosis/live_diagnosis.hpp"

#include <spdlog/spdlog.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <future>
#include <optional>
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
constexpr double kLeastPeriod_s = 5.0, kPeriodShare = 0.25, kMostPeriod_s = 20.0;
constexpr double kFirstLook_s = 10.0;     // of pictures, before the first look
constexpr double kPicturePeriod_s = 0.5;  // from one frame that is looked at to the next
constexpr double kWindow_s = 90.0;        // older pictures are forgotten
/// Outlines that are kept to measure them again, some 80 frames of two cameras at 320x240.
constexpr std::size_t kOutlines_bytes = 16u << 20;
/// Of 320x240; outlines that a picture's own joints would move no further are measured where they are predicted.
constexpr double kNear_px = 0.5;
constexpr double kAnswer_s = 3.0;  // what a look found is said this much later, when it is surely known
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

/// @param reduction  of the pictures that were measured; what is said is in pixels of those that were sent
Finding to_finding(const DiagnosedCause& cause, int reduction) {
  const bool unexplained = cause.cause.name == "unexplained";
  Finding finding{cause.cause.name,
                  cause.cause.joint,
                  unexplained ? cause.variable : cause.cause.source,
                  cause.sentence,
                  {},
                  cause.z,
                  cause.hand_mm,
                  cause.outline_px * reduction};
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

/// Whether two looks found the same causes, as large as each knows them.
bool about_the_same(const std::vector<Finding>& a, const std::vector<Finding>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Finding& one, const Finding& other) {
    return name_of(one) == name_of(other) &&
           std::equal(one.parameters.begin(), one.parameters.end(), other.parameters.begin(), other.parameters.end(),
                      [](const auto& p, const auto& q) { return std::abs(p.value - q.value) <= p.sd; });
  });
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

  /// @return nothing where that cannot tell: what was found before stays as good as it was
  std::optional<LiveFindings> look(const Batch& batch) {
    if (batch.anew) forget();
    if (!take(batch)) return std::nullopt;
    LiveFindings found;
    const auto last = log_.pictures().back().joints.utime;
    found.utime = last;
    found.span_s = seconds(last - log_.pictures().front().joints.utime);
    if (found.span_s < kFirstLook_s) return std::nullopt;
    // A share of what may be wrong for every look, all of them together (Lan and DeMets 1983): of the k-th 6 / (pi
    // k)^2.
    const double k = static_cast<double>(++looks_);
    diagnosis_.level = kLiveLevel * 6.0 / (kPi * kPi * k * k);
    auto [report, best] = diagnosis::look(fit_, state_, at_, noise_, tolerances_, diagnosis_, changes_);
    found.blocks = report.blocks;
    found.z_threshold = report.z_threshold;
    if (std::any_of(report.causes.begin(), report.causes.end(), [](const auto& c) { return c.implausible; })) {
      return std::nullopt;  // something stands in for what is not known
    }
    best_ = std::move(best);
    for (const auto& cause : report.causes) found.causes.push_back(to_finding(cause, reduction()));
    if (!about_the_same(found.causes, measured_with_)) {
      measured_with_ = found.causes;
      others_found_ = true;
    }
    // The offset follows already what the estimator saw slip.
    for (auto& finding : found.causes) finding.estimated = is_slip_at_change(finding);
    for (const auto& cause : report.estimated) {
      found.causes.push_back(to_finding(cause, reduction()));
      found.causes.back().estimated = true;
    }
    for (const auto& f : found.causes) spdlog::debug("live diagnosis: {} (z {:.1f})", f.sentence, f.z);
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
    best_.reset();
    measured_with_.clear();
    others_found_ = false;
  }

  /// Measures what is new and moves what is known of the rest to where all of it together has the robot: the estimator
  /// follows the last pictures, whatever is wrong. False: there is nothing new.
  bool take(const Batch& batch) {
    best_ ? state_.set(*best_) : state_.set(batch.x);
    const auto newest = at_ ? at_->instants.back().utime : 0;
    for (const auto& frame : batch.frames) log_.add(frame);
    if (log_.pictures().empty() || log_.pictures().back().joints.utime <= newest) return false;
    log_.forget_before(log_.pictures().back().joints.utime - microseconds(kWindow_s));
    remember(batch.changes);
    log_.finish();
    fit_.weigh_parts();
    linearise(batch.x);
    log_.drop_outlines(kOutlines_bytes);
    return true;
  }

  /// @param x  what the estimator believes
  void linearise(const Eigen::VectorXd& x) {
    auto now = std::make_shared<LinearLog>(fit_.predict(state_.model(), all_));
    std::vector<std::size_t> fresh;
    for (std::size_t p = 0, old = 0; p < now->instants.size(); ++p) {
      if (!keep_old(old, *now, p)) fresh.push_back(p);
    }
    others_found_ = false;
    at_ = now;
    spdlog::debug("live diagnosis: measures {} of {} pictures", fresh.size(), now->instants.size());
    if (fresh.empty()) return;
    auto measured = fit_.predict(best_ ? *best_ : state_.model(), joints_, fresh);
    bring_near(measured, fresh, x);
    measured.coordinates = all_;
    const OutlineSearch search{diagnosis::limits::kSearch_px, diagnosis_.spacing_px,
                               std::max(OutlineSearch{}.robust_px, widest_robust_px(noise_))};
    fit_.measure(measured, search, fresh, [&](std::size_t p, std::span<const OutlinePoint> points) {
      const auto camera = log_.pictures()[p].camera;
      noise_[camera].add(points, log_.unit_px(p), kNoisePictures);
    });
    for (const auto p : fresh) {
      move(measured.evidence[p], measured.corrections[p], now->corrections[p], now->evidence[p]);
    }
  }

  /// Predictions of pictures as each of them has the arm's joints, where these lie elsewhere: outlines far off count
  /// little, and what pushes them there, a latency or a gain, would hardly be seen. What they say is kept about the
  /// state all the same.
  /// @param x  what the estimator believes
  void bring_near(LinearLog& measured, std::vector<std::size_t> far, const Eigen::VectorXd& x) {
    for (const double search_px : {diagnosis::limits::kFrom_px, diagnosis::limits::kSearch_px}) {
      if (!far.empty()) fit_.measure(measured, coarse(search_px), far);
      std::erase_if(far, [&](std::size_t p) { return is_near(measured, p, own_step(measured, p)); });
      if (search_px == diagnosis::limits::kFrom_px) take_estimate_where_better(measured, far, x);
      for (const auto p : far) {
        const Eigen::VectorXd step = own_step(measured, p);
        for (std::size_t i = 0; i < joints_.size(); ++i) {
          fit_.coordinates()[joints_[i]].in(measured.corrections[p]) += step[static_cast<Eigen::Index>(i)];
        }
      }
    }
  }

  [[nodiscard]] OutlineSearch coarse(double search_px) const {
    constexpr double kSparse = 2.0;  // of the way there half the points tell
    return {.search_px = search_px, .spacing_px = kSparse * diagnosis_.spacing_px, .robust_px = 0.5 * search_px};
  }

  /// The estimator may have found the arm elsewhere since the last look.
  void take_estimate_where_better(LinearLog& measured, const std::vector<std::size_t>& far, const Eigen::VectorXd& x) {
    if (!best_ || far.empty()) return;
    State believed = state_;
    believed.set(x);
    auto there = fit_.predict(believed.model(), joints_, far);
    fit_.measure(there, coarse(diagnosis::limits::kFrom_px), far);
    const auto mean_cost = [](const OutlineEvidence& e) { return e.sampled > 0.0 ? e.cost / e.sampled : 1e300; };
    for (const auto p : far) {
      if (mean_cost(there.evidence[p]) >= mean_cost(measured.evidence[p])) continue;
      measured.corrections[p] = there.corrections[p];
      measured.evidence[p] = std::move(there.evidence[p]);
    }
  }

  /// Where a picture by itself has the arm's joints, from where they are predicted.
  [[nodiscard]] Eigen::VectorXd own_step(const LinearLog& measured, std::size_t p) const {
    const auto& evidence = measured.evidence[p];
    const double variance = noise_[log_.pictures()[p].camera].variance_px2() * std::pow(log_.unit_px(p), 2);
    Eigen::MatrixXd precision = evidence.A / variance;
    precision.diagonal().array() += std::pow(diagnosis::limits::kOneFrame_rad, -2);
    return precision.ldlt().solve(evidence.b / variance);
  }

  /// Whether that moves outlines so little that they are measured where they are predicted.
  [[nodiscard]] bool is_near(const LinearLog& measured, std::size_t p, const Eigen::VectorXd& step) const {
    const auto& evidence = measured.evidence[p];
    return evidence.weight > 0.0 &&
           step.dot(evidence.A * step) <= std::pow(kNear_px * log_.unit_px(p), 2) * evidence.weight;
  }

  /// What earlier looks measured of a picture, where that is still in the window. Evidence is a quadratic about the
  /// place where it was measured, and ways there are bent: with other causes it is measured anew while its outlines are
  /// kept.
  /// @param old  position among the pictures of the last look, in order
  bool keep_old(std::size_t& old, LinearLog& now, std::size_t p) {
    if (!at_) return false;
    const auto same = [&](const Instant& earlier) {
      return earlier.utime == now.instants[p].utime && earlier.camera == now.instants[p].camera;
    };
    while (old < at_->instants.size() && !same(at_->instants[old])) ++old;
    if (old == at_->instants.size()) return false;  // what follows is new
    const bool again = others_found_ && !log_.pictures()[p].mask.empty();
    if (!again) move(at_->evidence[old], at_->corrections[old], now.corrections[p], now.evidence[p]);
    ++old;
    return !again;
  }

  /// Of both cameras, whose pictures are alike but for odd rigs: of the first.
  [[nodiscard]] int reduction() const { return log_.rig().cameras.front().intrinsics.reduction; }

  [[nodiscard]] Eigen::VectorXd step_between(const Corrections& from, const Corrections& to) const {
    Eigen::VectorXd before(fit_.coordinates().size()), after(before.size());
    fit_.coordinates().read(from, before);
    fit_.coordinates().read(to, after);
    return after - before;
  }

  /// Evidence about one place, about another: quadratics keep their shape.
  void move(OutlineEvidence& evidence, const Corrections& from, const Corrections& to, OutlineEvidence& moved) const {
    const Eigen::VectorXd step = step_between(from, to), pull = evidence.A * step;
    moved = std::move(evidence);
    moved.square += step.dot(pull) - 2.0 * step.dot(moved.b);
    moved.b -= pull;
  }

  DiagnosisOptions diagnosis_;
  std::vector<Belief> tolerances_;
  State state_;
  PictureLog log_;
  LogFit fit_;
  std::vector<std::uint32_t> all_, joints_;  ///< coordinates; those of the arm's joints
  std::vector<OutlineNoise> noise_;
  std::vector<Microseconds> changes_;
  std::shared_ptr<LinearLog> at_;       ///< the window, about the state at the last look
  std::optional<ErrorModel> best_;      ///< the state and what was found beside it, by the last look that could tell
  std::vector<Finding> measured_with_;  ///< causes with which pictures were measured
  bool others_found_ = false;           ///< since
  std::size_t looks_ = 0;
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
    outdated = looking.valid();
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
    auto found = looking.get();
    if (std::exchange(outdated, false)) return false;
    if (!found) {
      // Of pictures that are long gone nothing is said any more.
      if (said.causes.empty() || seconds(now - said.utime) <= kWindow_s) return false;
      said = {};
      return true;
    }
    said = *found;
    std::erase_if(said.causes, [&](const Finding& f) {
      // What the estimator saw happen has been seen twice.
      const bool seen = f.estimated && f.effect == "slip";
      return !seen && std::none_of(last.begin(), last.end(), [&](const Finding& g) { return agree(f, g); });
    });
    last = std::move(found->causes);
    return true;
  }

  void begin_look(Microseconds now) {
    if (waiting.frames.empty() || looking.valid()) return;
    if (look_utime == 0) first_utime = look_utime = now;
    const double period_s = std::clamp(kPeriodShare * seconds(now - first_utime), kLeastPeriod_s, kMostPeriod_s);
    // What has changed is looked at as soon as some pictures tell of it; a look that came before has seen too few.
    const auto told_utime = change_utime + microseconds(kLeastPeriod_s);
    const bool changed = change_utime > 0 && look_utime < told_utime && now >= told_utime;
    if (!changed && seconds(now - look_utime) < period_s) return;
    look_utime = now;
    waiting.x = x;
    looking = worker.begin([this, batch = std::exchange(waiting, {})] {
      give_way(kNice);
      const double begin_s = thread_time_s();
      auto found = window.look(batch);
      const double took_s = thread_time_s() - begin_s;
      used_s = used_s + took_s;
      spdlog::debug("live diagnosis: a look took {:.0f} ms", 1e3 * took_s);
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
  std::future<std::optional<LiveFindings>> looking;
  bool outdated = false;    ///< it looks at pictures from before encoders began anew
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
