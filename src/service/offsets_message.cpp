#include "bodyschema/service/offsets_message.hpp"

#include <Eigen/Geometry>

namespace bodyschema {

joint_offsets_t to_message(const Estimate& estimate, const StereoRig& rig) {
  joint_offsets_t m;
  m.utime = estimate.utime;
  m.sequence = 0;
  m.latency_ms = 0.0;
  m.state = to_string(estimate.state);
  const auto n = static_cast<Eigen::Index>(estimate.joint_names.size());
  m.num_joints = static_cast<std::int32_t>(n);
  m.joint_name = estimate.joint_names;
  m.mean_rad.assign(estimate.offset_rad.data(), estimate.offset_rad.data() + n);
  for (Eigen::Index r = 0; r < n; ++r) {
    auto& row = m.covariance_rad2.emplace_back();
    for (Eigen::Index c = 0; c < n; ++c) row.push_back(estimate.covariance_rad2(r, c));
  }
  m.num_particles = 0;
  m.effective_sample_size = estimate.effective_sample_size;
  m.best_likelihood = estimate.best_likelihood;

  const std::size_t cameras = std::min(rig.cameras.size(), estimate.X_CP.size());
  m.num_cameras = static_cast<std::int32_t>(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    m.camera_name.push_back(rig.cameras[c].name);
    const Eigen::Vector3d p = estimate.X_CP[c].translation();
    Eigen::Quaterniond q(estimate.X_CP[c].rotation());
    q.normalize();
    pose_t pose;
    for (int i = 0; i < 3; ++i) pose.position_m[i] = p(i);
    pose.quaternion_wxyz[0] = q.w();
    pose.quaternion_wxyz[1] = q.x();
    pose.quaternion_wxyz[2] = q.y();
    pose.quaternion_wxyz[3] = q.z();
    m.hand_pose_in_camera.push_back(pose);
  }

  for (std::size_t k = 0; k < estimate.joint_names.size(); ++k) m.told.push_back(estimate.told(k) ? 1 : 0);
  m.num_parameters = static_cast<std::int32_t>(estimate.effects.size());
  for (const auto& parameter : estimate.effects) {
    m.parameter_name.push_back(parameter.name);
    m.parameter_unit.push_back(parameter.unit);
    m.parameter_value.push_back(parameter.value / parameter.si_per_unit);
    m.parameter_stddev.push_back(parameter.sd / parameter.si_per_unit);
    m.parameter_prior_stddev.push_back(parameter.prior_sd / parameter.si_per_unit);
  }

  m.hand_stddev_m = estimate.hand_sd_m;
  m.verdict = to_string(estimate.verdict);
  m.innovation = estimate.innovation;
  m.innovation_dof = estimate.innovation_dof;
  m.innovation_usual = estimate.innovation_usual;
  m.postures = static_cast<std::int32_t>(estimate.postures);
  m.posture_stddev_rad = estimate.posture_sd_rad;
  m.outline_stddev_px = estimate.outline_sd_px;
  m.outline_points_alike = estimate.outline_alike;
  m.changed = estimate.changed;
  m.misfit = estimate.misfit;
  m.stalled_joint = estimate.stalled_joint;
  m.stalled_motion_rad = estimate.stalled_motion_rad;
  m.cameras_swapped = estimate.cameras_swapped ? 1 : 0;
  return m;
}

findings_t to_message(const LiveFindings& findings) {
  findings_t m;
  m.utime = findings.utime;
  m.span_s = findings.span_s;
  m.blocks = static_cast<std::int32_t>(findings.blocks);
  m.z_threshold = findings.z_threshold;
  m.num_findings = static_cast<std::int32_t>(findings.causes.size());
  for (const auto& cause : findings.causes) {
    auto& f = m.finding.emplace_back();
    f.effect = cause.effect;
    f.joint = cause.joint;
    f.source = cause.source;
    f.sentence = cause.sentence;
    f.num_parameters = static_cast<std::int32_t>(cause.parameters.size());
    for (const auto& p : cause.parameters) {
      f.parameter_name.push_back(p.name);
      f.parameter_unit.push_back(p.unit);
      f.parameter_value.push_back(p.value);
      f.parameter_stddev.push_back(p.sd);
    }
    f.z = cause.z;
    f.hand_m = 1e-3 * cause.hand_mm;
    f.outline_px = cause.outline_px;
    f.from_utime = cause.from;
    f.estimated = cause.estimated ? 1 : 0;
    f.num_alike = static_cast<std::int32_t>(cause.alike.size());
    f.alike = cause.alike;
  }
  return m;
}

}  // namespace bodyschema
