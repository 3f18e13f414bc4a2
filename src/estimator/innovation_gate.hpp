#pragma once

#include <Eigen/Core>
#include <span>

#include "bodyschema/estimator/estimate.hpp"
#include "bodyschema/evidence/posture_memory.hpp"

namespace bodyschema {

/// Whether a frame agrees with what is remembered: chi-square of its innovation, times what is usual in this log. One
/// thread.
class InnovationGate {
 public:
  explicit InnovationGate(Eigen::Index joints) : usual_before_(Eigen::VectorXd::Ones(joints)) {}

  struct Judgement {
    FrameVerdict verdict = FrameVerdict::kNothingKnown;
    Innovation innovation;
  };
  /// What agrees becomes usual.
  /// @param near  whether the frame's outline lies near where the memory and it see the arm
  /// @param standing  joints that may have moved under a reading that stands
  Judgement judge(const PostureMemory& memory, const Quadratic& frame, bool near,
                  std::span<const Eigen::Index> standing);
  /// What innovations of these degrees of freedom hardly ever exceed, in this log.
  [[nodiscard]] double limit(double dof) const;
  /// What innovations are times what is believed of them, in this log.
  [[nodiscard]] double usual() const;
  /// A joint's reading has changed: how it moves from here on is held against what is usual now.
  void reading_changed(Eigen::Index joint) { usual_before_(joint) = usual(); }
  /// What was usual was so under another memory.
  void forget_usual() { usual_sum_ = 1.0; }
  void forget();

 private:
  [[nodiscard]] bool stalls(std::span<const Eigen::Index> standing, const Eigen::VectorXd& step_gain) const;

  double usual_sum_ = 1.0;
  Eigen::VectorXd usual_before_;  ///< what was usual when each joint's reading last changed
};

}  // namespace bodyschema
