#include "findings.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>

#include "agreed_motion.hpp"
#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "bodyschema/evidence/encoder_noise.hpp"
#include "left_over.hpp"
#include "limits.hpp"
#include "surplus.hpp"

namespace bodyschema::diagnosis {
namespace {

Eigen::MatrixXd sum_of(const std::vector<Eigen::MatrixXd>& parts) {
  Eigen::MatrixXd sum = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) sum += parts[i];
  return sum;
}

std::vector<Eigen::Index> all_but(Eigen::Index n, const std::vector<Eigen::Index>& out) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (std::find(out.begin(), out.end(), i) == out.end()) kept.push_back(i);
  }
  return kept;
}

/// Values of a cause's parameters in the model; a free curve has none: it stands in the regression alone.
Eigen::VectorXd values_of(const ModelSearch& search, const std::vector<Eigen::Index>& columns) {
  const Eigen::VectorXd x = search.state().x();
  Eigen::VectorXd values = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i) {
    if (columns[i] < x.size()) values[static_cast<Eigen::Index>(i)] = x[columns[i]];
  }
  return values;
}

/// How far all that is seen may be shifted and turned as a whole, and one joint be turned, where no picture tells: so
/// wide that it only keeps what is not told from running off.
constexpr double kShift_m = 0.02, kTurn_rad = 0.1;

/// Shift and turn of the rig, three each.
std::vector<std::uint32_t> rig_coordinates(const Coordinates& coordinates) {
  std::vector<std::uint32_t> list;
  for (const auto kind : {Coordinate::Kind::kRigShift, Coordinate::Kind::kRigTurn}) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      list.push_back(static_cast<std::uint32_t>(coordinates.find({kind, axis})));
  }
  return list;
}

/// The motion of what is seen as a whole that would explain what is left.
Eigen::VectorXd motion_of_all(Eigen::MatrixXd A, const Eigen::VectorXd& b, double precision) {
  A.diagonal().head<3>().array() += 1.0 / (precision * kShift_m * kShift_m);
  A.diagonal().tail<3>().array() += 1.0 / (precision * kTurn_rad * kTurn_rad);
  return A.ldlt().solve(b);
}

/// How much worse another explanation is, in standard deviations of the difference: on blocks that neither has seen,
/// and in how far nuisances must depart from what is believed of them for it (log likelihoods that are d apart in the
/// mean differ by a variance of 4 d).
double worse_by(const Heldout& other, const Heldout& best) {
  const Eigen::VectorXd d = other.loss - best.loss;
  const double n = static_cast<double>(d.size()), beliefs = other.beliefs - best.beliefs;
  if (n < 2) return 0.0;
  const double variance = (d.array() - d.mean()).square().sum() * n / (n - 1.0) + 4.0 * std::abs(beliefs);
  return variance > 0.0 ? (d.sum() + beliefs) / std::sqrt(variance) : 0.0;
}

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

}  // namespace

Reduced without(const ModelSearch& search, const BlockRegression& all, const std::vector<Eigen::Index>& out) {
  auto kept = all_but(all.size(), out);
  const Eigen::VectorXd value = values_of(search, out);
  std::vector<BaseBlock> blocks;
  AddedColumns own(all.blocks(), static_cast<Eigen::Index>(kept.size()), static_cast<Eigen::Index>(out.size()));
  for (std::size_t b = 0; b < all.blocks(); ++b) {
    const auto& block = all.parts()[b];
    const Eigen::VectorXd g = block.g + block.H(Eigen::all, out) * value;
    blocks.push_back({block.H(kept, kept), g(kept),
                      block.square + 2.0 * value.dot(block.g(out)) + value.dot(block.H(out, out) * value)});
    own.B[b] = block.H(kept, out);
    own.C[b] = block.H(out, out);
    own.d[b] = g(out);
  }
  return {BlockRegression(std::move(blocks), all.precision()(kept), all.away()(kept)), std::move(own), std::move(kept),
          out, value};
}

AddedColumns beside(const AddedColumns& columns, const Reduced& reduced) {
  AddedColumns result = columns;
  for (std::size_t b = 0; b < columns.B.size(); ++b) {
    result.B[b] = columns.B[b](reduced.kept, Eigen::all);
    result.d[b] += columns.B[b](reduced.out, Eigen::all).transpose() * reduced.value;
  }
  return result;
}

double Findings::quantile(const LogAbout& log) const {
  return student_quantile(limits::kConfidence, std::max(1.0, static_cast<double>(log.blocks) - 1.0));
}

void Findings::describe_log(const LogAbout& log) {
  const auto pictures = fit_.log().pictures();
  const auto& roles = fit_.log().roles();
  report_.begin_utime = pictures.front().joints.utime;
  report_.duration_s = seconds(pictures.back().joints.utime - pictures.front().joints.utime);
  report_.views = pictures.size();
  report_.arm_joints.clear();
  for (const auto joint : roles.arm) report_.arm_joints.push_back(roles.names[static_cast<std::size_t>(joint)]);
  report_.samples.resize(pictures.size());
  auto& measurement = fit_.measurement();
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    auto& sample = report_.samples[p];
    const auto& instant = log.at.instants[p];
    sample.utime = pictures[p].joints.utime;
    sample.time_s = seconds(sample.utime - report_.begin_utime);
    sample.camera = pictures[p].camera;
    for (const auto joint : roles.arm) {
      sample.angle_deg.push_back(degrees(instant.q[joint]));
      sample.velocity_deg_s.push_back(degrees(instant.qdot[joint]));
      sample.acceleration_deg_s2.push_back(degrees(instant.qddot[joint]));
      sample.torque_nm.push_back(instant.gravity_torque.size() > 0 ? instant.gravity_torque[joint] : 0.0);
    }
    measurement.projection().place(pictures[p].joints.q, log.at.corrections[p], sample.camera);
    const Eigen::Vector3d hand = measurement.projection().hand().translation();
    if (hand.z() <= 0.0) continue;
    const auto& k = fit_.log().rig().cameras[sample.camera].intrinsics;
    sample.depth_m = hand.z();
    sample.image_radius_px = std::hypot(k.fx * hand.x() / hand.z(), k.fy * hand.y() / hand.z());
  }
}

void Findings::before(const LogAbout& log) {
  describe_log(log);
  const auto base = search_.regression(log);
  report_.before = remainders(log, base, &ResidualSample::before);
  report_.baseline_model = search_.state().model();
  for (Eigen::Index j = 0; j < search_.state().joints(); ++j) {
    report_.offsets_deg_before[search_.state().parameters()[static_cast<std::size_t>(j)].name] =
        degrees(search_.state().x()[j]);
  }
}

Eigen::VectorXd Findings::left_of(const LogAbout& log, std::size_t picture, const Eigen::VectorXd& x, Remainder& out) {
  const auto& evidence = log.at.evidence[picture];
  const auto& coordinates = fit_.coordinates();
  const auto& roles = fit_.log().roles();
  Eigen::VectorXd c = Eigen::VectorXd::Zero(coordinates.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    for (const auto& step : log.base[picture][static_cast<std::size_t>(i)]) c[step.coordinate] += x[i] * step.amount;
  }
  Eigen::VectorXd b = evidence.b - evidence.A * c;
  out.rms_px = std::sqrt(std::max(0.0, evidence.square - c.dot(evidence.b + b)) / evidence.weight);
  double outwards = 0.0, outline = 0.0;
  for (std::size_t s = 0; s < roles.segments.size(); ++s) {
    const auto at = coordinates.find({Coordinate::Kind::kDilation, static_cast<Eigen::Index>(s)});
    outwards += b[at];
    outline += evidence.A(at, at);
  }
  out.mean_px = outline > 0.0 ? outwards / outline : 0.0;
  for (std::size_t j = 0; j < roles.arm.size(); ++j) {
    const auto at = coordinates.find({Coordinate::Kind::kJoint, roles.arm[j]});
    if (evidence.A(at, at) > 0.0) out.apparent_deg[j] = degrees(b[at] / evidence.A(at, at));
  }
  return b;
}

HeldoutError Findings::remainders(const LogAbout& log, const BlockRegression& base, Which which) {
  const auto held = base.heldout();
  const auto& roles = fit_.log().roles();
  const auto rig = rig_coordinates(fit_.coordinates());
  auto moving = rig;
  for (const auto joint : roles.arm) {
    moving.push_back(static_cast<std::uint32_t>(fit_.coordinates().find({Coordinate::Kind::kJoint, joint})));
  }
  const Eigen::VectorXd encoders = encoder_variance();
  double square = 0.0, weight = 0.0, hand = 0.0, turn = 0.0, found = 0.0, sampled = 0.0, where_seen = 0.0,
         sampled_seen = 0.0, of_encoders = 0.0;
  std::vector<MotionEvidence> motions;
  auto& measurement = fit_.measurement();
  for (std::size_t p = 0; p < log.base.size(); ++p) {
    const auto& evidence = log.at.evidence[p];
    auto& out = report_.samples[p].*which;
    out = {};
    out.apparent_deg.assign(roles.arm.size(), 0.0);
    report_.samples[p].noise = out;
    found += evidence.matched;
    sampled += evidence.sampled;
    if (log.precision[p] <= 0.0) continue;
    where_seen += evidence.matched;
    sampled_seen += evidence.sampled;
    Eigen::VectorXd x = held.replicas.col(static_cast<Eigen::Index>(log.block_of[p]));
    const Eigen::VectorXd b = left_of(log, p, x, out);
    const double own = out.rms_px * out.rms_px * evidence.weight;
    square += own;
    weight += evidence.weight;
    of_encoders += evidence.A.diagonal().dot(encoders);
    const auto& picture = fit_.log().pictures()[p];
    motions.push_back(
        {picture.joints.utime, picture.camera, evidence.A(moving, moving), b(moving), own, log.precision[p]});
    const auto jacobian = measurement.link_jacobian(picture.joints.q, log.at.corrections[p], picture.camera, rig,
                                                    measurement.projection().hand_link());
    const Eigen::VectorXd moved = jacobian * motion_of_all(evidence.A(rig, rig), b(rig), log.precision[p]);
    out.hand_C_m = measurement.projection().hand().translation();
    hand += moved.head<3>().squaredNorm();
    turn += moved.tail<3>().squaredNorm();
    if (which != &ResidualSample::after) continue;
    // A curve that nothing explains is no part of the extended model: charts of what that leaves show it.
    report_.samples[p].noise = out;
    for (std::size_t c = 0; c < search_.causes().size(); ++c) {
      if (search_.causes()[c].generic()) x(search_.columns_of(c)).setZero();
    }
    left_of(log, p, x, out);
  }
  const auto share = [](double part, double of) { return of > 0.0 ? part / of : 0.0; };
  if (weight <= 0.0) return {.outline_found = share(found, sampled), .outline_where_seen = 0.0};
  const double pictures = static_cast<double>(motions.size()), rms_px = std::sqrt(square / weight);
  return {rms_px,
          1e3 * std::sqrt(hand / pictures),
          degrees(std::sqrt(turn / pictures)),
          share(found, sampled),
          share(where_seen, sampled_seen),
          rms_px * std::sqrt(agreed_share(motions, motion_settings())),
          std::hypot(std::sqrt(of_encoders / weight), floor_px())};
}

Eigen::VectorXd Findings::encoder_variance() const {
  const Eigen::VectorXd sd = encoder_noise(fit_.log().encoders());
  const auto& coordinates = fit_.coordinates();
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(coordinates.size());
  for (Eigen::Index joint = 0; joint < sd.size(); ++joint) {
    if (const auto at = coordinates.find({Coordinate::Kind::kJoint, joint}); at >= 0)
      variance[at] = kInterpolatedVariance * sd[joint] * sd[joint];
  }
  return variance;
}

AgreedMotionSettings Findings::motion_settings() const {
  AgreedMotionSettings settings;
  settings.sd.resize(6 + static_cast<Eigen::Index>(fit_.log().roles().arm.size()));
  settings.sd.head<3>().setConstant(kShift_m);
  settings.sd.tail(settings.sd.size() - 3).setConstant(kTurn_rad);
  settings.longest_us = microseconds(options_.block_s);
  settings.level = options_.level;
  return settings;
}

void Findings::name_causes(const LogAbout& log, const std::vector<Candidate>& candidates) {
  const auto all = search_.regression(log);
  covariance_ = all.covariance();
  report_.blocks = log.blocks;
  describe_causes(log, all, candidates);
  name_estimated(log, all, candidates);
}

/// Under which kind an effect of the state is asked for: what all its targets do alike, where that is in the state too.
const std::string& Findings::kind_asked(const std::string& effect) const {
  const auto& of_all = effect_kind(effect).each_of;
  const auto& parameters = search_.state().parameters();
  const bool both = std::any_of(parameters.begin(), parameters.end(),
                                [&](const auto& p) { return search_.state().model()[p.ref.effect].name() == of_all; });
  return both ? of_all : effect_kind(effect).name;
}

void Findings::name_estimated(const LogAbout& log, const BlockRegression& all,
                              const std::vector<Candidate>& candidates) {
  std::vector<std::string> kinds;
  for (const auto& p : search_.state().parameters()) {
    const auto& kind = kind_asked(search_.state().model()[p.ref.effect].name());
    const bool found = std::any_of(search_.causes().begin(), search_.causes().end(),
                                   [&](const FoundCause& cause) { return cause.name.name == kind; });
    if (kind == "joint_offset" || found || std::find(kinds.begin(), kinds.end(), kind) != kinds.end()) continue;
    kinds.push_back(kind);
    add_estimated(log, all, kind, candidates);
  }
}

void Findings::conclude(const LogAbout& log, const std::vector<Candidate>& candidates) {
  const auto all = search_.regression(log);
  const auto& state = search_.state();
  report_.blocks = log.blocks;
  report_.block_s = log.block_s;
  report_.after = remainders(log, all, &ResidualSample::after);
  report_.extended_model = state.model();
  covariance_ = all.covariance();
  report_.extended_model->set_uncertainty(uncertainty());
  for (Eigen::Index j = 0; j < state.joints(); ++j) {
    const auto& name = state.parameters()[static_cast<std::size_t>(j)].name;
    const double offset = degrees(state.x()[j]), half = quantile(log) * degrees(std::sqrt(covariance_(j, j)));
    report_.offsets_deg_after[name] = offset;
    report_.offsets_ci95_deg[name] = {offset - half, offset + half};
  }
  describe_causes(log, all, candidates);
  name_estimated(log, all, candidates);
  check_outlines(log);
  check_surplus(log);
  exclude(log, all, candidates);
}

/// Of the model's parameters together: a length that a camera's place trades with is known no better than that place.
ModelUncertainty Findings::uncertainty() const {
  ModelUncertainty result;
  const auto& state = search_.state();
  for (const auto& p : state.parameters()) {
    const auto& effect = state.model()[p.ref.effect];
    result.parameters.push_back({effect.name(), effect.target(), p.ref.parameter});
  }
  result.covariance = covariance_.topLeftCorner(state.size(), state.size());
  return result;
}

Size Findings::size_of(const LogAbout& log, const BlockRegression& all, const std::vector<Eigen::Index>& columns) {
  return size_of(log, all, columns, values_of(search_, columns) + all.step()(columns), columns);
}

Size Findings::size_of(const LogAbout& log, const BlockRegression& all, const std::vector<Eigen::Index>& columns,
                       const Eigen::VectorXd& amount, const std::vector<Eigen::Index>& out) {
  // The state's own: what is considered besides is nothing that an answer could take up.
  const auto kept = all_but(search_.state().size(), out);
  Eigen::MatrixXd H = all.precision()(kept).asDiagonal();
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(H.rows(), amount.size());
  for (const auto& block : all.parts()) {
    H += block.H(kept, kept);
    B += block.H(kept, columns);
  }
  Eigen::VectorXd of_base = Eigen::VectorXd::Zero(search_.state().size());
  of_base(kept) = bounded_minimum(H, -B * amount, room_of(all, kept));
  std::vector<std::vector<Direction>> directions(log.base.size());
  for (std::size_t p = 0; p < directions.size(); ++p) {
    for (const auto i : columns) directions[p].push_back(log.base[p][static_cast<std::size_t>(i)]);
  }
  return search_.size_of(log, directions, amount, of_base);
}

Bounds Findings::room_of(const BlockRegression& all, const std::vector<Eigen::Index>& kept) const {
  const auto n = static_cast<Eigen::Index>(kept.size());
  Bounds room{Eigen::VectorXd::Constant(n, -kUnbounded), Eigen::VectorXd::Constant(n, kUnbounded)};
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto at = kept[static_cast<std::size_t>(i)];
    if (at < search_.state().joints()) continue;  // any offset is an answer
    const double away = all.away()[at] + all.step()[at];
    const double most = normal_quantile(options_.level) / std::sqrt(all.precision()[at]);
    room.low[i] = std::min(0.0, -most - away);
    room.high[i] = std::max(0.0, most - away);
  }
  return room;
}

void Findings::add_estimated(const LogAbout& log, const BlockRegression& all, const std::string& kind,
                             const std::vector<Candidate>& candidates) {
  const auto& state = search_.state();
  std::vector<CauseName> targets;
  std::vector<std::vector<Eigen::Index>> columns;
  std::vector<Eigen::Index> out;
  for (Eigen::Index i = state.joints(); i < state.size(); ++i) {
    const auto& effect = state.model()[state.parameters()[static_cast<std::size_t>(i)].ref.effect];
    if (kind_asked(effect.name()) != kind) continue;
    const CauseName name{effect.name(), effect.target().joint, effect.target().source};
    if (targets.empty() || !(targets.back() == name)) {
      targets.push_back(name);
      columns.emplace_back();
    }
    columns.back().push_back(i);
    out.push_back(i);
  }
  const auto reduced = without(search_, all, out);
  // Columns are scored each by itself: where none stands out no target does, and no fit needs to be held out.
  if (reduced.base.score(reduced.own).z() < report_.z_threshold) return;
  const double loss = reduced.base.heldout().total();
  double most = 0.0;
  std::size_t best = targets.size();
  AddedColumns own;
  for (std::size_t t = 0; t < targets.size(); ++t) {
    std::vector<Eigen::Index> at;
    for (const auto i : columns[t]) at.push_back(std::find(out.begin(), out.end(), i) - out.begin());
    auto part = reduced.own.only(at);
    const double gain = loss - reduced.base.heldout(part).total();
    if (gain <= most) continue;
    most = gain;
    best = t;
    own = std::move(part);
  }
  if (best == targets.size()) return;
  const auto scores = reduced.base.score(own);
  DiagnosedCause cause;
  cause.cause = targets[best];
  cause.z = scores.z();
  if (cause.z < report_.z_threshold) return;
  // Of a kind that has one target the state says it: with what is believed of it, and by how blocks differ about its
  // value. One target in place of several is another model than the state's, seen from where it has none of it.
  const bool as_in_state = targets.size() == 1;
  const Eigen::VectorXd estimate =
      as_in_state ? Eigen::VectorXd(values_of(search_, columns[best]) + all.step()(columns[best])) : scores.estimate();
  // Another joint of the head would make up for it: none is known in the model that it is held against.
  const auto size = size_of(log, all, columns[best], estimate, out);
  if (!matters(size)) return;
  cause.hand_mm = 1e3 * size.hand_m;
  cause.outline_px = size.outline_px;
  cause.heldout_gain = loss > 0.0 ? most / loss : 0.0;
  const Eigen::MatrixXd covariance =
      as_in_state ? Eigen::MatrixXd(covariance_(columns[best], columns[best])) : reduced.base.covariance(scores);
  for (std::size_t k = 0; k < columns[best].size(); ++k) {
    const auto& p = state.parameters()[static_cast<std::size_t>(columns[best][k])];
    const auto i = static_cast<Eigen::Index>(k);
    cause.parameters.push_back(parameter_of(log, state.model()[p.ref.effect].parameters()[p.ref.parameter], estimate[i],
                                            std::sqrt(covariance(i, i))));
  }
  cause.same = {cause.cause};
  find_class(reduced, columns[best], own, candidates, cause);
  report_.estimated.push_back(std::move(cause));
}

std::vector<double> Findings::bend(const LogAbout& log, const FoundCause& found, const Eigen::VectorXd& size) const {
  std::vector<double> shares(static_cast<std::size_t>(size.size()), 0.0);
  if (search_.in_state(found) || effect_kind(found.name.name).timing != EffectTiming::kAlways) return shares;
  ErrorModel model(log.state.model().roles());
  auto& effect = model.add(found.name.name, {found.name.joint, found.name.source});
  const auto refs = fitted_parameters(model);
  const auto small = fit_.directions(log.at, model, refs);
  for (std::size_t k = 0; k < refs.size(); ++k) {
    effect.parameters()[refs[k].parameter].value = size[static_cast<Eigen::Index>(k)];
  }
  const auto large = fit_.directions(log.at, model, refs);
  for (std::size_t k = 0; k < refs.size(); ++k) {
    double moved = 0.0;
    Eigen::VectorXd otherwise = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(log.blocks));
    for (std::size_t p = 0; p < small.size(); ++p) {
      std::map<std::uint32_t, double> rate;
      for (const auto& step : small[p][k]) rate[step.coordinate] += step.amount;
      double along = 0.0, all = 0.0;
      for (const auto& [coordinate, amount] : rate) all += amount * amount;
      for (const auto& step : large[p][k]) {
        if (const auto at = rate.find(step.coordinate); at != rate.end()) along += step.amount * at->second;
      }
      moved += all;
      // From nothing to its size it moves things by the mean of both rates.
      otherwise[static_cast<Eigen::Index>(log.block_of[p])] += 0.5 * (along - all);
    }
    if (moved > 0.0) shares[k] = otherwise.norm() / moved;
  }
  return shares;
}

DiagnosedParameter Findings::parameter_of(const LogAbout& log, const EffectParameter& parameter, double value,
                                          double sd) const {
  const double half = quantile(log) * sd, unit = parameter.si_per_unit;
  return {parameter.name, parameter.unit, value / unit, {(value - half) / unit, (value + half) / unit}, sd / unit};
}

double Findings::floor_px() const {
  return options_.noise.floor_px * picture_unit(fit_.log().rig().cameras.front().intrinsics);
}

bool Findings::matters(const Size& size) const {
  return size.metres() >= options_.matters_m && size.outline_px >= floor_px();
}

bool Findings::is_small(const LogAbout& log, const BlockRegression& all, std::size_t cause) {
  const auto& joint = search_.causes()[cause].name.joint;
  auto columns = search_.columns_of(cause);
  if (matters(size_of(log, all, columns))) return false;
  if (joint.empty()) return true;
  const auto own = columns.size();
  for (std::size_t c = 0; c < search_.causes().size(); ++c) {
    if (c == cause || search_.causes()[c].name.joint != joint) continue;
    const auto more = search_.columns_of(c);
    if (matters(size_of(log, all, more))) return true;  // that one says what is wrong with the joint
    columns.insert(columns.end(), more.begin(), more.end());
  }
  return columns.size() == own || !matters(size_of(log, all, columns));
}

void Findings::describe_causes(const LogAbout& log, const BlockRegression& all,
                               const std::vector<Candidate>& candidates) {
  const auto& state = search_.state();
  report_.matters_mm = 1e3 * options_.matters_m;
  if (search_.causes().empty()) return;
  const double loss = all.heldout().loss.sum();
  for (std::size_t c = 0; c < search_.causes().size(); ++c) {
    const auto& found = search_.causes()[c];
    DiagnosedCause cause;
    cause.cause = found.name;
    cause.variable = found.variable;
    const auto columns = search_.columns_of(c);
    const auto reduced = without(search_, all, columns);
    cause.z = reduced.base.score(reduced.own).z();
    const double lost = reduced.base.heldout().loss.sum();
    cause.heldout_gain = lost > 0.0 ? std::max(0.0, 1.0 - loss / lost) : 0.0;
    cause.same = {found.name};
    const auto size = size_of(log, all, columns);
    cause.hand_mm = 1e3 * size.hand_m;
    cause.outline_px = size.outline_px;
    if (!found.generic()) {
      const auto effect = make_effect(found.name.name, {found.name.joint, found.name.source}, state.model().roles());
      const auto shares = bend(log, found, all.step()(columns));
      std::size_t next = 0;
      for (const auto& parameter : std::as_const(*effect).parameters()) {
        if (!parameter.fitted) continue;
        const double share = shares[next];
        const auto i = columns[next++];
        const double value = search_.in_state(found) ? state.x()[i] : all.step()[i];
        auto e = parameter_of(log, parameter, value, std::hypot(std::sqrt(covariance_(i, i)), share * value));
        const auto timing = effect_kind(found.name.name).timing;
        if (timing == EffectTiming::kFromATime) e.from = found.from;
        if (timing == EffectTiming::kOverTheLog) {
          e.from = microseconds(found.begin_s);
          e.duration_s = found.duration_s;
        }
        cause.parameters.push_back(std::move(e));
        cause.implausible = cause.implausible || std::abs(value) > largest_plausible(log, *effect, parameter);
      }
      find_class(reduced, columns, reduced.own, candidates, cause);
    }
    (is_small(log, all, c) ? report_.small_causes : report_.causes).push_back(std::move(cause));
  }
  std::stable_sort(report_.causes.begin(), report_.causes.end(),
                   [](const auto& a, const auto& b) { return a.heldout_gain > b.heldout_gain; });
}

void Findings::find_class(const Reduced& reduced, const std::vector<Eigen::Index>& columns, const AddedColumns& own,
                          const std::vector<Candidate>& candidates, DiagnosedCause& cause) {
  const auto& base = reduced.base;
  const auto with = base.heldout(own);
  const double alone = base.heldout().total(), gain = alone - with.total();
  const double dof = static_cast<double>(base.blocks()) - 1.0;
  const auto own_columns = static_cast<Eigen::Index>(columns.size());
  for (const auto& candidate : candidates) {
    if (candidate.generic() || candidate.cause == cause.cause) continue;
    const auto rival = beside(candidate.columns, reduced);
    const auto scores = base.score(rival);
    if (scores.independent.maxCoeff() < limits::kRounding) continue;
    const auto other = base.heldout(rival);
    if (alone - other.total() < limits::kRivalShare * gain) continue;
    if (worse_by(other, with) > student_quantile(limits::kRivalTail, dof)) continue;
    // One that can say the same and more besides is no other explanation: what is left of the cause beside it? (A curve
    // that is nearly straight where the joint moved is one: elsewhere it is not.)
    if (rival.size() > own_columns) {
      Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(own_columns, rival.size());
      for (std::size_t b = 0; b < base.blocks(); ++b) shared += candidate.columns.B[b](columns, Eigen::all);
      const auto own_scores = base.score(own);
      const Eigen::MatrixXd cross = shared - own_scores.Y.transpose() * sum_of(rival.B);
      const Eigen::MatrixXd left = own_scores.S - cross * scores.S.ldlt().solve(cross.transpose());
      if (left.diagonal().cwiseQuotient(own_scores.S.diagonal()).maxCoeff() < limits::kOneChange) continue;
    }
    cause.same.push_back(candidate.cause);
  }
  if (cause.same.size() < 2) return;
  std::vector<std::string> motions;
  for (const auto& name : cause.same) {
    const auto& motion = effect_kind(name.name).splitting_motion;
    if (!motion.empty() && std::find(motions.begin(), motions.end(), motion) == motions.end())
      motions.push_back(motion);
  }
  for (const auto& motion : motions) cause.advice += (cause.advice.empty() ? "" : " ") + motion;
}

void Findings::check_outlines(const LogAbout& log) {
  std::vector<double> depths;  // of a hand before the camera
  for (const auto& sample : report_.samples) {
    if (sample.depth_m > 0.0) depths.push_back(sample.depth_m);
  }
  const double depth = median(std::move(depths));
  const auto left = left_over(fit_, log, search_.search(), {options_.level, options_.matters_m, depth});
  report_.side_left_over = left.side;
  report_.noise_px = left.noise_px;
  report_.left_px = left.rms_px;
  report_.rough_px = limits::kRough_px * picture_unit(fit_.log().rig().cameras.front().intrinsics);
}

void Findings::check_surplus(const LogAbout& log) {
  const auto found = surplus(fit_, log, search_.raster());
  if (found.blocks <= 0.0) return;
  constexpr double kCm2 = 1e-4;
  const auto text =
      fmt::format("{:.0f} cm2 beside the robot, in {:.0f} % of the log", found.area_m2 / kCm2, 100.0 * found.blocks);
  if (found.blocks >= limits::kMostOfTheLog) {
    report_.not_in_model = text;
  } else {
    report_.warnings.push_back("masks show something that the model lacks: " + text +
                               "; a passer-by, or a tool that is seen now and then");
  }
}

void Findings::exclude(const LogAbout& log, const BlockRegression& all, const std::vector<Candidate>& candidates) {
  const auto& roles = fit_.log().roles();
  for (const auto& candidate : candidates) {
    if (candidate.generic() || candidate.scores.independent.maxCoeff() < limits::kRounding) continue;
    const bool in_class = std::any_of(report_.causes.begin(), report_.causes.end(), [&](const auto& cause) {
      return std::find(cause.same.begin(), cause.same.end(), candidate.cause) != cause.same.end();
    });
    const bool untold = std::any_of(report_.not_testable.begin(), report_.not_testable.end(),
                                    [&](const auto& n) { return n.cause == candidate.cause; });
    if (in_class || untold) continue;
    const Eigen::VectorXd estimate = candidate.scores.estimate();
    const Eigen::MatrixXd covariance = all.covariance(candidate.scores);
    const auto effect = make_effect(candidate.cause.name, {candidate.cause.joint, candidate.cause.source}, roles);
    std::vector<const EffectParameter*> fitted;
    for (const auto& p : std::as_const(*effect).parameters()) {
      if (p.fitted) fitted.push_back(&p);
    }
    DiagnosedCause told;
    told.cause = candidate.cause;
    told.z = candidate.z();
    for (std::size_t k = 0; k < fitted.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      if (candidate.scores.independent[i] < limits::kRounding) continue;
      const auto p = parameter_of(log, *fitted[k], estimate[i], std::sqrt(covariance(i, i)));
      told.parameters.push_back(p);
      report_.exclusion_limits.push_back(
          {candidate.cause, p.parameter, p.unit, std::max(std::abs(p.ci95[0]), std::abs(p.ci95[1]))});
    }
    report_.estimates.push_back(std::move(told));
  }
}

}  // namespace bodyschema::diagnosis
