#include "outline_fitter.hpp"

#include <algorithm>
#include <cmath>

#include "limits.hpp"
#include "occlusion.hpp"
#include "shown_steps.hpp"

namespace bodyschema {
namespace {

constexpr double kFollow_px[] = {8.0, 5.0};
constexpr double kWide_px[] = {30.0, 20.0, 14.0, 10.0, 7.0, 5.0};
/// Of the distance at which outlines are looked for: what passes for a residual.
constexpr double kOfReach = 0.5;
/// About an arm that was just found, at the pictures' own noise: what came before weighed otherwise.
constexpr int kLeastSteps = 3;
/// Each step looks once, the last look may be two.
constexpr int kMostRendersOfStart = static_cast<int>(std::size(kWide_px)) + limits::kMostSteps + 2;

bool pictures(const Frame& frame) {
  return std::any_of(frame.seen.begin(), frame.seen.end(),
                     [](const auto* seen) { return seen != nullptr && !seen->image.empty(); });
}

}  // namespace

OutlineFitter::OutlineFitter(FrameModel& model, HypothesisScorer& scorer, const EstimatorOptions& options,
                             std::size_t cameras, int search_renders)
    : model_(model), scorer_(scorer), options_(options), noise_(cameras, OutlineNoise(options.noise)),
      search_renders_(std::max(search_renders, 2 * kMostRendersOfStart)), stamps_(options.stamp_sd_s) {}

std::vector<OutlineSearch> OutlineFitter::searches(double search_px, bool last, bool without_odd) const {
  std::vector<OutlineSearch> list;
  for (const auto& noise : noise_) {
    const double robust_px = last ? noise.robust_px() : std::max(noise.robust_px(), kOfReach * search_px);
    list.push_back({search_px, options_.outline_spacing_px, robust_px, part_weight_});
    if (without_odd) list.back().odd_sd_px = std::max(noise.sd_px(), limits::kLeastOdd_px);
  }
  return list;
}

void OutlineFitter::look(const Frame& frame, double search_px, double sd_px, bool last, OutlineFit& fit) {
  fit.points.assign(noise_.size(), {});
  ++renders_;
  model_.linearise(frame, fit.x, searches(search_px, last), last, fit.evidence,
                   [&](std::size_t c, std::span<const OutlinePoint> points) {
                     if (last) fit.points[c].assign(points.begin(), points.end());
                   });
  fit.quadratic = quadratic_of(fit.evidence, fit.x, last, sd_px);
  if (last) stamps_.take_out(time_of(fit.evidence, fit.x), fit.quadratic);
}

Quadratic OutlineFitter::quadratic_of(const FrameEvidence& evidence, const Eigen::VectorXd& x, bool with_beside,
                                      double sd_px) const {
  const auto n = x.size(), all = n + (with_beside ? model_.beside_count() : 0);
  Quadratic quadratic = Quadratic::zero(all);
  for (std::size_t c = 0; c < noise_.size(); ++c) {
    const auto& seen = evidence.cameras[c];
    if (seen.weight <= 0.0) continue;
    const double precision = 1.0 / std::max(noise_[c].variance_px2(), sd_px * sd_px);
    quadratic.A += precision * seen.A.topLeftCorner(all, all);
    quadratic.b += precision * seen.b.head(all);
  }
  // About the origin of the state; what lies beside it is zero there.
  quadratic.b += quadratic.A.leftCols(n) * x;
  return quadratic;
}

TimeEvidence OutlineFitter::time_of(const FrameEvidence& evidence, const Eigen::VectorXd& x) const {
  const auto n = x.size();
  TimeEvidence time{Eigen::VectorXd::Zero(n + model_.beside_count())};
  for (std::size_t c = 0; c < noise_.size(); ++c) {
    if (evidence.cameras[c].weight <= 0.0) continue;
    const double precision = 1.0 / noise_[c].variance_px2();
    time.with_state += precision * evidence.time[c].with_state;
    time.A += precision * evidence.time[c].A;
    time.b += precision * evidence.time[c].b;
  }
  time.b += time.with_state.head(n).dot(x);
  return time;
}

void OutlineFitter::look_twice(const Frame& frame, double search_px, OutlineFit& fit) {
  ++renders_;
  model_.linearise(frame, fit.x, searches(search_px, true, true), true, fit.seen.evidence,
                   [&](std::size_t c, std::span<const OutlinePoint> points) {
                     if (fit.points.size() != noise_.size()) fit.points.assign(noise_.size(), {});
                     fit.points[c].assign(points.begin(), points.end());
                   });
  fit.at_its_stamp = quadratic_of(fit.seen.evidence, fit.x, true, 0.0);
  fit.time = time_of(fit.seen.evidence, fit.x);
  fit.seen.quadratic = fit.at_its_stamp;
  stamps_.take_out(fit.time, fit.seen.quadratic);
  if (fit.seen.evidence.odd > 0.0) {
    auto points = std::move(fit.points);  // these know which are odd
    look(frame, search_px, 0.0, true, fit);
    fit.points = std::move(points);
  } else {
    fit.evidence = fit.seen.evidence;
    fit.quadratic = fit.seen.quadratic;
  }
}

double OutlineFitter::take_step(const Frame& frame, const PostureMemory& memory, double search_px, double sd_px,
                                OutlineFit& fit) {
  const Eigen::Index n = fit.x.size();
  look(frame, search_px, sd_px, false, fit);
  Eigen::VectorXd step = memory.solve_with(fit.quadratic) - fit.x;
  const double largest = step.head(model_.state().joints()).cwiseAbs().maxCoeff();
  if (largest > limits::kMaxStep_rad) step *= limits::kMaxStep_rad / largest;
  fit.x += step;
  double square = 0.0, weight = 0.0;
  for (const auto& seen : fit.evidence.cameras) {
    if (seen.weight <= 0.0) continue;
    square += step.dot(seen.A.topLeftCorner(n, n) * step);
    weight += seen.weight;
  }
  return weight > 0.0 ? std::sqrt(square / weight) : 0.0;
}

void OutlineFitter::refine(const Frame& frame, const PostureMemory& memory, std::span<const double> search_px,
                           int more_steps, OutlineFit& fit) {
  double moved_px = 0.0;
  // Of an arm that is looked for from afar, outlines are matched with others as well, and err by what passes for a
  // residual: taken for as exact as pictures are, such matches would move what much is believed of (a camera's place)
  // as readily as the joints. A memory holds it better than that.
  const bool first = more_steps > 0 && memory.empty();
  for (const double reach_px : search_px) {
    moved_px = take_step(frame, memory, reach_px, first ? kOfReach * reach_px : 0.0, fit);
  }
  for (int i = 0; i < more_steps && ((first && i < kLeastSteps) || moved_px > limits::kSettled_px); ++i) {
    moved_px = take_step(frame, memory, search_px.back(), 0.0, fit);
  }
  look_twice(frame, search_px.back(), fit);
  fit.misfit = memory.distance(fit.x);
  for (std::size_t c = 0; c < noise_.size(); ++c) fit.misfit += fit.evidence.cost[c] / noise_[c].variance_px2();
}

OutlineFit OutlineFitter::follow(const Frame& frame, const PostureMemory& memory, const Eigen::VectorXd& start) {
  OutlineFit fit;
  fit.x = start;
  refine(frame, memory, kFollow_px, 0, fit);
  return fit;
}

OutlineFit OutlineFitter::follow_from(const Frame& frame, const Eigen::VectorXd& start, const PostureMemory& memory) {
  OutlineFit fit;
  fit.x = start;
  const int before = renders_;
  // What still moves would claim a place that it has not reached.
  refine(frame, memory, kWide_px, limits::kMostSteps, fit);
  searched_renders_ += renders_ - before;
  return fit;
}

bool OutlineFitter::may_follow(int more) const {
  return searched_renders_ + (1 + more) * kMostRendersOfStart <= search_renders_;
}

bool OutlineFitter::go_on(const Frame& frame, const PostureMemory& memory, StartSearch& search, int room) {
  search.fit.reset();
  for (; search.next < search.starts.size(); ++search.next) {
    if (!may_follow(room)) return false;
    OutlineFit fit = follow_from(frame, search.starts[search.next], memory);
    double distance = scorer_.distance(fit.x);
    if (search.by_pictures && pictures(frame) && !pictures_show(frame, fit.evidence)) distance += 1.0;
    if (distance >= search.least) continue;
    search.least = distance;
    search.best = fit.x;
    search.fit = std::move(fit);
  }
  return true;
}

OutlineFit OutlineFitter::found(const Frame& frame, const PostureMemory& memory, StartSearch& search) {
  if (search.fit) return std::move(*search.fit);
  return follow_from(frame, search.best, memory);
}

std::optional<Quadratic> OutlineFitter::about(const Frame& frame, const Eigen::VectorXd& x) {
  OutlineFit fit;
  fit.x = x;
  look_twice(frame, kFollow_px[std::size(kFollow_px) - 1], fit);
  if (!fits(frame, fit.evidence)) return std::nullopt;
  return std::move(fit.seen.quadratic);
}

bool OutlineFitter::clearly_nearer(const OutlineFit& fit, const OutlineFit& other) {
  return scorer_.distance(fit.x) < limits::kNearer * scorer_.distance(other.x);
}

bool OutlineFitter::rest_fits(const OutlineFit::Seen& seen) const {
  const FrameEvidence& evidence = seen.evidence;
  const double left = evidence.sampled - evidence.odd;
  return left >= limits::kFewestPoints && evidence.rms_px() < limits::kNear_px;
}

bool OutlineFitter::lies_near(const Frame& frame, const FrameEvidence& evidence) const {
  if (evidence.rms_px() >= limits::kNear_px) return false;
  return evidence.matched_share() > limits::kLeastMatched || (evidence.matched > 0.0 && pictures_show(frame, evidence));
}

bool OutlineFitter::pictures_show(const Frame& frame, const FrameEvidence& evidence) const {
  return pictures(frame) ? shown_share(frame, evidence).value_or(0.0) > limits::kLeastMatched : frame.shown;
}

bool OutlineFitter::fits(const Frame& frame, const FrameEvidence& evidence) const {
  return evidence.matched >= limits::kFewestPoints && lies_near(frame, evidence);
}

bool OutlineFitter::only_first_shown(const Frame& frame, const OutlineFit& fit, const OutlineFit& other) const {
  return pictures(frame) && fits(frame, fit.evidence) && pictures_show(frame, fit.evidence) &&
         !pictures_show(frame, other.evidence);
}

std::vector<OutlinePoint> OutlineFitter::shown(const OutlineFit& fit, std::size_t camera) const {
  return without_hidden(fit.seen.evidence.samples[camera], fit.points[camera],
                        limits::kBeside_px * model_.picture_unit_px(camera),
                        limits::kParallel_px * model_.picture_unit_px(camera));
}

void OutlineFitter::count_still_parts_once(std::size_t postures) {
  part_weight_.clear();
  const auto& still = model_.still_parts();
  if (std::find(still.begin(), still.end(), true) == still.end()) return;
  for (const bool part : still) part_weight_.push_back(part ? 1.0 / static_cast<double>(postures) : 1.0);
}

void OutlineFitter::learn_noise(const OutlineFit& fit) {
  for (std::size_t c = 0; c < noise_.size(); ++c) {
    if (fit.evidence.cameras[c].weight > 0.0) {
      noise_[c].add(shown(fit, c), model_.picture_unit_px(c), limits::kNoisePictures);
    }
  }
}

void OutlineFitter::learn_stamps(const Frame& frame, const OutlineFit& fit, const PostureMemory& memory) {
  stamps_.learn(frame.time_s, fit.at_its_stamp, fit.time, memory);
}

void OutlineFitter::learn_shape(const OutlineFit& fit, double fitted) {
  for (std::size_t c = 0; c < noise_.size(); ++c) {
    if (fit.evidence.cameras[c].weight > 0.0) shape_.add(shown(fit, c), c, model_.picture_unit_px(c));
  }
  shape_.end_posture(options_.noise.floor_px, fitted);
}

double OutlineFitter::shape_variance_share(double fitted) const {
  return shape_.lasting_variance_px2(options_.noise.floor_px, fitted) / noise_.front().variance_px2();
}

}  // namespace bodyschema
