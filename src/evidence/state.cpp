#include "bodyschema/evidence/state.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <utility>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

/// "link_length of r_elbow", "joint_coupling of a with b", "principal_point difference": as Effect::description.
std::pair<std::string, EffectTarget> parse_name(const std::string& text) {
  const auto space = text.find(' ');
  std::pair<std::string, EffectTarget> result{text.substr(0, space), {}};
  if (space == std::string::npos) return result;
  std::string rest = text.substr(space + 1);
  if (rest.starts_with("of ")) {
    rest = rest.substr(3);
    const auto with = rest.find(" with ");
    result.second.joint = rest.substr(0, with);
    rest = with == std::string::npos ? "" : rest.substr(with + 6);
  }
  result.second.source = rest;
  return result;
}

/// "sd_mm" of "shift_1_mm": parameters are asked for by their unit.
std::string key_of(const EffectParameter& p) {
  return p.unit == "1" ? "sd" : "sd" + p.key().substr(p.name.size());
}

/// Target of effects by which two cameras differ.
constexpr const char* kBetweenCameras = "difference";

/// Largest standard deviation that makes sense, in units of the typical size.
constexpr double kMostTypical = 1e4;

std::vector<double> read_sds(const Configuration& entry, const Effect& effect) {
  std::vector<double> sds;
  for (const auto& p : effect.parameters()) {
    if (!p.fitted) continue;
    sds.push_back(entry.number(key_of(p), 0.0, kMostTypical * p.typical / p.si_per_unit) * p.si_per_unit);
  }
  return sds;
}

void replace(std::vector<Belief>& list, Belief belief) {
  std::erase_if(list, [&](const Belief& b) { return b.effect == belief.effect && b.target == belief.target; });
  if (std::any_of(belief.sd.begin(), belief.sd.end(), [](double sd) { return sd > 0.0; })) {
    list.push_back(std::move(belief));
  }
}

/// Whether a target is about two cameras, of which this robot has one.
bool misses_a_camera(const EffectKind& kind, const EffectTarget& target, const JointRoles& roles) {
  if (roles.cameras.size() != 1) return false;
  JointRoles two = roles;
  two.cameras.push_back("a second one");
  const auto own = kind.targets(roles), with_two = kind.targets(two);
  return std::find(own.begin(), own.end(), target) == own.end() &&
         std::find(with_two.begin(), with_two.end(), target) != with_two.end();
}

std::string name_of(const Effect& effect, const EffectParameter& parameter) {
  if (effect.name() == "joint_offset") return effect.target().joint;
  const auto fitted =
      std::count_if(effect.parameters().begin(), effect.parameters().end(), [](const auto& p) { return p.fitted; });
  return effect.description() + (fitted > 1 ? " " + parameter.name : "");
}

/// R with R R' = C; its units may differ by orders of magnitude.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& C) {
  if (C.isDiagonal()) return C.diagonal().cwiseSqrt().asDiagonal();
  const Eigen::VectorXd sd = C.diagonal().cwiseMax(1e-300).cwiseSqrt();
  const Eigen::MatrixXd correlation = sd.cwiseInverse().asDiagonal() * C * sd.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation);
  return sd.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

}  // namespace

std::vector<Belief> read_beliefs(const Configuration& mapping, const JointRoles& roles) {
  std::vector<Belief> list;
  for (const auto& key : mapping.keys()) {
    if (!mapping.has(key)) continue;  // null: taken out again
    const auto [name, target] = parse_name(key);
    const Configuration entry = mapping.section(key);
    if (target.source == kBetweenCameras && roles.cameras.size() < 2) {
      static_cast<void>(entry.keys());  // what files for every robot say of pairs is nothing about one camera
      continue;
    }
    try {
      const auto& kind = effect_kind(name);
      auto targets = kind.targets(roles);
      if (targets.empty() || misses_a_camera(kind, target, roles)) {
        // Sizes are read all the same, so that they are not unknown keys on a robot without this effect.
        static_cast<void>(entry.keys());
        continue;
      }
      const bool all = target == EffectTarget{} && !(targets.front() == EffectTarget{});
      if (target == EffectTarget{} && targets.front() == EffectTarget{}) targets.resize(1);
      if (!all) targets = {target};
      for (const auto& t : targets) {
        const auto effect = make_effect(name, t, roles);
        replace(list, {name, t, read_sds(entry, *effect)});
      }
    } catch (const ConfigurationError& e) {
      const std::string what = e.what();
      const auto place = mapping.place(key);
      throw ConfigurationError(
          what.find(place.substr(0, place.find(": key"))) == std::string::npos ? place + ": " + what : what);
    }
  }
  // Offsets first: particles are hypotheses about these.
  std::stable_partition(list.begin(), list.end(), [](const Belief& b) { return b.effect == "joint_offset"; });
  return list;
}

State::State(const JointRoles& roles, const std::vector<Belief>& beliefs) : State(ErrorModel(roles), beliefs) {}

State::State(const ErrorModel& known, const std::vector<Belief>& beliefs) : model_(known) {
  std::vector<std::pair<const Belief*, std::size_t>> order;
  for (const bool offsets : {true, false}) {
    for (const auto& belief : beliefs) {
      if ((belief.effect == "joint_offset") != offsets) continue;
      model_.add(belief.effect, belief.target);
      std::size_t e = 0;
      while (!(std::as_const(model_)[e].name() == belief.effect && std::as_const(model_)[e].target() == belief.target))
        ++e;
      const Effect& effect = std::as_const(model_)[e];
      std::size_t fitted = 0;
      for (std::size_t p = 0; p < effect.parameters().size(); ++p) {
        const auto& parameter = effect.parameters()[p];
        if (!parameter.fitted) continue;
        const double sd = belief.sd.at(fitted++);
        if (sd <= 0.0) continue;
        const Eigen::Index joint = offsets ? model_.roles().index(belief.target.joint) : -1;
        parameters_.push_back({{e, p}, name_of(effect, parameter), parameter.unit, parameter.si_per_unit, sd, joint});
      }
    }
    if (offsets) joints_ = static_cast<Eigen::Index>(parameters_.size());
  }
  prior_mean_ = x();
}

std::vector<ParameterRef> State::refs() const {
  std::vector<ParameterRef> refs;
  for (const auto& parameter : parameters_) refs.push_back(parameter.ref);
  return refs;
}

Eigen::VectorXd State::x() const {
  Eigen::VectorXd x(size());
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto& ref = parameters_[static_cast<std::size_t>(i)].ref;
    x[i] = model_[ref.effect].parameters()[ref.parameter].value;
  }
  return x;
}

Eigen::VectorXd State::prior_sd() const {
  Eigen::VectorXd sd(size());
  for (Eigen::Index i = 0; i < size(); ++i) sd[i] = parameters_[static_cast<std::size_t>(i)].prior_sd;
  return sd;
}

void State::set(const Eigen::VectorXd& x) {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto& ref = parameters_[static_cast<std::size_t>(i)].ref;
    auto& parameter = model_[ref.effect].parameters()[ref.parameter];
    parameter.value = std::max(x[i], parameter.at_least);
  }
}

void State::set(const ErrorModel& model) {
  Eigen::VectorXd x = this->x();
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto& ref = parameters_[static_cast<std::size_t>(i)].ref;
    const Effect& own = model_[ref.effect];
    if (const auto* other = model.find(own.name(), own.target())) x[i] = other->parameters()[ref.parameter].value;
  }
  set(x);
}

Considered Considered::beside(const State& state, const std::vector<Belief>& tolerances) {
  Considered result{ErrorModel(state.model().roles()), {}};
  for (const auto& belief : tolerances) result.effects.add(belief.effect, belief.target);
  const auto& known = state.model().uncertainty();
  std::vector<bool> open(known.parameters.size());
  for (std::size_t i = 0; i < open.size(); ++i) {
    const auto& p = known.parameters[i];
    open[i] = p.effect != "joint_offset" && state.find(p.effect, p.target, p.parameter) < 0;
    if (!open[i] || result.effects.find(p.effect, p.target) != nullptr) continue;
    // As it is known: some effects move nothing until they have a time, or a size.
    const auto* own = state.model().find(p.effect, p.target);
    result.effects.add(own != nullptr ? own->clone() : make_effect(p.effect, p.target, state.model().roles()));
  }
  const auto refs = fitted_parameters(result.effects);
  const auto position = [&](const std::string& effect, const EffectTarget& target, std::size_t parameter) {
    return std::find_if(refs.begin(), refs.end(),
                        [&](const ParameterRef& ref) {
                          const auto& other = std::as_const(result.effects)[ref.effect];
                          return ref.parameter == parameter && other.name() == effect && other.target() == target;
                        }) -
           refs.begin();
  };
  const auto n = static_cast<Eigen::Index>(refs.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n, n);
  for (const auto& belief : tolerances) {
    std::size_t fitted = 0;
    const auto* effect = result.effects.find(belief.effect, belief.target);
    for (std::size_t p = 0; p < effect->parameters().size(); ++p) {
      if (!effect->parameters()[p].fitted) continue;
      const auto k = position(belief.effect, belief.target, p);
      covariance(k, k) += belief.sd[fitted] * belief.sd[fitted];
      ++fitted;
    }
  }
  for (std::size_t i = 0; i < open.size(); ++i) {
    for (std::size_t j = 0; j < open.size(); ++j) {
      if (!open[i] || !open[j]) continue;
      const auto &a = known.parameters[i], &b = known.parameters[j];
      covariance(position(a.effect, a.target, a.parameter), position(b.effect, b.target, b.parameter)) +=
          known.covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  result.root = root_of(covariance);
  return result;
}

Eigen::Index State::find(const std::string& effect, const EffectTarget& target, std::size_t parameter) const {
  for (Eigen::Index i = 0; i < size(); ++i) {
    const auto& ref = parameters_[static_cast<std::size_t>(i)].ref;
    if (ref.parameter == parameter && model_[ref.effect].name() == effect && model_[ref.effect].target() == target) {
      return i;
    }
  }
  return -1;
}

}  // namespace bodyschema
