#include "bodyschema/evidence/log_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <random>
#include <set>
#include <thread>
#include <utility>

namespace bodyschema {
namespace {

/// A picture in which fewer points of the outline are found shows something else.
constexpr double kFewestPoints = 20.0;
constexpr double kLeastShare = 0.3;
/// Of ways that are tried for the slope, both ends each: with some hundred pictures it is known to a few hundredths.
constexpr int kWays = 2;
constexpr double kLeastSlope = 0.25;  ///< less is no slope that a step could rely on
constexpr double kNarrow = 0.75;      ///< of the search, a step

/// Plays the encoder log: `observe` sees every sample up to each picture, then `visit` the picture.
template <class Observe, class Visit>
void play(const PictureLog& log, Observe observe, Visit visit) {
  const auto encoders = log.encoders();
  std::size_t next = 0;
  for (std::size_t p = 0; p < log.pictures().size(); ++p) {
    const auto until = log.pictures()[p].joints.utime;
    for (; next < encoders.size() && encoders[next].utime <= until; ++next) observe(encoders[next]);
    visit(p);
  }
}

/// A state that a fit has tried.
struct Trial {
  Eigen::VectorXd x;
  LinearLog at;
  double cost = 0.0;  ///< with the beliefs' share, per outline point
};

/// Levenberg's and Marquardt's step.
struct DampedStep {
  Eigen::VectorXd x;
  double promised;  ///< chi-square that it takes off, were all as straight as it is about the trial
};

/// @param precision, away  of the beliefs, and of the state from them
DampedStep damped_step(const std::vector<StateEvidence>& pictures, double variance_px2,
                       const Eigen::VectorXd& precision, const Eigen::VectorXd& away, double damping) {
  Eigen::MatrixXd H = precision.asDiagonal();
  Eigen::VectorXd g = -precision.cwiseProduct(away);
  for (const auto& e : pictures) {
    H += e.A / variance_px2;
    g += e.b / variance_px2;
  }
  // Scaled to a unit diagonal: parameters have different units.
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd S = scale.asDiagonal() * H * scale.asDiagonal();
  S.diagonal().array() += damping;
  const Eigen::VectorXd x = scale.asDiagonal() * S.ldlt().solve(scale.asDiagonal() * g);
  return {x, 2.0 * x.dot(g) - x.dot(H * x)};
}

}  // namespace

double LinearLog::rms_px() const {
  double square = 0.0, weight = 0.0;
  for (const auto& e : evidence) {
    square += e.square;
    weight += e.weight;
  }
  return weight > 0.0 ? std::sqrt(square / weight) : 0.0;
}

double LinearLog::sampled() const {
  double points = 0.0;
  for (const auto& e : evidence) points += e.sampled;
  return points;
}

double LinearLog::matched_share() const {
  double matched = 0.0;
  for (const auto& e : evidence) matched += e.matched;
  const double points = sampled();
  return points > 0.0 ? matched / points : 0.0;
}

void StateEvidence::add(const StateEvidence& other, double factor) {
  if (A.size() == 0) {
    A.setZero(other.A.rows(), other.A.cols());
    b.setZero(other.b.size());
  }
  A += factor * other.A;
  b += factor * other.b;
  square += factor * other.square;
  weight += factor * other.weight;
}

LogFit::LogFit(PictureLog& log, int threads) : log_(log), workers_(static_cast<std::size_t>(std::max(1, threads))) {
  refresh();
}

void LogFit::refresh() {
  for (auto& worker : workers_) {
    worker = std::make_unique<OutlineMeasurement>(log_.robot(), log_.setup(), log_.rig(), log_.roles());
  }
  weigh_parts();
}

void LogFit::weigh_parts() {
  constexpr double kStill = 1e-3;  // m, and rad
  constexpr double kSamePosture_rad = 0.05;
  auto& projection = workers_.front()->projection();
  const auto nothing = log_.roles().no_corrections();
  part_weight_.clear();
  std::vector<bool> still(projection.part_count(), true);
  std::vector<std::vector<Pose>> first(projection.camera_count());
  Eigen::VectorXd posture;
  double postures = 0.0;
  for (const auto& picture : log_.pictures()) {
    projection.place(picture.joints.q, nothing, picture.camera);
    const auto links = projection.links();
    auto& reference = first[picture.camera];
    if (reference.empty()) reference.assign(links.begin(), links.end());
    for (std::size_t l = 0; l < still.size(); ++l) {
      if ((links[l].matrix() - reference[l].matrix()).cwiseAbs().maxCoeff() > kStill) still[l] = false;
    }
    if (posture.size() > 0 && (picture.joints.q - posture).cwiseAbs().maxCoeff() < kSamePosture_rad) continue;
    posture = picture.joints.q;
    postures += 1.0;
  }
  const auto shown = log_.parts_shown();
  if (postures < 2.0 && left_out_.empty()) return;
  for (std::size_t l = 0; l < still.size(); ++l) {
    const bool silent = !shown[l] || (!left_out_.empty() && left_out_[l]);
    part_weight_.push_back(silent ? 0.0 : still[l] ? 1.0 / std::max(1.0, postures) : 1.0);
  }
}

void LogFit::leave_out(std::vector<bool> parts) {
  left_out_ = std::move(parts);
  weigh_parts();
}

LogFit::~LogFit() = default;

const Coordinates& LogFit::coordinates() const {
  return workers_.front()->coordinates();
}

LinearLog LogFit::predict(const ErrorModel& model, std::span<const std::uint32_t> coordinates,
                          std::span<const std::size_t> pictures) {
  LinearLog result;
  const auto count = log_.pictures().size();
  std::vector<char> wanted(count, pictures.empty() ? 1 : 0);
  for (const auto p : pictures) wanted[p] = 1;
  result.coordinates.assign(coordinates.begin(), coordinates.end());
  result.instants.resize(count);
  result.corrections.assign(count, model.roles().no_corrections());
  result.evidence.resize(count);
  auto playing = model;
  playing.forget();
  bool sags = false;
  for (std::size_t e = 0; e < model.size(); ++e) sags = sags || model[e].follows_gravity();
  const auto offsets = model.offsets();
  Instant sagged;
  play(
      log_, [&](const JointSample& sample) { playing.observe(sample); },
      [&](std::size_t p) {
        if (wanted[p] == 0) return;
        log_.instant(p, offsets, result.instants[p]);
        auto& instant = result.instants[p];
        if (!sags) {
          playing.corrections(instant, result.corrections[p]);
          return;
        }
        settle_under_gravity(
            [&]() -> const Eigen::VectorXd& {
              playing.corrections(instant, result.corrections[p]);
              return result.corrections[p].dq;
            },
            [&](const Eigen::VectorXd& dq) {
              log_.instant(p, -dq, sagged);
              instant.gravity_torque = sagged.gravity_torque;
              instant.payload_torque = sagged.payload_torque;
            });
      });
  return result;
}

LinearLog LogFit::linearise(const ErrorModel& model, std::span<const std::uint32_t> coordinates,
                            const OutlineSearch& search, std::span<const std::size_t> pictures,
                            const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look) {
  LinearLog result = predict(model, coordinates);
  measure(result, search, pictures, look);
  return result;
}

void LogFit::measure(LinearLog& result, const OutlineSearch& search, std::span<const std::size_t> pictures,
                     const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look) {
  const auto& coordinates = result.coordinates;
  const auto count = log_.pictures().size();
  std::vector<char> wanted(count, pictures.empty() ? 1 : 0);
  for (const auto p : pictures) wanted[p] = 1;
  OutlineSearch weighed = search;
  weighed.part_weight = part_weight_;
  std::atomic<std::size_t> next{0};
  const auto work = [&](OutlineMeasurement& measurement) {
    for (std::size_t p; (p = next++) < count;) {
      auto& evidence = result.evidence[p];
      if (wanted[p] == 0) {
        if (evidence.A.size() == 0) evidence.clear(static_cast<Eigen::Index>(coordinates.size()));
        continue;
      }
      const auto& picture = log_.pictures()[p];
      measurement.linearise(log_.edges(p), picture.joints.q, result.corrections[p], picture.camera, coordinates,
                            weighed, evidence);
      if (evidence.matched < kFewestPoints || evidence.matched_share() < kLeastShare) {
        const auto blind = std::exchange(evidence, {});
        evidence.clear(static_cast<Eigen::Index>(coordinates.size()));
        evidence.cost = blind.cost;
        evidence.misfit = blind.misfit;
        evidence.sampled = blind.sampled;
      } else if (look) {
        look(p, measurement.points());
      }
    }
  };
  std::vector<std::jthread> threads;
  for (std::size_t t = 1; t < workers_.size(); ++t) threads.emplace_back([&, t] { work(*workers_[t]); });
  work(*workers_.front());
}

std::vector<std::vector<Direction>> LogFit::directions(const LinearLog& at, const ErrorModel& model,
                                                       const std::vector<ParameterRef>& parameters) {
  EffectProbes probes(model, parameters, coordinates());
  std::vector<std::vector<Direction>> result(log_.pictures().size());
  play(
      log_, [&](const JointSample& sample) { probes.observe(sample); },
      [&](std::size_t p) { probes.directions(at.instants[p], result[p]); });
  return result;
}

std::vector<StateEvidence> LogFit::project(const LinearLog& at, const ErrorModel& model,
                                           const std::vector<ParameterRef>& parameters) {
  const auto n = static_cast<Eigen::Index>(parameters.size()), m = static_cast<Eigen::Index>(at.coordinates.size());
  std::vector<Eigen::Index> position(static_cast<std::size_t>(coordinates().size()), -1);
  for (std::size_t i = 0; i < at.coordinates.size(); ++i) position[at.coordinates[i]] = static_cast<Eigen::Index>(i);
  const auto all = directions(at, model, parameters);
  std::vector<StateEvidence> result(at.evidence.size());
  Eigen::MatrixXd J(m, n);
  for (std::size_t p = 0; p < result.size(); ++p) {
    const auto& evidence = at.evidence[p];
    if (evidence.weight <= 0.0) {
      result[p].A.setZero(n, n);
      result[p].b.setZero(n);
      continue;
    }
    J.setZero();
    for (Eigen::Index k = 0; k < n; ++k) {
      for (const auto& step : all[p][static_cast<std::size_t>(k)]) {
        if (const auto i = position[step.coordinate]; i >= 0) J(i, k) = step.amount;
      }
    }
    result[p] = {J.transpose() * evidence.A * J, J.transpose() * evidence.b, evidence.square, evidence.weight};
  }
  return result;
}

double LogFit::slope(const State& state, const OutlineSearch& search, double variance_px2,
                     std::span<const std::size_t> pictures, std::uint64_t seed) {
  const auto parameters = state.refs();
  const auto coordinates = moved_by(state.model(), parameters);
  const auto sum_at = [&](const Eigen::VectorXd& x) {
    State there = state;
    there.set(x);
    StateEvidence sum{Eigen::MatrixXd::Zero(x.size(), x.size()), Eigen::VectorXd::Zero(x.size())};
    for (const auto& picture :
         project(linearise(there.model(), coordinates, search, pictures), there.model(), parameters)) {
      sum.add(picture, 1.0 / variance_px2);
    }
    return sum;
  };
  const Eigen::VectorXd x = state.x();
  const Eigen::MatrixXd A = sum_at(x).A;
  Eigen::MatrixXd H = A;
  H.diagonal() += state.prior_sd().array().square().inverse().matrix();
  const Eigen::LLT<Eigen::MatrixXd> root(H);
  std::mt19937_64 random(seed);
  double fell = 0.0, said = 0.0;
  for (int way = 0; way < kWays; ++way) {
    // As likely in all directions, told or not.
    const Eigen::VectorXd signs =
        Eigen::VectorXd::NullaryExpr(x.size(), [&] { return random() % 2 == 0 ? 1.0 : -1.0; });
    const Eigen::VectorXd step = root.matrixU().solve(signs);
    fell += step.dot(sum_at(x - step).b - sum_at(x + step).b);
    said += 2.0 * step.dot(A * step);
  }
  return said > 0.0 ? std::clamp(fell / said, kLeastSlope, 1.0) : 1.0;
}

std::vector<OutlineNoise> LogFit::noise(const ErrorModel& model, const OutlineSearch& search,
                                        const OutlineNoise::Prior& prior, std::span<const std::size_t> pictures) {
  std::vector<std::vector<OutlinePoint>> points(log_.pictures().size());
  linearise(model, {}, search, pictures,
            [&](std::size_t p, std::span<const OutlinePoint> seen) { points[p].assign(seen.begin(), seen.end()); });
  std::vector<OutlineNoise> noise(log_.rig().cameras.size(), OutlineNoise(prior));
  for (std::size_t p = 0; p < points.size(); ++p) {
    if (!points[p].empty()) noise[log_.pictures()[p].camera].add(points[p], log_.unit_px(p));
  }
  return noise;
}

std::vector<std::uint32_t> LogFit::moved_by(const ErrorModel& model, const std::vector<ParameterRef>& parameters) {
  // What moves where depends on the model alone, but for effects that rest with the arm: all pictures are asked.
  LinearLog at;
  at.instants.resize(log_.pictures().size());
  const auto offsets = model.offsets();
  for (std::size_t p = 0; p < at.instants.size(); ++p) log_.instant(p, offsets, at.instants[p]);
  std::set<std::uint32_t> moved;
  for (const auto& picture : directions(at, model, parameters)) {
    for (const auto& direction : picture) {
      for (const auto& step : direction) moved.insert(step.coordinate);
    }
  }
  return {moved.begin(), moved.end()};
}

double LogFit::mean_cost(const LinearLog& at, double usual_points, double OutlineEvidence::*cost) const {
  double sum = 0.0, points = 0.0, worst = 0.0;
  for (std::size_t p = 0; p < at.evidence.size(); ++p) {
    const auto& evidence = at.evidence[p];
    if (evidence.sampled <= 0.0) continue;
    const double own = evidence.*cost / std::pow(log_.unit_px(p), 2);
    sum += own;
    points += evidence.sampled;
    worst = std::max(worst, own / evidence.sampled);
  }
  // Nothing is predicted in any picture: that fits no log, though nothing lies off.
  if (points <= 0.0) return std::numeric_limits<double>::infinity();
  // Some of the outline always comes and goes; much of it gone is no better fit.
  constexpr double kUsualLoss = 0.1;
  const double lost = std::max(0.0, (1.0 - kUsualLoss) * usual_points - points);
  return (sum + worst * lost) / (points + lost);
}

double LogFit::fit(State& state, const FitSettings& settings, std::span<const std::size_t> pictures) {
  const auto parameters = state.refs();
  const auto coordinates = moved_by(state.model(), parameters);
  const Eigen::VectorXd precision = state.prior_sd().array().square().inverse();

  double usual_points = 0.0;
  const auto look = [&](const Eigen::VectorXd& x, double search_px) {
    const bool near = search_px <= settings.finest_px;
    Trial trial{x, {}, 0.0};
    state.set(x);
    trial.x = state.x();
    const double robust_px = near ? settings.robust_px : std::max(settings.robust_px, 0.5 * search_px);
    trial.at = linearise(state.model(), coordinates,
                         {.search_px = search_px, .spacing_px = settings.spacing_px, .robust_px = robust_px}, pictures);
    if (usual_points <= 0.0) usual_points = trial.at.sampled();
    const Eigen::VectorXd away = trial.x - state.prior_mean();
    trial.cost = mean_cost(trial.at, usual_points, near ? &OutlineEvidence::cost : &OutlineEvidence::misfit) +
                 settings.variance_px2 * away.cwiseAbs2().dot(precision) / std::max(1.0, usual_points);
    return trial;
  };
  const auto step = [&](const Trial& trial, double damping) {
    state.set(trial.x);
    return damped_step(project(trial.at, state.model(), parameters), settings.variance_px2, precision,
                       trial.x - state.prior_mean(), damping);
  };

  Trial best = look(state.x(), std::max(settings.finest_px, settings.from_px));
  if (settings.from_px > settings.finest_px) {
    // From afar the way to the outlines may lead over worse places: every step is taken, the best kept.
    Trial trial = best;
    for (double search_px = settings.from_px;; search_px = std::max(settings.finest_px, kNarrow * search_px)) {
      trial = look(trial.x + step(trial, 1e-3).x, search_px);
      if (trial.cost < best.cost) best = trial;
      if (search_px <= settings.finest_px) break;
    }
    best = look(best.x, settings.finest_px);
  }
  double damping = 1e-6, lowest = best.cost;
  int retreats = 0, idle = 0;
  for (int i = 0; i < settings.iterations && retreats < 5;) {
    // Points of an outline come and go: near the end the cost goes up and down by some ten thousandths.
    constexpr double kWorse = 1e-3, kLower = 1e-4;  // shares
    constexpr int kIdle = 2;                        // steps that do not lower it
    const DampedStep next = step(best, damping);
    const double promised = settings.variance_px2 * next.promised / std::max(1.0, usual_points);
    if (promised < settings.least_promise * best.cost) break;
    Trial trial = look(best.x + next.x, settings.finest_px);
    if (trial.cost > (1.0 + kWorse) * best.cost) {
      if (promised < 10.0 * settings.least_promise * best.cost) break;  // no step is too long for so little
      damping = std::max(1e-3, 10.0 * damping);
      ++retreats;
      continue;
    }
    const double gained = best.cost - trial.cost;
    best = std::move(trial);
    damping *= 0.1;
    retreats = 0;
    ++i;
    if (settings.progress) settings.progress(static_cast<double>(i) / settings.iterations);
    idle = best.cost < (1.0 - kLower) * lowest ? 0 : idle + 1;
    lowest = std::min(lowest, best.cost);
    if (idle >= kIdle || std::abs(gained) < 1e-5 * best.cost) break;
  }
  state.set(best.x);
  return best.cost;
}

}  // namespace bodyschema
