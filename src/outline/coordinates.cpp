#include "bodyschema/outline/coordinates.hpp"

#include <algorithm>

namespace bodyschema {
namespace {

using Kind = Coordinate::Kind;

template <class C>
auto& number(const Coordinate& coordinate, C& c) {
  const auto i = coordinate.index;
  const auto at = static_cast<std::size_t>(i);
  switch (coordinate.kind) {
    case Kind::kJoint: return c.dq.coeffRef(i);
    case Kind::kAlong: return c.adjustments[at].along_m;
    case Kind::kTilt1: return c.adjustments[at].tilt_1_rad;
    case Kind::kTilt2: return c.adjustments[at].tilt_2_rad;
    case Kind::kShift1: return c.adjustments[at].shift_1_m;
    case Kind::kShift2: return c.adjustments[at].shift_2_m;
    case Kind::kMountShift: return c.adjustments[at / 3].mount_shift_m.coeffRef(i % 3);
    case Kind::kMountTurn: return c.adjustments[at / 3].mount_turn_rad.coeffRef(i % 3);
    case Kind::kBase: return c.base_shift_m.coeffRef(i);
    case Kind::kRigShift: return c.camera.rig_shift_m.coeffRef(i);
    case Kind::kRigTurn: return c.camera.rig_turn_rad.coeffRef(i);
    case Kind::kCameraShift: return c.camera.shift_m.coeffRef(i);
    case Kind::kCameraTurn: return c.camera.turn_rad.coeffRef(i);
    case Kind::kFocal: return c.camera.focal_scale;
    case Kind::kCx: return c.camera.cx_px;
    case Kind::kCy: return c.camera.cy_px;
    case Kind::kK1: return c.camera.k1;
    case Kind::kReadout: return c.camera.readout_s;
    case Kind::kScale: return c.shapes[at].scale;
    case Kind::kSize: return c.shapes[at].size;
    case Kind::kThickness: return c.shapes[at].thickness_m;
    case Kind::kDilation: break;
  }
  return c.shapes[at].dilation_px;
}

}  // namespace

double& Coordinate::in(Corrections& corrections) const {
  return number(*this, corrections);
}

double Coordinate::in(const Corrections& corrections) const {
  return number(*this, const_cast<Corrections&>(corrections));
}

Coordinates::Coordinates(const JointRoles& roles) {
  const auto add = [&](Kind kind, Eigen::Index index) { all_.push_back({kind, index}); };
  for (const auto* group : {&roles.arm, &roles.head, &roles.hand}) {
    for (const auto joint : *group) add(Kind::kJoint, joint);
  }
  for (const auto joint : roles.arm) {
    for (const auto kind : {Kind::kAlong, Kind::kTilt1, Kind::kTilt2, Kind::kShift1, Kind::kShift2}) add(kind, joint);
  }
  for (const auto& mount : roles.mounts) {
    for (const auto kind : {Kind::kMountShift, Kind::kMountTurn}) {
      for (Eigen::Index axis = 0; axis < 3; ++axis) add(kind, 3 * mount.joint + axis);
    }
  }
  for (const auto kind : {Kind::kBase, Kind::kRigShift, Kind::kRigTurn, Kind::kCameraShift, Kind::kCameraTurn}) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) add(kind, axis);
  }
  for (const auto kind : {Kind::kFocal, Kind::kCx, Kind::kCy, Kind::kK1, Kind::kReadout}) add(kind, 0);
  for (const auto kind : {Kind::kScale, Kind::kThickness, Kind::kDilation}) {
    for (std::size_t s = 0; s < roles.segments.size(); ++s) add(kind, static_cast<Eigen::Index>(s));
  }
  for (std::size_t s = 0; s < roles.segments.size(); ++s) {
    if (!roles.segments[s].inner.empty()) add(Kind::kSize, static_cast<Eigen::Index>(s));
  }
}

Eigen::Index Coordinates::find(const Coordinate& coordinate) const {
  const auto at = std::find(all_.begin(), all_.end(), coordinate);
  return at == all_.end() ? -1 : at - all_.begin();
}

void Coordinates::read(const Corrections& corrections, Eigen::Ref<Eigen::VectorXd> out) const {
  for (std::size_t i = 0; i < all_.size(); ++i) out[static_cast<Eigen::Index>(i)] = all_[i].in(corrections);
}

}  // namespace bodyschema
