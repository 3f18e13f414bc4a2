#include "bodyschema/simulator/fault.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "faults/kinds.hpp"

namespace bodyschema::simulator {
namespace {

std::string number_text(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.10g", value);
  return buffer;
}

bool read_number(const std::string& text, double& value) {
  const char* const end = text.data() + text.size();
  const auto result = std::from_chars(text.data(), end, value);
  return result.ec == std::errc() && result.ptr == end && std::isfinite(value);
}

std::string did_you_mean(const std::string& name, const std::vector<std::string>& candidates) {
  const auto nearest = nearest_name(name, candidates);
  return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}

std::string list_of(const std::vector<std::string>& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : ", ") + item;
  return text;
}

}  // namespace

FaultSpec FaultSpec::parse(const std::string& text) {
  FaultSpec spec;
  const auto colon = text.find(':');
  spec.name = text.substr(0, colon);
  std::string rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  while (!rest.empty()) {
    const auto comma = rest.find(',');
    const std::string item = rest.substr(0, comma);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    const auto equals = item.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == item.size()) {
      throw ConfigurationError("fault '" + text + "': expected name:key=value,key=value, found '" + item + "'");
    }
    if (!spec.arguments.emplace(item.substr(0, equals), item.substr(equals + 1)).second) {
      throw ConfigurationError("fault '" + text + "': key '" + item.substr(0, equals) + "' is given twice");
    }
  }
  if (spec.name.empty()) throw ConfigurationError("fault '" + text + "': expected name:key=value,key=value");
  return spec;
}

FaultSpec FaultSpec::of(std::string name, const std::string& joint, double value) {
  FaultSpec spec{std::move(name), {}};
  if (!joint.empty()) spec.arguments["joint"] = joint;
  return spec.set("value", value);
}

FaultSpec& FaultSpec::set(const std::string& key, double number) {
  arguments[key] = number_text(number);
  return *this;
}

std::string FaultSpec::text() const {
  std::string result = name;
  char separator = ':';
  for (const auto& [key, value] : arguments) {
    result += separator + key + "=" + value;
    separator = ',';
  }
  return result;
}

double FaultSpec::value() const {
  double value = 0.0;
  const auto found = arguments.find("value");
  if (found != arguments.end()) read_number(found->second, value);
  return value;
}

void FaultArguments::fail(const std::string& key, const std::string& expected) const {
  const auto found = spec_.arguments.find(key);
  const std::string value = found == spec_.arguments.end() ? "missing" : "'" + found->second + "'";
  throw ConfigurationError("fault '" + spec_.name + "': " + key + " is " + value + ", expected " + expected);
}

double FaultArguments::number(const std::string& key, double min, double max) const {
  const auto found = spec_.arguments.find(key);
  double value = 0.0;
  if (found == spec_.arguments.end() || !read_number(found->second, value) || value < min || value > max) {
    fail(key, "a number from " + number_text(min) + " to " + number_text(max));
  }
  return value;
}

double FaultArguments::number_or(const std::string& key, double fallback, double min, double max) const {
  return spec_.arguments.contains(key) ? number(key, min, max) : fallback;
}

Eigen::Index FaultArguments::joint(const std::string& key) const {
  const auto found = spec_.arguments.find(key);
  if (found == spec_.arguments.end()) fail(key, "the name of a joint");
  const auto index = site_.model->find_joint(found->second);
  if (!index) {
    std::vector<std::string> names;
    for (const auto& joint : site_.model->joints()) names.push_back(joint.name);
    fail(key, "a joint of " + site_.model->name() + did_you_mean(found->second, names));
  }
  return *index;
}

std::string FaultArguments::choice_or(const std::string& key, const std::string& fallback,
                                      const std::vector<std::string>& choices) const {
  const auto found = spec_.arguments.find(key);
  if (found == spec_.arguments.end()) return fallback;
  if (std::find(choices.begin(), choices.end(), found->second) == choices.end()) {
    fail(key, "one of " + list_of(choices));
  }
  return found->second;
}

FaultSite::FaultSite(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig)
    : model(std::move(robot)), hand_link(setup.hand_link), gravity_W(setup.gravity_W), cameras(rig.cameras.size()) {
  std::vector<std::string> links = {setup.hand_link};
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  const std::size_t first_camera = links.size();
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  ForwardKinematics kinematics(model, links);
  std::vector<Pose> poses(links.size());
  kinematics.compute(setup.default_joints(*model), poses);

  for (const auto& name : setup.estimated_joints) arm.push_back(model->joint_index(name));
  // An eye may also tilt by itself: its pan is the joint that turns its gaze the furthest sideways.
  const auto sideways = [&](Eigen::Index joint, std::size_t camera) {
    const Eigen::Matrix3d R_WC = poses[first_camera + camera].linear();
    return std::abs(kinematics.joint_axis(joint).direction_W.cross(R_WC.col(2)).dot(R_WC.col(0)));
  };
  for (const auto& name : setup.head_joints) {
    const auto joint = model->joint_index(name);
    bool all = true;
    bool any = false;
    for (std::size_t c = 0; c < cameras; ++c) {
      const bool moves = kinematics.moves(joint, first_camera + c);
      all &= moves;
      any |= moves;
    }
    if (all) {
      head.push_back(joint);
    } else if (any) {
      const std::size_t camera = kinematics.moves(joint, first_camera) ? 0 : 1;
      auto& pan = camera == 0 ? left_pan : right_pan;
      if (!pan || sideways(joint, camera) > sideways(*pan, camera)) pan = joint;
    }
  }
  // What curls a finger turns about the axis of its last joint, or nearly so; the thumb's opposition and
  // the spread of the fingers turn them sideways.
  for (std::size_t tip = 1; tip < first_camera; ++tip) {
    Eigen::Vector3d curl_W = Eigen::Vector3d::Zero();
    for (Eigen::Index joint = model->joint_count(); joint-- > 0;) {
      if (kinematics.moves(joint, 0) || !kinematics.moves(joint, tip)) continue;
      const Eigen::Vector3d axis_W = kinematics.joint_axis(joint).direction_W;
      if (curl_W.isZero()) curl_W = axis_W;
      const bool known = std::find(fingers.begin(), fingers.end(), joint) != fingers.end();
      if (std::abs(axis_W.dot(curl_W)) > std::sqrt(0.5) && !known) fingers.push_back(joint);
    }
  }
  std::sort(fingers.begin(), fingers.end());
}

const std::vector<FaultKind>& fault_kinds() {
  static const std::vector<FaultKind> kinds = {faults::joint_offset(),
                                               faults::compliance(),
                                               faults::payload(),
                                               faults::backlash(),
                                               faults::encoder_gain(),
                                               faults::eccentricity(),
                                               faults::joint_coupling(),
                                               faults::latency(),
                                               faults::camera_skew(),
                                               faults::link_length(),
                                               faults::axis_tilt(),
                                               faults::axis_shift(),
                                               faults::head_offset(),
                                               faults::vergence(),
                                               faults::baseline(),
                                               faults::focal_length(),
                                               faults::principal_point(),
                                               faults::distortion(),
                                               faults::silhouette_bias(),
                                               faults::mesh_scale(),
                                               faults::finger_posture(),
                                               faults::drift(),
                                               faults::slip(),
                                               faults::wobble(),
                                               faults::velocity_lag(),
                                               faults::acceleration_lag(),
                                               faults::local_kink(),
                                               faults::random_walk()};
  return kinds;
}

const FaultKind& fault_kind(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& kind : fault_kinds()) {
    if (kind.name == name) return kind;
    names.push_back(kind.name);
  }
  throw ConfigurationError("unknown fault '" + name + "'" + did_you_mean(name, names));
}

std::unique_ptr<Fault> make_fault(const FaultSpec& spec, const FaultSite& site) {
  const FaultKind& kind = fault_kind(spec.name);
  auto keys = kind.keys;
  keys.push_back("value");
  for (const auto& [key, value] : spec.arguments) {
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
      throw ConfigurationError("fault '" + spec.name + "': unknown key '" + key + "'" + did_you_mean(key, keys));
    }
  }
  return kind.make(FaultArguments(spec, site), site);
}

FaultSpec draw_fault(std::uint64_t seed, const FaultSite& site, const DrawOptions& options) {
  Random random(seed, "hidden fault");
  struct Candidate {
    const FaultKind* kind;
    std::vector<FaultTarget> targets;
  };
  std::vector<Candidate> candidates;
  for (const auto& kind : fault_kinds()) {
    if (kind.name == "joint_offset" || kind.in_catalogue == options.outside_catalogue) continue;
    if (std::find(options.exclude.begin(), options.exclude.end(), kind.name) != options.exclude.end()) continue;
    auto targets = kind.targets(site);
    if (!targets.empty()) candidates.push_back({&kind, std::move(targets)});
  }
  if (candidates.empty()) throw ConfigurationError("no fault is left to draw");
  const auto& [kind, targets] = candidates[random.below(candidates.size())];
  const FaultTarget& target = targets[random.below(targets.size())];
  FaultSpec spec = target.spec;
  const double sign = kind->one_sided ? 1.0 : random.sign();
  constexpr double kSmallest = 3.0, kLargest = 6.0;
  const double drawn = random.uniform(kSmallest, kLargest);
  spec.set("value", sign * options.multiple_of_detectable.value_or(drawn) * target.detectable);
  if (kind->name == "slip") spec.set("at", (site.end_s - site.begin_s) * random.uniform(0.2, 0.8));
  if (kind->name == "wobble") spec.set("period", random.uniform(4.0, 12.0));
  return spec;
}

}  // namespace bodyschema::simulator
