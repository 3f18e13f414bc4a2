#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/effects/effect.hpp"
#include "bodyschema/geometry/pinhole.hpp"

namespace bodyschema {

/// The generalised coordinates in which one picture's residuals are compressed: joints of arm, head
/// and fingers, link lengths, tilts and shifts of arm axes, camera, size and thickness of the parts. Every
/// cause of the catalogue is a linear map of its parameters to them.
class CoordinateLayout {
 public:
  explicit CoordinateLayout(const JointRoles& roles);
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(entries_.size()); }
  /// The coordinates' values in a set of corrections.
  void read(const Corrections& corrections, Eigen::Ref<Eigen::VectorXd> out) const;
  /// Position of a joint's angle; -1 when the joint has none.
  [[nodiscard]] Eigen::Index joint(Eigen::Index joint) const;

  enum class Kind {
    kJoint,
    kAlong,
    kTilt1,
    kTilt2,
    kShift1,
    kShift2,
    kBaseX,
    kBaseY,
    kBaseZ,
    kCameraX,
    kFocal,
    kCx,
    kCy,
    kK1,
    kScale,
    kDilation
  };
  struct Entry {
    Kind kind;
    Eigen::Index joint = -1;
  };
  [[nodiscard]] std::span<const Entry> entries() const { return entries_; }
  /// The part of the corrections that coordinate `i` stands for.
  static double& slot(const Entry& entry, Corrections& corrections);
  static double slot(const Entry& entry, const Corrections& corrections);

 private:
  std::vector<Entry> entries_;
};

/// One picture's residuals, compressed: with G the derivatives of the predicted outline along its
/// normals and r the observed minus predicted distances in px, A = G'WG, b = G'Wr. W holds
/// robust weights.
struct CompressedView {
  Eigen::MatrixXd information;
  Eigen::VectorXd vector;
  double square = 0.0;  ///< r'Wr
  double weight = 0.0;  ///< trace of W: sqrt(square / weight) is the residual's rms in px
  /// Huber's cost of the whole predicted outline, px^2, and how many points it has. Unlike `square`
  /// it also counts points whose counterpart is far or missing, so that predictions can be compared
  /// however far apart they are.
  double misfit = 0.0;
  double outline = 0.0;
  double matched = 0.0;  ///< ... and how many of them `vector` and `square` hold
};

/// One outline point with its residual.
struct OutlinePoint {
  std::size_t link = 0;      ///< position in the kinematics' list of links
  Eigen::Vector3d p_C;       ///< m
  Eigen::Vector2d normal;    ///< unit, image
  double residual_px = 0.0;  ///< observed minus predicted, along the normal
  double weight = 1.0;       ///< robust weight
};

/// Derivatives of outline points with respect to the coordinates, by finite differences of the
/// kinematics (so mimic joints and tilted axes need no special care). One per thread.
class ViewCompressor {
 public:
  ViewCompressor(std::shared_ptr<const RobotModel> model, const JointRoles& roles, std::vector<std::string> links,
                 std::vector<std::string> camera_links);

  /// Poses of the links in the camera at a view. Valid until the next call.
  std::span<const Pose> set_view(const Eigen::Ref<const Eigen::VectorXd>& encoder, const Corrections& corrections,
                                 std::size_t camera);
  /// Compresses points of the view set last.
  void compress(std::span<const OutlinePoint> points, const PinholeIntrinsics& intrinsics, CompressedView& out);
  /// Motion of a link per unit of each coordinate: 6 x coordinates (translation of its frame in m,
  /// rotation vector in rad; camera frame), for errors of the hand in mm and degrees.
  [[nodiscard]] Eigen::MatrixXd link_jacobian(std::size_t link) const;
  [[nodiscard]] const CoordinateLayout& layout() const { return layout_; }

 private:
  CoordinateLayout layout_;
  CorrectedKinematics kinematics_;
  std::vector<Pose> X_CB_, moved_;
  Corrections probe_;
  /// Velocity of a point p_C of a link per unit of a coordinate: (linear, offset), [coordinate][link].
  std::vector<Eigen::Matrix<double, 3, 4>> motion_;
  Eigen::MatrixXd rows_;
  Eigen::VectorXd residuals_, weights_;
};

/// What one picture needs for its prediction: the encoders at its exposure, and which camera.
struct ViewInput {
  JointSample joints;
  std::size_t camera = 0;
  Eigen::VectorXd qddot;  ///< rad/s^2
};

/// Velocity and acceleration of every view, from the positions of the encoder log (joint_motion).
void set_motion(std::span<ViewInput> views, std::span<const JointSample> stream);

/// Where residuals come from: pictures of a log, or a synthetic outline for seeded trials.
class MeasurementSource {
 public:
  virtual ~MeasurementSource() = default;
  [[nodiscard]] virtual const JointRoles& roles() const = 0;
  /// In order of time.
  [[nodiscard]] virtual std::span<const ViewInput> views() const = 0;
  /// The whole encoder log, in order of time.
  [[nodiscard]] virtual std::span<const JointSample> stream() const = 0;
  /// Torques of an exposure; `offsets` as InstantBuilder::build.
  virtual void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) = 0;
  /// How far from the prediction the observed outline is looked for, px, and at every n-th
  /// instant only; the others then count as unseen. False where the source knows which point
  /// belongs to which: then all of it is always compressed.
  virtual bool set_search(double search_px, std::size_t every = 1) {
    static_cast<void>(search_px);
    static_cast<void>(every);
    return false;
  }
  /// Compresses every view's residuals about a prediction with these corrections (one per view).
  virtual void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) = 0;
  /// Motion of the hand per coordinate at a view, as ViewCompressor::link_jacobian.
  virtual Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& corrections) = 0;
};

/// The largest range of any of these joints over the views, radians.
double largest_range(std::span<const ViewInput> views, const std::vector<Eigen::Index>& joints);

}  // namespace bodyschema
