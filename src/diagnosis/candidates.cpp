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

const Eigen::MatrixXd& AgainstBase::of(std::size_t picture) {
  const auto& A = log_.at.evidence[picture].A;
  const auto& base = log_.base[picture];
  columns_.setZero(A.rows(), static_cast<Eigen::Index>(base.size()));
  for (std::size_t i = 0; i < base.size(); ++i) {
    for (const auto& step : base[i]) {
      columns_.col(static_cast<Eigen::Index>(i)) += log_.precision[picture] * step.amount * A.col(step.coordinate);
    }
  }
  // Sums over the base run along its columns.
  rows_ = columns_.transpose();
  return rows_;
}

std::vector<BaseBlock> base_blocks(const LogAbout& log) {
  const auto n = static_cast<Eigen::Index>(log.base.empty() ? 0 : log.base.front().size());
  std::vector<BaseBlock> blocks(log.blocks, {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  AgainstBase against(log);
  for (std::size_t p = 0; p < log.base.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    auto& block = blocks[log.block_of[p]];
    const auto& evidence = log.at.evidence[p];
    const auto& rows = against.of(p);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto& own = log.base[p][static_cast<std::size_t>(j)];
      block.g[j] += log.precision[p] * gradient(evidence, own);
      for (const auto& step : own) block.H.col(j) += step.amount * rows.col(step.coordinate);
    }
    block.square += log.precision[p] * evidence.square;
  }
  for (auto& block : blocks) block.H.triangularView<Eigen::StrictlyUpper>() = block.H.transpose();
  return blocks;
}

std::vector<AddedColumns> added_columns(const LogAbout& log, const std::vector<std::vector<Direction>>& directions,
                                        const std::vector<std::size_t>& widths) {
  std::vector<AddedColumns> list;
  const auto n = static_cast<Eigen::Index>(log.base.front().size());
  for (const auto width : widths) list.emplace_back(log.blocks, n, static_cast<Eigen::Index>(width));
  AgainstBase against(log);
  for (std::size_t p = 0; p < directions.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    const auto b = log.block_of[p];
    const auto& evidence = log.at.evidence[p];
    const auto& rows = against.of(p);
    auto own = directions[p].begin();
    for (auto& added : list) {
      for (Eigen::Index j = 0; j < added.size(); ++j) {
        for (const auto& step : own[j]) added.B[b].col(j) += step.amount * rows.col(step.coordinate);
        added.d[b][j] += log.precision[p] * gradient(evidence, own[j]);
        for (Eigen::Index i = 0; i <= j; ++i) added.C[b](i, j) += log.precision[p] * product(evidence, own[i], own[j]);
      }
      own += added.size();
    }
  }
  for (auto& added : list) {
    for (auto& C : added.C) C.triangularView<Eigen::StrictlyLower>() = C.transpose();
  }
  return list;
}

AddedColumns added_columns(const LogAbout& log, const std::vector<std::vector<Direction>>& directions) {
  return std::move(added_columns(log, directions, {directions.front().size()}).front());
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
  std::vector<std::size_t> widths;
  for (const auto& candidate : list) widths.push_back(candidate.parameters.size());
  auto columns = added_columns(log, fit.directions(log.at, catalogue, fitted_parameters(catalogue)), widths);
  for (std::size_t c = 0; c < list.size(); ++c) list[c].columns = std::move(columns[c]);
  return list;
}

std::vector<Candidate> free_curves(LogFit& fit, const LogAbout& log) {
  const auto& roles = log.state.model().roles();
  const auto n = static_cast<Eigen::Index>(log.base.front().size());
  std::vector<Candidate> list;
  std::vector<Eigen::Index> coordinate;  // that each of them moves
  for (const auto joint : roles.arm) {
    for (auto& curve : curves_of(history(log, joint))) {
      Candidate candidate{.cause = {"unexplained", roles.names[static_cast<std::size_t>(joint)], ""},
                          .variable = curve.variable,
                          .parameters = std::vector<std::size_t>(curve.columns.size())};
      std::iota(candidate.parameters.begin(), candidate.parameters.end(), std::size_t{0});
      candidate.columns = AddedColumns(log.blocks, n, static_cast<Eigen::Index>(curve.columns.size()));
      candidate.amounts = std::move(curve.columns);
      list.push_back(std::move(candidate));
      coordinate.push_back(fit.coordinates().find({Coordinate::Kind::kJoint, joint}));
    }
  }
  AgainstBase against(log);
  for (std::size_t p = 0; p < log.base.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    const auto b = log.block_of[p];
    const auto& rows = against.of(p);
    for (std::size_t c = 0; c < list.size(); ++c) {
      const auto at = coordinate[c];
      const auto& amounts = list[c].amounts;
      Eigen::VectorXd own(static_cast<Eigen::Index>(amounts.size()));
      for (std::size_t k = 0; k < amounts.size(); ++k) own[static_cast<Eigen::Index>(k)] = amounts[k][p];
      auto& columns = list[c].columns;
      columns.B[b].noalias() += rows.col(at) * own.transpose();
      columns.C[b] += (log.precision[p] * log.at.evidence[p].A(at, at)) * own * own.transpose();
      columns.d[b] += (log.precision[p] * log.at.evidence[p].b[at]) * own;
    }
  }
  return list;
}

namespace {

/// What one picture says of the offset of every arm joint.
struct OffsetSums {
  Eigen::MatrixXd B;     ///< base x joints
  Eigen::VectorXd C, d;  ///< by joint
};

std::vector<OffsetSums> offset_sums(const LogAbout& log) {
  std::vector<OffsetSums> sums(log.base.size());
  const auto n = static_cast<Eigen::Index>(log.base.front().size()), joints = log.state.joints();
  AgainstBase against(log);
  for (std::size_t p = 0; p < sums.size(); ++p) {
    if (log.precision[p] <= 0.0) continue;
    const auto& rows = against.of(p);
    sums[p] = {Eigen::MatrixXd::Zero(n, joints), Eigen::VectorXd(joints), Eigen::VectorXd(joints)};
    for (Eigen::Index j = 0; j < joints; ++j) {
      const auto& own = log.base[p][static_cast<std::size_t>(j)];
      for (const auto& step : own) sums[p].B.col(j) += step.amount * rows.col(step.coordinate);
      sums[p].C[j] = log.precision[p] * product(log.at.evidence[p], own, own);
      sums[p].d[j] = log.precision[p] * gradient(log.at.evidence[p], own);
    }
  }
  return sums;
}

/// A slip is an offset, with the opposite sign, of the pictures from a time on.
void add_slipped(const LogAbout& log, const std::vector<OffsetSums>& sums, std::size_t picture, Eigen::Index joint,
                 AddedColumns& slip) {
  if (log.precision[picture] <= 0.0) return;
  const auto b = log.block_of[picture];
  slip.B[b] -= sums[picture].B.col(joint);
  slip.C[b](0, 0) += sums[picture].C[joint];
  slip.d[b][0] -= sums[picture].d[joint];
}

}  // namespace

Slips slips(const LogAbout& log, const BlockRegression& base, const std::vector<NotTestable>& untestable,
            bool at_every_picture) {
  const auto n = base.size();
  const auto& parameters = log.state.parameters();
  const auto pictures = log.base.size();
  const auto sums = offset_sums(log);
  Slips result;
  for (Eigen::Index j = 0; j < log.state.joints(); ++j) {
    const CauseName cause{"slip", parameters[static_cast<std::size_t>(j)].name, ""};
    if (is_excluded(untestable, cause) || std::find(log.found.begin(), log.found.end(), cause) != log.found.end())
      continue;
    // From the last picture back to the first.
    AddedColumns tail(log.blocks, n, 1);
    std::vector<AddedColumns> tails;
    std::vector<Microseconds> times;
    for (std::size_t p = pictures; p-- > 1;) {
      add_slipped(log, sums, p, j, tail);
      if (log.at.instants[p].utime == log.at.instants[p - 1].utime || log.precision[p] <= 0.0) continue;
      if (!at_every_picture && log.block_of[p] == log.block_of[p - 1]) continue;
      tails.push_back(tail);
      times.push_back(log.at.instants[p].utime);
    }
    auto scores = base.score(tails, false);
    // When it was is where it explains most (maximum likelihood): how far it stands out hardly says.
    std::optional<std::size_t> best;
    double most = -1.0;
    for (std::size_t t = 0; t < tails.size(); ++t) {
      const double explained = scores[t].total[0] * scores[t].total[0] / std::max(1e-300, scores[t].S(0, 0));
      if (scores[t].independent[0] <= limits::kRounding || explained <= most) continue;
      most = explained;
      best = t;
    }
    if (best) {
      result.best.push_back(Candidate{.cause = cause, .variable = {}, .parameters = {0}, .from = times[*best]});
      result.best.back().scores = base.score(tails[*best]);
      result.best.back().columns = std::move(tails[*best]);
    }
    std::move(scores.begin(), scores.end(), std::back_inserter(result.all));
  }
  return result;
}

std::vector<Candidate> stated_slips(const LogAbout& log, const BlockRegression& base,
                                    const std::vector<Microseconds>& times) {
  const auto sums = offset_sums(log);
  std::vector<Candidate> list;
  for (const auto time : times) {
    for (Eigen::Index j = 0; j < log.state.joints(); ++j) {
      const CauseName cause{"slip", log.state.parameters()[static_cast<std::size_t>(j)].name, ""};
      if (std::find(log.found.begin(), log.found.end(), cause) != log.found.end()) continue;
      Candidate candidate{.cause = cause, .variable = {}, .parameters = {0}, .from = time, .stated = true};
      candidate.columns = AddedColumns(log.blocks, base.size(), 1);
      for (std::size_t p = 0; p < sums.size(); ++p) {
        if (log.at.instants[p].utime >= time) add_slipped(log, sums, p, j, candidate.columns);
      }
      candidate.scores = base.score(candidate.columns);
      list.push_back(std::move(candidate));
    }
  }
  return list;
}

double largest_plausible(const LogAbout& log, const Effect& effect, const EffectParameter& parameter) {
  const double largest = limits::kImplausible * parameter.typical;
  const auto& joint = effect.target().joint;
  if (!effect.follows_gravity() || joint.empty()) return largest;
  const auto& roles = log.state.model().roles();
  const auto at = roles.index(joint);
  double torque_nm = 0.0;
  for (const auto& instant : log.at.instants) {
    if (instant.gravity_torque.size() > 0) torque_nm = std::max(torque_nm, std::abs(instant.gravity_torque[at]));
  }
  const auto offset = make_effect("joint_offset", {joint, ""}, roles);
  const double angle = limits::kImplausible * std::as_const(*offset).parameters()[0].typical;
  return std::max(largest, torque_nm > 0.0 ? angle / torque_nm : 0.0);
}

bool is_told(const LogAbout& log, const Candidate& candidate, double threshold) {
  const auto& roles = log.state.model().roles();
  const auto effect = make_effect(candidate.cause.name, {candidate.cause.joint, candidate.cause.source}, roles);
  Eigen::Index i = 0;
  for (const auto& p : std::as_const(*effect).parameters()) {
    if (!p.fitted) continue;
    const double t = student_quantile(normal_tail(threshold), candidate.scores.dof[i]);
    if (t < largest_plausible(log, *effect, p) * std::sqrt(std::max(0.0, candidate.scores.S(i, i)))) return true;
    ++i;
  }
  return false;
}

}  // namespace bodyschema::diagnosis
