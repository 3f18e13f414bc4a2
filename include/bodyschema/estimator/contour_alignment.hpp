#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/estimator/body_pose_model.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/silhouette/contour_points.hpp"

namespace bodyschema {

struct ContourAlignmentOptions {
  float spacing_px = 3.0f;  ///< along the outline
  double huber_px = 1.0;    ///< residuals beyond this count linearly, not squared
};

/// The picture's evidence about the state near one point of it, as a quadratic in pixels:
/// cost(x0 + d) = c - 2 b'd + d'A d. Not yet divided by the variance of a residual.
struct ContourEvidence {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double cost = 0.0;        ///< sum of robust squared residuals, px^2
  std::size_t matched = 0;  ///< outline points that found an observed edge
  std::size_t sampled = 0;  ///< outline points that were looked at
  /// Root mean square of the matched residuals, px.
  [[nodiscard]] double rms_px() const;
  [[nodiscard]] double matched_share() const;
};

/// Distances between the predicted outline and the observed one along the image normal, with
/// their derivatives by every parameter of the state.
///
/// For each outline point the observed edge is where coverage crosses one half from robot (inside)
/// to background (outside), nearest to the point along its normal, found to a fraction of a pixel.
/// Derivatives follow from moving each part by each parameter (central differences of the part
/// transforms, exact for the points): the outline of a smooth body moves along its normal as its
/// surface points do. One per thread; allocates nothing once warm.
class ContourAlignment {
 public:
  ContourAlignment(BodyPoseModel& body, const SilhouetteModel& silhouettes, std::span<const PinholeIntrinsics> cameras,
                   const ContourAlignmentOptions& options);

  /// Adds every present camera's evidence about the state near `x`.
  /// @param search_px  how far along the normal an edge is looked for
  void linearise(const Observation& observation, const Eigen::VectorXd& x, double search_px, ContourEvidence& evidence);

 private:
  void add_camera(const CameraObservation& seen, const Eigen::VectorXd& x, std::size_t camera, double search_px,
                  ContourEvidence& evidence);

  BodyPoseModel& body_;
  ContourExtractor extractor_;
  std::vector<PinholeIntrinsics> cameras_;
  ContourAlignmentOptions options_;
  std::vector<Eigen::Isometry3f> X_CB_, X_plus_, X_minus_;
  std::vector<Eigen::Matrix<double, 3, 4>> dX_dB_;  ///< [parameter][part], acts on (p_C, 1)
  Eigen::VectorXd x_work_, jacobian_row_;
};

}  // namespace bodyschema
