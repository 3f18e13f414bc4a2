#include "innovation_gate.hpp"

#include <algorithm>

#include "bodyschema/evidence/distributions.hpp"
#include "limits.hpp"

namespace bodyschema {

double InnovationGate::usual() const {
  return std::max(1.0, usual_sum_);
}

double InnovationGate::limit(double dof) const {
  return chi_square_quantile(limits::kDoubt_tail, std::max(1.0, dof)) * usual();
}

InnovationGate::Judgement InnovationGate::judge(const PostureMemory& memory, const Quadratic& frame, bool near,
                                                std::span<const Eigen::Index> standing) {
  const auto agreement = memory.agreement(frame, standing);
  const Innovation& innovation = agreement.innovation;
  if (!near) return {FrameVerdict::kContradicts, innovation};
  if (innovation.nis > limit(innovation.dof) || stalls(standing, agreement.step_gain)) {
    return {FrameVerdict::kDoubtful, innovation};
  }
  if (innovation.dof > 0.0) usual_sum_ += (innovation.nis / innovation.dof - usual_sum_) / limits::kUsualFrames;
  return {FrameVerdict::kAgrees, innovation};
}

/// Whether a frame looks as if a joint had moved under its reading, by more than hardly ever happens by chance. What
/// is usual counts as it was before the reading stood: a joint that moves slowly makes its own deviations usual.
bool InnovationGate::stalls(std::span<const Eigen::Index> standing, const Eigen::VectorXd& step_gain) const {
  if (standing.empty()) return false;
  const double limit = chi_square_quantile(limits::kDoubt_tail / static_cast<double>(usual_before_.size()), 1.0);
  for (std::size_t i = 0; i < standing.size(); ++i) {
    if (step_gain(static_cast<Eigen::Index>(i)) > limit * usual_before_(standing[i])) return true;
  }
  return false;
}

void InnovationGate::forget() {
  forget_usual();
  usual_before_.setOnes();
}

}  // namespace bodyschema
