#include "synthetic_path.hpp"

#include <cmath>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"

namespace bodyschema::trials {
namespace {

constexpr double kDeg = kPi / 180.0;

class PathPlanner {
 public:
  PathPlanner(const TrialRobot& robot, const JointRoles& roles, const TrialOptions& options, SeededRandom& random)
      : robot_(robot), roles_(roles), options_(options), random_(random),
        kinematics_(robot.model, shown_links(robot), camera_links(robot)),
        X_CB_(shown_links(robot).size(), Pose::Identity()) {
    const auto all = shown_links(robot);
    hand_ = static_cast<std::size_t>(std::find(all.begin(), all.end(), robot.setup.hand_link) - all.begin());
  }
  SyntheticPath plan() {
    const auto postures = visible_postures(working_posture());
    SyntheticPath path;
    path.rest(postures.front(), 0.5);
    if (options_.one_way) {
      one_way(postures, path);
    } else {
      babble(postures, path);
    }
    return path;
  }

 private:
  [[nodiscard]] bool hand_in_view(const Eigen::VectorXd& q) {
    const Corrections none(q.size());
    for (std::size_t c = 0; c < robot_.rig.cameras.size(); ++c) {
      kinematics_.compute(q, none, c, X_CB_);
      const Eigen::Vector3d p = X_CB_[hand_].translation();
      const auto& k = robot_.rig.cameras[c].intrinsics;
      if (p.z() < 0.2 || p.z() > 0.52) return false;
      const auto pixel = k.project(p);
      const double margin = 0.1 * k.width;
      if (pixel.x() < margin || pixel.y() < margin || pixel.x() > k.width - margin || pixel.y() > k.height - margin) {
        return false;
      }
    }
    return true;
  }

  Eigen::VectorXd random_arm(Eigen::VectorXd q) {
    for (const auto joint : roles_.arm) {
      const auto& info = robot_.model->joints()[static_cast<std::size_t>(joint)];
      const double low = std::max(info.lower_rad, -kPi), high = std::min(info.upper_rad, kPi);
      q[joint] = random_.uniform(low, high);
    }
    return q;
  }

  /// Frozen and locked joints, relative to the first posture.
  void constrain(const Eigen::VectorXd& first, Eigen::VectorXd& q) const {
    for (const auto& name : options_.frozen_joints) q[roles_.index(name)] = first[roles_.index(name)];
    if (!options_.locked.first.empty()) {
      const auto a = roles_.index(options_.locked.first), b = roles_.index(options_.locked.second);
      q[b] = first[b] + 0.5 * (q[a] - first[a]);
    }
  }

  /// Fingers a little curled, and a head posture before which the arm can work.
  Eigen::VectorXd working_posture() {
    const auto rest_posture = robot_.setup.default_joints(*robot_.model);
    Eigen::VectorXd best = rest_posture;
    int most = -1;
    for (int trial = 0; trial < 24; ++trial) {
      Eigen::VectorXd q = rest_posture;
      constexpr double low[4] = {-30, -5, -35, -25}, high[4] = {0, 5, 10, 0};
      for (std::size_t i = 0; i < roles_.neck.size() && i < 4; ++i) {
        q[roles_.neck[i]] = random_.uniform(low[i], high[i]) * kDeg;
      }
      int hits = 0;
      for (int i = 0; i < 150; ++i) hits += hand_in_view(random_arm(q));
      if (hits > most) {
        most = hits;
        best = q;
      }
    }
    for (const auto joint : roles_.fingers) {
      const auto& info = robot_.model->joints()[static_cast<std::size_t>(joint)];
      best[joint] = std::clamp(random_.uniform(10.0, 30.0) * kDeg, info.lower_rad, info.upper_rad);
    }
    return best;
  }

  std::vector<Eigen::VectorXd> visible_postures(const Eigen::VectorXd& like) {
    std::vector<Eigen::VectorXd> postures;
    for (int i = 0; i < 200000 && postures.size() < 64; ++i) {
      auto q = random_arm(like);
      if (!postures.empty()) constrain(postures.front(), q);
      if (hand_in_view(q)) postures.push_back(std::move(q));
    }
    if (postures.size() < 8) {
      throw DataError("trials: the arm of '" + robot_.model->name() + "' hardly reaches before its eyes");
    }
    return postures;
  }

  /// To the posture that is furthest away.
  void one_way(const std::vector<Eigen::VectorXd>& postures, SyntheticPath& path) const {
    std::size_t far = 1;
    for (std::size_t i = 1; i < postures.size(); ++i) {
      if ((postures[i] - postures[0]).norm() > (postures[far] - postures[0]).norm()) far = i;
    }
    path.move(postures[far], options_.duration_s - 1.0);
    path.rest(postures[far], 10.0);
  }

  void babble(const std::vector<Eigen::VectorXd>& postures, SyntheticPath& path) {
    const auto first_four = [&] {
      for (std::size_t i = 0; i < 4; ++i) path.move(postures[i], random_.uniform(0.8, 2.0));
    };
    const double rest_s = options_.duration_s / 6.0;
    bool rested = false, middle = false;
    std::size_t next = 0;
    while (path.end_s() < options_.duration_s) {
      if (!rested && path.end_s() > 0.4 * (options_.duration_s - rest_s)) {
        path.rest(path.last(), rest_s);
        rested = true;
      }
      if (!middle && path.end_s() > 0.6 * options_.duration_s) {
        middle = true;
        first_four();
        next = std::max<std::size_t>(next, 4);
      }
      if (path.end_s() > options_.duration_s - 6.0) {
        first_four();
        path.rest(path.last(), 10.0);
        return;
      }
      // There and back: the same postures in both directions.
      const Eigen::VectorXd from = path.last();
      const double slow = std::exp(random_.uniform(std::log(0.7), std::log(3.0)));
      path.move(postures[++next % postures.size()], slow);
      if (random_.uniform(0.0, 1.0) < 0.4) path.move(from, random_.uniform(0.7, 2.0));
    }
  }

  const TrialRobot& robot_;
  const JointRoles& roles_;
  const TrialOptions& options_;
  SeededRandom& random_;
  CorrectedKinematics kinematics_;
  std::vector<Pose> X_CB_;
  std::size_t hand_ = 0;
};

}  // namespace

std::vector<std::string> shown_links(const TrialRobot& robot) {
  auto list = robot.setup.model.rendered_links;
  if (std::find(list.begin(), list.end(), robot.setup.hand_link) == list.end()) {
    list.push_back(robot.setup.hand_link);
  }
  return list;
}

std::vector<std::string> camera_links(const TrialRobot& robot) {
  std::vector<std::string> list;
  for (const auto& camera : robot.rig.cameras) list.push_back(camera.link);
  return list;
}

SyntheticPath plan_path(const TrialRobot& robot, const JointRoles& roles, const TrialOptions& options,
                        SeededRandom& random) {
  return PathPlanner(robot, roles, options, random).plan();
}

}  // namespace bodyschema::trials
