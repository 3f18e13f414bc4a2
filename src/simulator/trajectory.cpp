#include "bodyschema/simulator/trajectory.hpp"

#include <algorithm>
#include <utility>

namespace bodyschema::simulator {

double minimum_jerk(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

Trajectory::Trajectory(Eigen::VectorXd start) : start_(std::move(start)) {}

void Trajectory::move_to(const Eigen::VectorXd& target, double duration_s) {
  segments_.push_back({end_s_, duration_s, last(), target});
  end_s_ += duration_s;
}

void Trajectory::hold(double duration_s) {
  if (duration_s > 0.0) move_to(Eigen::VectorXd(last()), duration_s);
}

void Trajectory::append(const Trajectory& more) {
  const double begin = end_s_;
  for (Segment segment : more.segments_) {
    segment.begin_s += begin;
    segments_.push_back(std::move(segment));
  }
  end_s_ = begin + more.end_s_;
}

void Trajectory::position(double t_s, Eigen::Ref<Eigen::VectorXd> q) const {
  if (segments_.empty() || t_s <= 0.0) {
    q = start_;
    return;
  }
  auto next = std::upper_bound(segments_.begin(), segments_.end(), t_s,
                               [](double t, const Segment& segment) { return t < segment.begin_s; });
  const Segment& segment = *std::prev(next);
  const double s = minimum_jerk((t_s - segment.begin_s) / segment.duration_s);
  q = segment.from + s * (segment.to - segment.from);
}

Eigen::VectorXd Trajectory::position(double t_s) const {
  Eigen::VectorXd q(start_.size());
  position(t_s, q);
  return q;
}

}  // namespace bodyschema::simulator
