#include "calibrated_cameras.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "bodyschema/effects/corrected_kinematics.hpp"

namespace bodyschema {
namespace {

/// The link that carries a camera.
std::string carrier_of(const StereoRig& rig, std::size_t camera) {
  const auto& mount = rig.cameras[camera].mount;
  if (mount.relative) return carrier_of(rig, 0);
  return mount.parent.empty() ? rig.cameras[camera].link : mount.parent;
}

/// A camera's place in the frame of the link that carries it, by values of the state's parameters.
Pose camera_place(const PictureLog& log, const State& state, const Eigen::VectorXd& x, std::size_t camera) {
  State moved = state;
  moved.set(x);
  const auto q = log.setup().default_joints(*log.robot());
  CorrectedKinematics kinematics(log.robot(), {carrier_of(log.rig(), camera)}, log.rig().links());
  const Instant at = Instant::at_rest(q, camera);
  Corrections all = log.roles().no_corrections(), own = all;
  moved.model().corrections(at, all);
  own.camera = all.camera;
  std::vector<Pose> X_CL(1);
  kinematics.compute(q, own, camera, X_CL);
  return X_CL[0].inverse(Eigen::Isometry);
}

/// How a place moves, m and rad a unit of each parameter of the state that places cameras.
template <class PlaceOf>
Eigen::MatrixXd place_jacobian(const State& state, const PlaceOf& place) {
  constexpr double kStep = 1e-5;
  const Eigen::VectorXd x = state.x();
  const Pose X = place(x);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, state.size());
  for (Eigen::Index k = 0; k < state.size(); ++k) {
    const auto& effect = state.model()[state.parameters()[static_cast<std::size_t>(k)].ref.effect].name();
    if (!places_cameras(effect)) continue;
    Eigen::VectorXd changed = x;
    changed[k] += kStep;
    const Pose moved = place(changed);
    J.col(k).head<3>() = (moved.translation() - X.translation()) / kStep;
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(moved.linear() * X.linear().transpose()));
    J.col(k).tail<3>() = turn.angle() * turn.axis() / kStep;
  }
  return J;
}

/// Whether any parameter moves the place at all: what is configured as exact has none that does.
bool is_moved(const Eigen::MatrixXd& place_jacobian) {
  constexpr double kRounding = 1e-6;
  return place_jacobian.size() > 0 && place_jacobian.cwiseAbs().maxCoeff() > kRounding;
}

/// @param C  covariance of a camera's place and of its rotation vector, both in the axes of what carries it
/// @return standard deviations along and about the camera's own axes, m and rad
std::pair<Eigen::Vector3d, Eigen::Vector3d> along_axes(const Eigen::MatrixXd& C, const Pose& X) {
  const auto own = [&](const Eigen::Matrix3d& block) -> Eigen::Vector3d {
    return (X.linear().transpose() * block * X.linear()).diagonal().cwiseMax(0.0).cwiseSqrt();
  };
  return {own(C.topLeftCorner<3, 3>()), own(C.bottomRightCorner<3, 3>())};
}

/// Where the pictures say that two cameras are rigid, they are better known to each other than to the robot.
CalibratedCamera::Beside beside_first(const PictureLog& log, const BatchFit& batch, std::size_t camera) {
  const auto& state = batch.state();
  const auto place = [&](const Eigen::VectorXd& x) {
    return camera_place(log, state, x, 0).inverse(Eigen::Isometry) * camera_place(log, state, x, camera);
  };
  const Eigen::MatrixXd J = place_jacobian(state, place);
  const Pose X = place(state.x());
  const auto [sd_m, sd_rad] = along_axes(J * batch.estimate().covariance * J.transpose(), X);
  return {log.rig().cameras.front().name, X, sd_m, sd_rad, is_moved(J)};
}

}  // namespace

std::vector<CalibratedCamera> calibrated_cameras(const PictureLog& log, const BatchFit& batch) {
  const auto& rig = log.rig();
  std::vector<CalibratedCamera> list;
  const auto& state = batch.state();
  ErrorModel lenses(log.roles());
  for (std::size_t e = 0; e < state.model().size(); ++e) {
    const Effect& effect = state.model()[e];
    if (effect_kind(effect.name()).home == EffectHome::kCameras) lenses.add(effect.clone());
  }
  const StereoRig corrected = lenses.corrected(rig);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const auto& camera = rig.cameras[c];
    CalibratedCamera found;
    found.name = camera.name;
    found.link = carrier_of(rig, c);
    const auto place = [&](const Eigen::VectorXd& x) { return camera_place(log, state, x, c); };
    const Eigen::VectorXd x = state.x();
    found.X_link_optical = place(x);
    found.intrinsics = corrected.cameras[c].intrinsics;
    found.distortion = corrected.cameras[c].distortion;
    const Eigen::MatrixXd J = place_jacobian(state, place);
    found.estimated = is_moved(J);
    const Eigen::MatrixXd C = J * batch.estimate().covariance * J.transpose();
    found.sd_m = std::sqrt(std::max(0.0, C.topLeftCorner<3, 3>().trace()));
    found.sd_rad = std::sqrt(std::max(0.0, C.bottomRightCorner<3, 3>().trace()));
    std::tie(found.axes_sd_m, found.axes_sd_rad) = along_axes(C, found.X_link_optical);
    if (camera.mount.relative) found.beside = beside_first(log, batch, c);
    const Eigen::VectorXd with_first = J * batch.estimate().covariance.col(0);
    const Eigen::MatrixXd beside =
        C - with_first * with_first.transpose() / std::max(1e-300, batch.estimate().covariance(0, 0));
    found.sd_m_beside_first_joint = std::sqrt(std::max(0.0, beside.topLeftCorner<3, 3>().trace()));
    found.sd_rad_beside_first_joint = std::sqrt(std::max(0.0, beside.bottomRightCorner<3, 3>().trace()));
    list.push_back(std::move(found));
  }
  return list;
}

}  // namespace bodyschema
