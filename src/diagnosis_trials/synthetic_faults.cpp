#include "synthetic_faults.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema::trials {
namespace {

constexpr double kDeg = kPi / 180.0;
constexpr double kTableRate_hz = 500.0;
constexpr double kMostOffset = 7.0 * kDeg;

}  // namespace

FaultyRobot::FaultyRobot(const TrialRobot& robot, const JointRoles& roles, const TrialOptions& options,
                         const SyntheticPath& path, SeededRandom& random)
    : robot_(robot), roles_(roles), options_(options), path_(path), random_(random),
      instants_(robot.model, robot.setup.hand_link, robot.setup.gravity_W), torques_(robot.model) {
  offset_.setZero(robot.model->joint_count());
  for (const auto joint : roles.arm) offset_[joint] = random.uniform(-kMostOffset, kMostOffset);
  make_tables();
}

Eigen::VectorXd FaultyRobot::true_joints(double t_s) {
  const Eigen::VectorXd motor = path_.position(t_s);
  Eigen::VectorXd q = motor;
  for (std::size_t f = 0; f < options_.faults.size(); ++f) {
    transmit(options_.faults[f], f, t_s, motor, q);
  }
  return q;
}

void FaultyRobot::transmit(const TrialFault& fault, std::size_t index, double t_s, const Eigen::VectorXd& motor,
                           Eigen::VectorXd& q) {
  const auto row =
      static_cast<std::size_t>(std::clamp(t_s * kTableRate_hz, 0.0, static_cast<double>(table_.size() - 1)));
  const auto& name = fault.cause.name;
  const auto j = fault.cause.joint.empty() ? Eigen::Index{0} : roles_.index(fault.cause.joint);
  if (name == "compliance") {
    double sag = 0.0;
    for (int i = 0; i < 3; ++i) {
      Eigen::VectorXd at = motor;
      at[j] += sag;
      sag = fault.value * kDeg * torques_.compute(at, robot_.setup.gravity_W)[j];
    }
    q[j] += sag;
  } else if (name == "payload") {
    JointSample sample{0, motor, motor};
    instants_.build(sample, 0, Eigen::VectorXd::Zero(motor.size()), scratch_);
    for (const auto joint : roles_.arm) {
      q[joint] += 0.3 * kDeg * fault.value * scratch_.payload_torque[joint];
    }
  } else if (name == "joint_coupling") {
    q[j] += 0.01 * fault.value * motor[roles_.index(fault.cause.source)];
  } else if (name == "drift") {
    q[j] += fault.value * kDeg * t_s / options_.duration_s;
  } else if (name == "slip") {
    if (t_s >= fault.second * options_.duration_s) q[j] += fault.value * kDeg;
  } else if (name == "backlash" || name == "velocity_lag" || name == "random_walk") {
    q[j] += table_[row][index];
  } else if (name == "wobble") {
    q[j] += fault.value * kDeg * std::sin(2.0 * kPi * t_s / fault.second + phase_);
  } else if (name == "acceleration_lag") {
    q[j] -= fault.value * kDeg * path_.acceleration(t_s)[j];
  } else if (name == "local_kink") {
    const double x = (motor[j] - kink_[index].first) / kink_[index].second;
    q[j] += fault.value * kDeg * std::exp(-0.5 * x * x);
  } else if (name == "vergence") {
    q[roles_.left_pan] += 0.5 * fault.value * kDeg;
    q[roles_.right_pan] -= 0.5 * fault.value * kDeg;
  } else if (name == "head_offset") {
    q[j] += fault.value * kDeg;
  } else if (name == "finger_posture") {
    for (const auto joint : roles_.fingers) q[joint] += fault.value * kDeg;
  }
}

Eigen::VectorXd FaultyRobot::encoders(double t_s) {
  Eigen::VectorXd e = path_.position(t_s);
  for (const auto& fault : options_.faults) {
    const auto& name = fault.cause.name;
    if (name == "encoder_gain") {
      const auto j = roles_.index(fault.cause.joint);
      e[j] /= 1.0 + 0.01 * fault.value;
    } else if (name == "eccentricity") {
      const auto j = roles_.index(fault.cause.joint);
      const double turned = e[j];
      for (int i = 0; i < 20; ++i) {
        e[j] = turned - kDeg * (fault.value * std::sin(e[j]) + fault.second * std::cos(e[j]));
      }
    }
  }
  for (const auto joint : roles_.arm) e[joint] += offset_[joint];
  for (Eigen::Index j = 0; j < e.size(); ++j) e[j] += 0.02 * kDeg * random_.normal();
  return e;
}

void FaultyRobot::make_tables() {
  const auto rows = static_cast<std::size_t>(options_.duration_s * kTableRate_hz) + 2;
  table_.assign(rows, std::vector<double>(options_.faults.size(), 0.0));
  kink_.resize(options_.faults.size());
  phase_ = random_.uniform(0.0, 2.0 * kPi);
  for (std::size_t f = 0; f < options_.faults.size(); ++f) {
    const auto& fault = options_.faults[f];
    if (fault.cause.joint.empty()) continue;
    const auto j = roles_.index(fault.cause.joint);
    double state = path_.position(0.0)[j], walk = 0.0, low = 1e9, high = -1e9;
    const double dt = 1.0 / kTableRate_hz;
    for (std::size_t i = 0; i < rows; ++i) {
      const double motor = path_.position(static_cast<double>(i) * dt)[j];
      low = std::min(low, motor);
      high = std::max(high, motor);
      if (fault.cause.name == "backlash") {
        const double half = 0.5 * fault.value * kDeg;
        state = std::clamp(state, motor - half, motor + half);
        table_[i][f] = state - motor;
      } else if (fault.cause.name == "velocity_lag") {
        state += (motor - state) * (1.0 - std::exp(-dt / (1e-3 * fault.value)));
        table_[i][f] = state - motor;
      } else if (fault.cause.name == "random_walk") {
        table_[i][f] = walk;
        walk += fault.value * kDeg * random_.normal() * std::sqrt(dt / options_.duration_s);
      }
    }
    kink_[f] = {0.5 * (low + high), std::max(0.5 * kDeg, 0.1 * (high - low))};
  }
}

double FaultyRobot::exposure(double stamp_s, std::size_t camera) const {
  double t_s = stamp_s;
  for (const auto& fault : options_.faults) {
    if (fault.cause.name == "latency") t_s -= 1e-3 * fault.value;
    if (fault.cause.name == "camera_skew" && camera == 1) t_s += 1e-3 * fault.value;
  }
  return t_s;
}

Corrections FaultyRobot::body(std::size_t camera) const {
  Corrections body(robot_.model->joint_count());
  for (const auto& fault : options_.faults) build(fault, camera, body);
  return body;
}

void FaultyRobot::build(const TrialFault& fault, std::size_t camera, Corrections& body) const {
  const auto& name = fault.cause.name;
  const double v = fault.value;
  if (name == "link_length" || name == "axis_tilt" || name == "axis_shift") {
    auto& a = body.adjustments[static_cast<std::size_t>(roles_.index(fault.cause.joint))];
    if (name == "link_length") {
      a.along_m += 1e-3 * v;
    } else if (name == "axis_shift") {
      a.shift_1_m += 1e-3 * v;
      a.shift_2_m += 1e-3 * fault.second;
    } else {
      a.tilt_1_rad += v * kDeg;
      a.tilt_2_rad += fault.second * kDeg;
    }
  } else if (name == "base_shift") {
    body.base_shift_m += 1e-3 * Eigen::Vector3d(v, fault.second, 0.0);
  } else if (name == "baseline") {
    if (camera == 1) body.camera.shift_x_m += 1e-3 * v;
  } else if (name == "focal_length") {
    body.camera.focal_scale += 0.01 * v;
  } else if (name == "principal_point") {
    const auto& where = fault.cause.source;
    const double share = where == "common"                    ? 1.0
                         : where == "difference"              ? (camera == 0 ? 0.5 : -0.5)
                         : (where == "left") == (camera == 0) ? 1.0
                                                              : 0.0;
    body.camera.cx_px += share * v;
    body.camera.cy_px += share * fault.second;
  } else if (name == "distortion") {
    body.camera.k1 += v;
  } else if (name == "silhouette_bias") {
    body.dilation_px += v;
  } else if (name == "mesh_scale") {
    body.mesh_scale += 0.01 * v;
  }
}

}  // namespace bodyschema::trials
