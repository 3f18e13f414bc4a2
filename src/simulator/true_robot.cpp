#include "bodyschema/simulator/true_robot.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace bodyschema::simulator {
namespace {

constexpr double kStep_s = 0.004;
/// Deflections reach beyond both ends of the trajectory for exposures moved by latency.
constexpr double kMargin_s = 1.5;

class TorquesOfGravity final : public JointTorques {
 public:
  TorquesOfGravity(const FaultSite& site, double payload_kg)
      : gravity_W_(site.gravity_W), payload_kg_(payload_kg), torques_(site.model), hand_(site.model, {site.hand_link}),
        payload_torque_(Eigen::VectorXd::Zero(site.model->joint_count())) {}

  const Eigen::VectorXd& total(const Eigen::VectorXd& q) override {
    total_ = torques_.compute(q, gravity_W_);
    if (payload_kg_ != 0.0) total_ += payload(q);
    return total_;
  }
  const Eigen::VectorXd& payload(const Eigen::VectorXd& q) override {
    Pose X_WP;
    hand_.compute(q, {&X_WP, 1});
    const Eigen::Vector3d weight_W = payload_kg_ * gravity_W_;
    for (Eigen::Index j = 0; j < payload_torque_.size(); ++j) {
      if (!hand_.moves(j, 0)) continue;
      const auto axis = hand_.joint_axis(j);
      payload_torque_[j] = axis.direction_W.dot((X_WP.translation() - axis.point_W).cross(weight_W));
    }
    return payload_torque_;
  }

 private:
  Eigen::Vector3d gravity_W_;
  double payload_kg_;
  GravityTorques torques_;
  ForwardKinematics hand_;
  Eigen::VectorXd total_, payload_torque_;
};

}  // namespace

TrueKinematics::TrueKinematics(std::shared_ptr<const RobotModel> model, const TrueBody& body,
                               std::vector<std::string> links)
    : link_count_(links.size()), tracked_count_(links.size()), X_CT_(body.X_CT), X_MK_(body.X_MK), X_KT_(body.X_KT) {
  mount_moved_ = !X_KT_.matrix().isIdentity(0.0);
  if (mount_moved_) {
    links.push_back(body.mount_link);
    ++tracked_count_;
  }
  for (const auto& change : body.misplacements) {
    Misplacement m;
    m.change = change;
    const auto& joint = model->joints()[static_cast<std::size_t>(change.joint)];
    m.parent = links.size();
    links.push_back(joint.parent_link);
    links.push_back(joint.child_link);
    misplacements_.push_back(m);
  }
  // Base first: the model's joints are in breadth-first order.
  std::stable_sort(misplacements_.begin(), misplacements_.end(),
                   [](const auto& a, const auto& b) { return a.change.joint < b.change.joint; });
  const std::vector<std::string> all = links;
  nominal_ = std::make_unique<ForwardKinematics>(model, std::move(links));
  X_W_.resize(all.size());
  nominal_->compute(Eigen::VectorXd::Zero(model->joint_count()), X_W_);
  for (auto& m : misplacements_) {
    const auto axis = nominal_->joint_axis(m.change.joint);
    const Eigen::Matrix3d R_PW = X_W_[m.parent].linear().transpose();
    const Eigen::Vector3d axis_P = R_PW * axis.direction_W;
    // First perpendicular: across the axis and the coordinate axis it is least aligned with.
    // Of two it is equally aligned with, the first: not rounding decides.
    const double least_aligned = axis_P.cwiseAbs().minCoeff();
    Eigen::Index least = 0;
    while (std::abs(axis_P[least]) > least_aligned + 1e-6) ++least;
    m.tilt_1_P = axis_P.cross(Eigen::Vector3d::Unit(least)).normalized();
    m.tilt_2_P = axis_P.cross(m.tilt_1_P).normalized();
    // Outwards: towards the next joint beyond this one along the chain.
    m.outwards = 1.0;
    for (Eigen::Index j = m.change.joint + 1; j < model->joint_count(); ++j) {
      const auto& next = model->joints()[static_cast<std::size_t>(j)];
      ForwardKinematics beyond(model, {next.child_link, next.parent_link});
      if (!beyond.moves(m.change.joint, 1)) continue;
      std::array<Pose, 2> X_WL;
      beyond.compute(Eigen::VectorXd::Zero(model->joint_count()), X_WL);
      const Pose& X_W = X_WL.front();
      const double along = axis.direction_W.dot(X_W.translation() - X_W_[m.parent + 1].translation());
      if (std::abs(along) > 1e-6) {
        m.outwards = along > 0.0 ? 1.0 : -1.0;
        break;
      }
    }
  }
}

void TrueKinematics::compute(const Eigen::VectorXd& q, std::span<Pose> X_WB) {
  if (misplacements_.empty() && !mount_moved_) {
    nominal_->compute(q, X_WB);
    return;
  }
  nominal_->compute(q, X_W_);
  tracked_.assign(X_W_.begin(), X_W_.begin() + static_cast<std::ptrdiff_t>(tracked_count_));
  // Each D is made of nominal frames, so the product grows from the tip.
  for (auto m = misplacements_.rbegin(); m != misplacements_.rend(); ++m) {
    const auto axis = nominal_->joint_axis(m->change.joint);
    const Eigen::Matrix3d& R_WP = X_W_[m->parent].linear();
    const Eigen::Vector3d tilt_W = R_WP * (m->change.tilt_1_rad * m->tilt_1_P + m->change.tilt_2_rad * m->tilt_2_P);
    Pose D = Pose::Identity();
    if (const double angle = tilt_W.norm(); angle > 0.0) {
      const Eigen::AngleAxisd tilt(angle, tilt_W / angle);
      const double turn = q[m->change.joint];
      const Eigen::Vector3d tilted = tilt * axis.direction_W;
      D.linear() = (Eigen::AngleAxisd(turn, tilted) * Eigen::AngleAxisd(-turn, axis.direction_W)).toRotationMatrix();
    }
    D.translation() =
        axis.point_W - D.linear() * axis.point_W + m->outwards * m->change.lengthening_m * axis.direction_W +
        R_WP * (m->change.shift_1_m * m->tilt_1_P + m->change.shift_2_m * m->tilt_2_P + m->change.shift_P);
    for (std::size_t l = 0; l < tracked_count_; ++l) {
      if (nominal_->moves(m->change.joint, l)) tracked_[l] = D * tracked_[l];
    }
  }
  std::copy_n(tracked_.begin(), link_count_, X_WB.begin());
  if (mount_moved_) X_WM_ = tracked_.back();
}

Pose TrueKinematics::camera(std::size_t index, const Pose& X_WLink) const {
  Pose X_WC = X_WLink;
  if (mount_moved_) {
    const Pose X_WK = X_WM_ * X_MK_;
    X_WC = X_WK * X_KT_ * X_WK.inverse(Eigen::Isometry) * X_WC;
  }
  if (index < X_CT_.size()) X_WC = X_WC * X_CT_[index];
  return X_WC;
}

TrueRobot::TrueRobot(FaultSite site, const StereoRig& rig, Trajectory trajectory, const std::vector<FaultSpec>& specs)
    : site_(std::move(site)), trajectory_(std::move(trajectory)) {
  body_.cameras = rig.cameras;
  body_.X_CT.assign(rig.cameras.size(), Pose::Identity());
  body_.mount_link = site_.mount_link;
  body_.X_MK = site_.X_MK;
  body_.covers.resize(site_.model->meshes().size());
  site_.trajectory = &trajectory_;
  std::vector<std::size_t> order(specs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return fault_kind(specs[a].name).stage < fault_kind(specs[b].name).stage;
  });
  for (const auto i : order) readers_.push_back(make_fault(specs[i], site_));
  for (auto& fault : readers_) {
    fault->build(body_);
    fault->expose(timing_);
    fault->stall(stalls_);
  }
  offsets_.setZero(site_.model->joint_count());
  for (const auto& spec : specs) {
    if (spec.name == "joint_offset") {
      offsets_[FaultArguments(spec, site_).joint()] += radians(spec.value());
    }
  }

  if (specs.empty()) return;
  TorquesOfGravity torques(site_, body_.payload_kg);
  start_s_ = -kMargin_s;
  const double end_s = trajectory_.duration_s() + kMargin_s;
  const auto steps = static_cast<std::size_t>(std::ceil((end_s - start_s_) / kStep_s)) + 1;
  deflection_.reserve(steps);
  Eigen::VectorXd before = trajectory_.position(start_s_ - kStep_s);
  Eigen::VectorXd now = trajectory_.position(start_s_);
  Eigen::VectorXd after(now.size());
  Eigen::VectorXd velocity(now.size());
  Eigen::VectorXd acceleration(now.size());
  for (std::size_t i = 0; i < steps; ++i) {
    const double t = start_s_ + kStep_s * static_cast<double>(i);
    trajectory_.position(t + kStep_s, after);
    velocity = (after - before) / (2.0 * kStep_s);
    acceleration = (after - 2.0 * now + before) / (kStep_s * kStep_s);
    Eigen::VectorXd q = now;
    const MotorStep step{t, kStep_s, now, velocity, acceleration, torques};
    for (auto& fault : readers_) fault->transmit(step, q);
    deflection_.push_back(q - now);
    before.swap(now);
    now.swap(after);
  }
}

void TrueRobot::joints(double t_s, Eigen::VectorXd& q) const {
  q.resize(site_.model->joint_count());
  trajectory_.position(t_s, q);
  if (deflection_.empty()) return;
  const double x = std::clamp((t_s - start_s_) / kStep_s, 0.0, static_cast<double>(deflection_.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(x), deflection_.size() - 2);
  const double share = x - static_cast<double>(i);
  q += (1.0 - share) * deflection_[i] + share * deflection_[i + 1];
}

Eigen::VectorXd TrueRobot::joints(double t_s) const {
  Eigen::VectorXd q;
  joints(t_s, q);
  return q;
}

void TrueRobot::encoders(double t_s, Eigen::VectorXd& encoder) const {
  encoder.resize(site_.model->joint_count());
  trajectory_.position(t_s, encoder);
  for (const auto& fault : readers_) fault->read(encoder);
  for (const auto& stall : stalls_) {
    if (stalled_since(stall.joint, t_s) != stall.begin_s) continue;
    Eigen::VectorXd then(encoder.size());
    trajectory_.position(stall.begin_s, then);
    for (const auto& fault : readers_) fault->read(then);
    encoder[stall.joint] = then[stall.joint];
  }
}

std::optional<double> TrueRobot::stalled_since(Eigen::Index joint, double t_s) const {
  std::optional<double> since;
  for (const auto& stall : stalls_) {
    if (stall.joint != joint || t_s < stall.begin_s || t_s >= stall.end_s) continue;
    since = std::min(since.value_or(stall.begin_s), stall.begin_s);
  }
  return since;
}

}  // namespace bodyschema::simulator
