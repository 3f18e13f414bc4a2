#include "estimate_json.hpp"

#include <cmath>

#include "bodyschema/pipeline/estimate_line.hpp"
#include "bodyschema/pipeline/pose_json.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

Json finding_json(const Finding& f) {
  Json json = {{"effect", f.effect}};
  if (!f.joint.empty()) json["joint"] = f.joint;
  if (!f.source.empty()) json["source"] = f.source;
  json["sentence"] = f.sentence;
  for (const auto& p : f.parameters) {
    json["parameters"].push_back({{"parameter", p.name}, {"unit", p.unit}, {"value", p.value}, {"stddev", p.sd}});
  }
  json["z"] = f.z;
  json["hand_mm"] = f.hand_mm;
  json["outline_px"] = f.outline_px;
  if (f.from > 0) json["from_utime"] = f.from;
  if (!f.alike.empty()) json["alike"] = f.alike;
  if (f.estimated) json["estimated"] = true;
  return json;
}

}  // namespace

nlohmann::ordered_json estimate_json(const Estimate& e, const StereoRig& rig) {
  Json json;
  json["utime"] = e.utime;
  json["state"] = to_string(e.state);
  for (std::size_t k = 0; k < e.joint_names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    json["offset_deg"][e.joint_names[k]] = degrees(e.offset_rad(i));
    json["stddev_deg"][e.joint_names[k]] = degrees(std::sqrt(std::max(0.0, e.covariance_rad2(i, i))));
  }
  json["told"] = Json::array();
  for (std::size_t k = 0; k < e.joint_names.size(); ++k) {
    if (e.told(k)) json["told"].push_back(e.joint_names[k]);
  }
  for (const auto& p : e.effects) {
    Json entry = {{"name", p.effect}};
    if (!p.joint.empty()) entry["joint"] = p.joint;
    if (!p.source.empty()) entry["source"] = p.source;
    entry["parameter"] = p.parameter;
    entry["unit"] = p.unit;
    entry["value"] = p.value / p.si_per_unit;
    entry["stddev"] = p.sd / p.si_per_unit;
    entry["prior_stddev"] = p.prior_sd / p.si_per_unit;
    json["effects"].push_back(std::move(entry));
  }
  for (std::size_t c = 0; c < e.X_CP.size(); ++c) {
    json["hand_pose_" + rig.cameras[c].name + "_camera"] = pose_json(e.X_CP[c]);
  }
  json["likelihood"] = e.best_likelihood;
  json["effective_sample_size"] = e.effective_sample_size;
  json["contour_rms_px"] = e.contour_rms_px;
  json["hand_sd_mm"] = 1e3 * e.hand_sd_m;
  if (e.hand_sd_limit_m <= 0.0) return json;
  json["hand_sd_limit_mm"] = 1e3 * e.hand_sd_limit_m;
  json["verdict"] = to_string(e.verdict);
  json["innovation"] = {{"nis", e.innovation}, {"dof", e.innovation_dof}, {"usual", e.innovation_usual}};
  json["postures"] = e.postures;
  json["posture_sd_deg"] = degrees(e.posture_sd_rad);
  json["head_posture_sd_deg"] = degrees(e.head_posture_sd_rad);
  json["stamp_sd_ms"] = 1e3 * e.stamp_sd_s;
  json["outline"] = {{"stddev_px", e.outline_sd_px}, {"points_alike", e.outline_alike}};
  if (e.hidden.robot > 0.0 || e.hidden.holds) {
    json["hidden"] = {{"hand", e.hidden.hand}, {"robot", e.hidden.robot}, {"holds", e.hidden.holds}};
  }
  for (const auto& finding : e.findings.causes) json["findings"].push_back(finding_json(finding));
  if (!e.changed.empty()) json["changed"] = e.changed;
  if (!e.misfit.empty()) json["misfit"] = e.misfit;
  if (!e.stalled_joint.empty()) {
    json["stalled"] = {{"joint", e.stalled_joint}, {"moved_deg", degrees(e.stalled_motion_rad)}};
  }
  if (e.cameras_swapped) json["cameras_swapped"] = true;
  return json;
}

nlohmann::ordered_json error_model_json(const ErrorModel& model) {
  Json effects = Json::array();
  for (std::size_t e = 0; e < model.size(); ++e) {
    const Effect& effect = model[e];
    Json entry = {{"name", effect.name()}};
    if (!effect.target().joint.empty()) entry["joint"] = effect.target().joint;
    if (!effect.target().source.empty()) entry["source"] = effect.target().source;
    for (const auto& p : effect.parameters()) {
      entry["parameters"].push_back({{"name", p.name}, {"unit", p.unit}, {"value", p.in_unit()}});
    }
    effects.push_back(std::move(entry));
  }
  return effects;
}

std::string estimate_line(const Estimate& estimate, const StereoRig& rig) {
  return estimate_json(estimate, rig).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace bodyschema
