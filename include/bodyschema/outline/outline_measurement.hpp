#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/outline/coordinates.hpp"
#include "bodyschema/outline/observed_edges.hpp"
#include "bodyschema/outline/odd_pieces.hpp"
#include "bodyschema/outline/robot_projection.hpp"
#include "bodyschema/silhouette/contour_points.hpp"

namespace bodyschema {

/// How a picture's outline is looked at. Lengths are those of a picture of 320x240 and grow with the picture
/// (picture_unit).
struct OutlineSearch {
  double search_px = 8.0;   ///< how far along the normal from the prediction
  double spacing_px = 3.0;  ///< between points, along the outline
  /// Robust scale c: a residual r costs r^2 c^2 / (r^2 + c^2) and weighs (c^2 / (r^2 + c^2))^2 (Geman and McClure):
  /// what lies many c away, a tool that no mesh shows or somebody's arm, says nothing.
  double robust_px = 3.0;
  /// Factor on every point of a part; empty: 1. 0: the part has no say, it only hides others.
  std::vector<double> part_weight{};
  /// Standard deviation of a residual, by which pieces of the outline that show something else are told and left out
  /// (OddPieces); 0: none are.
  double odd_sd_px = 0.0;
  /// Pixels where something else is known to be: the outline is not looked for there. Null: none.
  const BinaryMask* covered = nullptr;
};

/// One point of a predicted outline with its counterpart in the picture.
struct OutlinePoint {
  std::size_t part = 0;
  Eigen::Vector3d p_C = Eigen::Vector3d::Zero();     ///< the surface point that makes the outline, m
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();   ///< predicted, px
  Eigen::Vector2d normal = Eigen::Vector2d::Zero();  ///< unit, image, outwards
  double residual_px = 0.0;                          ///< observed minus predicted, along the normal
  double weight = 1.0;                               ///< robust weight
  bool odd = false;                                  ///< left out: it shows something else
};

/// What one picture says about some coordinates near a prediction. With G the derivatives of the predicted outline
/// along its normals, W robust weights and r the observed minus predicted distances in px: A = G'WG, b = G'Wr, so that
/// the cost after a step d is square - 2 b'd + d'A d, px^2. Not yet divided by the variance of a residual.
struct OutlineEvidence {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double square = 0.0;   ///< r'Wr
  double weight = 0.0;   ///< trace of W: sqrt(square / weight) is the residual's rms in px
  double cost = 0.0;     ///< robust cost of the whole predicted outline, px^2; a point without counterpart costs c^2
  double misfit = 0.0;   ///< the same with one c for all: comparable however far was searched
  double sampled = 0.0;  ///< points of the predicted outline in the picture
  double matched = 0.0;  ///< ... that found a counterpart within the search
  double odd = 0.0;      ///< points of `sampled` that were left out: they show something else
  void clear(Eigen::Index coordinates);
  [[nodiscard]] double rms_px() const { return weight > 0.0 ? std::sqrt(square / weight) : 0.0; }
  [[nodiscard]] double matched_share() const { return sampled > 0.0 ? matched / sampled : 0.0; }
};

/// The measurement: distances between the predicted outline of the robot and the observed one along the image normal,
/// with their derivatives by any coordinates. Estimator, replay, calibration and diagnosis all call this.
///
/// The outline of a smooth body moves along its normal as its surface points do, so derivatives are those of points
/// fixed to their parts; they come from finite differences of the kinematics (mimic joints and tilted axes need no
/// special care), cameras and shapes in closed form. One per thread; allocates nothing once warm.
class OutlineMeasurement {
 public:
  OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const JointRoles& roles);
  /// @param drawn  the rendered links' meshes as outlines are taken from, one per mesh of the robot
  OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const JointRoles& roles, const SilhouetteModel& drawn);
  /// For another thread: of the same robot and cameras, shares the meshes with `other`.
  OutlineMeasurement(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const JointRoles& roles, const OutlineMeasurement& other);

  [[nodiscard]] const Coordinates& coordinates() const { return coordinates_; }
  [[nodiscard]] RobotProjection& projection() { return projection_; }
  [[nodiscard]] std::size_t part_count() const { return projection_.part_count(); }

  /// Compares one picture with its prediction.
  /// @param q  encoders at its exposure
  /// @param active  coordinates wanted, by position; A and b are over these, in this order
  void linearise(const ObservedEdges& edges, const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                 std::size_t camera, std::span<const std::uint32_t> active, const OutlineSearch& search,
                 OutlineEvidence& out);
  /// What a picture of this view would tell if every point of its outline were found where it is predicted.
  void expect(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera,
              std::span<const std::uint32_t> active, const OutlineSearch& search, OutlineEvidence& out);
  /// The matched points of the last `linearise`.
  [[nodiscard]] std::span<const OutlinePoint> points() const { return points_; }
  /// All points of the last predicted outline, but for parts without a say.
  [[nodiscard]] std::span<const OutlineSample> samples() const { return samples_; }

  /// Motion of a link (position in RobotProjection::links) per unit of each active coordinate: 6 x active, translation
  /// of its frame in m and rotation vector in rad, camera frame.
  Eigen::MatrixXd link_jacobian(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                std::size_t camera, std::span<const std::uint32_t> active, std::size_t link);

 private:
  /// @param edges  null: every point is where it is predicted
  void measure(const ObservedEdges* edges, const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
               std::size_t camera, std::span<const std::uint32_t> active, const OutlineSearch& search,
               OutlineEvidence& out);
  void find_motions(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera,
                    std::span<const std::uint32_t> active);
  /// How links move while rows are read out; nothing where no row is another one's time, or nothing moves.
  void find_shutter_motion(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                           std::size_t camera, std::span<const std::uint32_t> active);
  /// Moves a point to where its row saw it.
  void roll(const Corrections& corrections, const PinholeIntrinsics& k, OutlinePoint& point) const;
  /// @param edges  as above
  void compare(const ObservedEdges* edges, const Corrections& corrections, std::size_t camera,
               const OutlineSearch& search, OutlineEvidence& out);
  /// Where covers and fat masks move the outline of the meshes. @param spacing_px  of its points
  void find_moved(std::span<const ContourPoint> outline, const Corrections& corrections, std::size_t camera,
                  double spacing_px);
  /// Whether a point that was moved has none of the outline that is seen: that of another has passed it, over a bare
  /// part beside a cover, and in a notch whose sides have met.
  [[nodiscard]] bool is_passed(std::size_t index) const;
  /// Leaves odd pieces of `samples_` out of the points.
  void leave_out_odd(const OutlineSearch& search, double unit_px, OutlineEvidence& out);
  /// Velocity of a part's place, per unit of coordinate `i` of `find_motions`, that is due to another size of its
  /// segment, per unit of that.
  [[nodiscard]] Eigen::Vector3d motion_of_size(std::size_t i, std::size_t part) const;
  void differentiate(const Corrections& corrections, const PinholeIntrinsics& k, std::span<const std::uint32_t> active,
                     OutlineEvidence& out);

  Coordinates coordinates_;
  RobotProjection projection_, moved_;
  ContourExtractor extractor_;
  Corrections probe_;
  std::vector<Eigen::Isometry3f> X_CB_;
  std::vector<Pose> links_;  ///< of the prediction
  /// Velocity of a point (p_C, 1) of a link per unit of an active coordinate: [coordinate][link].
  std::vector<Eigen::Matrix<double, 3, 4>> motion_;
  std::vector<Eigen::Matrix<double, 3, 4>> shutter_;  ///< the same per second, by link; empty: they rest
  std::vector<OutlinePoint> points_;
  std::vector<OutlineSample> samples_;
  struct MovedPoint {
    Eigen::Vector2f from, to;
    float by_px;  ///< outwards
  };
  std::vector<MovedPoint> moved_points_;  ///< of the whole outline; empty where none is moved by enough to pass another
  OddPieces odd_pieces_;
  Eigen::MatrixXd rows_;
};

}  // namespace bodyschema
