#include "bodyschema/diagnosis_trials/synthetic_log.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/core/seeded_random.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "synthetic_faults.hpp"
#include "synthetic_path.hpp"

namespace bodyschema {
namespace {

using namespace trials;

constexpr double kStreamRate_hz = 100.0;
constexpr double kStart_s = 100.0;  // of the synthetic clock

/// Points on the surface of one link with their normals.
struct SurfacePoint {
  std::size_t link;
  Eigen::Vector3d p_B, normal_B;
};

class SyntheticLog final : public SyntheticMeasurement {
 public:
  SyntheticLog(const TrialRobot& robot, const TrialOptions& options, std::uint64_t seed)
      : robot_(robot), options_(options), random_(seed), roles_(JointRoles::of(robot.model, robot.setup, robot.rig)),
        instants_(robot.model, robot.setup.hand_link, robot.setup.gravity_W),
        kinematics_(robot.model, shown_links(robot), camera_links(robot)),
        compressor_(robot.model, roles_, shown_links(robot), camera_links(robot)),
        X_CB_(shown_links(robot).size(), Pose::Identity()) {
    white_px_ = random_.uniform(0.3, 0.7);
    shared_px_ = random_.uniform(0.1, 0.3);
    shared_time_s_ = random_.uniform(0.1, 0.35);
    if (options.noise_correlation_s > 0.0) shared_time_s_ = options.noise_correlation_s;
    sample_surface();
    path_ = plan_path(robot_, roles_, options_, random_);
    FaultyRobot faulty(robot_, roles_, options_, path_, random_);
    record_encoders(faulty);
    take_pictures(faulty);
    set_motion(views_, stream_);
  }

  const Eigen::MatrixXd& true_corrections() const override { return truth_; }
  const JointRoles& roles() const override { return roles_; }
  std::span<const ViewInput> views() const override { return views_; }
  std::span<const JointSample> stream() const override { return stream_; }

  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    instants_.build(views_[view].joints, views_[view].camera, offsets, out);
    out.qddot = views_[view].qddot;
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
        const Eigen::Vector2d pixel = project(camera.intrinsics, c.camera, p_C) + c.dilation_px * seen.normal;
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
  static Eigen::Vector2d project(const PinholeIntrinsics& k, const CameraCorrection& c, const Eigen::Vector3d& p) {
    const Eigen::Vector2d x = p.head<2>() / p.z();
    const Eigen::Vector2d d = x * (1.0 + c.k1 * x.squaredNorm());
    return {k.fx * (1.0 + c.focal_scale) * d.x() + k.cx + c.cx_px,
            k.fy * (1.0 + c.focal_scale) * d.y() + k.cy + c.cy_px};
  }

  void sample_surface() {
    const auto all = shown_links(robot_);
    hand_ = static_cast<std::size_t>(std::find(all.begin(), all.end(), robot_.setup.hand_link) - all.begin());
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
        const auto at = std::lower_bound(area.begin(), area.end(), random_.uniform(0.0, sum)) - area.begin();
        const auto& t = mesh.triangles[static_cast<std::size_t>(at)];
        const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                              c = mesh.vertices[t[2]].cast<double>();
        const Eigen::Vector3d n = (b - a).cross(c - a);
        if (n.norm() <= 0.0) continue;
        surface_.push_back({l, (a + b + c) / 3.0, n.normalized()});
      }
    }
  }

  void record_encoders(FaultyRobot& faulty) {
    const auto samples = static_cast<std::size_t>(options_.duration_s * kStreamRate_hz);
    for (std::size_t i = 0; i < samples; ++i) {
      const double t = static_cast<double>(i) / kStreamRate_hz;
      stream_.push_back({microseconds(kStart_s + t), faulty.encoders(t), Eigen::VectorXd()});
    }
  }

  Eigen::Vector3d normal3() {
    const double x = random_.normal(), y = random_.normal();
    return {x, y, random_.normal()};
  }

  /// A bias of the whole outline in one camera, correlated over time: shift in x and y, and width.
  struct SharedNoise {
    std::vector<Eigen::Vector3d> at;
    double decay;
  };

  void take_pictures(FaultyRobot& faulty) {
    std::vector<Corrections> bodies;
    for (std::size_t c = 0; c < robot_.rig.cameras.size(); ++c) bodies.push_back(faulty.body(c));
    const double period = 1.0 / options_.picture_rate_hz;
    const double burst_at = random_.uniform(0.1, 0.9) * options_.duration_s;
    const double burst_for = random_.uniform(1.0, 3.0);
    SharedNoise shared{{}, std::exp(-period / shared_time_s_)};
    for (std::size_t c = 0; c < bodies.size(); ++c) shared.at.push_back(shared_px_ * normal3());
    pattern_.assign(surface_.size(), 0.0);
    if (options_.mesh_pattern_px > 0.0) {
      for (auto& p : pattern_) p = options_.mesh_pattern_px * random_.normal();
    }
    std::vector<Eigen::VectorXd> truth;
    for (double t = 0.5; t < options_.duration_s - 0.2; t += period) {
      const double jitter = random_.uniform(-0.03, 0.03) * period;
      const bool burst = options_.noise_burst && t > burst_at && t < burst_at + burst_for;
      for (std::size_t c = 0; c < bodies.size(); ++c) {
        const double stamp = t + jitter + 0.002 * static_cast<double>(c);
        views_.push_back({interpolate(stamp), c, {}});
        const auto q_true = faulty.true_joints(faulty.exposure(stamp, c));
        kinematics_.compute(q_true, bodies[c], c, X_CB_);
        truth.push_back(Eigen::VectorXd(static_cast<Eigen::Index>(roles_.arm.size())));
        for (std::size_t j = 0; j < roles_.arm.size(); ++j) {
          truth.back()[static_cast<Eigen::Index>(j)] = (q_true - views_.back().joints.q)[roles_.arm[j]];
        }
        shared.at[c] =
            shared.decay * shared.at[c] + std::sqrt(1.0 - shared.decay * shared.decay) * shared_px_ * normal3();
        seen_.push_back(outline(bodies[c], c, shared.at[c], burst ? 3.0 : 1.0));
      }
    }
    truth_.resize(static_cast<Eigen::Index>(truth.size()), static_cast<Eigen::Index>(roles_.arm.size()));
    for (std::size_t v = 0; v < truth.size(); ++v) {
      truth_.row(static_cast<Eigen::Index>(v)) = truth[v].transpose();
    }
  }

  /// Surface points that lie on the outline in a camera, with the links where X_CB_ says.
  std::vector<Seen> outline(const Corrections& body, std::size_t c, const Eigen::Vector3d& shared, double loudness) {
    constexpr double kGrazing = 0.12;  // sine of the angle between surface and ray
    std::vector<Seen> seen;
    const auto& k = robot_.rig.cameras[c].intrinsics;
    const std::size_t start = random_.below(surface_.size());
    for (std::size_t i = 0; i < surface_.size() && static_cast<int>(seen.size()) < options_.points; ++i) {
      // A stride prime to the count visits every point once, in a scattered order.
      const std::size_t at = (start + i * kStride) % surface_.size();
      const auto& point = surface_[at];
      const Pose& X = X_CB_[point.link];
      const Eigen::Vector3d p = X * ((1.0 + body.mesh_scale) * point.p_B);
      if (p.z() < 0.08) continue;
      const Eigen::Vector3d n = X.linear() * point.normal_B;
      if (std::abs(n.dot(p.normalized())) > kGrazing) continue;
      // The image normal: pixels per motion along the surface normal.
      Eigen::Vector2d normal_px((n.x() - p.x() / p.z() * n.z()) * k.fx, (n.y() - p.y() / p.z() * n.z()) * k.fy);
      normal_px.normalize();
      const Eigen::Vector2d pixel = project(k, body.camera, p);
      if (pixel.x() < 3 || pixel.y() < 3 || pixel.x() > k.width - 4 || pixel.y() > k.height - 4) {
        continue;
      }
      const double noise =
          pattern_[at] + loudness * (white_px_ * random_.normal() + shared.z() + normal_px.dot(shared.head<2>()));
      seen.push_back({at, pixel + normal_px * (body.dilation_px + noise), normal_px});
    }
    return seen;
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
    return {utime, a.q + s * (b.q - a.q), {}};
  }

  static constexpr std::size_t kStride = 7919;

  TrialRobot robot_;
  TrialOptions options_;
  SeededRandom random_;
  JointRoles roles_;
  InstantBuilder instants_;
  CorrectedKinematics kinematics_;
  ViewCompressor compressor_;
  std::vector<Pose> X_CB_;
  double white_px_, shared_px_, shared_time_s_;
  std::size_t hand_ = 0;
  std::vector<SurfacePoint> surface_;
  std::vector<double> pattern_;  ///< residual that stays with each surface point, px
  SyntheticPath path_;
  std::vector<JointSample> stream_;
  Eigen::MatrixXd truth_;
  std::vector<ViewInput> views_;
  std::vector<std::vector<Seen>> seen_;
};

}  // namespace

std::unique_ptr<SyntheticMeasurement> make_synthetic_log(const TrialRobot& robot, const TrialOptions& options,
                                                         std::uint64_t seed) {
  return std::make_unique<SyntheticLog>(robot, options, seed);
}

}  // namespace bodyschema
