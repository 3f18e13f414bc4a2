#include <algorithm>
#include <optional>

#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/pipeline/export_correction.hpp"

namespace bodyschema {
namespace {

/// Where an adjustment puts the joint, in terms of the URDF: along its axis as written there; a shift
/// and a rotation vector in its parent's frame.
JointPlacement placed(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const StereoRig& rig,
                      Eigen::Index joint, const JointAdjustment& adjustment) {
  const auto& info = robot->joints()[static_cast<std::size_t>(joint)];
  CorrectedKinematics kinematics(robot, {info.parent_link, info.child_link, setup.hand_link},
                                 {rig.cameras.front().link});
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(robot->joint_count());
  Corrections corrections(robot->joint_count());
  std::vector<Pose> X_CL(3), moved(3);
  kinematics.compute(q, corrections, 0, X_CL);
  corrections.adjustments[static_cast<std::size_t>(joint)].along_m = adjustment.along_m;
  kinematics.compute(q, corrections, 0, moved);
  // An adjustment counts away from the root, whichever way the URDF's axis points.
  const Eigen::Vector3d axis_W = kinematics.tilt_axis(joint, 0).cross(kinematics.tilt_axis(joint, 1));
  const Eigen::Vector3d step_W = kinematics.X_WC().linear() * (moved[1].translation() - X_CL[1].translation());
  const Eigen::Vector3d tilt_W =
      adjustment.tilt_1_rad * kinematics.tilt_axis(joint, 0) + adjustment.tilt_2_rad * kinematics.tilt_axis(joint, 1);
  const Eigen::Vector3d shift_W =
      adjustment.shift_1_m * kinematics.tilt_axis(joint, 0) + adjustment.shift_2_m * kinematics.tilt_axis(joint, 1);
  const Eigen::Matrix3d R_PW = (kinematics.X_WC() * X_CL.front()).linear().transpose();
  return {info.name, axis_W.dot(step_W), R_PW * shift_W, R_PW * tilt_W};
}

/// Where what the joint's link carries is then, in its frame of the URDF.
std::pair<std::string, Pose> mounted(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                     const StereoRig& rig, const JointRoles& roles, Eigen::Index joint,
                                     const JointAdjustment& adjustment) {
  const auto mount =
      std::find_if(roles.mounts.begin(), roles.mounts.end(), [&](const Mount& m) { return m.joint == joint; });
  CorrectedKinematics kinematics(robot, {mount->link}, {rig.cameras.front().link});
  const auto q = setup.default_joints(*robot);
  Corrections corrections(robot->joint_count());
  std::vector<Pose> before(1), after(1);
  kinematics.compute(q, corrections, 0, before);
  corrections.adjustments[static_cast<std::size_t>(joint)].mount_shift_m = adjustment.mount_shift_m;
  corrections.adjustments[static_cast<std::size_t>(joint)].mount_turn_rad = adjustment.mount_turn_rad;
  kinematics.compute(q, corrections, 0, after);
  return {mount->link, before.front().inverse(Eigen::Isometry) * after.front()};
}

/// The whole arm moved along the root's axes: its first joint, in the frame of the link that carries it.
JointPlacement shifted_base(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                            const Eigen::Vector3d& shift_W) {
  // The estimated joint nearest to the root carries the others.
  Eigen::Index first = robot->joint_index(setup.estimated_joints.front());
  for (const auto& name : setup.estimated_joints) first = std::min(first, robot->joint_index(name));
  const auto& joint = robot->joints()[static_cast<std::size_t>(first)];
  ForwardKinematics kinematics(robot, {joint.parent_link});
  std::vector<Pose> X_WL(1);
  kinematics.compute(setup.default_joints(*robot), X_WL);
  return {joint.name, 0.0, X_WL.front().linear().transpose() * shift_W, Eigen::Vector3d::Zero()};
}

/// A camera's corrected frame in its own of the URDF; nothing where it stays.
std::optional<Pose> camera_motion(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                  const StereoRig& rig, std::size_t camera, const Corrections& change) {
  CorrectedKinematics kinematics(robot, {setup.hand_link}, rig.links());
  const auto q = setup.default_joints(*robot);
  Corrections cameras_alone(robot->joint_count(), change.shapes.size());
  std::vector<Pose> X_CP(1);
  kinematics.compute(q, cameras_alone, camera, X_CP);
  const Pose X_WC = kinematics.X_WC();
  cameras_alone.camera = change.camera;
  kinematics.compute(q, cameras_alone, camera, X_CP);
  const Pose X = X_WC.inverse(Eigen::Isometry) * kinematics.X_WC();
  if (X.isApprox(Pose::Identity(), 1e-12)) return std::nullopt;
  return X;
}

bool moves_rig(const CameraCorrection& camera) {
  return !camera.rig_shift_m.isZero(0.0) || !camera.rig_turn_rad.isZero(0.0);
}

/// Else it is a frame that only the configuration knows.
bool is_link_of_urdf(const CameraModel& camera) {
  return !camera.mount.relative && camera.link == camera.mount.parent;
}

}  // namespace

StereoRig corrected_rig(const ErrorModel& model, const std::shared_ptr<const RobotModel>& robot,
                        const RobotSetup& setup, const StereoRig& rig) {
  StereoRig result = model.corrected(rig);
  std::vector<Pose> moved(rig.cameras.size(), Pose::Identity());
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    Corrections change = model.roles().no_corrections();
    model.corrections(Instant::at_rest(Eigen::VectorXd::Zero(robot->joint_count()), c), change);
    const auto motion = camera_motion(robot, setup, rig, c, change);
    if (motion) moved[c] = *motion;
    if (is_link_of_urdf(rig.cameras[c])) continue;
    CameraMount& mount = result.cameras[c].mount;
    mount.X_PC = mount.X_PC * moved[c];
    if (mount.relative) mount.X_PC = moved.front().inverse(Eigen::Isometry) * mount.X_PC;
    const bool found = motion || (mount.relative && !moved.front().isApprox(Pose::Identity(), 1e-12));
    if (found && mount.knowledge != PlaceKnowledge::kExact) mount.knowledge = PlaceKnowledge::kKnown;
  }
  return result;
}

std::vector<AppliedEffect> add_effects(const ErrorModel& model, const std::shared_ptr<const RobotModel>& robot,
                                       const RobotSetup& setup, const StereoRig& rig, Correction& correction) {
  const auto joints = robot->joint_count();
  std::vector<AppliedEffect> list;
  std::vector<Corrections> cameras(rig.cameras.size(), model.roles().no_corrections());
  for (std::size_t e = 0; e < model.size(); ++e) {
    const Effect& effect = model[e];
    if (effect.name() == "joint_offset") continue;
    AppliedEffect entry{describe(effect), "", ""};
    const EffectKind& kind = effect_kind(effect.name());
    if (kind.home == EffectHome::kCameras) {
      entry.applied = "cameras.yaml";
    } else if (kind.home == EffectHome::kUrdf) {
      entry.applied = "corrected.urdf";
      for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
        effect.apply(Instant::at_rest(Eigen::VectorXd::Zero(joints), c), cameras[c]);
        Corrections own = model.roles().no_corrections();
        effect.apply(Instant::at_rest(Eigen::VectorXd::Zero(joints), c), own);
        if (!is_link_of_urdf(rig.cameras[c]) && camera_motion(robot, setup, rig, c, own))
          entry.applied = "cameras.yaml";
      }
      Corrections change = model.roles().no_corrections();
      effect.apply(Instant::at_rest(Eigen::VectorXd::Zero(joints), 0),
                   change);  // what is no camera's changes for all of them alike
      if (moves_rig(change.camera) && model.roles().neck.size() < model.roles().head.size()) {
        entry.remark = "for eyes that stand at their default angles";
      }
      if (change.base_shift_m.norm() > 0.0) {
        correction.placements.push_back(shifted_base(robot, setup, change.base_shift_m));
        entry.remark = "at the first arm joint, for a torso that stands as configured";
      }
      for (Eigen::Index j = 0; j < joints; ++j) {
        const auto& name = robot->joints()[static_cast<std::size_t>(j)].name;
        if (change.dq[j] != 0.0) correction.known_offsets_rad.emplace_back(name, -change.dq[j]);
        const auto& adjustment = change.adjustments[static_cast<std::size_t>(j)];
        if (adjustment.mounts()) {
          correction.frame_motions.push_back(mounted(robot, setup, rig, model.roles(), j, adjustment));
        }
        if (!adjustment.is_zero()) correction.placements.push_back(placed(robot, setup, rig, j, adjustment));
      }
    } else {
      entry.remark = kind.remark;
    }
    list.push_back(std::move(entry));
  }
  // All at once: motions of a camera do not commute.
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    if (!is_link_of_urdf(rig.cameras[c])) continue;
    if (auto moved = camera_motion(robot, setup, rig, c, cameras[c])) {
      correction.frame_motions.emplace_back(rig.cameras[c].link, *moved);
    }
  }
  return list;
}

}  // namespace bodyschema
