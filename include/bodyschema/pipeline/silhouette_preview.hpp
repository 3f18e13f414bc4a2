#pragma once

#include <memory>
#include <vector>

#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/outline/robot_projection.hpp"

namespace bodyschema {

/// Draws the silhouette that a model predicts for one picture, for people. One thread.
class SilhouettePreview {
 public:
  explicit SilhouettePreview(const PictureLog& log);
  /// @param q  encoders, rad, RobotModel order
  /// @param corrections  what the model adds to them and to the camera
  BinaryMask draw(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera);
  /// The same of some parts alone, by position in RobotSetup's rendered links, whatever hides them.
  BinaryMask draw_parts(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera,
                        const std::vector<bool>& parts);
  /// The hand's pixel in the last drawn picture; behind the camera: not finite.
  [[nodiscard]] Eigen::Vector2d hand() const;
  /// Length in px of a metre across the line of sight at the hand's distance; behind the camera: 0.
  [[nodiscard]] double hand_px_per_m() const;

 private:
  RobotProjection projection_;
  std::vector<Eigen::Isometry3f> X_CB_;
  std::unique_ptr<SilhouetteScorer> scorer_;
  std::size_t camera_ = 0;
};

}  // namespace bodyschema
