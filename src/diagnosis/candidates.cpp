#include "candidates.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "bodyschema/core/time.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

/// Physical. Of slower motion little is known but the encoder's steps.
constexpr double kLeastAcceleration = 5.0 * kPi / 180.0;  // rad/s^2 rms
constexpr double kLeastRange = 2.0 * kPi / 180.0;         // rad, of a joint whose angle a curve is to follow
/// Free curves over time go round so often at most: pictures come ten times a second, a joint's wobble may be quick.
constexpr int kMostPeriods = 24;

bool is_excluded(const std::vector<NotTestable>& excluded, const CauseName& cause) {
  return std::any_of(excluded.begin(), excluded.end(), [&](const auto& e) { return e.cause == cause; });
}

/// Zero mean and unit deviation, in radians of the joint.
std::vector<double> normalised(std::vector<double> value) {
  const double n = static_cast<double>(std::max<std::size_t>(1, value.size()));
  const double mean = std::accumulate(value.begin(), value.end(), 0.0) / n;
  double square = 0.0;
  for (double& x : value) {
    x -= mean;
    square += x * x;
  }
  const double deviation = std::sqrt(square / n);
  for (double& x : value) x = deviation > 1e-12 ? x / deviation : 0.0;
  return value;
}

double root_mean_square(const std::vector<double>& x) {
  return std::sqrt(std::inner_product(x.begin(), x.end(), x.begin(), 0.0) /
                   static_cast<double>(std::max<std::size_t>(1, x.size())));
}

/// Hat functions over the range of x, but for one, which the joint's offset makes up for.
std::vector<std::vector<double>> hats(const std::vector<double>& x, int knots) {
  auto sorted = x;
  std::sort(sorted.begin(), sorted.end());
  const double low = sorted[sorted.size() / 50], high = sorted[sorted.size() - 1 - sorted.size() / 50];
  std::vector<std::vector<double>> list;
  if (high - low < 1e-6) return list;
  const double width = (high - low) / (knots - 1);
  for (int k = 1; k < knots; ++k) {
    std::vector<double> hat(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) {
      hat[v] = std::max(0.0, 1.0 - std::abs(std::clamp(x[v], low, high) - (low + width * k)) / width);
    }
    list.push_back(std::move(hat));
  }
  return list;
}

/// What a joint did, picture by picture.
struct JointHistory {
  std::vector<double> time, angle, velocity, acceleration, torque;
};

JointHistory history(const LogAbout& log, Eigen::Index joint) {
  JointHistory h;
  for (const auto& instant : log.at.instants) {
    h.time.push_back(seconds(instant.utime - log.at.instants.front().utime));
    h.angle.push_back(instant.q[joint]);
    h.velocity.push_back(instant.qdot[joint]);
    h.acceleration.push_back(instant.qddot[joint]);
    if (instant.gravity_torque.size() > 0) h.torque.push_back(instant.gravity_torque[joint]);
  }
  return h;
}

struct Curve {
  std::string variable;
  std::vector<std::vector<double>> columns;
};

std::vector<Curve> curves_of(const JointHistory& h) {
  std::vector<Curve> list;
  const auto add = [&](const char* variable, std::vector<std::vector<double>> columns) {
    if (columns.empty()) return;
    for (auto& column : columns) column = normalised(std::move(column));
    list.push_back({variable, std::move(columns)});
  };
  const double duration = std::max(1e-9, h.time.back());
  const int periods = std::clamp(static_cast<int>(0.4 * duration), 3, kMostPeriods);
  for (int k = 1; k <= periods; ++k) {
    std::vector<double> s, c;
    for (const double t : h.time) {
      s.push_back(std::sin(2.0 * kPi * k * t / duration));
      c.push_back(std::cos(2.0 * kPi * k * t / duration));
    }
    add("time", {s, c});
  }
  add("time", hats(h.time, 7));
  std::vector<double> speed, square, cube;
  for (const double v : h.velocity) speed.push_back(std::abs(v));
  add("velocity", {h.velocity});
  add("velocity", {speed});
  if (root_mean_square(h.acceleration) > kLeastAcceleration) add("acceleration", {h.acceleration});
  const auto [low, high] = std::minmax_element(h.angle.begin(), h.angle.end());
  if (*high - *low > kLeastRange) {
    const double mean = std::accumulate(h.angle.begin(), h.angle.end(), 0.0) / static_cast<double>(h.angle.size());
    for (const double q : h.angle) {
      square.push_back(std::pow(q - mean, 2));
      cube.push_back(std::pow(q - mean, 3));
    }
    add("angle", {square, cube});
    add("angle", hats(h.angle, 7));
    add("angle", hats(h.angle, 11));
  }
  if (!h.torque.empty()) add("torque", hats(h.torque, 5));
  return list;
}

}  // namespace

double gradient(const OutlineEvidence& evidence, const Direction& direction) {
  double sum = 0.0;
  for (const auto& step : direction) sum += step.amount * evidence.b[step.coordinate];
  return sum;
}

double product(const OutlineEvidence& evidence, const Direction& a, const Direction& b) {
  double sum = 0.0;
  for (const auto& i : a) {
    for (const auto& j : b) sum += i.amount * j.amount * evidence.A(i.coordinate, j.coordinate);
  }
  return sum;
}

std::vector<BaseBlock> base_blocks(const LogAbout& log) {
  const auto n = static_cast<Eigen::Index>(log.base.empty() ? 0 : log.base.front().size());
  std::vector<BaseBlock> blocks(log.blocks, {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  for (std::size_t p = 0; p < log.base.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    auto& block = blocks[log.block_of[p]];
    const auto& evidence = log.at.evidence[p];
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto& a = log.base[p][static_cast<std::size_t>(i)];
      block.g[i] += log.precision[p] * gradient(evidence, a);
      for (Eigen::Index j = 0; j <= i; ++j) {
        const double own = log.precision[p] * product(evidence, a, log.base[p][static_cast<std::size_t>(j)]);
        block.H(i, j) += own;
        if (j != i) block.H(j, i) += own;
      }
    }
    block.square += log.precision[p] * evidence.square;
    block.weight += log.precision[p] * evidence.weight;
  }
  return blocks;
}

AddedColumns added_columns(const LogAbout& log, const std::vector<std::vector<Direction>>& directions) {
  const auto n = static_cast<Eigen::Index>(log.base.front().size());
  const auto k = static_cast<Eigen::Index>(directions.front().size());
  AddedColumns added(log.blocks, n, k);
  Eigen::VectorXd along;
  for (std::size_t p = 0; p < directions.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    const auto b = log.block_of[p];
    const auto& evidence = log.at.evidence[p];
    for (Eigen::Index j = 0; j < k; ++j) {
      const auto& direction = directions[p][static_cast<std::size_t>(j)];
      if (direction.empty()) continue;
      along.setZero(evidence.A.rows());
      for (const auto& step : direction) along += log.precision[p] * step.amount * evidence.A.col(step.coordinate);
      added.d[b][j] += log.precision[p] * gradient(evidence, direction);
      for (Eigen::Index i = 0; i < n; ++i) {
        for (const auto& step : log.base[p][static_cast<std::size_t>(i)])
          added.B[b](i, j) += step.amount * along[step.coordinate];
      }
      for (Eigen::Index i = 0; i < k; ++i) {
        for (const auto& step : directions[p][static_cast<std::size_t>(i)])
          added.C[b](i, j) += step.amount * along[step.coordinate];
      }
    }
  }
  return added;
}

std::vector<std::vector<Direction>> along_joint(const LogFit& fit, Eigen::Index joint,
                                                const std::vector<std::vector<double>>& amounts) {
  const auto coordinate = static_cast<std::uint32_t>(fit.coordinates().find({Coordinate::Kind::kJoint, joint}));
  std::vector<std::vector<Direction>> directions(amounts.front().size(), std::vector<Direction>(amounts.size()));
  for (std::size_t p = 0; p < directions.size(); ++p) {
    for (std::size_t k = 0; k < amounts.size(); ++k) directions[p][k] = {{coordinate, amounts[k][p]}};
  }
  return directions;
}

std::pair<double, double> seen_span(const LogFit& fit, const LinearLog& at) {
  double first = 0.0, last = 0.0;
  for (std::size_t p = 0; p < at.evidence.size(); ++p) {
    if (at.evidence[p].weight <= 0.0) continue;
    const double t = seconds(const_cast<LogFit&>(fit).log().pictures()[p].joints.utime);
    if (first == 0.0) first = t;
    last = t;
  }
  return {first, last};
}

std::vector<std::vector<Direction>> directions_of(LogFit& fit, const LogAbout& log, const Candidate& candidate) {
  const auto& roles = log.state.model().roles();
  if (candidate.generic()) return along_joint(fit, roles.index(candidate.cause.joint), candidate.amounts);
  ErrorModel model(roles);
  auto& effect = model.add(candidate.cause.name, {candidate.cause.joint, candidate.cause.source});
  const auto timing = effect_kind(candidate.cause.name).timing;
  if (timing == EffectTiming::kFromATime) effect.parameters()[1].value = seconds(candidate.from);
  if (timing == EffectTiming::kOverTheLog) {
    const auto [begin, end] = seen_span(fit, log.at);
    effect.parameters()[1].value = begin;
    effect.parameters()[2].value = end - begin;
  }
  return fit.directions(log.at, model, fitted_parameters(model));
}

std::vector<Candidate> catalogue_candidates(LogFit& fit, const LogAbout& log,
                                            const std::vector<NotTestable>& untestable) {
  const auto& roles = log.state.model().roles();
  const auto [begin, end] = seen_span(fit, log.at);
  std::vector<Candidate> list;
  ErrorModel catalogue(roles);
  for (const auto& kind : effect_kinds()) {
    if (kind.get().name == "joint_offset" || kind.get().where_believed) continue;
    if (kind.get().timing == EffectTiming::kFromATime) continue;
    for (const auto& target : kind.get().targets(roles)) {
      const CauseName cause{kind.get().name, target.joint, target.source};
      if (is_excluded(untestable, cause) || std::find(log.found.begin(), log.found.end(), cause) != log.found.end())
        continue;
      auto& effect = catalogue.add(cause.name, target);
      if (kind.get().timing == EffectTiming::kOverTheLog) {
        effect.parameters()[1].value = begin;
        effect.parameters()[2].value = end - begin;
      }
      Candidate candidate{.cause = cause, .variable = {}, .parameters = {}};
      std::size_t fitted = 0;
      for (const auto& p : std::as_const(effect).parameters()) {
        if (p.fitted) candidate.parameters.push_back(fitted++);
      }
      list.push_back(std::move(candidate));
    }
  }
  const auto all = fit.directions(log.at, catalogue, fitted_parameters(catalogue));
  std::size_t first = 0;
  for (auto& candidate : list) {
    std::vector<std::vector<Direction>> own(all.size());
    for (std::size_t p = 0; p < all.size(); ++p) {
      own[p].assign(all[p].begin() + static_cast<std::ptrdiff_t>(first),
                    all[p].begin() + static_cast<std::ptrdiff_t>(first + candidate.parameters.size()));
    }
    first += candidate.parameters.size();
    candidate.columns = added_columns(log, own);
  }
  return list;
}

std::vector<Candidate> free_curves(LogFit& fit, const LogAbout& log) {
  const auto& roles = log.state.model().roles();
  std::vector<Candidate> list;
  for (const auto joint : roles.arm) {
    for (auto& curve : curves_of(history(log, joint))) {
      Candidate candidate{.cause = {"unexplained", roles.names[static_cast<std::size_t>(joint)], ""},
                          .variable = curve.variable,
                          .parameters = std::vector<std::size_t>(curve.columns.size())};
      std::iota(candidate.parameters.begin(), candidate.parameters.end(), std::size_t{0});
      candidate.columns = added_columns(log, along_joint(fit, joint, curve.columns));
      candidate.amounts = std::move(curve.columns);
      list.push_back(std::move(candidate));
    }
  }
  return list;
}

Slips slips(const LogAbout& log, const BlockRegression& base, const std::vector<NotTestable>& untestable,
            bool at_every_picture) {
  const auto n = base.size();
  const auto& parameters = log.state.parameters();
  const auto pictures = log.base.size();
  Slips result;
  for (Eigen::Index j = 0; j < log.state.joints(); ++j) {
    const CauseName cause{"slip", parameters[static_cast<std::size_t>(j)].name, ""};
    if (is_excluded(untestable, cause) || std::find(log.found.begin(), log.found.end(), cause) != log.found.end())
      continue;
    // A slip is an offset, with the opposite sign, of the pictures from a time on: from the last one back to the first.
    AddedColumns tail(log.blocks, n, 1);
    std::optional<Candidate> best;
    double most = -1.0;
    for (std::size_t p = pictures; p-- > 1;) {
      if (log.precision[p] > 0.0) {
        const auto b = log.block_of[p];
        const auto& own = log.base[p][static_cast<std::size_t>(j)];
        for (Eigen::Index i = 0; i < n; ++i) {
          tail.B[b](i, 0) -=
              log.precision[p] * product(log.at.evidence[p], log.base[p][static_cast<std::size_t>(i)], own);
        }
        tail.C[b](0, 0) += log.precision[p] * product(log.at.evidence[p], own, own);
        tail.d[b][0] -= log.precision[p] * gradient(log.at.evidence[p], own);
      }
      if (log.at.instants[p].utime == log.at.instants[p - 1].utime || log.precision[p] <= 0.0) continue;
      if (!at_every_picture && log.block_of[p] == log.block_of[p - 1]) continue;
      result.all.push_back(base.score(tail));
      const auto& scores = result.all.back();
      // When it was is where it explains most (maximum likelihood): how far it stands out hardly says.
      const double explained = scores.total[0] * scores.total[0] / std::max(1e-300, scores.S(0, 0));
      if (scores.independent[0] > limits::kRounding && explained > most) {
        most = explained;
        best = Candidate{.cause = cause, .variable = {}, .parameters = {0}, .from = log.at.instants[p].utime};
        best->columns = tail;
        best->scores = scores;
      }
    }
    if (best) result.best.push_back(std::move(*best));
  }
  return result;
}

std::vector<Candidate> stated_slips(LogFit& fit, const LogAbout& log, const BlockRegression& base,
                                    const std::vector<Microseconds>& times) {
  std::vector<Candidate> list;
  for (const auto time : times) {
    for (Eigen::Index j = 0; j < log.state.joints(); ++j) {
      const CauseName cause{"slip", log.state.parameters()[static_cast<std::size_t>(j)].name, ""};
      if (std::find(log.found.begin(), log.found.end(), cause) != log.found.end()) continue;
      Candidate candidate{.cause = cause, .variable = {}, .parameters = {0}, .from = time, .stated = true};
      candidate.columns = added_columns(log, directions_of(fit, log, candidate));
      candidate.scores = base.score(candidate.columns);
      list.push_back(std::move(candidate));
    }
  }
  return list;
}

bool is_told(const Candidate& candidate, const JointRoles& roles, double threshold) {
  const auto effect = make_effect(candidate.cause.name, {candidate.cause.joint, candidate.cause.source}, roles);
  Eigen::Index i = 0;
  for (const auto& p : std::as_const(*effect).parameters()) {
    if (!p.fitted) continue;
    const double t = student_quantile(normal_tail(threshold), candidate.scores.dof[i]);
    if (t < limits::kImplausible * p.typical * std::sqrt(std::max(0.0, candidate.scores.S(i, i)))) return true;
    ++i;
  }
  return false;
}

}  // namespace bodyschema::diagnosis
