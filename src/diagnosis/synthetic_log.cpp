#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/diagnosis/trials.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"

namespace bodyschema {
namespace {

constexpr double kDeg = kPi / 180.0;
constexpr double kStreamRate_hz = 100.0;
constexpr double kStart_s = 100.0;  // of the synthetic clock

/// Minimum-jerk moves between postures, with rests.
class Path {
 public:
  void rest(const Eigen::VectorXd& q, double duration_s) { add(q, q, duration_s); }
  void move(const Eigen::VectorXd& to, double duration_s) { add(pieces_.back().to, to, duration_s); }
  [[nodiscard]] double end_s() const { return end_s_; }
  [[nodiscard]] const Eigen::VectorXd& last() const { return pieces_.back().to; }

  [[nodiscard]] Eigen::VectorXd position(double t_s) const {
    const auto [piece, s] = find(t_s);
    return piece->from + (piece->to - piece->from) * (s * s * s * (10.0 + s * (-15.0 + 6.0 * s)));
  }
  [[nodiscard]] Eigen::VectorXd velocity(double t_s) const {
    const auto [piece, s] = find(t_s);
    return (piece->to - piece->from) * (30.0 * s * s * (1.0 - s) * (1.0 - s) / piece->duration_s);
  }
  [[nodiscard]] Eigen::VectorXd acceleration(double t_s) const {
    const auto [piece, s] = find(t_s);
    return (piece->to - piece->from) *
           (60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (piece->duration_s * piece->duration_s));
  }

 private:
  struct Piece {
    Eigen::VectorXd from, to;
    double begin_s, duration_s;
  };
  void add(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double duration_s) {
    pieces_.push_back({from, to, end_s_, duration_s});
    end_s_ += duration_s;
  }
  [[nodiscard]] std::pair<const Piece*, double> find(double t_s) const {
    auto at = std::upper_bound(pieces_.begin(), pieces_.end(), t_s,
                               [](double t, const Piece& p) { return t < p.begin_s; });
    const auto& piece = at == pieces_.begin() ? pieces_.front() : *(at - 1);
    return {&piece, std::clamp((t_s - piece.begin_s) / piece.duration_s, 0.0, 1.0)};
  }
  std::vector<Piece> pieces_;
  double end_s_ = 0.0;
};

/// Points on the surface of one link with their normals.
struct SurfacePoint {
  std::size_t link;
  Eigen::Vector3d p_B, normal_B;
};

class SyntheticLog final : public SyntheticMeasurement {
 public:
  SyntheticLog(const TrialRobot& robot, const TrialOptions& options, std::uint64_t seed)
      : robot_(robot), options_(options), random_(seed), roles_(JointRoles::of(robot.model, robot.setup)),
        instants_(robot.model, robot.setup.hand_link, robot.setup.gravity_W),
        torques_(robot.model), kinematics_(robot.model, links(), camera_links()),
        compressor_(robot.model, roles_, links(), camera_links()),
        X_CB_(links().size(), Pose::Identity()) {
    white_px_ = uniform(0.3, 0.7);
    shared_px_ = uniform(0.1, 0.3);
    shared_time_s_ = uniform(0.1, 0.35);
    if (options.noise_correlation_s > 0.0) shared_time_s_ = options.noise_correlation_s;
    sample_surface();
    plan_path();
    simulate();
  }

  const Eigen::MatrixXd& true_corrections() const override { return truth_; }
  const JointRoles& roles() const override { return roles_; }
  std::span<const ViewInput> views() const override { return views_; }
  std::span<const JointSample> stream() const override { return stream_; }

  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    instants_.build(views_[view].joints, views_[view].camera, offsets, out);
  }

  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    out.resize(views_.size());
    std::vector<OutlinePoint> points;
    for (std::size_t v = 0; v < views_.size(); ++v) {
      const auto& view = views_[v];
      const auto& c = corrections[v];
      const auto poses = compressor_.set_view(view.joints.q, c, view.camera);
      const auto& camera = robot_.rig.cameras[view.camera];
      points.clear();
      for (const auto& seen : seen_[v]) {
        const auto& surface = surface_[seen.point];
        const Pose& X_CB = poses[surface.link];
        const Eigen::Vector3d p_C = X_CB * ((1.0 + c.mesh_scale) * surface.p_B);
        if (p_C.z() < 0.05) continue;
        const Eigen::Vector2d pixel = project(camera.intrinsics, c.camera, p_C) +
                                      c.dilation_px * seen.normal;
        points.push_back({surface.link, p_C, seen.normal, seen.normal.dot(seen.pixel - pixel), 1.0});
      }
      if (points.size() < 10) {
        out[v] = {Eigen::MatrixXd::Zero(compressor_.layout().size(), compressor_.layout().size()),
                  Eigen::VectorXd::Zero(compressor_.layout().size()), 0.0, 0.0};
        continue;
      }
      compressor_.compress(points, intrinsics(camera.intrinsics, c.camera), out[v]);
    }
  }

  Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& corrections) override {
    compressor_.set_view(views_[view].joints.q, corrections, views_[view].camera);
    return compressor_.link_jacobian(hand_);
  }

 private:
  struct Seen {
    std::size_t point;
    Eigen::Vector2d pixel, normal;  ///< where the outline was observed, noise included
  };

  static PinholeIntrinsics intrinsics(PinholeIntrinsics k, const CameraCorrection& c) {
    k.fx *= 1.0 + c.focal_scale;
    k.fy *= 1.0 + c.focal_scale;
    k.cx += c.cx_px;
    k.cy += c.cy_px;
    return k;
  }
  static Eigen::Vector2d project(const PinholeIntrinsics& k, const CameraCorrection& c,
                                 const Eigen::Vector3d& p) {
    const Eigen::Vector2d x = p.head<2>() / p.z();
    const Eigen::Vector2d d = x * (1.0 + c.k1 * x.squaredNorm());
    return {k.fx * (1.0 + c.focal_scale) * d.x() + k.cx + c.cx_px,
            k.fy * (1.0 + c.focal_scale) * d.y() + k.cy + c.cy_px};
  }

  [[nodiscard]] std::vector<std::string> links() const {
    auto list = robot_.setup.model.rendered_links;
    if (std::find(list.begin(), list.end(), robot_.setup.hand_link) == list.end()) {
      list.push_back(robot_.setup.hand_link);
    }
    return list;
  }
  [[nodiscard]] std::vector<std::string> camera_links() const {
    std::vector<std::string> list;
    for (const auto& camera : robot_.rig.cameras) list.push_back(camera.link);
    return list;
  }

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }
  double normal() {
    // Box and Muller; the library's distribution differs between systems.
    const double u = std::max(1e-300, uniform(0.0, 1.0));
    return std::sqrt(-2.0 * std::log(u)) * std::cos(2.0 * kPi * uniform(0.0, 1.0));
  }

  void sample_surface() {
    const auto all = links();
    hand_ = static_cast<std::size_t>(
        std::find(all.begin(), all.end(), robot_.setup.hand_link) - all.begin());
    for (std::size_t l = 0; l < robot_.model->meshes().size(); ++l) {
      const auto& mesh = robot_.model->meshes()[l].mesh;
      std::vector<double> area;
      double sum = 0.0;
      for (const auto& t : mesh.triangles) {
        const Eigen::Vector3f e1 = mesh.vertices[t[1]] - mesh.vertices[t[0]];
        const Eigen::Vector3f e2 = mesh.vertices[t[2]] - mesh.vertices[t[0]];
        area.push_back(sum += static_cast<double>(e1.cross(e2).norm()));
      }
      const int count = 300;
      for (int i = 0; i < count && sum > 0.0; ++i) {
        const auto at = std::lower_bound(area.begin(), area.end(), uniform(0.0, sum)) - area.begin();
        const auto& t = mesh.triangles[static_cast<std::size_t>(at)];
        const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                              c = mesh.vertices[t[2]].cast<double>();
        const Eigen::Vector3d n = (b - a).cross(c - a);
        if (n.norm() <= 0.0) continue;
        surface_.push_back({l, (a + b + c) / 3.0, n.normalized()});
      }
    }
  }

  [[nodiscard]] bool hand_in_view(const Eigen::VectorXd& q) {
    const Corrections none(q.size());
    for (std::size_t c = 0; c < robot_.rig.cameras.size(); ++c) {
      kinematics_.compute(q, none, c, X_CB_);
      const Eigen::Vector3d p = X_CB_[hand_].translation();
      const auto& k = robot_.rig.cameras[c].intrinsics;
      if (p.z() < 0.2 || p.z() > 0.52) return false;
      const auto pixel = k.project(p);
      const double margin = 0.1 * k.width;
      if (pixel.x() < margin || pixel.y() < margin || pixel.x() > k.width - margin ||
          pixel.y() > k.height - margin) {
        return false;
      }
    }
    return true;
  }

  Eigen::VectorXd random_arm(Eigen::VectorXd q) {
    for (const auto joint : roles_.arm) {
      const auto& info = robot_.model->joints()[static_cast<std::size_t>(joint)];
      const double low = std::max(info.lower_rad, -kPi), high = std::min(info.upper_rad, kPi);
      q[joint] = uniform(low, high);
    }
    return q;
  }

  /// Frozen and locked joints, relative to the first posture.
  void constrain(const Eigen::VectorXd& first, Eigen::VectorXd& q) const {
    for (const auto& name : options_.frozen_joints) q[roles_.index(name)] = first[roles_.index(name)];
    if (!options_.locked.first.empty()) {
      const auto a = roles_.index(options_.locked.first), b = roles_.index(options_.locked.second);
      q[b] = first[b] + 0.5 * (q[a] - first[a]);
    }
  }

  void plan_path() {
    const auto rest_posture = robot_.setup.default_joints(*robot_.model);
    // A head posture before which the arm can work.
    Eigen::VectorXd best = rest_posture;
    int most = -1;
    for (int trial = 0; trial < 24; ++trial) {
      Eigen::VectorXd q = rest_posture;
      const double low[6] = {-30, -5, -35, -25, -2, -2}, high[6] = {0, 5, 10, 0, 2, 2};
      for (std::size_t i = 0; i < roles_.head.size() && i < 4; ++i) {
        q[roles_.head[i]] = uniform(low[i], high[i]) * kDeg;
      }
      int hits = 0;
      for (int i = 0; i < 150; ++i) hits += hand_in_view(random_arm(q));
      if (hits > most) {
        most = hits;
        best = q;
      }
    }
    for (const auto joint : roles_.fingers) {
      const auto& info = robot_.model->joints()[static_cast<std::size_t>(joint)];
      best[joint] = std::clamp(uniform(10.0, 30.0) * kDeg, info.lower_rad, info.upper_rad);
    }
    std::vector<Eigen::VectorXd> postures;
    for (int i = 0; i < 200000 && postures.size() < 64; ++i) {
      auto q = random_arm(best);
      if (!postures.empty()) constrain(postures.front(), q);
      if (hand_in_view(q)) postures.push_back(std::move(q));
    }
    if (postures.size() < 8) {
      throw DataError("trials: the arm of '" + robot_.model->name() + "' hardly reaches before its eyes");
    }
    const double rest_s = options_.duration_s / 6.0;
    const double move_s = options_.duration_s - rest_s;
    std::size_t next = 0;
    const auto posture = [&](std::size_t i) { return postures[i % postures.size()]; };
    path_.rest(posture(0), 0.5);
    if (options_.one_way) {
      // To the posture that is furthest away.
      std::size_t far = 1;
      for (std::size_t i = 1; i < postures.size(); ++i) {
        if ((postures[i] - postures[0]).norm() > (postures[far] - postures[0]).norm()) far = i;
      }
      path_.move(posture(far), options_.duration_s - 1.0);
      path_.rest(posture(far), 10.0);
      return;
    }
    bool rested = false, middle = false;
    while (path_.end_s() < options_.duration_s) {
      if (!rested && path_.end_s() > 0.4 * move_s) {
        path_.rest(path_.last(), rest_s);
        rested = true;
      }
      if (!middle && path_.end_s() > 0.6 * options_.duration_s) {
        middle = true;
        for (std::size_t i = 0; i < 4; ++i) path_.move(posture(i), uniform(0.8, 2.0));
        next = std::max<std::size_t>(next, 4);
      }
      if (path_.end_s() > options_.duration_s - 6.0) {
        for (std::size_t i = 0; i < 4; ++i) path_.move(posture(i), uniform(0.8, 2.0));
        path_.rest(path_.last(), 10.0);
        break;
      }
      // There and back: the same postures in both directions.
      const auto from = path_.last();
      const double slow = std::exp(uniform(std::log(0.7), std::log(3.0)));
      path_.move(posture(++next), slow);
      if (uniform(0.0, 1.0) < 0.4) path_.move(from, uniform(0.7, 2.0));
    }
  }

  /// True joint angles at a time. Play, lags and walks are taken from tables made beforehand.
  [[nodiscard]] Eigen::VectorXd true_joints(double t_s) {
    const Eigen::VectorXd motor = path_.position(t_s);
    Eigen::VectorXd q = motor;
    const auto row = static_cast<std::size_t>(std::clamp(t_s * kTableRate_hz, 0.0, static_cast<double>(table_.size() - 1)));
    for (std::size_t f = 0; f < options_.faults.size(); ++f) {
      const auto& fault = options_.faults[f];
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
        q[j] += table_[row][f];
      } else if (name == "wobble") {
        q[j] += fault.value * kDeg * std::sin(2.0 * kPi * t_s / fault.second + phase_);
      } else if (name == "acceleration_lag") {
        q[j] -= fault.value * kDeg * path_.acceleration(t_s)[j];
      } else if (name == "local_kink") {
        const double x = (motor[j] - kink_[f].first) / kink_[f].second;
        q[j] += fault.value * kDeg * std::exp(-0.5 * x * x);
      } else if (name == "vergence") {
        q[roles_.head[4]] += 0.5 * fault.value * kDeg;
        q[roles_.head[5]] -= 0.5 * fault.value * kDeg;
      } else if (name == "head_offset") {
        q[j] += fault.value * kDeg;
      } else if (name == "finger_posture") {
        for (const auto joint : roles_.fingers) q[joint] += fault.value * kDeg;
      }
    }
    return q;
  }

  [[nodiscard]] Eigen::VectorXd encoders(double t_s) {
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
    for (Eigen::Index j = 0; j < e.size(); ++j) e[j] += 0.02 * kDeg * normal();
    return e;
  }

  void make_tables() {
    const auto rows = static_cast<std::size_t>(options_.duration_s * kTableRate_hz) + 2;
    table_.assign(rows, std::vector<double>(options_.faults.size(), 0.0));
    kink_.resize(options_.faults.size());
    phase_ = uniform(0.0, 2.0 * kPi);
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
          walk += fault.value * kDeg * normal() * std::sqrt(dt / options_.duration_s);
        }
      }
      kink_[f] = {0.5 * (low + high), std::max(0.5 * kDeg, 0.1 * (high - low))};
    }
  }

  [[nodiscard]] Corrections true_body(std::size_t camera) const {
    Corrections body(robot_.model->joint_count());
    for (const auto& fault : options_.faults) {
      const auto& name = fault.cause.name;
      const double v = fault.value;
      if (name == "link_length" || name == "axis_tilt") {
        auto& a = body.adjustments[static_cast<std::size_t>(roles_.index(fault.cause.joint))];
        if (name == "link_length") {
          a.along_m += 1e-3 * v;
        } else {
          a.tilt_1_rad += v * kDeg;
          a.tilt_2_rad += fault.second * kDeg;
        }
      } else if (name == "baseline") {
        if (camera == 1) body.camera.shift_x_m += 1e-3 * v;
      } else if (name == "focal_length") {
        body.camera.focal_scale += 0.01 * v;
      } else if (name == "principal_point") {
        const auto& where = fault.cause.source;
        const double share = where == "common" ? 1.0
                             : where == "difference" ? (camera == 0 ? 0.5 : -0.5)
                             : (where == "left") == (camera == 0) ? 1.0 : 0.0;
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
    return body;
  }

  void simulate() {
    offset_.setZero(robot_.model->joint_count());
    for (const auto joint : roles_.arm) offset_[joint] = uniform(-7.0, 7.0) * kDeg;
    make_tables();
    double latency_s = 0.0, skew_s = 0.0;
    for (const auto& fault : options_.faults) {
      if (fault.cause.name == "latency") latency_s += 1e-3 * fault.value;
      if (fault.cause.name == "camera_skew") skew_s += 1e-3 * fault.value;
    }
    const auto samples = static_cast<std::size_t>(options_.duration_s * kStreamRate_hz);
    for (std::size_t i = 0; i < samples; ++i) {
      const double t = static_cast<double>(i) / kStreamRate_hz;
      stream_.push_back({microseconds(kStart_s + t), encoders(t), Eigen::VectorXd()});
    }
    for (std::size_t i = 0; i < samples; ++i) {
      const std::size_t a = i < 3 ? 0 : i - 3, b = std::min(samples - 1, i + 3);
      stream_[i].qdot = (stream_[b].q - stream_[a].q) /
                        seconds(stream_[b].utime - stream_[a].utime);
    }
    std::vector<Corrections> bodies;
    for (std::size_t c = 0; c < robot_.rig.cameras.size(); ++c) bodies.push_back(true_body(c));
    const double period = 1.0 / options_.picture_rate_hz;
    const double burst_at = uniform(0.1, 0.9) * options_.duration_s;
    const double burst_for = uniform(1.0, 3.0);
    const double decay = std::exp(-period / shared_time_s_);
    std::vector<Eigen::Vector3d> shared(robot_.rig.cameras.size());
    for (auto& s : shared) s = shared_px_ * Eigen::Vector3d(normal(), normal(), normal());
    std::vector<Eigen::VectorXd> corrections;
    std::vector<double> pattern(surface_.size(), 0.0);
    if (options_.mesh_pattern_px > 0.0) {
      for (auto& p : pattern) p = options_.mesh_pattern_px * normal();
    }
    for (double t = 0.5; t < options_.duration_s - 0.2; t += period) {
      const double jitter = uniform(-0.03, 0.03) * period;
      for (std::size_t c = 0; c < robot_.rig.cameras.size(); ++c) {
        const double stamp = t + jitter + 0.002 * static_cast<double>(c);
        ViewInput view;
        view.camera = c;
        view.joints = interpolate(stamp);
        const double exposed = stamp - latency_s + (c == 1 ? skew_s : 0.0);
        const auto& body = bodies[c];
        const auto q_true = true_joints(exposed);
        kinematics_.compute(q_true, body, c, X_CB_);
        Eigen::VectorXd correction(static_cast<Eigen::Index>(roles_.arm.size()));
        for (std::size_t j = 0; j < roles_.arm.size(); ++j) {
          correction[static_cast<Eigen::Index>(j)] = (q_true - view.joints.q)[roles_.arm[j]];
        }
        corrections.push_back(std::move(correction));
        const double burst =
            options_.noise_burst && t > burst_at && t < burst_at + burst_for ? 3.0 : 1.0;
        shared[c] = decay * shared[c] + std::sqrt(1.0 - decay * decay) * shared_px_ *
                                            Eigen::Vector3d(normal(), normal(), normal());
        std::vector<Seen> seen;
        const auto& k = robot_.rig.cameras[c].intrinsics;
        const std::size_t start = random_() % surface_.size();
        for (std::size_t i = 0; i < surface_.size() && static_cast<int>(seen.size()) < options_.points; ++i) {
          // A stride prime to the count visits every point once, in a scattered order.
          const std::size_t at = (start + i * kStride) % surface_.size();
          const auto& point = surface_[at];
          const Pose& X = X_CB_[point.link];
          const Eigen::Vector3d p = X * ((1.0 + body.mesh_scale) * point.p_B);
          if (p.z() < 0.08) continue;
          const Eigen::Vector3d n = X.linear() * point.normal_B;
          if (std::abs(n.dot(p.normalized())) > 0.12) continue;  // not on the outline
          // The image normal: pixels per motion along the surface normal.
          Eigen::Vector2d normal_px((n.x() - p.x() / p.z() * n.z()) * k.fx,
                                    (n.y() - p.y() / p.z() * n.z()) * k.fy);
          normal_px.normalize();
          Eigen::Vector2d pixel = project(k, body.camera, p);
          if (pixel.x() < 3 || pixel.y() < 3 || pixel.x() > k.width - 4 || pixel.y() > k.height - 4) continue;
          const double noise = pattern[at] + burst * (white_px_ * normal() + shared[c].z()) +
                               burst * normal_px.dot(shared[c].head<2>());
          seen.push_back({at, pixel + normal_px * (body.dilation_px + noise), normal_px});
        }
        views_.push_back(std::move(view));
        seen_.push_back(std::move(seen));
      }
    }
    truth_.resize(static_cast<Eigen::Index>(corrections.size()),
                  static_cast<Eigen::Index>(roles_.arm.size()));
    for (std::size_t v = 0; v < corrections.size(); ++v) {
      truth_.row(static_cast<Eigen::Index>(v)) = corrections[v].transpose();
    }
  }

  [[nodiscard]] JointSample interpolate(double t_s) const {
    const auto utime = microseconds(kStart_s + t_s);
    auto at = std::lower_bound(stream_.begin(), stream_.end(), utime,
                               [](const JointSample& s, Microseconds u) { return s.utime < u; });
    if (at == stream_.end()) return stream_.back();
    if (at == stream_.begin()) return stream_.front();
    const auto& a = *(at - 1);
    const auto& b = *at;
    const double s = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
    return {utime, a.q + s * (b.q - a.q), a.qdot + s * (b.qdot - a.qdot)};
  }

  static constexpr double kTableRate_hz = 500.0;
  static constexpr std::size_t kStride = 7919;

  TrialRobot robot_;
  TrialOptions options_;
  std::mt19937_64 random_;
  JointRoles roles_;
  InstantBuilder instants_;
  GravityTorques torques_;
  CorrectedKinematics kinematics_;
  ViewCompressor compressor_;
  std::vector<Pose> X_CB_;
  Instant scratch_;
  double white_px_, shared_px_, shared_time_s_, phase_ = 0.0;
  std::size_t hand_ = 0;
  std::vector<SurfacePoint> surface_;
  Path path_;
  Eigen::VectorXd offset_;
  std::vector<std::vector<double>> table_;
  std::vector<std::pair<double, double>> kink_;
  std::vector<JointSample> stream_;
  Eigen::MatrixXd truth_;
  std::vector<ViewInput> views_;
  std::vector<std::vector<Seen>> seen_;
};

}  // namespace

std::unique_ptr<SyntheticMeasurement> make_synthetic_log(const TrialRobot& robot,
                                                      const TrialOptions& options,
                                                      std::uint64_t seed) {
  return std::make_unique<SyntheticLog>(robot, options, seed);
}

}  // namespace bodyschema
