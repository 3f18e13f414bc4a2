#include "bodyschema/pipeline/export_correction.hpp"

#include <spdlog/fmt/fmt.h>
#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/core/yaml_name.hpp"
#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/pipeline/ros_files.hpp"
#include "bodyschema/robot/urdf_origin.hpp"
#include "cameras_json.hpp"
#include "estimate_json.hpp"
#include "model_hash.hpp"

namespace bodyschema {
namespace {

using tinyxml2::XMLElement;

constexpr double kHardlyKnown_deg = 0.5;
constexpr const char* kHeadOffset = "head_offset";

Eigen::Vector3d triple(const XMLElement* element, const char* attribute, const Eigen::Vector3d& fallback) {
  return urdf_triple(element != nullptr ? element->Attribute(attribute) : nullptr, fallback);
}

/// The joint's origin, made where there is none.
XMLElement* origin_of(tinyxml2::XMLDocument& document, XMLElement* joint) {
  XMLElement* origin = joint->FirstChildElement("origin");
  if (origin == nullptr) {
    origin = document.NewElement("origin");
    joint->InsertFirstChild(origin);
  }
  return origin;
}

void correct_joint(tinyxml2::XMLDocument& document, XMLElement* joint, double offset) {
  XMLElement* origin = origin_of(document, joint);
  const Eigen::Vector3d axis = triple(joint->FirstChildElement("axis"), "xyz", Eigen::Vector3d::UnitX()).normalized();
  const Eigen::Matrix3d R = urdf_rotation(triple(origin, "rpy", Eigen::Vector3d::Zero()));
  if (std::string(joint->Attribute("type")) == "prismatic") {
    const Eigen::Vector3d p = triple(origin, "xyz", Eigen::Vector3d::Zero()) - R * axis * offset;
    origin->SetAttribute("xyz", urdf_text(p).c_str());
  } else {
    const Eigen::Matrix3d turned = R * Eigen::AngleAxisd(-offset, axis).toRotationMatrix();
    origin->SetAttribute("rpy", urdf_text(urdf_rpy(turned)).c_str());
  }
  if (XMLElement* limit = joint->FirstChildElement("limit")) {
    for (const char* side : {"lower", "upper"}) {
      double value = 0.0;
      if (limit->QueryDoubleAttribute(side, &value) == tinyxml2::XML_SUCCESS) {
        limit->SetAttribute(side, value + offset);
      }
    }
  }
}

/// Moves the joint within its own frame.
void move_joint(tinyxml2::XMLDocument& document, XMLElement* joint, const Pose& X) {
  XMLElement* origin = origin_of(document, joint);
  const Eigen::Matrix3d R = urdf_rotation(triple(origin, "rpy", Eigen::Vector3d::Zero()));
  const Eigen::Vector3d p = triple(origin, "xyz", Eigen::Vector3d::Zero()) + R * X.translation();
  origin->SetAttribute("xyz", urdf_text(p).c_str());
  if (!X.linear().isIdentity(1e-12)) origin->SetAttribute("rpy", urdf_text(urdf_rpy(R * X.linear())).c_str());
}

void place_joint(tinyxml2::XMLDocument& document, XMLElement* joint, const JointPlacement& placement) {
  XMLElement* axis_element = joint->FirstChildElement("axis");
  Eigen::Vector3d axis = triple(axis_element, "xyz", Eigen::Vector3d::UnitX()).normalized();
  Pose along = Pose::Identity();
  along.translation() = placement.along_m * axis;
  move_joint(document, joint, along);
  XMLElement* origin = origin_of(document, joint);
  const Eigen::Vector3d p = triple(origin, "xyz", Eigen::Vector3d::Zero()) + placement.shift_m;
  origin->SetAttribute("xyz", urdf_text(p).c_str());
  const double angle = placement.tilt.norm();
  if (angle == 0.0) return;
  const Eigen::Matrix3d R = urdf_rotation(triple(origin_of(document, joint), "rpy", Eigen::Vector3d::Zero()));
  axis = R.transpose() * (Eigen::AngleAxisd(angle, placement.tilt / angle) * (R * axis));
  if (axis_element == nullptr) {
    axis_element = document.NewElement("axis");
    joint->InsertEndChild(axis_element);
  }
  axis_element->SetAttribute("xyz", urdf_text(axis).c_str());
}

XMLElement* find_joint_of_child(XMLElement* robot, const std::string& link) {
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const XMLElement* child = joint->FirstChildElement("child");
    const char* name = child != nullptr ? child->Attribute("link") : nullptr;
    if (name != nullptr && link == name) return joint;
  }
  return nullptr;
}

XMLElement* find_joint(XMLElement* robot, const std::string& name) {
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    const char* own = joint->Attribute("name");
    if (own != nullptr && name == own && joint->Attribute("type") != nullptr) return joint;
  }
  return nullptr;
}

/// Offsets that were found with an extended model are wrong without it, and the other way round.
void check_same_extended_model(const std::filesystem::path& summary, const nlohmann::ordered_json& json,
                               const RobotSetup& setup, const std::optional<ErrorModel>& model) {
  const bool made_with = json.contains("extended_model");
  if (made_with && !model) {
    throw ConfigurationError(summary.string() +
                             ": made with an extended model; expected the same one here (--extended-model)");
  }
  if (!made_with && model) {
    throw ConfigurationError(summary.string() + ": made without an extended model, but robot.extended_model is '" +
                             setup.extended_model.string() + "'; expected a replay made with it");
  }
  if (made_with && json["extended_model"] != error_model_json(*model)) {
    throw ConfigurationError(summary.string() + ": made with another extended model than '" +
                             setup.extended_model.string() + "'; expected the one of the replay");
  }
}

/// Offsets that were found with one URDF are wrong in another; in one that has been corrected by them, double.
/// @param warnings  out: what is wrong, where that is accepted
void check_same_robot(const std::filesystem::path& summary, const nlohmann::ordered_json& json, const RobotSetup& setup,
                      const std::string& hash, bool anyway, std::vector<std::string>& warnings) {
  if (!json.contains("model_hash") || json["model_hash"] == hash) return;
  const std::string difference =
      fmt::format("made with the robot of model_hash {}, but robot.urdf '{}' with its meshes has \"{}\"",
                  json["model_hash"].dump(), setup.model.urdf.string(), hash);
  if (!anyway) {
    throw ConfigurationError(summary.string() + ": " + difference + "; expected the URDF of the replay (--anyway)");
  }
  warnings.push_back(difference);
}

/// cameras.yaml and ros/ hold the configuration's cameras with what the replay found of them.
/// @param warnings  out: what is wrong, where that is accepted
void check_same_cameras(const std::filesystem::path& summary, const nlohmann::ordered_json& json, const StereoRig& rig,
                        bool anyway, std::vector<std::string>& warnings) {
  if (!json.contains("cameras")) return;  // older replays do not say
  const std::string difference = difference_of_cameras(json["cameras"], cameras_json(rig));
  if (difference.empty()) return;
  if (!anyway) {
    throw ConfigurationError(summary.string() + ": made with " + difference +
                             "; expected the configuration of the replay (--config, or --anyway)");
  }
  warnings.push_back("made with " + difference);
}

std::string joints_yaml(const std::vector<std::pair<std::string, double>>& angles_rad) {
  std::string text;
  for (const auto& [joint, angle] : angles_rad) text += fmt::format("  {}: {:.4f}\n", yaml_name(joint), degrees(angle));
  return text;
}

std::string joints_delta(const std::vector<std::pair<std::string, double>>& offsets_rad) {
  std::string text;
  for (const auto& [joint, offset] : offsets_rad) text += fmt::format("{:<24} {:+.4f}\n", joint, degrees(offset));
  return text;
}

std::string mount_yaml(const CameraModel& camera, const CameraModel& first) {
  const CameraMount& mount = camera.mount;
  std::string text;
  if (mount.relative) {
    text = fmt::format("    beside: {}\n    X_beside_optical: {}\n", yaml_name(first.name), pose_yaml(mount.X_PC));
  } else if (camera.link == mount.parent) {
    text = fmt::format("    link: {}\n", yaml_name(camera.link));
    if (mount.knowledge == PlaceKnowledge::kExact) return text;
  } else {
    text = fmt::format("    link: {}\n    X_link_optical: {}\n", yaml_name(mount.parent), pose_yaml(mount.X_PC));
  }
  constexpr std::array<const char*, 4> kKnowledge = {"exact", "known", "roughly", "unknown"};
  text += fmt::format("    pose: {}\n", kKnowledge[static_cast<std::size_t>(mount.knowledge)]);
  if (mount.knowledge == PlaceKnowledge::kRoughly) {
    const Eigen::Vector3d deg = degrees(1.0) * mount.sd_rad, mm = 1e3 * mount.sd_m;
    text += fmt::format("    pose_sd_deg: [{:.6g}, {:.6g}, {:.6g}]\n    pose_sd_mm: [{:.6g}, {:.6g}, {:.6g}]\n",
                        deg.x(), deg.y(), deg.z(), mm.x(), mm.y(), mm.z());
  }
  return text;
}

std::string cameras_yaml(const StereoRig& rig) {
  std::string text =
      "# Cameras as found: px; distortion k1 k2 p1 p2 k3 as OpenCV; m. To be included behind robot.yaml, or put in\n"
      "# place of its section of the same name; do not load an extended model as well.\ncameras:\n";
  for (const auto& camera : rig.cameras) {
    const auto& k = camera.intrinsics;
    const auto& d = camera.distortion;
    text += fmt::format(
        "  {}:\n{}    image_type: {}\n    width: {}\n    height: {}\n    fx: {:.4f}\n    fy: {:.4f}\n"
        "    cx: {:.4f}\n    cy: {:.4f}\n    distortion: [{:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}]\n",
        yaml_name(camera.name), mount_yaml(camera, rig.cameras.front()), camera.number(), k.width, k.height, k.fx, k.fy,
        k.cx, k.cy, d[0], d[1], d[2], d[3], d[4]);
  }
  return text;
}

std::string applied_text(const std::vector<AppliedEffect>& applied, bool extended) {
  std::string yes, no;
  for (const auto& effect : applied) {
    (effect.applied.empty() ? no : yes) +=
        fmt::format("  {}: {}{}\n", effect.effect, effect.applied.empty() ? "" : "in " + effect.applied,
                    effect.remark.empty() ? "" : (effect.applied.empty() ? "" : "; ") + effect.remark);
  }
  std::string text;
  if (!yes.empty()) text += "Beside the offsets these files hold:\n" + yes;
  if (!no.empty()) {
    text += "They cannot hold the following:\n" + no;
    if (extended) {
      text +=
          "For those of the extended model load extended_model.yaml in bodyschemad or bodyschema replay\n"
          "(--extended-model), with the original URDF and cameras. Beside corrected.urdf it would apply twice what\n"
          "that holds.\n";
    }
  }
  return text.empty() ? "Only joint offsets; those of the replay are used.\n" : text;
}

}  // namespace

Correction read_correction(const std::filesystem::path& summary, bool anyway) {
  std::ifstream stream(summary);
  if (!stream) throw FileError(summary.string() + ": no such file; expected a replay's summary.json");
  Correction correction;
  std::string state;
  try {
    const auto json = nlohmann::ordered_json::parse(stream);
    if (!json.contains("estimate") && json.contains("outline_px")) {
      throw FileError(summary.string() +
                      ": that of a calibration, which writes these files itself (bodyschema calibrate --out FOLDER: "
                      "corrected.urdf, offsets.yaml, cameras.yaml, ros/); expected a replay's summary.json");
    }
    const auto& estimate = json.at("estimate");
    state = estimate.at("state").get<std::string>();
    const auto read_joints = [&](const char* key, std::vector<std::pair<std::string, double>>& list) {
      for (const auto& [joint, value] : estimate.at(key).items()) {
        list.emplace_back(joint, radians(value.get<double>()));
      }
    };
    read_joints("offset_deg", correction.offsets_rad);
    read_joints("stddev_deg", correction.sd_rad);
    if (estimate.contains("nuisance") || !estimate.contains("told")) {
      throw FileError(summary.string() + ": the estimate is that of an older version; replay the log again");
    }
    for (const auto& entry : estimate.value("effects", nlohmann::ordered_json::array())) {
      EstimatedParameter p;
      p.effect = entry.at("name").get<std::string>();
      p.joint = entry.value("joint", "");
      p.source = entry.value("source", "");
      p.parameter = entry.at("parameter").get<std::string>();
      p.unit = entry.at("unit").get<std::string>();
      p.value = entry.at("value").get<double>();
      p.sd = entry.at("stddev").get<double>();
      correction.effects.push_back(std::move(p));
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(summary.string() + ": not a replay's summary.json: " + e.what());
  }
  if (state != to_string(EstimatorState::kConverged)) {
    const std::string ending = "the replay ended as '" + state + "'; its offsets are not to be applied";
    if (!anyway) throw DataError(summary.string() + ": " + ending + " (--anyway)");
    correction.warnings.push_back(ending);
  }
  const auto warn = [&](const std::string& joint, double sd_deg) {
    if (sd_deg <= kHardlyKnown_deg) return;
    correction.warnings.push_back(
        fmt::format("{}: known to {:.2f} deg only (one sigma); this motion hardly told it", joint, sd_deg));
  };
  for (const auto& [joint, sd] : correction.sd_rad) warn(joint, degrees(sd));
  for (const auto& p : correction.effects) {
    if (p.effect == kHeadOffset) warn(p.joint, p.sd);
  }
  return correction;
}

void write_corrected_urdf(const std::filesystem::path& urdf, const Correction& correction,
                          const std::filesystem::path& out) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(urdf.c_str()) != tinyxml2::XML_SUCCESS) {
    throw FileError(urdf.string() + ": cannot be read as XML");
  }
  XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) throw FileError(urdf.string() + ": has no <robot>");
  const auto joint_named = [&](const std::string& name) {
    XMLElement* joint = find_joint(robot, name);
    if (joint == nullptr) {
      throw FileError(urdf.string() + ": has no joint '" + name + "', which the result corrects");
    }
    return joint;
  };
  // Axes first: offsets turn about the axes as they are.
  for (const auto& placement : correction.placements) {
    place_joint(document, joint_named(placement.joint), placement);
  }
  for (const auto& [link, moved] : correction.frame_motions) {
    XMLElement* joint = find_joint_of_child(robot, link);
    if (joint == nullptr) throw FileError(urdf.string() + ": no joint carries link '" + link + "'");
    move_joint(document, joint, moved);
  }
  for (const auto* list : {&correction.offsets_rad, &correction.known_offsets_rad}) {
    for (const auto& [name, offset] : *list) correct_joint(document, joint_named(name), offset);
  }
  for (auto warning = correction.warnings.rbegin(); warning != correction.warnings.rend(); ++warning) {
    std::string text = ' ' + *warning + ' ';
    for (auto at = text.find("--"); at != std::string::npos; at = text.find("--")) text.erase(at, 1);  // ends it
    robot->InsertFirstChild(document.NewComment(text.c_str()));
  }
  tinyxml2::XMLPrinter text;
  document.Print(&text);
  replace_file(out, text.CStr());
}

namespace {

/// What is known beyond the URDF and beyond joint offsets: the extended model, with what the replay estimated.
ErrorModel known_effects(const std::optional<ErrorModel>& model, const JointRoles& roles,
                         const std::vector<EstimatedParameter>& estimated, const std::string& summary) {
  ErrorModel all = model ? *model : ErrorModel(roles);
  for (const auto& p : estimated) {
    try {
      auto& effect = all.add(p.effect, {p.joint, p.source});
      const auto parameters = effect.parameters();
      const auto at =
          std::find_if(parameters.begin(), parameters.end(), [&](const auto& q) { return q.name == p.parameter; });
      if (at == parameters.end()) throw ConfigurationError("'" + p.effect + "' has no parameter '" + p.parameter + "'");
      at->value = p.value * at->si_per_unit;
    } catch (const ConfigurationError& e) {
      throw FileError(summary + ": estimate.effects: " + e.what());
    }
  }
  return all;
}

}  // namespace

std::string export_correction(const std::filesystem::path& summary, const RobotSetup& setup, const StereoRig& rig,
                              const std::filesystem::path& out, bool anyway) {
  Correction correction = read_correction(summary, anyway);
  const auto robot = load_robot(setup, rig);
  const auto roles = JointRoles::of(robot, setup, rig);
  std::optional<ErrorModel> model;
  if (!setup.extended_model.empty()) model = ErrorModel::load(setup.extended_model, roles);
  std::ifstream stream(summary);
  const auto json = nlohmann::ordered_json::parse(stream);
  check_same_extended_model(summary, json, setup, model);
  check_same_robot(summary, json, setup, model_hash_of(setup, *robot, model), anyway, correction.warnings);
  check_same_cameras(summary, json, rig, anyway, correction.warnings);
  const auto all = known_effects(model, roles, correction.effects, summary.string());
  const auto applied = add_effects(all, robot, setup, rig, correction);
  make_folder(out);
  write_corrected_urdf(setup.model.urdf, correction, out / "corrected.urdf");
  std::string yaml = "# encoder = true + offset: subtract from every encoder reading. Degrees.\n";
  std::string delta =
      "# deg to add to each joint's calibrationDelta (the calibrator adds it to the zero, which lowers\n"
      "# the reading by as much)\n";
  if (all.size() > 0) {
    const std::string note =
        "# Estimated together with other effects, and right together with them; what_was_applied.txt says where each\n"
        "# of them went.\n";
    yaml += note;
    delta += note;
  }
  std::string warnings, marks;
  for (const auto& warning : correction.warnings) {
    warnings += "warning: " + warning + '\n';
    marks += "# " + warning + '\n';
  }
  yaml += marks;
  delta += marks;
  yaml += "version: 1\noffset_deg:\n" + joints_yaml(correction.offsets_rad);
  yaml += "stddev_deg:\n" + joints_yaml(correction.sd_rad);
  delta += joints_delta(correction.offsets_rad);
  std::vector<std::pair<std::string, double>> head, head_sd;
  std::string others;
  for (const auto& p : correction.effects) {
    if (p.effect == kHeadOffset) {
      // Encoder = true + offset, and the effect is true minus encoder.
      head.emplace_back(p.joint, radians(-p.value));
      head_sd.emplace_back(p.joint, radians(p.sd));
    } else {
      const auto name = make_effect(p.effect, {p.joint, p.source}, roles)->description() + " " + p.parameter;
      others += fmt::format("  {}: {{value: {:.6g}, stddev: {:.6g}, unit: \"{}\"}}\n", name, p.value, p.sd, p.unit);
    }
  }
  if (!head.empty()) {
    yaml += "# Of the head's joints. Arm and head offsets hold together: apply both or neither.\n";
    yaml += "head_offset_deg:\n" + joints_yaml(head) + "head_stddev_deg:\n" + joints_yaml(head_sd);
    delta += "# head; holds together with the arm: apply both or neither\n" + joints_delta(head);
  }
  if (!others.empty()) yaml += "# What else was estimated.\neffects:\n" + others;
  replace_file(out / "offsets.yaml", yaml);
  replace_file(out / "calibration_delta.txt", delta);
  std::string files =
      warnings + fmt::format("corrected URDF        {}\noffsets by joint      {}\niCub calibrationDelta {}\n",
                             (out / "corrected.urdf").string(), (out / "offsets.yaml").string(),
                             (out / "calibration_delta.txt").string());
  const StereoRig found = corrected_rig(all, robot, setup, rig);
  files += write_ros_files(out / "ros", setup.model.urdf, out / "corrected.urdf", correction, ros_cameras_of(found));
  if (applied.empty()) return files;
  const bool cameras =
      std::any_of(applied.begin(), applied.end(), [](const auto& a) { return a.applied == "cameras.yaml"; });
  if (cameras) {
    replace_file(out / "cameras.yaml", marks + cameras_yaml(found));
    files += fmt::format("cameras               {}\n", (out / "cameras.yaml").string());
  }
  const std::string report = applied_text(applied, model.has_value());
  replace_file(out / "what_was_applied.txt", report);
  files += fmt::format("where effects went    {}\n\n{}", (out / "what_was_applied.txt").string(), report);
  return files;
}

}  // namespace bodyschema
