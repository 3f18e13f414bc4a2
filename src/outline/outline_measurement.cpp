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
         kind == Kind::kShift1 || kind == Kind::kShift2 || kind == Kind::kMountShift || kind == Kind::kMountTurn ||
         kind == Kind::kBase || kind == Kind::kRigShift || kind == Kind::kRigTurn || kind == Kind::kCameraShift ||
         kind == Kind::kCameraTurn;
}

/// d(normal . pixel) by the point in the camera's frame, px/m. @param focal  px
Eigen::RowVector3d across(const OutlinePoint& point, const Eigen::Vector2d& focal, double k1) {
  const double iz = 1.0 / point.p_C.z();
  const Eigen::Vector2d x = point.p_C.head<2>() * iz;
  const Eigen::Vector2d n_f = point.normal.cwiseProduct(focal);
  const Eigen::RowVector2d by_x = ((1.0 + k1 * x.squaredNorm()) * n_f + 2.0 * k1 * n_f.dot(x) * x).transpose();
  return {by_x.x() * iz, by_x.y() * iz, -by_x.dot(x) * iz};
}

/// Where a point of the camera's frame is seen, px from the principal point.
Eigen::Vector2d seen_at(const Eigen::Vector3d& p_C, const Eigen::Vector2d& focal, double k1) {
  const Eigen::Vector2d x = p_C.head<2>() / p_C.z();
  return (1.0 + k1 * x.squaredNorm()) * x.cwiseProduct(focal);
}

/// When a row is exposed, from the middle one's time on, as a share of the read-out.
double row_time(double v, const PinholeIntrinsics& k) {
  return (v - 0.5 * (k.height - 1)) / std::max(1, k.height - 1);
}

/// Motion of a body from X0 to X, per unit: (p, 1) of the frame to velocity.
Eigen::Matrix<double, 3, 4> motion_between(const Pose& X0, const Pose& X, double step) {
  Eigen::Matrix<double, 3, 4> motion;
  const Eigen::Matrix3d W = (X.linear() - X0.linear()) * X0.linear().transpose() / step;
  motion.leftCols<3>() = W;
  motion.col(3) = (X.translation() - X0.translation()) / step - W * X0.translation();
  return motion;
}

/// Share of a residual's square that counts.
double damping(double r, double scale) {
  return scale * scale / (r * r + scale * scale);
}

}  // namespace

void OutlineEvidence::clear(Eigen::Index coordinates) {
  A.setZero(coordinates, coordinates);
  b.setZero(coordinates);
  square = weight = cost = misfit = sampled = matched = odd = 0.0;
}

OutlineMeasurement::OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                       const StereoRig& rig, const JointRoles& roles)
    : OutlineMeasurement(robot, setup, rig, roles, silhouette_model(*robot, setup)) {}

OutlineMeasurement::OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                       const StereoRig& rig, const JointRoles& roles, const SilhouetteModel& drawn)
    : coordinates_(roles), projection_(robot, setup, rig, roles), moved_(robot, setup, rig, roles),
      extractor_(drawn, rig.intrinsics()), probe_(roles.no_corrections()), X_CB_(projection_.part_count()) {}

OutlineMeasurement::OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup,
                                       const StereoRig& rig, const JointRoles& roles, const OutlineMeasurement& other)
    : coordinates_(roles), projection_(robot, setup, rig, roles), moved_(robot, setup, rig, roles),
      extractor_(other.extractor_), probe_(roles.no_corrections()), X_CB_(projection_.part_count()) {}

void OutlineMeasurement::linearise(const ObservedEdges& edges, const Eigen::Ref<const Eigen::VectorXd>& q,
                                   const Corrections& corrections, std::size_t camera,
                                   std::span<const std::uint32_t> active, const OutlineSearch& search,
                                   OutlineEvidence& out) {
  measure(&edges, q, corrections, camera, active, search, out);
}

void OutlineMeasurement::expect(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                std::size_t camera, std::span<const std::uint32_t> active, const OutlineSearch& search,
                                OutlineEvidence& out) {
  measure(nullptr, q, corrections, camera, active, search, out);
}

void OutlineMeasurement::measure(const ObservedEdges* edges, const Eigen::Ref<const Eigen::VectorXd>& q,
                                 const Corrections& corrections, std::size_t camera,
                                 std::span<const std::uint32_t> active, const OutlineSearch& search,
                                 OutlineEvidence& out) {
  out.clear(static_cast<Eigen::Index>(active.size()));
  projection_.place(q, corrections, camera);
  find_shutter_motion(q, corrections, camera, active);
  compare(edges, corrections, camera, search, out);
  if (points_.empty() || active.empty()) return;
  find_motions(q, corrections, camera, active);
  differentiate(corrections, projection_.intrinsics(camera), active, out);
}

void OutlineMeasurement::find_shutter_motion(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                             std::size_t camera, std::span<const std::uint32_t> active) {
  shutter_.clear();
  constexpr double kStep_s = 1e-5, kRest_rad_s = 1e-4;
  const bool asked = std::any_of(active.begin(), active.end(),
                                 [&](std::uint32_t i) { return coordinates_[i].kind == Kind::kReadout; });
  if (!asked && corrections.camera.readout_s == 0.0) return;
  if (corrections.qdot.size() != q.size() || corrections.qdot.cwiseAbs().maxCoeff() < kRest_rad_s) return;
  moved_.place(q + kStep_s * corrections.qdot, corrections, camera);
  for (std::size_t l = 0; l < projection_.links().size(); ++l) {
    shutter_.push_back(motion_between(projection_.links()[l], moved_.links()[l], kStep_s));
  }
}

void OutlineMeasurement::roll(const Corrections& corrections, const PinholeIntrinsics& k, OutlinePoint& point) const {
  if (shutter_.empty() || corrections.camera.readout_s == 0.0) return;
  const double time_s = corrections.camera.readout_s * row_time(point.pixel.y(), k);
  const Eigen::Vector3d p_C = point.p_C + time_s * (shutter_[point.part] * point.p_C.homogeneous());
  const Eigen::Array2d focal = Eigen::Array2d(k.fx, k.fy) * (1.0 + corrections.camera.focal_scale);
  const Eigen::Vector2d step = p_C.head<2>() / p_C.z() - point.p_C.head<2>() / point.p_C.z();
  point.pixel += (focal * step.array()).matrix();
  point.p_C = p_C;
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
  samples_.clear();
  const auto outline = extractor_.extract(X_CB_, camera, static_cast<float>(unit * search.spacing_px));
  find_moved(outline, corrections, camera, unit * search.spacing_px);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    if (is_passed(i)) continue;
    const auto& predicted = outline[i];
    const double factor = search.part_weight.empty() ? 1.0 : search.part_weight[predicted.part];
    if (factor <= 0.0) continue;
    OutlinePoint point;
    point.part = predicted.part;
    point.p_C = unwarp * predicted.p_C.cast<double>();
    point.pixel = predicted.pixel.cast<double>();
    point.normal = predicted.normal.cast<double>();
    roll(corrections, k, point);
    if (k1 != 0.0) {
      const Eigen::Vector2d x = point.p_C.head<2>() / point.p_C.z();
      point.pixel += (k1 * x.squaredNorm() * focal * x.array()).matrix();
      const Eigen::Matrix2d bend =
          (1.0 + k1 * x.squaredNorm()) * Eigen::Matrix2d::Identity() + 2.0 * k1 * x * x.transpose();
      point.normal = (bend.inverse().transpose() * point.normal).normalized();
    }
    const auto& shape = corrections.shapes[projection_.segment_of(point.part)];
    if (shape.thickness_m != 0.0) {
      // Where an outline is seen the surface's normal lies across the line of sight.
      const Eigen::Vector3d moved = point.p_C + shape.thickness_m * across(point, focal, k1).transpose().normalized();
      point.pixel += seen_at(moved, focal, k1) - seen_at(point.p_C, focal, k1);
      point.p_C = moved;
    }
    point.pixel += shape.dilation_px / k.reduction * point.normal;
    const bool covered = search.covered != nullptr && search.covered->shows(point.pixel.x(), point.pixel.y());
    const auto distance =
        edges != nullptr ? edges->find(point.pixel, point.normal, reach_px) : std::optional<double>(0.0);
    const double r = distance.value_or(0.0);
    const bool found = distance && std::abs(r) <= search_px;
    samples_.push_back({point.part, point.pixel, point.normal, found ? distance : std::nullopt, covered});
    if (!covered) {
      out.sampled += 1.0;
      out.misfit += distance ? r * r * damping(r, misfit_px) : misfit_px * misfit_px;
      if (!found) out.cost += robust_px * robust_px;
    }
    if (!found) continue;
    const double share = damping(r, robust_px);
    point.residual_px = r;
    point.weight = factor * share * share;
    point.odd = covered;
    points_.push_back(point);
    if (covered) continue;
    out.matched += 1.0;
    out.cost += r * r * share;
    out.square += point.weight * r * r;
    out.weight += point.weight;
  }
  if (search.odd_sd_px > 0.0) leave_out_odd(search, unit, out);
}

void OutlineMeasurement::find_moved(std::span<const ContourPoint> outline, const Corrections& corrections,
                                    std::size_t camera, double spacing_px) {
  const auto& k = projection_.intrinsics(camera);
  const double focal_px = k.fx * (1.0 + corrections.camera.focal_scale);
  moved_points_.clear();
  // Points lie too far apart for less to bring one past another but by chance.
  const bool moved = std::any_of(corrections.shapes.begin(), corrections.shapes.end(), [&](const auto& shape) {
    return shape.thickness_m != 0.0 || std::abs(shape.dilation_px / k.reduction) >= spacing_px;
  });
  if (!moved) return;
  float most_px = 0.0f;
  bool covered = false;
  for (const auto& point : outline) {
    const auto& shape = corrections.shapes[projection_.segment_of(point.part)];
    const auto by_px =
        static_cast<float>(shape.thickness_m * focal_px / point.p_C.z() + shape.dilation_px / k.reduction);
    most_px = std::max(most_px, std::abs(by_px));
    covered = covered || shape.thickness_m > 0.0;
    moved_points_.push_back({point.pixel, point.pixel + by_px * point.normal, by_px});
  }
  if (!covered && most_px < static_cast<float>(spacing_px)) moved_points_.clear();
}

bool OutlineMeasurement::is_passed(std::size_t index) const {
  if (moved_points_.empty()) return false;
  const auto& own = moved_points_[index];
  const bool inwards = own.by_px < 0.0f;
  return std::any_of(moved_points_.begin(), moved_points_.end(), [&](const MovedPoint& other) {
    if (other.by_px == 0.0f || (other.by_px < 0.0f) != inwards) return false;
    // Where a cover ends beside something bare its edge may be sharp and reach further; in a notch its sides meet.
    const bool ends = 2.0f * std::abs(own.by_px) < std::abs(other.by_px);
    const float reach_px = (ends ? 1.5f : 0.95f) * other.by_px;
    return (other.from - own.to).squaredNorm() < reach_px * reach_px;
  });
}

void OutlineMeasurement::leave_out_odd(const OutlineSearch& search, double unit_px, OutlineEvidence& out) {
  odd_pieces_.find(samples_, unit_px * search.odd_sd_px, unit_px * search.spacing_px, unit_px * search.search_px);
  const double robust_px = unit_px * search.robust_px;
  auto point = points_.begin();  // one for every sample that was found, in their order
  for (const auto& sample : samples_) {
    out.odd += sample.odd;
    if (!sample.residual_px) continue;
    OutlinePoint& own = *point++;
    if (!sample.odd) continue;
    own.odd = true;
    const double r = own.residual_px;
    out.cost += robust_px * robust_px - r * r * damping(r, robust_px);
    out.square -= own.weight * r * r;
    out.weight -= own.weight;
  }
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
      auto& motion = motion_[i * links_.size() + l];
      const auto& X = moved_.links()[l];
      if (X.matrix() == links_[l].matrix()) {
        motion.setZero();  // most joints move few of the links
      } else {
        motion = motion_between(links_[l], X, kStep);
      }
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
    if (point.odd) {
      rows_.col(p).setZero();
      continue;
    }
    const double iz = 1.0 / point.p_C.z();
    const Eigen::Vector2d x = point.p_C.head<2>() * iz;
    const double bent = 1.0 + k1 * x.squaredNorm();
    const Eigen::Vector2d n_f = point.normal.cwiseProduct(focal);
    const Eigen::RowVector3d by_p = across(point, focal, k1);
    const Eigen::Vector4d p_C = point.p_C.homogeneous();
    const std::size_t segment = projection_.segment_of(point.part);
    const double size = projection_.size(point.part);
    for (std::size_t i = 0; i < active.size(); ++i) {
      const auto& coordinate = coordinates_[active[i]];
      const bool own = coordinate.index == static_cast<Eigen::Index>(segment);
      double g = 0.0;
      switch (coordinate.kind) {
        case Kind::kFocal: g = bent * n_f.dot(x) / (1.0 + corrections.camera.focal_scale); break;
        case Kind::kCx: g = point.normal.x() / k.reduction; break;
        case Kind::kCy: g = point.normal.y() / k.reduction; break;
        case Kind::kReadout:
          if (!shutter_.empty()) g = by_p.dot(shutter_[point.part] * p_C) * row_time(point.pixel.y(), k);
          break;
        case Kind::kK1: g = n_f.dot(x) * x.squaredNorm(); break;
        case Kind::kScale:
          if (own) {
            g = by_p.dot(point.p_C - projection_.origin(point.part)) / (1.0 + corrections.shapes[segment].scale);
          }
          break;
        case Kind::kSize:
          if (own && projection_.core_of(point.part) != RobotProjection::kNone) {
            g = by_p.dot(projection_.from_core(point.part) +
                         (point.p_C - projection_.origin(point.part)) / (1.0 + size));
          }
          break;
        case Kind::kThickness: g = own ? by_p.norm() : 0.0; break;
        case Kind::kDilation: g = own ? 1.0 / k.reduction : 0.0; break;
        default:
          g = by_p.dot(motion_[i * links_.size() + point.part] * p_C);
          if (size != 0.0) g += size * by_p.dot(motion_of_size(i, point.part));
      }
      rows_(static_cast<Eigen::Index>(i), p) = g;
    }
    out.b += point.weight * point.residual_px * rows_.col(p);
    rows_.col(p) *= std::sqrt(point.weight);
  }
  out.A.selfadjointView<Eigen::Lower>().rankUpdate(rows_);
  out.A = out.A.selfadjointView<Eigen::Lower>();
}

Eigen::Vector3d OutlineMeasurement::motion_of_size(std::size_t i, std::size_t part) const {
  const auto* motion = &motion_[i * links_.size()];
  const std::size_t core = projection_.core_of(part);
  // What the part's own motion says of a point that its segment's size has moved is too much by that of the way there.
  const Eigen::Vector3d way = motion[part].leftCols<3>() * projection_.from_core(part);
  return motion[part] * links_[part].translation().homogeneous() -
         motion[core] * links_[core].translation().homogeneous() - way;
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
