#include "bodyschema/pipeline/silhouette_preview.hpp"

#include <cmath>
#include <limits>

#include "bodyschema/camera/bent_silhouette.hpp"

namespace bodyschema {
SilhouettePreview::SilhouettePreview(const PictureLog& log)
    : projection_(log.robot(), log.setup(), log.rig(), log.roles()), X_CB_(projection_.part_count()) {
  SilhouetteOptions options;
  options.engine = "contour";
  options.threads = 1;
  scorer_ = make_silhouette_scorer(silhouette_model(*log.robot(), log.setup()), log.rig().intrinsics(), options);
}

BinaryMask SilhouettePreview::draw(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                   std::size_t camera) {
  camera_ = camera;
  projection_.place(q, corrections, camera);
  projection_.parts(X_CB_);
  return bent_silhouette(scorer_->render(X_CB_, camera), projection_.intrinsics(camera), corrections.camera.k1);
}

BinaryMask SilhouettePreview::draw_parts(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections,
                                         std::size_t camera, const std::vector<bool>& parts) {
  camera_ = camera;
  projection_.place(q, corrections, camera);
  projection_.parts(X_CB_);
  constexpr float kOutOfSight_m = 1000.0f;  // to the side
  for (std::size_t part = 0; part < X_CB_.size(); ++part) {
    if (!parts[part]) X_CB_[part].pretranslate(Eigen::Vector3f(kOutOfSight_m, 0.0f, 0.0f));
  }
  return bent_silhouette(scorer_->render(X_CB_, camera), projection_.intrinsics(camera), corrections.camera.k1);
}

Eigen::Vector2d SilhouettePreview::hand() const {
  const Eigen::Vector3d p = projection_.hand().translation();
  const auto& k = projection_.intrinsics(camera_);
  if (p.z() <= 0.0) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return {k.fx * p.x() / p.z() + k.cx, k.fy * p.y() / p.z() + k.cy};
}

double SilhouettePreview::hand_px_per_m() const {
  const double depth_m = projection_.hand().translation().z();
  return depth_m > 0.0 ? projection_.intrinsics(camera_).fx / depth_m : 0.0;
}

}  // namespace bodyschema
