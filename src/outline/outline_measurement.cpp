#include "bodyschema/outline/outline_measurement.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

using Kind = Coordinate::Kind;

/// Step of the finite differences, rad or m: small against curvature, large against rounding.
constexpr double kStep = 1e-6;
/// Of the misfit: px of a 320x240 picture.
constexpr double kMisfitScale_px = 6.0;

bool moves_links(Kind kind) {
  return kind == Kind::kJoint || kind == Kind::kAlong || kind == Kind::kTilt1 || kind == Kind::kTilt2 ||
         kind == Kind::kShift1 || kind == Kind::kShift2 || kind == Kind::kBase || kind == Kind::kRigShift ||
         kind == Kind::kRigTurn || kind == Kind::kCameraShift || kind == Kind::kCameraTurn;
}

/// Share of a residual's square that counts.
double damping(double r, double scale) {
  return scale * scale / (r * r + scale * scale);
}

}  // namespace

double picture_unit(const PinholeIntrinsics& k) {
  return std::sqrt(static_cast<double>(k.width) * static_cast<double>(k.height) / (320.0 * 240.0));
}

void OutlineEvidence::clear(Eigen::Index coordinates) {
  A.setZero(coordinates, coordinates);
  b.setZero(coordinates);
  square = weight = cost = misfit = sampled = matched = 0.0;
}

OutlineMeasurement::OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                       const StereoRig& rig, const JointRoles& roles)
    : OutlineMeasurement(robot, setup, rig, roles, silhouette_model(*robot, setup)) {}

OutlineMeasurement::OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                       const StereoRig& rig, const JointRoles& roles, const SilhouetteModel& drawn)
    : coordinates_(roles), projection_(robot, setup, rig, roles), moved_(robot, setup, rig, roles),
      extractor_(drawn, rig.intrinsics()), probe_(roles.no_corrections()), X_CB_(projection_.part_count()) {}

void OutlineMeasurement::linearise(const ObservedEdges& edges, const Eigen::Ref<const Eigen::VectorXd>& q,
                                   const Corrections& corrections, std::size_t camera,
                                   std::span<const std::uint32_t> active, const OutlineSearch& search,
                                   OutlineEvidence& out) {
  out.clear(static_cast<Eigen::Index>(active.size()));
  projection_.place(q, corrections, camera);
  compare(&edges, corrections, camera, search, out);
  if (points_.empty() || active.empty()) return;
  find_motions(q, corrections, camera, active);
  differentiate(corrections, projection_.intrinsics(camera), active, out);
}

void OutlineMeasurement::expect(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                std::size_t camera, std::span<const std::uint32_t> active, const OutlineSearch& search,
                                OutlineEvidence& out) {
  out.clear(static_cast<Eigen::Index>(active.size()));
  projection_.place(q, corrections, camera);
  compare(nullptr, corrections, camera, search, out);
  if (points_.empty() || active.empty()) return;
  find_motions(q, corrections, camera, active);
  differentiate(corrections, projection_.intrinsics(camera), active, out);
}

void OutlineMeasurement::compare(const ObservedEdges* edges, const Corrections& corrections, std::size_t camera,
                                 const OutlineSearch& search, OutlineEvidence& out) {
  const auto& k = projection_.intrinsics(camera);
  const double unit = picture_unit(k);
  const double search_px = unit * search.search_px, robust_px = unit * search.robust_px;
  const double misfit_px = unit * kMisfitScale_px, reach_px = std::max(search_px, 2.0 * misfit_px);
  const Eigen::Matrix3d unwarp = projection_.warp().inverse();
  const double k1 = corrections.camera.k1;
  const Eigen::Array2d focal = Eigen::Array2d(k.fx, k.fy) * (1.0 + corrections.camera.focal_scale);
  projection_.parts(X_CB_);
  points_.clear();
  for (const auto& predicted : extractor_.extract(X_CB_, camera, static_cast<float>(unit * search.spacing_px))) {
    const double factor = search.part_weight.empty() ? 1.0 : search.part_weight[predicted.part];
    if (factor <= 0.0) continue;
    OutlinePoint point;
    point.part = predicted.part;
    point.p_C = unwarp * predicted.p_C.cast<double>();
    point.pixel = predicted.pixel.cast<double>();
    point.normal = predicted.normal.cast<double>();
    if (k1 != 0.0) {
      const Eigen::Vector2d x = point.p_C.head<2>() / point.p_C.z();
      point.pixel += (k1 * x.squaredNorm() * focal * x.array()).matrix();
      const Eigen::Matrix2d bend =
          (1.0 + k1 * x.squaredNorm()) * Eigen::Matrix2d::Identity() + 2.0 * k1 * x * x.transpose();
      point.normal = (bend.inverse().transpose() * point.normal).normalized();
    }
    point.pixel += corrections.shapes[projection_.segment_of(point.part)].dilation_px * point.normal;
    const auto distance =
        edges != nullptr ? edges->find(point.pixel, point.normal, reach_px) : std::optional<double>(0.0);
    out.sampled += 1.0;
    const double r = distance.value_or(0.0);
    out.misfit += distance ? r * r * damping(r, misfit_px) : misfit_px * misfit_px;
    if (!distance || std::abs(r) > search_px) {
      out.cost += robust_px * robust_px;
      continue;
    }
    const double share = damping(r, robust_px);
    point.residual_px = r;
    point.weight = factor * share * share;
    out.cost += r * r * share;
    out.square += point.weight * r * r;
    out.weight += point.weight;
    points_.push_back(point);
  }
  out.matched = static_cast<double>(points_.size());
}

void OutlineMeasurement::find_motions(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                      std::size_t camera, std::span<const std::uint32_t> active) {
  const auto links = projection_.links();
  links_.assign(links.begin(), links.end());
  motion_.resize(active.size() * links_.size());
  probe_ = corrections;
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto& coordinate = coordinates_[active[i]];
    if (!moves_links(coordinate.kind)) continue;
    double& number = coordinate.in(probe_);
    const double value = number;
    number = value + kStep;
    moved_.place(q, probe_, camera);
    number = value;
    for (std::size_t l = 0; l < links_.size(); ++l) {
      // d(X X0^-1)/d coordinate: a twist acting on points of the camera's frame.
      const Pose& X = moved_.links()[l];
      const Eigen::Matrix3d W = (X.linear() - links_[l].linear()) * links_[l].linear().transpose() / kStep;
      auto& motion = motion_[i * links_.size() + l];
      motion.leftCols<3>() = W;
      motion.col(3) = (X.translation() - links_[l].translation()) / kStep - W * links_[l].translation();
    }
  }
}

void OutlineMeasurement::differentiate(const Corrections& corrections, const PinholeIntrinsics& k,
                                       std::span<const std::uint32_t> active, OutlineEvidence& out) {
  const auto n = static_cast<Eigen::Index>(points_.size());
  rows_.resize(static_cast<Eigen::Index>(active.size()), n);
  const double k1 = corrections.camera.k1;
  const Eigen::Vector2d focal = Eigen::Vector2d(k.fx, k.fy) * (1.0 + corrections.camera.focal_scale);
  for (Eigen::Index p = 0; p < n; ++p) {
    const auto& point = points_[static_cast<std::size_t>(p)];
    const double iz = 1.0 / point.p_C.z();
    const Eigen::Vector2d x = point.p_C.head<2>() * iz;
    const double bent = 1.0 + k1 * x.squaredNorm();
    const Eigen::Vector2d n_f = point.normal.cwiseProduct(focal);
    // d(normal . pixel) by x, and from there by p_C.
    const Eigen::RowVector2d by_x = (bent * n_f + 2.0 * k1 * n_f.dot(x) * x).transpose();
    const Eigen::RowVector3d by_p(by_x.x() * iz, by_x.y() * iz, -by_x.dot(x) * iz);
    const Eigen::Vector4d p_C = point.p_C.homogeneous();
    const std::size_t segment = projection_.segment_of(point.part);
    for (std::size_t i = 0; i < active.size(); ++i) {
      const auto& coordinate = coordinates_[active[i]];
      const bool own = coordinate.index == static_cast<Eigen::Index>(segment);
      double g = 0.0;
      switch (coordinate.kind) {
        case Kind::kFocal: g = bent * n_f.dot(x) / (1.0 + corrections.camera.focal_scale); break;
        case Kind::kCx: g = point.normal.x(); break;
        case Kind::kCy: g = point.normal.y(); break;
        case Kind::kK1: g = n_f.dot(x) * x.squaredNorm(); break;
        case Kind::kScale:
          if (own) {
            g = by_p.dot(point.p_C - links_[point.part].translation()) / (1.0 + corrections.shapes[segment].scale);
          }
          break;
        case Kind::kDilation: g = own ? 1.0 : 0.0; break;
        default: g = by_p.dot(motion_[i * links_.size() + point.part] * p_C);
      }
      rows_(static_cast<Eigen::Index>(i), p) = g;
    }
    out.b += point.weight * point.residual_px * rows_.col(p);
    rows_.col(p) *= std::sqrt(point.weight);
  }
  out.A.selfadjointView<Eigen::Lower>().rankUpdate(rows_);
  out.A = out.A.selfadjointView<Eigen::Lower>();
}

Eigen::MatrixXd OutlineMeasurement::link_jacobian(const Eigen::Ref<const Eigen::VectorXd>& q,
                                                  const Corrections& corrections, std::size_t camera,
                                                  std::span<const std::uint32_t> active, std::size_t link) {
  projection_.place(q, corrections, camera);
  find_motions(q, corrections, camera, active);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, static_cast<Eigen::Index>(active.size()));
  const Eigen::Vector4d origin = links_[link].translation().homogeneous();
  for (std::size_t i = 0; i < active.size(); ++i) {
    if (!moves_links(coordinates_[active[i]].kind)) continue;
    const auto& motion = motion_[i * links_.size() + link];
    const auto column = static_cast<Eigen::Index>(i);
    jacobian.col(column).head<3>() = motion * origin;
    // The linear part is the cross-product matrix of the angular velocity.
    jacobian.col(column).tail<3>() << motion(2, 1), motion(0, 2), motion(1, 0);
  }
  return jacobian;
}

}  // namespace bodyschema
