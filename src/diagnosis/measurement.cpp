#include "bodyschema/diagnosis/measurement.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/effects/catalogue.hpp"
#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema {
namespace {

using Kind = CoordinateLayout::Kind;

/// Step of the finite differences, rad or m: small against curvature, large against rounding.
constexpr double kStep = 1e-5;

bool moves_links(Kind kind) {
  return kind == Kind::kJoint || kind == Kind::kAlong || kind == Kind::kTilt1 || kind == Kind::kTilt2 ||
         kind == Kind::kShift1 || kind == Kind::kShift2 || kind == Kind::kBaseX || kind == Kind::kBaseY ||
         kind == Kind::kBaseZ || kind == Kind::kCameraX;
}

template <class C>
auto& slot_of(const CoordinateLayout::Entry& entry, C& c) {
  const auto joint = static_cast<std::size_t>(entry.joint < 0 ? 0 : entry.joint);
  switch (entry.kind) {
    case Kind::kJoint: return c.dq.coeffRef(entry.joint);
    case Kind::kAlong: return c.adjustments[joint].along_m;
    case Kind::kTilt1: return c.adjustments[joint].tilt_1_rad;
    case Kind::kTilt2: return c.adjustments[joint].tilt_2_rad;
    case Kind::kShift1: return c.adjustments[joint].shift_1_m;
    case Kind::kShift2: return c.adjustments[joint].shift_2_m;
    case Kind::kBaseX: return c.base_shift_m.x();
    case Kind::kBaseY: return c.base_shift_m.y();
    case Kind::kBaseZ: return c.base_shift_m.z();
    case Kind::kCameraX: return c.camera.shift_x_m;
    case Kind::kFocal: return c.camera.focal_scale;
    case Kind::kCx: return c.camera.cx_px;
    case Kind::kCy: return c.camera.cy_px;
    case Kind::kK1: return c.camera.k1;
    case Kind::kScale: return c.mesh_scale;
    case Kind::kDilation: break;
  }
  return c.dilation_px;
}

}  // namespace

CoordinateLayout::CoordinateLayout(const JointRoles& roles) {
  for (const auto* group : {&roles.arm, &roles.head, &roles.fingers}) {
    for (const auto joint : *group) entries_.push_back({Kind::kJoint, joint});
  }
  for (const auto& target : effect_targets("link_length", roles)) {
    entries_.push_back({Kind::kAlong, roles.index(target.joint)});
  }
  for (const auto joint : roles.arm) {
    entries_.push_back({Kind::kTilt1, joint});
    entries_.push_back({Kind::kTilt2, joint});
  }
  for (const auto& target : effect_targets("axis_shift", roles)) {
    entries_.push_back({Kind::kShift1, roles.index(target.joint)});
    entries_.push_back({Kind::kShift2, roles.index(target.joint)});
  }
  for (const auto kind : {Kind::kBaseX, Kind::kBaseY, Kind::kBaseZ, Kind::kCameraX, Kind::kFocal, Kind::kCx, Kind::kCy,
                          Kind::kK1, Kind::kScale, Kind::kDilation}) {
    entries_.push_back({kind, -1});
  }
}

double& CoordinateLayout::slot(const Entry& entry, Corrections& c) {
  return slot_of(entry, c);
}

double CoordinateLayout::slot(const Entry& entry, const Corrections& c) {
  return slot_of(entry, const_cast<Corrections&>(c));
}

void CoordinateLayout::read(const Corrections& corrections, Eigen::Ref<Eigen::VectorXd> out) const {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    out[static_cast<Eigen::Index>(i)] = slot(entries_[i], corrections);
  }
}

Eigen::Index CoordinateLayout::joint(Eigen::Index joint) const {
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].kind == Kind::kJoint && entries_[i].joint == joint) {
      return static_cast<Eigen::Index>(i);
    }
  }
  return -1;
}

ViewCompressor::ViewCompressor(std::shared_ptr<const RobotModel> model, const JointRoles& roles,
                               std::vector<std::string> links, std::vector<std::string> camera_links)
    : layout_(roles), kinematics_(model, std::move(links), std::move(camera_links)),
      X_CB_(kinematics_.link_count(), Pose::Identity()), moved_(X_CB_), probe_(model->joint_count()),
      motion_(static_cast<std::size_t>(layout_.size()) * X_CB_.size(), Eigen::Matrix<double, 3, 4>::Zero()) {}

std::span<const Pose> ViewCompressor::set_view(const Eigen::Ref<const Eigen::VectorXd>& encoder,
                                               const Corrections& corrections, std::size_t camera) {
  kinematics_.compute(encoder, corrections, camera, X_CB_);
  probe_ = corrections;
  for (std::size_t i = 0; i < layout_.entries().size(); ++i) {
    const auto& entry = layout_.entries()[i];
    if (!moves_links(entry.kind)) continue;
    double& value = CoordinateLayout::slot(entry, probe_);
    const double at = value;
    value = at + kStep;
    kinematics_.compute(encoder, probe_, camera, moved_);
    value = at;
    for (std::size_t l = 0; l < X_CB_.size(); ++l) {
      motion_[i * X_CB_.size() + l] = ((moved_[l] * X_CB_[l].inverse(Eigen::Isometry)).matrix().topRows<3>() -
                                       Eigen::Matrix4d::Identity().topRows<3>()) /
                                      kStep;
    }
  }
  return X_CB_;
}

void ViewCompressor::compress(std::span<const OutlinePoint> points, const PinholeIntrinsics& intrinsics,
                              CompressedView& out) {
  const auto n = static_cast<Eigen::Index>(points.size());
  rows_.resize(layout_.size(), n);  // one column per point
  residuals_.resize(n);
  weights_.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto& point = points[static_cast<std::size_t>(k)];
    const double iz = 1.0 / point.p_C.z();
    const double x = point.p_C.x() * iz, y = point.p_C.y() * iz;
    const double nx = point.normal.x(), ny = point.normal.y();
    // Motion of the projection along the normal per motion of the point.
    const Eigen::Vector3d a(nx * intrinsics.fx * iz, ny * intrinsics.fy * iz,
                            -(nx * intrinsics.fx * x + ny * intrinsics.fy * y) * iz);
    const double radial = nx * intrinsics.fx * x + ny * intrinsics.fy * y;
    const Eigen::Vector4d p(point.p_C.x(), point.p_C.y(), point.p_C.z(), 1.0);
    for (std::size_t i = 0; i < layout_.entries().size(); ++i) {
      double g = 0.0;
      switch (layout_.entries()[i].kind) {
        case Kind::kFocal: g = radial; break;
        case Kind::kCx: g = nx; break;
        case Kind::kCy: g = ny; break;
        case Kind::kK1: g = radial * (x * x + y * y); break;
        case Kind::kScale: g = a.dot(point.p_C - X_CB_[point.link].translation()); break;
        case Kind::kDilation: g = 1.0; break;
        default: g = a.dot(motion_[i * X_CB_.size() + point.link] * p);
      }
      rows_(static_cast<Eigen::Index>(i), k) = g;
    }
    residuals_[k] = point.residual_px;
    weights_[k] = point.weight;
  }
  out.information.setZero(layout_.size(), layout_.size());
  out.vector.noalias() = rows_ * weights_.cwiseProduct(residuals_);
  out.square = weights_.dot(residuals_.cwiseAbs2());
  out.weight = weights_.sum();
  // Huber's cost: with w = h / |r| it is 2 h |r| - h^2.
  out.misfit = (weights_.array() * (2.0 - weights_.array()) * residuals_.array().square()).sum();
  out.outline = static_cast<double>(n);
  rows_ *= weights_.cwiseSqrt().asDiagonal();
  out.information.selfadjointView<Eigen::Lower>().rankUpdate(rows_);
  out.information = out.information.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd ViewCompressor::link_jacobian(std::size_t link) const {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, layout_.size());
  const Eigen::Vector4d origin = X_CB_[link].translation().homogeneous();
  for (std::size_t i = 0; i < layout_.entries().size(); ++i) {
    const auto& motion = motion_[i * X_CB_.size() + link];
    const auto column = static_cast<Eigen::Index>(i);
    jacobian.col(column).head<3>() = motion * origin;
    // The linear part is the cross-product matrix of the angular velocity.
    jacobian.col(column).tail<3>() << motion(2, 1), motion(0, 2), motion(1, 0);
  }
  return jacobian;
}

void set_motion(std::span<ViewInput> views, std::span<const JointSample> stream) {
  for (auto& view : views) joint_motion(stream, view.joints.utime, view.joints.qdot, view.qddot);
}

double largest_range(std::span<const ViewInput> views, const std::vector<Eigen::Index>& joints) {
  double range = 0.0;
  for (const auto joint : joints) {
    const auto [low, high] = std::minmax_element(views.begin(), views.end(), [joint](const auto& a, const auto& b) {
      return a.joints.q[joint] < b.joints.q[joint];
    });
    if (low != views.end()) range = std::max(range, high->joints.q[joint] - low->joints.q[joint]);
  }
  return range;
}

}  // namespace bodyschema
