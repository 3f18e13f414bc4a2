#include "estimate_json.hpp"

#include <cmath>

#include "bodyschema/pipeline/estimate_line.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

Json matrix_json(const Pose& X) {
  Json rows = Json::array();
  for (int r = 0; r < 4; ++r) {
    Json row = Json::array();
    for (int c = 0; c < 4; ++c) row.push_back(X.matrix()(r, c));
    rows.push_back(std::move(row));
  }
  return rows;
}

/// "vergence_rad", "focal_scale" (relative: has no unit).
std::string with_unit(const std::string& name, const std::string& unit) {
  return unit == "1" ? name : name + '_' + unit;
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
  for (std::size_t k = 0; k < e.nuisance_names.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (k < e.head_joints) {
      json["head_offset_deg"][e.nuisance_names[k]] = degrees(e.nuisance(i));
      json["head_stddev_deg"][e.nuisance_names[k]] = degrees(e.nuisance_sd(i));
    } else {
      const std::string name = with_unit(e.nuisance_names[k], e.nuisance_units[k]);
      json["nuisance"][name] = e.nuisance(i);
      json["nuisance_stddev"][name] = e.nuisance_sd(i);
    }
  }
  for (std::size_t c = 0; c < e.X_CP.size(); ++c) {
    json["hand_pose_" + rig.cameras[c].name + "_camera"] = matrix_json(e.X_CP[c]);
  }
  json["likelihood"] = e.best_likelihood;
  json["effective_sample_size"] = e.effective_sample_size;
  json["contour_rms_px"] = e.contour_rms_px;
  json["hand_sd_mm"] = 1e3 * e.hand_sd_m;
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
