#include "bodyschema/pipeline/silhouette_preview.hpp"

#include <cmath>
#include <limits>

namespace bodyschema {
namespace {

/// A silhouette of a pinhole camera as a lens with radial distortion k1 shows it.
BinaryMask bent(const BinaryMask& straight, const PinholeIntrinsics& k, double k1) {
  BinaryMask result(straight.width(), straight.height());
  for (int v = 0; v < straight.height(); ++v) {
    for (int u = 0; u < straight.width(); ++u) {
      const Eigen::Vector2d seen((u - k.cx) / k.fx, (v - k.cy) / k.fy);
      Eigen::Vector2d x = seen;
      for (int i = 0; i < 5; ++i) x = seen / (1.0 + k1 * x.squaredNorm());
      const auto su = static_cast<int>(std::lround(k.fx * x.x() + k.cx));
      const auto sv = static_cast<int>(std::lround(k.fy * x.y() + k.cy));
      const bool inside = su >= 0 && sv >= 0 && su < straight.width() && sv < straight.height();
      if (inside && straight.at(su, sv)) result.set(u, v);
    }
  }
  return result;
}

}  // namespace

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
  const BinaryMask silhouette = scorer_->render(X_CB_, camera);
  const double k1 = corrections.camera.k1;
  return k1 == 0.0 ? silhouette : bent(silhouette, projection_.intrinsics(camera), k1);
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
  const BinaryMask silhouette = scorer_->render(X_CB_, camera);
  const double k1 = corrections.camera.k1;
  return k1 == 0.0 ? silhouette : bent(silhouette, projection_.intrinsics(camera), k1);
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
