#include "model_search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <spdlog/spdlog.h>
#include <utility>

#include "bodyschema/evidence/batch_fit.hpp"
#include "limits.hpp"

namespace bodyschema {

Belief wide_belief(const CauseName& cause, const JointRoles& roles) {
  const EffectTarget target{cause.joint, cause.source};
  const auto effect = make_effect(cause.name, target, roles);
  std::vector<double> sd;
  for (const auto& p : std::as_const(*effect).parameters()) {
    if (p.fitted) sd.push_back(diagnosis::limits::kWide * p.typical);
  }
  return {cause.name, target, sd};
}

}  // namespace bodyschema

namespace bodyschema::diagnosis {
namespace {

/// When it happened, which no fit changes.
void set_timing(Effect& effect, const FoundCause& cause) {
  const auto timing = effect_kind(cause.name.name).timing;
  if (timing == EffectTiming::kFromATime) effect.parameters()[1].value = seconds(cause.from);
  if (timing != EffectTiming::kOverTheLog) return;
  effect.parameters()[1].value = cause.begin_s;
  effect.parameters()[2].value = cause.duration_s;
}

/// A part of a log in which the robot is hardly found.
struct LostPart {
  std::size_t split = 0;  ///< the first picture after it changed
  bool at_first = false;  ///< it is what lies before
};

/// Seen from the beginning up to some picture, and hardly from there on; or the other way round.
std::optional<LostPart> lost_part(const LinearLog& at) {
  const auto count = at.evidence.size();
  std::vector<double> seen(count + 1, 0.0);
  for (std::size_t p = 0; p < count; ++p) seen[p + 1] = seen[p] + (at.evidence[p].weight > 0.0 ? 1.0 : 0.0);
  std::optional<LostPart> part;
  double most = 0.0;
  for (std::size_t p = 1; p < count; ++p) {
    const double before = seen[p] / static_cast<double>(p);
    const double after = (seen.back() - seen[p]) / static_cast<double>(count - p);
    const double contrast = std::abs(before - after) * std::sqrt(static_cast<double>(p * (count - p)));
    if (contrast <= most) continue;
    most = contrast;
    part.reset();
    if (std::abs(before - after) >= limits::kLostContrast) part = LostPart{p, before < after};
  }
  return part;
}

/// Whether two models say the same of every picture.
bool are_same(const ErrorModel& a, const ErrorModel& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t e = 0; e < a.size(); ++e) {
    if (a[e].name() != b[e].name() || a[e].target() != b[e].target()) return false;
    const auto own = a[e].parameters(), other = b[e].parameters();
    if (!std::equal(own.begin(), own.end(), other.begin(), other.end(),
                    [](const auto& p, const auto& q) { return p.value == q.value; })) {
      return false;
    }
  }
  return true;
}

/// Every n-th observation, so that at most so many pictures are looked at.
std::vector<std::size_t> raster_of(const PictureLog& log, std::size_t most) {
  const auto pictures = log.pictures();
  const std::size_t every = (pictures.size() + most - 1) / std::max<std::size_t>(1, most);
  std::vector<std::size_t> list, seen(log.rig().cameras.size(), 0);
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    if (seen[pictures[p].camera]++ % std::max<std::size_t>(1, every) == 0) list.push_back(p);
  }
  return list;
}

}  // namespace

ModelSearch::ModelSearch(LogFit& fit, const std::vector<Belief>& beliefs, const std::vector<Belief>& tolerances,
                         const DiagnosisOptions& options)
    : fit_(fit), beliefs_(beliefs), tolerances_(tolerances), options_(options),
      raster_(raster_of(fit.log(), options.most_pictures)), state_(fit.log().roles(), beliefs),
      noise_(fit.log().rig().cameras.size(), OutlineNoise(options.noise)) {}

ModelSearch::ModelSearch(LogFit& fit, State state, std::shared_ptr<const LinearLog> pictures,
                         std::vector<OutlineNoise> noise, const std::vector<Belief>& tolerances,
                         const DiagnosisOptions& options)
    : fit_(fit), tolerances_(tolerances), options_(options), given_(std::move(pictures)),
      raster_(raster_of(fit.log(), options.most_pictures)), state_(std::move(state)), noise_(std::move(noise)) {}

OutlineSearch ModelSearch::search() const {
  return {limits::kSearch_px, options_.spacing_px, widest_robust_px(noise_)};
}

void ModelSearch::measure_noise() {
  constexpr double kRobust_px = 3.0;
  noise_ = fit_.noise(state_.model(), {limits::kSearch_px, options_.spacing_px, kRobust_px}, options_.noise, raster_);
}

double ModelSearch::fit(State& state, double from_px) {
  return fit(state, from_px, raster_);
}

double ModelSearch::fit(State& state, double from_px, std::span<const std::size_t> pictures) {
  return fit_.fit(state,
                  {.iterations = 12,
                   .from_px = from_px,
                   .finest_px = limits::kSearch_px,
                   .robust_px = search().robust_px,
                   .spacing_px = options_.spacing_px,
                   .variance_px2 = mean_variance_px2(noise_) * slope_,
                   .least_promise = limits::kLeastPromise},
                  pictures);
}

void ModelSearch::start() {
  auto starts = options_.starts;
  starts.insert(starts.begin(), state_.x());
  std::optional<State> best;
  // The way from afar needs no more postures than tell the way; where it ends all have their say.
  const auto some = raster_of(fit_.log(), std::min(options_.most_pictures, limits::kPicturesFromAfar));
  for (const auto& x : starts) {
    State state(fit_.log().roles(), beliefs_);
    state.set(x);
    const double cost = fit(state, limits::kFrom_px, some);
    if (best && cost >= cost_) continue;
    cost_ = cost;
    best = std::move(state);
  }
  state_ = std::move(*best);
  if (some.size() < raster_.size()) fit(state_, 0.0);
  measure_noise();
  cost_ = fit(state_, 0.0);
  measure_noise();
}

State ModelSearch::state_with(const std::vector<FoundCause>& causes) const {
  auto beliefs = beliefs_;
  for (const auto& cause : causes) {
    if (cause.generic()) continue;
    auto wide = wide_belief(cause.name, fit_.log().roles());
    for (double& sd : wide.sd) sd *= cause.room;
    std::erase_if(beliefs, [&](const Belief& b) { return b.effect == wide.effect && b.target == wide.target; });
    beliefs.push_back(wide);
  }
  State state(fit_.log().roles(), beliefs);
  for (const auto& cause : causes) {
    if (cause.generic()) continue;
    set_timing(*state.model().find(cause.name.name, {cause.name.joint, cause.name.source}), cause);
  }
  return state;
}

ErrorModel ModelSearch::best(const BlockRegression& regression) const {
  const Eigen::VectorXd& step = regression.step();
  State best = state_;
  best.set(state_.x() + step.head(state_.size()));
  for (std::size_t c = 0; c < causes_.size(); ++c) {
    const auto& cause = causes_[c];
    if (cause.generic() || in_state(cause)) continue;
    auto& effect = best.model().add(cause.name.name, {cause.name.joint, cause.name.source});
    set_timing(effect, cause);
    const auto columns = columns_of(c);
    std::size_t next = 0;
    for (auto& parameter : effect.parameters()) {
      if (parameter.fitted) parameter.value = std::max(step[columns[next++]], parameter.at_least);
    }
  }
  return best.model();
}

std::optional<ModelSearch::Extended> ModelSearch::with(const FoundCause& cause, const Eigen::VectorXd& estimate,
                                                       Eigen::Index base) {
  auto causes = causes_;
  causes.push_back(cause);
  if (!in_state(cause)) return Extended{std::move(causes), state_, cost_, noise_};
  State stepped = state_;
  stepped.set(state_.x() + estimate.head(state_.size()));
  State state = state_with(causes);
  state.set(stepped.model());
  Eigen::VectorXd x = state.x();
  const EffectTarget target{cause.name.joint, cause.name.source};
  Eigen::Index column = base;
  const auto parameters = std::as_const(*state.model().find(cause.name.name, target)).parameters();
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    if (!parameters[p].fitted) continue;
    if (const auto at = state.find(cause.name.name, target, p); at >= 0) x[at] += estimate[column];
    ++column;
  }
  state.set(x);
  const double cost = fit(state, 0.0);
  if (cost >= cost_ * (1.0 - limits::kLeastGain)) return std::nullopt;
  return Extended{std::move(causes), std::move(state), cost, noise_};
}

void ModelSearch::take(Extended extended) {
  const bool beside = !in_state(extended.causes.back());
  causes_ = std::move(extended.causes);
  if (beside) return;
  cost_ = extended.cost;
  state_ = std::move(extended.state);
  measure_noise();
  cost_ = fit(state_, 0.0);
}

void ModelSearch::go_back_to(Extended before) {
  causes_ = std::move(before.causes);
  state_ = std::move(before.state);
  cost_ = before.cost;
  noise_ = std::move(before.noise);
}

void ModelSearch::drop(const std::vector<std::size_t>& out) {
  std::vector<FoundCause> causes;
  bool fitted = false;
  for (std::size_t c = 0; c < causes_.size(); ++c) {
    const bool stays = std::find(out.begin(), out.end(), c) == out.end();
    if (stays) causes.push_back(causes_[c]);
    fitted = fitted || (!stays && in_state(causes_[c]));
  }
  causes_ = causes;
  if (!fitted) return;
  State state = state_with(causes);
  state.set(state_.model());
  // A nuisance that was let loose is held by its belief again.
  cost_ = fit(state, 0.0);
  state_ = std::move(state);
}

std::vector<Eigen::Index> ModelSearch::columns_of(const CauseName& name) const {
  std::vector<Eigen::Index> list;
  for (Eigen::Index i = 0; i < state_.size(); ++i) {
    const auto& effect = state_.model()[state_.parameters()[static_cast<std::size_t>(i)].ref.effect];
    if (effect.name() == name.name && effect.target() == EffectTarget{name.joint, name.source}) list.push_back(i);
  }
  return list;
}

std::vector<Eigen::Index> ModelSearch::columns_of(std::size_t cause) const {
  const auto& found = causes_[cause];
  if (in_state(found)) return columns_of(found.name);
  std::vector<Eigen::Index> list;
  Eigen::Index first = state_.size();
  for (std::size_t c = 0; c < cause; ++c) {
    if (!in_state(causes_[c])) first += static_cast<Eigen::Index>(causes_[c].columns);
  }
  for (std::size_t k = 0; k < found.columns; ++k) list.push_back(first + static_cast<Eigen::Index>(k));
  return list;
}

std::shared_ptr<const LinearLog> ModelSearch::linearised(std::span<const std::uint32_t> coordinates) {
  const auto how = search();
  const auto& model = state_.model();
  if (!last_ || !are_same(last_->model, model) || last_->robust_px != how.robust_px || last_->slope != slope_) {
    last_.reset();  // before the next one needs room
    auto at = std::make_shared<LinearLog>(fit_.linearise(model, coordinates, how));
    for (auto& evidence : at->evidence) evidence.A *= slope_;
    last_.emplace(Linearised{model, how.robust_px, slope_, std::move(at)});
  }
  return last_->at;
}

LogAbout ModelSearch::about(double block_s) {
  std::vector<std::uint32_t> all(static_cast<std::size_t>(fit_.coordinates().size()));
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint32_t>(i);
  LogAbout log(state_, given_ ? given_ : linearised(all));
  log.base = fit_.directions(log.at, state_.model(), state_.refs());
  add_causes(log);
  add_considered(log);
  // A has the slope in it: divided by it once more here, what pictures tell stays, and their pull counts for more.
  for (std::size_t p = 0; p < log.base.size(); ++p) {
    const auto camera = fit_.log().pictures()[p].camera;
    const double unit = picture_unit(fit_.log().rig().cameras[camera].intrinsics);
    const bool seen = log.at.evidence[p].weight > 0.0;
    log.precision.push_back(seen ? 1.0 / (unit * unit * noise_[camera].variance_px2() * slope_) : 0.0);
  }
  log.block_s = block_s;
  group_blocks(log);
  return log;
}

void ModelSearch::add_causes(LogAbout& log) const {
  for (const auto& cause : causes_) {
    if (!cause.generic()) log.found.push_back(cause.name);
    if (in_state(cause)) continue;
    const auto more = directions_of(fit_, log,
                                    {.cause = cause.name,
                                     .variable = cause.variable,
                                     .parameters = {},
                                     .from = cause.from,
                                     .amounts = cause.amounts});
    for (std::size_t p = 0; p < more.size(); ++p) log.base[p].insert(log.base[p].end(), more[p].begin(), more[p].end());
  }
}

void ModelSearch::add_considered(LogAbout& log) const {
  const auto& roles = state_.model().roles();
  ErrorModel model(roles);
  for (const auto& belief : tolerances_) {
    const CauseName cause{belief.effect, belief.target.joint, belief.target.source};
    if (std::find(log.found.begin(), log.found.end(), cause) != log.found.end()) continue;
    model.add(belief.effect, belief.target);
    log.considered_sd.insert(log.considered_sd.end(), belief.sd.begin(), belief.sd.end());
  }
  std::vector<std::vector<Direction>> directions(log.base.size());
  if (model.size() > 0) directions = fit_.directions(log.at, model, fitted_parameters(model));
  // How far pictures place a whole flank: each camera's outlines as a whole, and each part's to the outside.
  const auto& cameras = fit_.log().rig().cameras;
  const auto coordinate = [&](Coordinate::Kind kind, std::size_t index) {
    return static_cast<std::uint32_t>(fit_.coordinates().find({kind, static_cast<Eigen::Index>(index)}));
  };
  for (std::size_t p = 0; p < directions.size(); ++p) {
    for (std::size_t c = 0; c < cameras.size(); ++c) {
      for (const auto kind : {Coordinate::Kind::kCx, Coordinate::Kind::kCy}) {
        const bool own = fit_.log().pictures()[p].camera == c;
        directions[p].push_back(own ? Direction{{coordinate(kind, 0), 1.0}} : Direction{});
      }
    }
    for (std::size_t s = 0; s < roles.segments.size(); ++s) {
      directions[p].push_back({{coordinate(Coordinate::Kind::kDilation, s), 1.0}});
    }
    log.base[p].insert(log.base[p].end(), directions[p].begin(), directions[p].end());
  }
  for (const auto& camera : cameras) {
    log.considered_sd.insert(log.considered_sd.end(), 2, limits::kFloor_px * picture_unit(camera.intrinsics));
  }
  log.considered_sd.insert(log.considered_sd.end(), roles.segments.size(),
                           limits::kFloor_px * picture_unit(cameras.front().intrinsics));
}

void ModelSearch::group_blocks(LogAbout& log) const {
  Eigen::VectorXd begin, last;
  double begin_s = 0.0;
  for (const auto& picture : fit_.log().pictures()) {
    const Eigen::VectorXd q = posture_of(picture.joints.q, state_.model().roles());
    const double t = seconds(picture.joints.utime);
    // Where postures beside each other err alike they go into one block.
    const bool jumped =
        last.size() > 0 && log.block_s <= options_.block_s && (q - last).cwiseAbs().maxCoeff() > limits::kJump_rad;
    const bool moved = begin.size() == 0 || (q - begin).cwiseAbs().maxCoeff() > options_.same_posture_rad;
    if (begin.size() == 0 || jumped || (moved && t - begin_s >= log.block_s)) {
      begin = q;
      begin_s = t;
      ++log.blocks;
    }
    last = q;
    log.block_of.push_back(log.blocks - 1);
  }
  count_postures_once(log);
}

void ModelSearch::count_postures_once(LogAbout& log) const {
  struct Block {
    Microseconds first = 0, last = 0;
    std::map<std::size_t, double> pictures;  ///< by camera
  };
  const auto& pictures = fit_.log().pictures();
  std::vector<Block> blocks(log.blocks);
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    auto& block = blocks[log.block_of[p]];
    if (block.first == 0) block.first = pictures[p].joints.utime;
    block.last = pictures[p].joints.utime;
    ++block.pictures[pictures[p].camera];
  }
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    const auto& block = blocks[log.block_of[p]];
    const double span_s = seconds(block.last - block.first);
    if (span_s > log.block_s) {
      log.precision[p] *= std::max(log.block_s / span_s, 1.0 / block.pictures.at(pictures[p].camera));
    }
  }
}

BlockRegression ModelSearch::regression(const LogAbout& log) const {
  const auto n = static_cast<Eigen::Index>(log.base.front().size());
  const auto considered = static_cast<Eigen::Index>(log.considered_sd.size());
  Eigen::VectorXd precision = Eigen::VectorXd::Zero(n), away = precision;
  precision.head(state_.size()) = state_.prior_sd().array().square().inverse();
  away.head(state_.size()) = state_.x() - state_.prior_mean();
  for (Eigen::Index i = 0; i < considered; ++i) {
    const double sd = log.considered_sd[static_cast<std::size_t>(i)];
    precision[n - considered + i] = 1.0 / std::max(1e-300, sd * sd);
  }
  return {base_blocks(log), precision, away};
}

const std::vector<ModelSearch::HandInPicture>& ModelSearch::hand_in(const LogAbout& log) {
  if (hand_at_ == log.linear) return hand_;
  hand_.clear();
  auto& measurement = fit_.measurement();
  const auto link = measurement.projection().hand_link();
  const auto most = refits() ? limits::kPicturesForSize : limits::kPicturesForSizeInALook;
  const std::size_t every = std::max<std::size_t>(1, raster_.size() / most);
  for (std::size_t i = 0; i < raster_.size(); i += every) {
    const auto p = raster_[i];
    if (log.precision[p] <= 0.0) continue;
    const auto& picture = fit_.log().pictures()[p];
    const auto jacobian =
        measurement.link_jacobian(picture.joints.q, log.at.corrections[p], picture.camera, log.at.coordinates, link);
    hand_.push_back({p, jacobian.topRows<3>(), measurement.projection().hand().translation().z()});
  }
  hand_at_ = log.linear;
  return hand_;
}

Size ModelSearch::size_of(const LogAbout& log, const std::vector<std::vector<Direction>>& columns,
                          const Eigen::VectorXd& amount, const Eigen::VectorXd& of_base) {
  Size size;
  double pictures = 0.0, weight = 0.0, depth = 0.0, focal = 0.0;
  Eigen::VectorXd moved(fit_.coordinates().size());
  const auto add = [&](const std::vector<Direction>& directions, const Eigen::VectorXd& amounts) {
    for (Eigen::Index k = 0; k < amounts.size(); ++k) {
      for (const auto& step : directions[static_cast<std::size_t>(k)])
        moved[step.coordinate] += amounts[k] * step.amount;
    }
  };
  for (const auto& hand : hand_in(log)) {
    moved.setZero();
    add(columns[hand.picture], amount);
    add(log.base[hand.picture], of_base);
    const auto& evidence = log.at.evidence[hand.picture];
    size.hand_m += (hand.jacobian * moved).squaredNorm();
    size.outline_px += moved.dot(evidence.A * moved) / slope_;
    weight += evidence.weight;
    depth += hand.depth;
    focal += fit_.log().rig().cameras[fit_.log().pictures()[hand.picture].camera].intrinsics.fx;
    pictures += 1.0;
  }
  if (pictures <= 0.0 || weight <= 0.0) return {};
  size.hand_m = std::sqrt(size.hand_m / pictures);
  size.outline_px = std::sqrt(std::max(0.0, size.outline_px / weight));
  size.outline_m = size.outline_px * depth / focal;
  return size;
}

void ModelSearch::polish(double block_s) {
  constexpr int kRounds = 4;
  constexpr double kNegligible_sd = 0.05;
  const bool known = polished_ && polished_->causes == causes_.size() && polished_->block_s == block_s;
  if (known && are_same(polished_->model, state_.model())) return;
  slope_ = fit_.slope(state_, search(), mean_variance_px2(noise_), raster_, options_.seed);
  spdlog::debug("diagnosis: slope {:.3f}", slope_);
  double last = 0.0;
  Eigen::VectorXd before = state_.x();
  for (int round = 0; round < kRounds; ++round) {
    const auto base = regression(about(block_s));
    const Eigen::VectorXd step = base.step().head(state_.size());
    const Eigen::VectorXd sd = base.covariance().diagonal().head(state_.size()).cwiseSqrt();
    const Eigen::VectorXd in_sd = step.cwiseQuotient(sd.cwiseMax(1e-300));
    // Towards an answer steps get shorter (natural monotonicity: Deuflhard, 1974). What is left of the pictures cannot
    // tell: it is least where nothing that is considered besides takes its share.
    if (round > 0 && in_sd.norm() >= last) {
      state_.set(before);
      break;
    }
    if (in_sd.cwiseAbs().maxCoeff() < kNegligible_sd) break;
    last = in_sd.norm();
    before = state_.x();
    state_.set(before + step);
  }
  polished_.emplace(Polished{state_.model(), causes_.size(), block_s});
}

void ModelSearch::look_for_lost_part() {
  const auto pictures = fit_.log().pictures();
  const auto at = fit_.linearise(state_.model(), {}, search());
  const auto part = lost_part(at);
  if (!part) return;
  std::vector<std::size_t> lost;
  for (const auto p : raster_) {
    if ((p < part->split) == part->at_first) lost.push_back(p);
  }
  if (lost.size() < 2 * static_cast<std::size_t>(state_.size())) return;
  State there = state_;
  fit_.fit(there,
           {.iterations = 12,
            .from_px = limits::kFrom_px,
            .finest_px = limits::kSearch_px,
            .spacing_px = options_.spacing_px},
           lost);
  const Eigen::VectorXd change = there.x() - state_.x();
  const double sign = part->at_first ? 1.0 : -1.0;  // a slip moves the joint against its offset, from its time on
  std::optional<State> best;
  FoundCause found;
  double cost = cost_ * (1.0 - limits::kLeastGain);
  for (Eigen::Index j = 0; j < state_.joints(); ++j) {
    const FoundCause slip{.name = {"slip", state_.parameters()[static_cast<std::size_t>(j)].name, ""},
                          .variable = {},
                          .from = pictures[part->split].joints.utime};
    State state = state_with({slip});
    state.set((part->at_first ? there : state_).model());
    Eigen::VectorXd x = state.x();
    const auto step = state.find("slip", {slip.name.joint, ""}, 0);
    if (step < 0) continue;
    x[step] = sign * change[j];
    state.set(x);
    const double own = fit(state, limits::kFrom_px);
    if (own >= cost) continue;
    cost = own;
    found = slip;
    best = std::move(state);
  }
  if (!best) return;
  // It explains the part only if the part is seen then.
  const auto now = fit_.linearise(best->model(), {}, search());
  const auto explained =
      std::count_if(lost.begin(), lost.end(), [&](std::size_t p) { return now.evidence[p].weight > 0.0; });
  if (static_cast<double>(explained) < limits::kLostContrast * static_cast<double>(lost.size())) return;
  spdlog::debug("diagnosis: a part of the log out of sight is explained by {}", found.name.text());
  state_ = std::move(*best);
  causes_ = {found};
  measure_noise();
  cost_ = fit(state_, 0.0);
}

}  // namespace bodyschema::diagnosis
