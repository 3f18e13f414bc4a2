#include "bodyschema/pipeline/hand_errors.hpp"

namespace bodyschema {

HandError hand_error(const Pose& X_CP_estimated, const TruthInstant& truth, std::size_t camera,
                     const PinholeIntrinsics& intrinsics) {
  const Pose& X_CP = truth.X_CP[camera];
  HandError error;
  error.position_m = (X_CP_estimated.translation() - X_CP.translation()).norm();
  error.rotation_rad = rotation_distance(X_CP.linear(), X_CP_estimated.linear());
  for (const auto& p_P : truth.fingertips_P) {
    const Eigen::Vector3d real = X_CP * p_P;
    const Eigen::Vector3d estimated = X_CP_estimated * p_P;
    error.fingertip_m += (real - estimated).norm();
    error.fingertip_px += intrinsics.reduction * (intrinsics.project(real) - intrinsics.project(estimated)).norm();
  }
  if (!truth.fingertips_P.empty()) {
    error.fingertip_m /= static_cast<double>(truth.fingertips_P.size());
    error.fingertip_px /= static_cast<double>(truth.fingertips_P.size());
  }
  return error;
}

}  // namespace bodyschema
