#include "calibration_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "bodyschema/core/write_file.hpp"
#include "bodyschema/core/yaml_name.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/pipeline/export_correction.hpp"
#include "bodyschema/pipeline/overlay.hpp"
#include "bodyschema/pipeline/pose_json.hpp"
#include "bodyschema/pipeline/ros_files.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/report/report.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

Json parameter_json(const CalibratedParameter& p) {
  Json json = {{"name", p.name}, {"unit", p.unit}, {"value", p.value}, {"stddev", p.sd}};
  if (p.prior_sd > 0.0) json["prior_stddev"] = p.prior_sd;
  return json;
}

Json to_json(const Calibration& c, const std::string& root) {
  Json json;
  json["state"] = to_string(c.state);
  json["sentence"] = c.sentence;
  json["told"] = json["applied"] = Json::array();
  for (const auto& joint : c.joints) {
    json["offset_deg"][joint.name] = degrees(joint.offset_rad);
    json["stddev_deg"][joint.name] = degrees(joint.sd_rad);
    if (joint.told) json["told"].push_back(joint.name);
    if (joint.applied) json["applied"].push_back(joint.name);
    if (joint.told) continue;
    json["untold"][joint.name] = joint.untold_why;
    json["pictures_alone"][joint.name] = {{"offset_deg", degrees(joint.seen_rad)},
                                          {"stddev_deg", degrees(joint.seen_sd_rad)}};
  }
  for (const auto& camera : c.cameras) {
    auto& entry = json["cameras"][camera.name];
    entry["link"] = camera.link;
    entry[camera.link == root ? "X_base_optical" : "X_" + camera.link + "_optical"] = pose_json(camera.X_link_optical);
    entry["estimated"] = camera.estimated;
    entry["sd_mm"] = 1e3 * camera.sd_m;
    entry["sd_deg"] = degrees(camera.sd_rad);
    if (camera.estimated && !c.joints.empty()) {
      entry["if_first_joint_were_known"] = {{"joint", c.joints.front().name},
                                            {"turn_about_it_sd_deg", degrees(c.joints.front().sd_rad)},
                                            {"sd_mm", 1e3 * camera.sd_m_beside_first_joint},
                                            {"sd_deg", degrees(camera.sd_rad_beside_first_joint)}};
    }
  }
  for (const auto& view : c.views) {
    json["views"].push_back({{"utime", view.utime},
                             {"camera", c.cameras[view.camera].name},
                             {"X_camera_hand", pose_json(view.X_camera_hand)}});
  }
  json["outline_px"] = {{"before", c.outline_px.before}, {"after", c.outline_px.after}};
  if (c.outline_px.heldout) {
    json["outline_px"]["heldout"] = *c.outline_px.heldout;
    json["outline_px"]["heldout_worst"] = *c.outline_px.heldout_worst;
  }
  json["parameters"] = Json::array();
  for (const auto& p : c.parameters) json["parameters"].push_back(parameter_json(p));
  json["effects"] = Json::array();
  for (const auto& e : c.effects) {
    Json entry = {{"effect", e.effect}, {"sentence", e.sentence}, {"parameters", Json::array()}};
    if (!e.joint.empty()) entry["joint"] = e.joint;
    if (!e.source.empty()) entry["source"] = e.source;
    for (const auto& p : e.parameters) entry["parameters"].push_back(parameter_json(p));
    json["effects"].push_back(std::move(entry));
  }
  json["hand_sd_mm"] = 1e3 * c.hand_sd_m;
  json["postures"] = c.postures;
  json["pictures"] = c.pictures;
  json["dispersion"] = c.dispersion;
  json["posture_sd_deg"] = degrees(c.posture_sd_rad);
  json["outline"] = {{"stddev_px", c.outline_sd_px}, {"points_alike", c.outline_points_alike}};
  json["remarks"] = c.remarks;
  if (!c.next_posture_rad.empty()) {
    json["next_posture_for"] = c.next_posture_for;
    for (const auto& [joint, angle] : c.next_posture_rad) json["next_posture_deg"][joint] = degrees(angle);
  }
  return json;
}

/// What of a joint that is not told the files and tables say.
std::string why_so(const CalibratedJoint& joint) {
  if (joint.told) return {};
  if (joint.applied) return "hardly told: " + joint.untold_why;
  return fmt::format("not told: {}; the pictures alone make it {:.2f}, sd {:.2f}", joint.untold_why,
                     degrees(joint.seen_rad), degrees(joint.seen_sd_rad));
}

/// For the top of what is not to be applied; empty where it is.
std::string warning_of(const Calibration& c) {
  return c.state == CalibrationState::kGood ? "" : "NOT TO BE APPLIED. " + c.sentence;
}

/// What is to be applied, as the exporter takes it.
Correction correction_of(const Calibration& c) {
  Correction correction;
  if (const auto warning = warning_of(c); !warning.empty()) correction.warnings.push_back(warning);
  for (const auto& joint : c.joints) {
    if (!joint.applied) {
      correction.warnings.push_back(joint.name + " is left as it is: " + joint.untold_why);
      continue;
    }
    correction.offsets_rad.emplace_back(joint.name, joint.offset_rad);
    correction.sd_rad.emplace_back(joint.name, joint.sd_rad);
  }
  return correction;
}

/// What a URDF can hold besides: the head's offsets, lengths, how hands are mounted; the offsets hold together with it.
/// Of a result that is not good nothing: a mount takes up what is wrong elsewhere, and its standard deviation does not
/// say so. Cameras have a file of their own.
void add_geometry(const Calibration& calibration, const BatchFit& batch, const PictureLog& log,
                  const Pipeline& pipeline, bool all, Correction& correction) {
  if (calibration.state != CalibrationState::kGood && !all) return;
  ErrorModel geometry(log.roles());
  const auto& model = batch.state().model();
  for (std::size_t e = 0; e < model.size(); ++e) {
    const auto parameters = model[e].parameters();
    const bool differs =
        std::any_of(parameters.begin(), parameters.end(), [](const auto& p) { return p.value != 0.0; });
    if (differs && effect_kind(model[e].name()).home == EffectHome::kUrdf && !places_cameras(model[e].name())) {
      geometry.add(model[e].clone());
    }
  }
  add_effects(geometry, log.robot(), pipeline.setup(), log.rig(), correction);
}

std::string warning_comment(const Calibration& c) {
  const std::string warning = warning_of(c);
  return warning.empty() ? warning : "# " + warning + '\n';
}

std::string offsets_yaml(const Calibration& c, const Correction& correction) {
  std::string text =
      warning_comment(c) + "# encoder = true + offset: subtract from every encoder reading. Degrees.\nversion: 1\n";
  std::string offsets = "offset_deg:\n", sds = "stddev_deg:\n";
  for (const auto& joint : c.joints) {
    if (!joint.applied) {
      text += fmt::format("# {} is left out: {}\n", joint.name, joint.untold_why);
      continue;
    }
    offsets += fmt::format("  {}: {:.4f}\n", yaml_name(joint.name), degrees(joint.offset_rad));
    sds += fmt::format("  {}: {:.4f}\n", yaml_name(joint.name), degrees(joint.sd_rad));
  }
  std::string head;
  for (const auto& [joint, offset] : correction.known_offsets_rad) {
    head += fmt::format("  {}: {:.4f}\n", yaml_name(joint), degrees(offset));
  }
  if (!head.empty())
    head = "# Of the head's joints; arm and head hold together: apply both or neither.\nhead_offset_deg:\n" + head;
  return text + offsets + sds + head;
}

std::string cameras_yaml(const Calibration& c) {
  std::string text =
      warning_comment(c) +
      "# Cameras as found: to be included behind robot.yaml, or put in place of its section.\ncameras:\n";
  constexpr double kLeast_m = 1e-5, kLeast_rad = 2e-5;  // that a configuration takes
  for (const auto& camera : c.cameras) {
    const auto& k = camera.intrinsics;
    const auto& d = camera.distortion;
    const auto& beside = camera.beside;
    const Eigen::Matrix4d X = (beside ? beside->X_first_optical : camera.X_link_optical).matrix();
    const Eigen::Vector3d mm = 1e3 * (beside ? beside->axes_sd_m : camera.axes_sd_m).cwiseMax(kLeast_m);
    const Eigen::Vector3d deg = degrees(1.0) * (beside ? beside->axes_sd_rad : camera.axes_sd_rad).cwiseMax(kLeast_rad);
    // The other way to place a camera is taken out of what this is included behind.
    text += beside ? fmt::format("  {}:\n    link: ~\n    X_link_optical: ~\n    beside: {}\n    X_beside_optical:\n",
                                 yaml_name(camera.name), yaml_name(beside->camera))
                   : fmt::format("  {}:\n    beside: ~\n    X_beside_optical: ~\n    link: {}\n    X_link_optical:\n",
                                 yaml_name(camera.name), yaml_name(camera.link));
    for (int r = 0; r < 4; ++r) {
      text += fmt::format("      - [{:.9f}, {:.9f}, {:.9f}, {:.9f}]\n", X(r, 0), X(r, 1), X(r, 2), X(r, 3));
    }
    if (beside ? beside->estimated : camera.estimated) {
      text += fmt::format(
          "    pose: roughly                  # along and about each of its axes\n"
          "    pose_sd_deg: [{:.4f}, {:.4f}, {:.4f}]\n    pose_sd_mm: [{:.3f}, {:.3f}, {:.3f}]\n",
          deg.x(), deg.y(), deg.z(), mm.x(), mm.y(), mm.z());
    } else {
      text += "    pose: exact\n";
    }
    text += fmt::format(
        "    width: {}\n    height: {}\n    fx: {:.4f}\n    fy: {:.4f}\n    cx: {:.4f}\n    cy: {:.4f}\n"
        "    distortion: [{:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}]\n",
        k.width, k.height, k.fx, k.fy, k.cx, k.cy, d[0], d[1], d[2], d[3], d[4]);
  }
  return text;
}

/// What the arm may be built otherwise by, so that whoever goes on with these cameras believes it too.
std::string arm_build_yaml(const ArmBuild& build) {
  return fmt::format(
      "# How far joints lie beside where the URDF has them, and axes are tilted, as the log tells (standard "
      "deviations).\n"
      "{}:\n  {}:\n    joint_place: {{sd_mm: {:.3f}}}\n    axis_tilt: {{sd_deg: {:.4f}}}\n",
      build.estimated ? "estimator" : "robot", build.estimated ? "state" : "tolerances", 1e3 * build.beside_sd_m,
      degrees(build.tilted_sd_rad));
}

/// The configuration as it was, with the cameras as found: what replay, diagnose and the service go on with.
std::string estimator_yaml(const CalibrationOptions& options, const std::optional<ArmBuild>& build) {
  namespace fs = std::filesystem;
  const fs::path before = fs::proximate(fs::absolute(options.configuration), fs::absolute(options.out));
  std::string quoted;
  for (const char c : before.generic_string()) quoted += c == '\'' ? "''" : std::string(1, c);
  return fmt::format(
      "# The configuration that was calibrated, with its cameras where they were found.\ninclude: ['{}', "
      "cameras.yaml]\n{}",
      quoted, build ? arm_build_yaml(*build) : "");
}

/// Where the URDF itself places a camera, and nothing else was found, it stays with the URDF.
std::vector<RosCamera> ros_cameras_of(const Calibration& c, const StereoRig& rig) {
  std::vector<RosCamera> cameras;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const auto& camera = c.cameras[i];
    const bool as_in_urdf =
        camera.link == rig.cameras[i].link && camera.X_link_optical.isApprox(Pose::Identity(), 1e-12);
    cameras.push_back(
        {camera.name, camera.intrinsics, camera.distortion, as_in_urdf ? "" : camera.link, camera.X_link_optical});
  }
  return cameras;
}

/// Remarks but for those that a table of joints has beside each.
std::vector<std::string> notes_of(const Calibration& c) {
  std::vector<std::string> notes = c.remarks;
  for (const auto& joint : c.joints) std::erase(notes, joint.name + ": " + joint.untold_why);
  return notes;
}

/// Every joint of a finger has an offset in the state; where nothing is found of one, a line of it says nothing.
bool worth_a_line(const CalibratedParameter& p) {
  return !p.name.starts_with("finger_offset") || std::abs(p.value) >= p.sd;
}

void write_page(const Calibration& c, const BatchFit& batch, PictureLog& log, const std::vector<Observation>& kept,
                const CalibrationOptions& options) {
  Report page("Calibration of " + options.log.filename().string());
  page.verdict(c.sentence);
  page.heading("Offsets of the joints");
  page.paragraph(
      "encoder = true + offset; one standard deviation. What is not told stays as it is: zero, and how far off it is. "
      "All else is right together with that.");
  std::vector<std::vector<std::string>> rows;
  for (const auto& joint : c.joints) {
    rows.push_back({joint.name, fmt::format("{:.2f}", degrees(joint.offset_rad)),
                    fmt::format("{:.2f}", degrees(joint.sd_rad)), joint.told ? "told" : why_so(joint)});
  }
  page.table({"joint", "offset, deg", "sd, deg", ""}, rows);
  page.heading("Cameras");
  rows.clear();
  for (const auto& camera : c.cameras) {
    const Eigen::Vector3d p = camera.X_link_optical.translation();
    rows.push_back({camera.name, camera.link, fmt::format("{:.4f}, {:.4f}, {:.4f}", p.x(), p.y(), p.z()),
                    camera.estimated ? fmt::format("{:.1f}", 1e3 * camera.sd_m) : "as configured",
                    camera.estimated ? fmt::format("{:.2f}", degrees(camera.sd_rad)) : "as configured"});
  }
  page.table({"camera", "on link", "place in its frame, m", "sd, mm", "sd, deg"}, rows);
  if (!c.parameters.empty()) {
    page.heading("What else was estimated");
    rows.clear();
    const auto short_of = [](double value, int digits) {
      return std::abs(value) < 100.0 ? fmt::format("{:.{}g}", value, digits) : fmt::format("{:.0f}", value);
    };
    for (const auto& p : c.parameters) {
      if (!worth_a_line(p)) continue;
      rows.push_back({p.name, short_of(p.value, 3), short_of(p.sd, 2), short_of(p.prior_sd, 2), p.unit});
    }
    page.table({"effect", "value", "sd", "sd believed before", "unit"}, rows);
  }
  if (!c.effects.empty()) {
    page.heading("What else was found");
    std::vector<std::string> items;
    for (const auto& effect : c.effects) items.push_back(effect.sentence);
    page.list(items);
  }
  if (const auto notes = notes_of(c); !notes.empty()) {
    page.heading("What limits it");
    page.list(notes);
  }
  page.heading("How well it fits");
  rows = {{"before", fmt::format("{:.2f}", c.outline_px.before)}, {"after", fmt::format("{:.2f}", c.outline_px.after)}};
  if (c.outline_px.heldout)
    rows.push_back({"postures left out of the fit",
                    fmt::format("{:.2f}, worst part {:.2f}", *c.outline_px.heldout, *c.outline_px.heldout_worst)});
  page.table({"outline to outline, median", "px"}, rows);
  page.paragraph(
      fmt::format("{} pictures of {} distinct postures. One point of an outline errs by {:.2f} px, {:.0f} neighbours "
                  "alike; a posture "
                  "errs by {:.2f} deg per joint; postures disagree by {:.2f} times what is claimed.",
                  c.pictures, c.postures, c.outline_sd_px, c.outline_points_alike, degrees(c.posture_sd_rad),
                  std::sqrt(std::max(0.0, c.dispersion))));
  if (!c.next_posture_rad.empty()) {
    page.heading("What to record next");
    rows.clear();
    for (const auto& [joint, angle] : c.next_posture_rad)
      rows.push_back({joint, fmt::format("{:.1f}", degrees(angle))});
    page.paragraph("This posture would tell most of " + c.next_posture_for +
                   ", of those drawn at random within the joints' limits and in view. Check it for collisions.");
    page.table({"joint", "encoder, deg"}, rows);
  }
  page.heading("Pictures");
  page.paragraph("Outlines of encoders and model as they are (red) and of the calibration (green).");
  SilhouettePreview preview(log);
  const Corrections nothing = log.roles().no_corrections();
  for (const auto& observation : kept) {
    std::vector<OverlayView> views;
    for (std::size_t k = 0; k < observation.cameras.size(); ++k) {
      const auto& seen = observation.cameras[k];
      if (!seen || seen->image.empty()) continue;
      const auto picture = log.find(k, seen->utime);
      if (!picture) continue;
      const auto& q = log.pictures()[*picture].joints.q;
      views.push_back(
          {&seen->image, preview.draw(q, nothing, k), preview.draw(q, batch.at().corrections[*picture], k), {}});
      views.back().px_per_m = preview.hand_px_per_m();
    }
    if (views.empty()) continue;
    crop_to_arm(views);
    page.picture(draw_overlay(views, fmt::format("{:.1f} s", seconds(observation.utime - kept.front().utime)), 0,
                              {"encoders as they are", "calibrated"}),
                 fmt::format("{:.1f} s", seconds(observation.utime - kept.front().utime)));
  }
  page.write(options.out / "report.html");
}

}  // namespace

bool places_cameras(const std::string& effect) {
  return effect == "camera_pose" || effect == "camera_pair" || effect == "first_camera" || effect == "baseline";
}

void write_calibration(const Calibration& calibration, const BatchFit& batch, PictureLog& log,
                       const std::vector<Observation>& kept, const Pipeline& pipeline,
                       const Configuration& configuration, const CalibrationOptions& options) {
  Json json = to_json(calibration, log.robot()->root_link());
  json["log"] = options.log.filename().string();
  json["configuration_hash"] = configuration.hash();
  json["model_hash"] = pipeline.model_hash();
  replace_file(options.out / "calibration.json", json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
  write_page(calibration, batch, log, kept, options);
  Correction correction = correction_of(calibration);
  add_geometry(calibration, batch, log, pipeline, options.all_parameters, correction);
  replace_file(options.out / "offsets.yaml", offsets_yaml(calibration, correction));
  replace_file(options.out / "cameras.yaml", cameras_yaml(calibration));
  if (!options.configuration.empty())
    replace_file(options.out / "estimator.yaml", estimator_yaml(options, calibration.arm_build));
  write_corrected_urdf(pipeline.setup().model.urdf, correction, options.out / "corrected.urdf");
  write_ros_files(options.out / "ros", pipeline.setup().model.urdf, options.out / "corrected.urdf", correction,
                  ros_cameras_of(calibration, log.rig()));
}

std::string to_table(const Calibration& c) {
  std::string text = c.sentence + "\n\n";
  text += fmt::format("{:<24} {:>10} {:>8}\n", "joint", "offset deg", "sd deg");
  for (const auto& joint : c.joints) {
    text += fmt::format("{:<24} {:>10.2f} {:>8.2f}  {}\n", joint.name, degrees(joint.offset_rad), degrees(joint.sd_rad),
                        why_so(joint));
  }
  for (const auto& camera : c.cameras) {
    const Eigen::Vector3d p = camera.X_link_optical.translation();
    text += fmt::format(
        "\ncamera {:<16} at {:.4f} {:.4f} {:.4f} m in {}{}", camera.name, p.x(), p.y(), p.z(), camera.link,
        camera.estimated ? fmt::format(", known to {:.1f} mm and {:.2f} deg", 1e3 * camera.sd_m, degrees(camera.sd_rad))
                         : ", as configured");
  }
  text += "\n";
  for (const auto& p : c.parameters) {
    if (p.name.starts_with("camera_") || !worth_a_line(p)) continue;
    text +=
        fmt::format("\n{:<36} {:>9.3f} {:<3} sd {:.3f} (believed {:.3f})", p.name, p.value, p.unit, p.sd, p.prior_sd);
  }
  for (const auto& effect : c.effects) text += "\nalso: " + effect.sentence;
  for (const auto& note : notes_of(c)) text += "\nnote: " + note;
  text += fmt::format("\n\noutlines, median distance: {:.2f} px before, {:.2f} px after{}\n", c.outline_px.before,
                      c.outline_px.after,
                      c.outline_px.heldout ? fmt::format(", {:.2f} px on postures left out (worst part {:.2f})",
                                                         *c.outline_px.heldout, *c.outline_px.heldout_worst)
                                           : "");
  if (!c.next_posture_rad.empty()) {
    text += "to tell " + c.next_posture_for + " better, record this posture as well (deg; check it for collisions):";
    for (const auto& [joint, angle] : c.next_posture_rad) text += fmt::format(" {} {:.0f}", joint, degrees(angle));
    text += '\n';
  }
  return text;
}

}  // namespace bodyschema
