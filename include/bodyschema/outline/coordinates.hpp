#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "bodyschema/effects/joint_roles.hpp"
#include "bodyschema/observation/corrections.hpp"

namespace bodyschema {

/// One number of Corrections.
struct Coordinate {
  enum class Kind {
    kJoint,        ///< dq of joint `index`, rad
    kAlong,        ///< adjustment of joint `index`, m
    kTilt1,        ///< ..., rad
    kTilt2,        ///< ..., rad
    kShift1,       ///< ..., m
    kShift2,       ///< ..., m
    kMountShift,   ///< axis `index` modulo 3 of what joint `index` / 3 carries, m
    kMountTurn,    ///< ..., rad
    kBase,         ///< axis `index` of the base's shift, m
    kRigShift,     ///< axis `index` of the rig's shift, m
    kRigTurn,      ///< ... of its turn, rad
    kCameraShift,  ///< axis `index` of the camera's own shift, m
    kCameraTurn,   ///< ... of its turn, rad
    kFocal,        ///< relative
    kCx,           ///< px
    kCy,           ///< px
    kK1,
    kReadout,    ///< s
    kScale,      ///< of segment `index`, relative
    kSize,       ///< ..., its joints with it
    kThickness,  ///< of segment `index`, m
    kDilation,   ///< ..., px
  };
  Kind kind;
  Eigen::Index index = 0;
  friend bool operator==(const Coordinate&, const Coordinate&) = default;
  /// The number in a set of corrections.
  [[nodiscard]] double& in(Corrections& corrections) const;
  [[nodiscard]] double in(const Corrections& corrections) const;
};

/// The generalised coordinates of a robot's pictures: every number of Corrections that some effect can move. What
/// effects do to a picture is a linear map of their parameters to these, so that one set of derivatives serves all.
class Coordinates {
 public:
  explicit Coordinates(const JointRoles& roles);
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(all_.size()); }
  [[nodiscard]] std::span<const Coordinate> all() const { return all_; }
  [[nodiscard]] const Coordinate& operator[](std::size_t i) const { return all_[i]; }
  /// Position of a coordinate; -1: this robot has no such one.
  [[nodiscard]] Eigen::Index find(const Coordinate& coordinate) const;
  /// Values in a set of corrections, one per coordinate.
  void read(const Corrections& corrections, Eigen::Ref<Eigen::VectorXd> out) const;

 private:
  std::vector<Coordinate> all_;
};

/// So much of one coordinate.
struct CoordinateStep {
  std::uint32_t coordinate = 0;
  double amount = 0.0;
};
/// How one parameter moves the coordinates of one picture, per unit of the parameter.
using Direction = std::vector<CoordinateStep>;

}  // namespace bodyschema
