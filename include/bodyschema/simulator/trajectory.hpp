#pragma once

#include <Eigen/Core>
#include <vector>

namespace bodyschema::simulator {

/// Minimum-jerk time scaling s(x) = 10 x^3 - 15 x^4 + 6 x^5 on [0, 1], clamped outside: zero
/// velocity and acceleration at both ends (Flash and Hogan 1985).
double minimum_jerk(double x);

/// A joint trajectory made of minimum-jerk moves and holds, in seconds from its start and radians,
/// RobotModel order. Before the start it stands at the first posture, after the end at the last.
class Trajectory {
 public:
  explicit Trajectory(Eigen::VectorXd start);

  /// Moves in a straight joint-space line from the last posture to `target`.
  /// @param duration_s  > 0
  void move_to(const Eigen::VectorXd& target, double duration_s);
  void hold(double duration_s);
  /// Goes on with another trajectory, which should begin at the last posture.
  void append(const Trajectory& more);

  [[nodiscard]] double duration_s() const { return end_s_; }
  [[nodiscard]] const Eigen::VectorXd& last() const { return segments_.empty() ? start_ : segments_.back().to; }
  [[nodiscard]] const Eigen::VectorXd& first() const { return start_; }
  void position(double t_s, Eigen::Ref<Eigen::VectorXd> q) const;
  [[nodiscard]] Eigen::VectorXd position(double t_s) const;

 private:
  struct Segment {
    double begin_s;
    double duration_s;
    Eigen::VectorXd from;
    Eigen::VectorXd to;
  };
  Eigen::VectorXd start_;
  std::vector<Segment> segments_;
  double end_s_ = 0.0;
};

}  // namespace bodyschema::simulator
