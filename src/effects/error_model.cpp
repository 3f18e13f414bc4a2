#include "bodyschema/effects/error_model.hpp"

#include <yaml-cpp/yaml.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema {
namespace {

constexpr int kVersion = 1;
constexpr std::uintmax_t kMaxFileBytes = 1 << 20;

[[noreturn]] void fail(const std::string& origin, const YAML::Mark& mark, const std::string& what) {
  throw ConfigurationError(origin + ":" + std::to_string(mark.line + 1) + ": " + what);
}

std::string scalar(const YAML::Node& entry, const char* key) {
  const auto node = entry[key];
  return node && node.IsScalar() ? node.Scalar() : std::string();
}

double read_number(const YAML::Node& node, const std::string& origin, const std::string& what) {
  double value = 0.0;
  if (!YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail(origin, node.Mark(),
         what + " is '" + (node.IsScalar() ? node.Scalar() : "...") + "', expected a finite number");
  }
  return value;
}

/// Numbers by the keys of an effect's parameters, SI: `take(parameter, value)` for each.
template <class Take>
void read_keys(const YAML::Node& node, const std::string& origin, const Effect& effect, Take take) {
  std::vector<std::string> keys;
  for (const auto& p : effect.parameters()) keys.push_back(p.key());
  for (const auto& item : node) {
    const auto key = item.first.Scalar();
    const auto at = std::find(keys.begin(), keys.end(), key);
    if (at == keys.end()) {
      fail(origin, item.first.Mark(),
           effect.description() + ": unknown parameter '" + key + "'; did you mean '" + nearest_name(key, keys) + "'?");
    }
    const auto i = static_cast<std::size_t>(at - keys.begin());
    const double value = read_number(item.second, origin, effect.description() + ": '" + key + "'");
    take(i, value * effect.parameters()[i].si_per_unit);
  }
}

void read_parameters(const YAML::Node& entry, const std::string& origin, Effect& effect) {
  const auto node = entry["parameters"];
  if (!node || !node.IsMap()) {
    fail(origin, entry.Mark(), effect.description() + ": expected a mapping 'parameters'");
  }
  read_keys(node, origin, effect, [&](std::size_t i, double value) { effect.parameters()[i].value = value; });
  for (const auto& p : std::as_const(effect).parameters()) {
    if (!node[p.key()]) fail(origin, node.Mark(), effect.description() + ": expected parameter '" + p.key() + "'");
  }
}

/// Standard deviations of an effect's parameters, where it has some.
void read_sds(const YAML::Node& entry, const std::string& origin, const Effect& effect,
              std::vector<ModelUncertainty::Parameter>& parameters, std::vector<double>& sds) {
  const auto node = entry["sd"];
  if (!node) return;
  if (!node.IsMap()) fail(origin, node.Mark(), effect.description() + ": 'sd': expected a mapping");
  read_keys(node, origin, effect, [&](std::size_t i, double sd) {
    const auto& p = effect.parameters()[i];
    if (sd < 0.0 || !p.fitted) {
      fail(origin, node.Mark(),
           effect.description() + ": sd of '" + p.key() + "': expected " +
               (p.fitted ? "0 or more" : "none, it is a setting"));
    }
    if (sd <= 0.0) return;
    parameters.push_back({effect.name(), effect.target(), i});
    sds.push_back(sd);
  });
}

/// Correlations of parameters that have a standard deviation, each with those before it; none: they are independent.
Eigen::MatrixXd read_covariance(const YAML::Node& node, const std::string& origin, const std::vector<double>& sds) {
  const auto n = static_cast<Eigen::Index>(sds.size());
  const auto sd = Eigen::Map<const Eigen::VectorXd>(sds.data(), n);
  Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(n, n);
  if (node) {
    const std::string expected =
        "'correlations': expected " + std::to_string(std::max<Eigen::Index>(0, n - 1)) +
        " rows, each parameter with an sd against all before it, in the order of this file, from -1 to 1";
    if (!node.IsSequence() || static_cast<Eigen::Index>(node.size()) != std::max<Eigen::Index>(0, n - 1)) {
      fail(origin, node.Mark(), expected);
    }
    for (Eigen::Index i = 1; i < n; ++i) {
      const auto row = node[static_cast<std::size_t>(i - 1)];
      if (!row.IsSequence() || static_cast<Eigen::Index>(row.size()) != i) fail(origin, row.Mark(), expected);
      for (Eigen::Index j = 0; j < i; ++j) {
        const double r = read_number(row[static_cast<std::size_t>(j)], origin, "a correlation");
        if (std::abs(r) > 1.0) fail(origin, row.Mark(), expected);
        correlation(i, j) = correlation(j, i) = r;
      }
    }
    if (n == 0) return correlation;
    constexpr double kRounding = 1e-6;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(correlation, Eigen::EigenvaluesOnly);
    if (eigen.eigenvalues()(0) < -kRounding) {
      fail(origin, node.Mark(), "'correlations': contradict each other, expected those of some numbers");
    }
  }
  return sd.asDiagonal() * correlation * sd.asDiagonal();
}

/// Standard deviations of an effect's parameters that have some, and which of the uncertain ones they are.
void write_sds(YAML::Emitter& out, const Effect& effect, const ModelUncertainty& known,
               std::vector<Eigen::Index>& order) {
  bool begun = false;
  for (std::size_t p = 0; p < effect.parameters().size(); ++p) {
    const auto& all = known.parameters;
    const auto at = std::find(all.begin(), all.end(), ModelUncertainty::Parameter{effect.name(), effect.target(), p});
    if (at == all.end()) continue;
    const auto i = static_cast<Eigen::Index>(at - all.begin());
    const double sd = std::sqrt(std::max(0.0, known.covariance(i, i)));
    if (sd <= 0.0) continue;
    if (!begun) out << YAML::Key << "sd" << YAML::Value << YAML::BeginMap;
    begun = true;
    const auto& parameter = effect.parameters()[p];
    out << YAML::Key << parameter.key() << YAML::Value << sd / parameter.si_per_unit;
    order.push_back(i);
  }
  if (begun) out << YAML::EndMap;
}

}  // namespace

ErrorModel::ErrorModel(JointRoles roles) : roles_(std::move(roles)) {}

ErrorModel::ErrorModel(const ErrorModel& other) : roles_(other.roles_), uncertainty_(other.uncertainty_) {
  for (const auto& effect : other.effects_) effects_.push_back(effect->clone());
}

ErrorModel& ErrorModel::operator=(const ErrorModel& other) {
  if (this != &other) *this = ErrorModel(other);
  return *this;
}

ErrorModel ErrorModel::load(const std::filesystem::path& file, const JointRoles& roles) {
  std::ifstream in(file);
  if (!in) throw ConfigurationError(file.string() + ": cannot be read, expected an extended model");
  file_size_at_most(file, kMaxFileBytes);
  std::stringstream text;
  text << in.rdbuf();
  return parse(text.str(), roles, file.string());
}

ErrorModel ErrorModel::parse(const std::string& yaml, const JointRoles& roles, const std::string& origin) {
  YAML::Node root;
  try {
    root = YAML::Load(yaml);
  } catch (const YAML::Exception& e) {
    throw ConfigurationError(origin + ": not YAML: " + e.what());
  }
  if (!root.IsMap()) throw ConfigurationError(origin + ": expected a mapping with key 'version'");
  int version = 0;
  if (!root["version"] || !YAML::convert<int>::decode(root["version"], version) || version != kVersion) {
    throw ConfigurationError(origin + ": version is '" + scalar(root, "version") + "', expected " +
                             std::to_string(kVersion));
  }
  for (const auto& item : root) {
    const auto key = item.first.Scalar();
    const std::vector<std::string> known = {"version", "effects", "correlations"};
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      fail(origin, item.first.Mark(), "unknown key '" + key + "'; did you mean '" + nearest_name(key, known) + "'?");
    }
  }
  ErrorModel model(roles);
  const auto list = root["effects"];
  if (!list) return model;
  if (!list.IsSequence()) fail(origin, list.Mark(), "'effects': expected a list");
  std::vector<double> sds;
  for (const auto& entry : list) {
    if (!entry.IsMap()) fail(origin, entry.Mark(), "'effects': expected entries with a 'name'");
    for (const auto& item : entry) {
      const auto key = item.first.Scalar();
      const std::vector<std::string> known = {"name", "joint", "source", "parameters", "sd"};
      if (std::find(known.begin(), known.end(), key) == known.end()) {
        fail(origin, item.first.Mark(), "unknown key '" + key + "'; did you mean '" + nearest_name(key, known) + "'?");
      }
    }
    const EffectTarget target{scalar(entry, "joint"), scalar(entry, "source")};
    std::unique_ptr<Effect> effect;
    try {
      effect = make_effect(scalar(entry, "name"), target, roles);
    } catch (const ConfigurationError& e) {
      fail(origin, entry.Mark(), e.what());
    }
    if (model.find(effect->name(), target) != nullptr) {
      fail(origin, entry.Mark(), effect->description() + ": listed twice");
    }
    read_parameters(entry, origin, *effect);
    read_sds(entry, origin, *effect, model.uncertainty_.parameters, sds);
    model.add(std::move(effect));
  }
  model.uncertainty_.covariance = read_covariance(root["correlations"], origin, sds);
  return model;
}

std::string ErrorModel::to_yaml() const {
  std::vector<Eigen::Index> order;  // of the uncertain parameters
  YAML::Emitter out;
  out.SetDoublePrecision(16);
  out << YAML::Comment(
             "What this robot is, beyond its URDF and configuration. Written by bodyschema "
             "diagnose.")
      << YAML::BeginMap << YAML::Key << "version" << YAML::Value << kVersion << YAML::Key << "effects" << YAML::Value
      << YAML::BeginSeq;
  for (const auto& effect : effects_) {
    out << YAML::BeginMap << YAML::Key << "name" << YAML::Value << effect->name();
    if (!effect->target().joint.empty()) {
      out << YAML::Key << "joint" << YAML::Value << effect->target().joint;
    }
    if (!effect->target().source.empty()) {
      out << YAML::Key << "source" << YAML::Value << effect->target().source;
    }
    out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
    for (const auto& p : std::as_const(*effect).parameters()) {
      out << YAML::Key << p.key() << YAML::Value << p.in_unit();
    }
    out << YAML::EndMap;
    write_sds(out, std::as_const(*effect), uncertainty_, order);
    out << YAML::EndMap;
  }
  out << YAML::EndSeq;
  if (order.size() > 1) {
    const auto& covariance = uncertainty_.covariance;
    const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
    out << YAML::Newline
        << YAML::Comment("of each parameter that has an sd with all those before it, in the order of this file")
        << YAML::Key << "correlations" << YAML::Value << YAML::BeginSeq;
    for (std::size_t i = 1; i < order.size(); ++i) {
      out << YAML::Flow << YAML::BeginSeq;
      for (std::size_t j = 0; j < i; ++j) {
        out << std::clamp(covariance(order[i], order[j]) / (sd[order[i]] * sd[order[j]]), -1.0, 1.0);
      }
      out << YAML::EndSeq;
    }
    out << YAML::EndSeq;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

void ErrorModel::save(const std::filesystem::path& file) const {
  write_file(file, to_yaml());
}

Effect* ErrorModel::find(const std::string& name, const EffectTarget& target) {
  return const_cast<Effect*>(std::as_const(*this).find(name, target));
}

const Effect* ErrorModel::find(const std::string& name, const EffectTarget& target) const {
  for (const auto& effect : effects_) {
    if (effect->name() == name && effect->target() == target) return effect.get();
  }
  return nullptr;
}

Effect& ErrorModel::add(const std::string& name, const EffectTarget& target) {
  if (auto* present = find(name, target)) return *present;
  effects_.push_back(make_effect(name, target, roles_));
  return *effects_.back();
}

void ErrorModel::add(std::unique_ptr<Effect> effect) {
  effects_.push_back(std::move(effect));
}

void ErrorModel::remove(const std::string& name, const EffectTarget& target) {
  std::erase_if(effects_, [&](const auto& e) { return e->name() == name && e->target() == target; });
}

Eigen::VectorXd ErrorModel::offsets() const {
  Eigen::VectorXd offsets = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(roles_.names.size()));
  for (const auto& effect : effects_) {
    if (effect->name() == "joint_offset") {
      offsets[roles_.index(effect->target().joint)] += effect->parameters()[0].value;
    }
  }
  return offsets;
}

void ErrorModel::forget() {
  for (auto& effect : effects_) effect->forget();
}

void ErrorModel::observe(const JointSample& sample) {
  for (auto& effect : effects_) effect->observe(sample);
}

void ErrorModel::corrections(const Instant& at, Corrections& out) const {
  out.clear();
  out.qdot = at.qdot;
  for (const auto& effect : effects_) effect->apply(at, out);
}

StereoRig ErrorModel::corrected(const StereoRig& rig) const {
  const auto joints = static_cast<Eigen::Index>(roles_.names.size());
  StereoRig result = rig;
  Instant at = Instant::at_rest(Eigen::VectorXd::Zero(joints), 0);
  Corrections corrections = roles_.no_corrections();
  for (std::size_t c = 0; c < result.cameras.size(); ++c) {
    at.camera = c;
    this->corrections(at, corrections);
    auto& camera = result.cameras[c];
    camera.intrinsics.fx *= 1.0 + corrections.camera.focal_scale;
    camera.intrinsics.fy *= 1.0 + corrections.camera.focal_scale;
    camera.intrinsics.cx += corrections.camera.cx_px / camera.intrinsics.reduction;
    camera.intrinsics.cy += corrections.camera.cy_px / camera.intrinsics.reduction;
    camera.distortion[0] += corrections.camera.k1;
  }
  return result;
}

std::string describe(const Effect& effect) {
  std::ostringstream text;
  text.precision(3);
  text << effect.description();
  for (const auto& p : effect.parameters()) {
    if (p.fitted) text << ' ' << p.name << ' ' << p.in_unit() << (p.unit == "1" ? "" : " " + p.unit);
  }
  return text.str();
}

std::string describe(const ErrorModel& model) {
  std::string text;
  for (std::size_t e = 0; e < model.size(); ++e) {
    if (model[e].name() == "joint_offset") continue;
    text += (text.empty() ? "" : "; ") + describe(model[e]);
  }
  return text.empty() ? "joint offsets alone" : text;
}

}  // namespace bodyschema
