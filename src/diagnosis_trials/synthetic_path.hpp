#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <utility>
#include <vector>

#include "bodyschema/core/seeded_random.hpp"
#include "bodyschema/diagnosis_trials/synthetic_log.hpp"

namespace bodyschema::trials {

/// Minimum-jerk moves between postures, with rests.
class SyntheticPath {
 public:
  void rest(const Eigen::VectorXd& q, double duration_s) { add(q, q, duration_s); }
  void move(const Eigen::VectorXd& to, double duration_s) { add(pieces_.back().to, to, duration_s); }
  [[nodiscard]] double end_s() const { return end_s_; }
  [[nodiscard]] const Eigen::VectorXd& last() const { return pieces_.back().to; }

  [[nodiscard]] Eigen::VectorXd position(double t_s) const {
    const auto [piece, s] = find(t_s);
    return piece->from + (piece->to - piece->from) * (s * s * s * (10.0 + s * (-15.0 + 6.0 * s)));
  }
  [[nodiscard]] Eigen::VectorXd acceleration(double t_s) const {
    const auto [piece, s] = find(t_s);
    return (piece->to - piece->from) *
           (60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (piece->duration_s * piece->duration_s));
  }

 private:
  struct Piece {
    Eigen::VectorXd from, to;
    double begin_s, duration_s;
  };
  void add(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double duration_s) {
    pieces_.push_back({from, to, end_s_, duration_s});
    end_s_ += duration_s;
  }
  [[nodiscard]] std::pair<const Piece*, double> find(double t_s) const {
    auto at =
        std::upper_bound(pieces_.begin(), pieces_.end(), t_s, [](double t, const Piece& p) { return t < p.begin_s; });
    const auto& piece = at == pieces_.begin() ? pieces_.front() : *(at - 1);
    return {&piece, std::clamp((t_s - piece.begin_s) / piece.duration_s, 0.0, 1.0)};
  }
  std::vector<Piece> pieces_;
  double end_s_ = 0.0;
};

/// Random postures with the hand before both eyes, there and back at several speeds, a rest, the
/// first postures again in the middle and at the end.
SyntheticPath plan_path(const TrialRobot& robot, const JointRoles& roles, const TrialOptions& options,
                        SeededRandom& random);

/// The links that synthetic logs show: the rendered ones and the hand's frame.
std::vector<std::string> shown_links(const TrialRobot& robot);
std::vector<std::string> camera_links(const TrialRobot& robot);

}  // namespace bodyschema::trials
