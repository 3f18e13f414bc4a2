#include "hand_uncertainty.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {

double HandUncertainty::sd_m() const {
  return std::sqrt(std::max(0.0, covariance_m2.trace()));
}

double HandUncertainty::tolerated_sd_m() const {
  return std::sqrt(std::max(0.0, (covariance_m2 - own_m2).trace()));
}

double HandUncertainty::described_sd_m(const State& state) const {
  double square = 0.0;
  for (Eigen::Index k = state.joints(); k < state.size(); ++k) {
    const auto& p = state.parameters()[static_cast<std::size_t>(k)];
    if (state.model()[p.ref.effect].name() == "head_offset") continue;
    square += (J.col(k) * p.prior_sd).squaredNorm();
  }
  return std::sqrt(square);
}

HandUncertainty hand_uncertainty(FrameModel& model, const Exposure& exposure, const FusedState& known,
                                 const Eigen::MatrixXd& shape) {
  HandUncertainty result;
  result.J = model.hand_jacobian(exposure, known.in_frame.x);
  const Eigen::MatrixXd& J = result.J;
  const auto n = model.state().size();
  result.own_m2 = known.disagreement() * J.leftCols(n) * known.in_frame.own * J.leftCols(n).transpose();
  result.own_m2 += J.leftCols(n) * shape * J.leftCols(n).transpose();
  result.covariance_m2 = result.own_m2;
  if (J.cols() == n) return result;
  const Eigen::MatrixXd T =
      (J.leftCols(n) * known.in_frame.sensitivity + J.rightCols(J.cols() - n)) * known.memory.layout().considered_root;
  result.covariance_m2 += T * T.transpose();
  return result;
}

}  // namespace bodyschema
