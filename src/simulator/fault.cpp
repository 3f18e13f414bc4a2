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

std::vector<std::size_t> FaultArguments::covers() const {
  const auto found = spec_.arguments.find("part");
  const std::string part = found == spec_.arguments.end() ? "all" : found->second;
  auto covers = site_.covers_of(part);
  if (covers.empty()) {
    std::vector<std::string> names = {"all", "hand", "palm", "fingers", "forearm", "upper_arm"};
    for (const auto& mesh : site_.model->meshes()) names.push_back(mesh.link);
    fail("part",
         "all, hand, palm, fingers, forearm, upper_arm as far as this robot has them, or rendered links "
         "joined by '+'" +
             did_you_mean(part, names));
  }
  return covers;
}

std::vector<double> FaultArguments::camera_shares() const {
  const auto source = choice_or("source", "common", {"left", "right", "common", "difference"});
  const auto& names = site_.camera_names;
  if ((source == "left" || source == "right") && std::find(names.begin(), names.end(), source) == names.end()) {
    fail("source", "a camera of this rig (" + list_of(names) + ") or common");
  }
  if (source == "difference" && names.size() < 2) fail("source", "common: this rig has one camera");
  std::vector<double> shares(site_.cameras, 1.0);
  for (std::size_t c = 0; c < shares.size(); ++c) {
    if (source == "left" || source == "right") shares[c] = names[c] == source ? 1.0 : 0.0;
    if (source == "difference") shares[c] = c == 0 ? 0.5 : -0.5;
  }
  return shares;
}

Eigen::Vector3d FaultArguments::axis() const {
  return Eigen::Vector3d::Unit(choice_or("axis", "x", {"x", "y", "z"})[0] - 'x');
}

FaultSite::FaultSite(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig)
    : model(std::move(robot)), hand_link(setup.hand_link), gravity_W(setup.gravity_W), cameras(rig.cameras.size()) {
  std::vector<std::string> links = {setup.hand_link};
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  const std::size_t first_camera = links.size();
  for (const auto& camera : rig.cameras) {
    links.push_back(camera.link);
    camera_names.push_back(camera.name);
  }
  ForwardKinematics kinematics(model, links);
  std::vector<Pose> poses(links.size());
  kinematics.compute(setup.default_joints(*model), poses);

  mount_link = model->root_link();
  for (Eigen::Index joint = 0; joint < model->joint_count(); ++joint) {  // breadth first: the last one is the nearest
    bool all = cameras > 0;
    for (std::size_t c = 0; c < cameras; ++c) all &= kinematics.moves(joint, first_camera + c);
    if (all) mount_link = model->joints()[static_cast<std::size_t>(joint)].child_link;
  }
  if (cameras > 0) {
    Pose X_WK = poses[first_camera];
    for (std::size_t c = 1; c < cameras; ++c) X_WK.translation() += poses[first_camera + c].translation();
    X_WK.translation() /= static_cast<double>(cameras);
    Pose X_WM;
    ForwardKinematics(model, {mount_link}).compute(setup.default_joints(*model), {&X_WM, 1});
    X_MK = X_WM.inverse(Eigen::Isometry) * X_WK;
  }

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

std::vector<std::size_t> FaultSite::covers_of(const std::string& part) const {
  std::vector<std::size_t> covers;
  const auto meshes = model->meshes();
  if (part == "all") {
    for (std::size_t i = 0; i < meshes.size(); ++i) covers.push_back(i);
    return covers;
  }
  const bool known = part == "hand" || part == "palm" || part == "fingers" || part == "forearm" || part == "upper_arm";
  if (!known) {
    for (std::size_t begin = 0; begin <= part.size();) {
      const std::size_t end = std::min(part.find('+', begin), part.size());
      const auto found = std::find_if(meshes.begin(), meshes.end(),
                                      [&](const auto& mesh) { return mesh.link == part.substr(begin, end - begin); });
      if (found == meshes.end()) return {};
      covers.push_back(static_cast<std::size_t>(found - meshes.begin()));
      begin = end + 1;
    }
    return covers;
  }
  std::vector<std::string> links;
  for (const auto& mesh : meshes) links.push_back(mesh.link);
  links.push_back(hand_link);
  const ForwardKinematics kinematics(model, links);
  const std::size_t n = arm.size();
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    std::size_t moved_by = 0;
    for (const auto joint : arm) moved_by += kinematics.moves(joint, i) ? 1 : 0;
    bool rigid_with_hand = true;
    for (Eigen::Index joint = 0; joint < model->joint_count(); ++joint) {
      rigid_with_hand &= kinematics.moves(joint, i) == kinematics.moves(joint, meshes.size());
    }
    // The wrist is the last two joints; the joint before them turns the forearm, and the one before that is the
    // elbow.
    const bool hand = moved_by == n;
    const bool forearm = !hand && moved_by + 3 >= n && moved_by + 2 <= n;
    const bool wanted = part == "hand"      ? hand
                        : part == "palm"    ? hand && rigid_with_hand
                        : part == "fingers" ? hand && !rigid_with_hand
                        : part == "forearm" ? forearm
                                            : !hand && moved_by > 0 && moved_by + 3 < n;
    if (wanted) covers.push_back(i);
  }
  return covers;
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
                                               faults::random_walk(),
                                               faults::camera_rotation(),
                                               faults::camera_position(),
                                               faults::cover_dilation(),
                                               faults::hand_size(),
                                               faults::held(),
                                               faults::stalled_encoder(),
                                               faults::exposure_time(),
                                               faults::readout_time()};
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
