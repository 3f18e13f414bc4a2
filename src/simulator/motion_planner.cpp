#include "bodyschema/simulator/motion_planner.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "bodyschema/core/error.hpp"

namespace bodyschema::simulator {
namespace {

constexpr double kClosestToEye_m = 0.16;
constexpr int kPathSamples = 16;

}  // namespace

MotionPlanner::MotionPlanner(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
                             MotionSettings settings, std::uint64_t seed, Head head,
                             const std::vector<std::string>& frozen)
    : model_(std::move(model)), rig_(rig), settings_(std::move(settings)), random_(seed, "motion"), head_mode_(head),
      tips_(setup.fingertip_links.size()) {
  base_ = setup.default_joints(*model_);
  for (const auto& [name, value] : settings_.posture_deg) base_[model_->joint_index(name)] = radians(value);
  std::vector<std::string> links = {setup.hand_link};
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  const auto& arm = setup.estimated_joints;
  // The forearm lies between the link that carries the wrist and the first link beyond it.
  has_forearm_ = arm.size() >= 3;
  if (has_forearm_) {
    const auto& wrist = model_->joints()[static_cast<std::size_t>(model_->joint_index(arm[arm.size() - 2]))];
    links.push_back(wrist.child_link);
    links.push_back(wrist.parent_link);
  }
  for (const auto& camera : rig_.cameras) links.push_back(camera.link);
  X_W_.resize(links.size());
  kinematics_ = std::make_unique<ForwardKinematics>(model_, std::move(links));
  for (const auto& name : arm) {
    const auto joint = model_->joint_index(name);
    if (std::find(frozen.begin(), frozen.end(), name) == frozen.end()) {
      arm_.push_back(joint);
    } else {
      const auto& info = model_->joints()[static_cast<std::size_t>(joint)];
      if (!settings_.posture_deg.contains(name) && std::isfinite(info.lower_rad + info.upper_rad)) {
        base_[joint] = 0.5 * (info.lower_rad + info.upper_rad);
      }
    }
  }
  for (const auto& name : frozen) {
    if (std::find(arm.begin(), arm.end(), name) == arm.end()) {
      throw ConfigurationError("cannot freeze '" + name + "': not one of robot.estimated_joints");
    }
  }
  for (const auto& name : setup.head_joints) {
    // Eyes turn together or not at all: a moving head moves its neck and the tilt of the eyes.
    const auto joint = model_->joint_index(name);
    bool all = true;
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      all &= kinematics_->moves(joint, X_W_.size() - rig_.cameras.size() + c);
    }
    if (all) head_.push_back(joint);
  }
  if (head_mode_ == Head::kGaze) {
    compute(base_);
    const Eigen::Vector3d look_W = X_W_[X_W_.size() - rig_.cameras.size()].linear().col(2);
    for (const auto joint : head_) {
      constexpr double kMostlyRoll = 0.8;
      if (std::abs(kinematics_->joint_axis(joint).direction_W.dot(look_W)) < kMostlyRoll) gaze_.push_back(joint);
    }
    if (gaze_.empty()) {
      throw ConfigurationError(
          "simulator.motion.head is 'gaze', but no joint of robot.head_joints turns the cameras; expected still "
          "(--set simulator.motion.head=still)");
    }
  }
  if (settings_.distance_min_m > 0.0 && settings_.distance_max_m > 0.0) return;
  const auto seen = seen_distances();
  if (!seen) {
    throw DataError("hardly any posture of the arm shows its hand '" + setup.hand_link +
                    "' to the cameras; check cameras: links with OpenCV's axes (x right, y down, z into the "
                    "picture), focal lengths and sizes; and simulator.motion.posture_deg: where the head looks");
  }
  double& nearest_m = settings_.distance_min_m;
  double& farthest_m = settings_.distance_max_m;
  if (nearest_m <= 0.0) nearest_m = farthest_m > 0.0 ? std::min(seen->min_m, 0.9 * farthest_m) : seen->min_m;
  if (farthest_m <= 0.0) farthest_m = std::max(seen->max_m, 1.1 * nearest_m);
}

std::optional<MotionPlanner::Range> MotionPlanner::seen_distances() {
  constexpr int kPostures = 20000;
  constexpr std::size_t kEnough = 300;
  constexpr std::size_t kTooFew = 20;
  // The same answer for every seed of the motion, and the same motion whether it is asked or not.
  const Random motion = std::exchange(random_, Random(1, "where the hand is seen"));
  std::vector<double> distances;
  for (int i = 0; i < kPostures && distances.size() < kEnough; ++i) {
    const View v = view(random_arm(base_, 1.0));
    if (v.whole_hand) distances.push_back(v.distance_m);
  }
  random_ = motion;
  if (distances.size() < kTooFew) return std::nullopt;
  std::sort(distances.begin(), distances.end());
  return Range{distances[distances.size() / 20], distances[distances.size() / 2]};
}

void MotionPlanner::compute(const Eigen::VectorXd& q) {
  kinematics_->compute(q, X_W_);
}

MotionPlanner::View MotionPlanner::view(const Eigen::VectorXd& q) {
  compute(q);
  View result;
  result.whole_hand = true;
  result.forearm = true;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i <= tips_; ++i) centre += X_W_[i].translation();
  centre /= static_cast<double>(tips_ + 1);
  Eigen::Vector3d eyes = Eigen::Vector3d::Zero();
  const std::size_t cameras = rig_.cameras.size();
  const std::size_t first_camera = X_W_.size() - cameras;
  for (std::size_t c = 0; c < cameras; ++c) {
    const Pose X_CW = X_W_[first_camera + c].inverse(Eigen::Isometry);
    const auto& k = rig_.cameras[c].intrinsics;
    eyes += X_W_[first_camera + c].translation();
    const auto inside = [&](const Eigen::Vector3d& p_W, double border) {
      const Eigen::Vector3d p_C = X_CW * p_W;
      if (p_C.z() < 0.05) return false;
      const Eigen::Vector2d pixel = k.project(p_C);
      return pixel.x() >= border && pixel.y() >= border && pixel.x() <= k.width - 1 - border &&
             pixel.y() <= k.height - 1 - border;
    };
    for (std::size_t i = 0; i <= tips_; ++i) {
      const Eigen::Vector3d p_W = X_W_[i].translation();
      result.whole_hand &= inside(p_W, settings_.border_px);
      result.whole_hand &= (p_W - X_W_[first_camera + c].translation()).norm() > kClosestToEye_m;
    }
    if (has_forearm_) {
      const Eigen::Vector3d wrist = X_W_[tips_ + 1].translation();
      const Eigen::Vector3d elbow = X_W_[tips_ + 2].translation();
      result.whole_hand &= inside(wrist, 0.0);
      result.forearm &= inside(wrist + 0.2 * (elbow - wrist), 0.0);
      // Nothing of the arm so near that it fills the picture.
      const Eigen::Vector3d eye = X_W_[first_camera + c].translation();
      result.whole_hand &= (elbow - eye).norm() > kClosestToEye_m && (wrist - eye).norm() > kClosestToEye_m;
    }
    const Eigen::Vector3d centre_C = X_CW * centre;
    result.centre_px.push_back(centre_C.z() > 0.01 ? k.project(centre_C) : Eigen::Vector2d(-1e6, -1e6));
  }
  eyes /= static_cast<double>(cameras);
  result.distance_m = (centre - eyes).norm();
  result.centre_W = centre;
  return result;
}

bool MotionPlanner::good(const View& view) const {
  if (head_mode_ == Head::kGaze) {
    constexpr double kMiddle = 0.26;  // share of the picture to either side
    for (std::size_t c = 0; c < view.centre_px.size(); ++c) {
      const auto& k = rig_.cameras[c].intrinsics;
      if (std::abs(view.centre_px[c].x() / k.width - 0.5) > kMiddle) return false;
      if (std::abs(view.centre_px[c].y() / k.height - 0.5) > kMiddle) return false;
    }
  }
  return view.whole_hand && view.distance_m >= settings_.distance_min_m && view.distance_m <= settings_.distance_max_m;
}

Eigen::Vector3d MotionPlanner::point_in_view(const Eigen::Vector2d& pixel, double distance_m,
                                             const Eigen::VectorXd& q) {
  compute(q);
  const std::size_t first_camera = X_W_.size() - rig_.cameras.size();
  Eigen::Vector3d eyes = Eigen::Vector3d::Zero();
  for (std::size_t c = first_camera; c < X_W_.size(); ++c) eyes += X_W_[c].translation();
  eyes /= static_cast<double>(rig_.cameras.size());
  const Eigen::Vector3d ray = rig_.cameras.front().intrinsics.ray(pixel).normalized();
  return eyes + distance_m * (X_W_[first_camera].linear() * ray);
}

bool MotionPlanner::solve(const Eigen::Vector3d& centre_W, Eigen::VectorXd& q) {
  constexpr double kTolerance_m = 0.002;
  constexpr double kDamping = 0.02;
  const auto count = static_cast<Eigen::Index>(arm_.size());
  Eigen::Matrix3Xd J(3, count);
  for (int iteration = 0; iteration < 40; ++iteration) {
    compute(q);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i <= tips_; ++i) centre += X_W_[i].translation();
    centre /= static_cast<double>(tips_ + 1);
    Eigen::Vector3d error = centre_W - centre;
    if (error.norm() < kTolerance_m) return true;
    if (error.norm() > 0.08) error *= 0.08 / error.norm();
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto axis = kinematics_->joint_axis(arm_[static_cast<std::size_t>(k)]);
      J.col(k) = axis.direction_W.cross(centre - axis.point_W);
    }
    const Eigen::Matrix3d A = J * J.transpose() + kDamping * kDamping * Eigen::Matrix3d::Identity();
    const Eigen::VectorXd dq = J.transpose() * A.ldlt().solve(error);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto joint = arm_[static_cast<std::size_t>(k)];
      const auto& info = model_->joints()[static_cast<std::size_t>(joint)];
      const double room =
          std::isfinite(info.upper_rad - info.lower_rad) ? 0.03 * (info.upper_rad - info.lower_rad) : 0.0;
      q[joint] = std::clamp(q[joint] + std::clamp(dq[k], -0.4, 0.4), info.lower_rad + room, info.upper_rad - room);
    }
  }
  return false;
}

/// Arm joints drawn within their limits, around `like` by `share` of the range (1: anywhere).
Eigen::VectorXd MotionPlanner::random_arm(const Eigen::VectorXd& like, double share) {
  Eigen::VectorXd q = like;
  for (const auto joint : arm_) {
    const auto& info = model_->joints()[static_cast<std::size_t>(joint)];
    const double low = std::max(info.lower_rad, -kPi);
    const double high = std::min(info.upper_rad, kPi);
    const double room = 0.05 * (high - low);
    if (share >= 1.0) {
      q[joint] = random_.uniform(low + room, high - room);
    } else {
      q[joint] = std::clamp(like[joint] + share * (high - low) * random_.uniform(-1.0, 1.0), low + room, high - room);
    }
  }
  return q;
}

Eigen::VectorXd MotionPlanner::move_head(Eigen::VectorXd q) {
  for (const auto joint : head_) {
    q[joint] = base_[joint];
    if (head_mode_ == Head::kStill) continue;
    const auto& info = model_->joints()[static_cast<std::size_t>(joint)];
    const bool gazes = std::find(gaze_.begin(), gaze_.end(), joint) != gaze_.end();
    const double range_deg = gazes ? settings_.gaze_range_deg : settings_.head_motion_deg;
    q[joint] = std::clamp(q[joint] + radians(range_deg) * random_.uniform(-1.0, 1.0), info.lower_rad, info.upper_rad);
  }
  return q;
}

double MotionPlanner::share_in_view(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double* forearm) {
  int seen = 0;
  int forearms = 0;
  for (int i = 0; i <= kPathSamples; ++i) {
    const View v = view(from + minimum_jerk(static_cast<double>(i) / kPathSamples) * (to - from));
    seen += good(v) ? 1 : 0;
    forearms += v.forearm ? 1 : 0;
  }
  if (forearm != nullptr) *forearm = static_cast<double>(forearms) / (kPathSamples + 1);
  return static_cast<double>(seen) / (kPathSamples + 1);
}

/// A point such that a hand around it fits into all pictures; the arguments choose within the room
/// that leaves, 0 left or top, 1 right or bottom.
Eigen::Vector3d MotionPlanner::random_target(const Eigen::VectorXd& q, double u_low, double u_high, double v_low,
                                             double v_high) {
  const auto& k = rig_.cameras.front().intrinsics;
  if (head_mode_ == Head::kGaze) {  // the head looks at the hand
    u_low = v_low = 0.40;
    u_high = v_high = 0.60;
  }
  const double span = settings_.distance_max_m - settings_.distance_min_m;
  const double distance = settings_.distance_min_m + span * random_.uniform(0.08, 0.95);
  compute(q);
  const std::size_t first_camera = X_W_.size() - rig_.cameras.size();
  const double baseline = (X_W_.back().translation() - X_W_[first_camera].translation()).norm();
  const double margin_v = settings_.hand_radius_m * k.fy / distance + settings_.border_px;
  const double margin_u = margin_v + 0.5 * baseline * k.fx / distance;
  const double room_u = std::max(0.0, k.width - 2.0 * margin_u);
  const double room_v = std::max(0.0, k.height - 2.0 * margin_v);
  const Eigen::Vector2d pixel(0.5 * (k.width - room_u) + room_u * random_.uniform(u_low, u_high),
                              0.5 * (k.height - room_v) + room_v * random_.uniform(v_low, v_high));
  return point_in_view(pixel, distance, q);
}

Trajectory MotionPlanner::reach(double duration_s) {
  for (int attempt = 0; attempt < 20000; ++attempt) {
    Eigen::VectorXd start = move_head(random_arm(base_, 1.0));
    if (!solve(random_target(start, 0.8, 1.1, 0.75, 1.1), start) || !good(view(start))) continue;
    for (int second = 0; second < 6; ++second) {
      Eigen::VectorXd end = move_head(random_arm(start, 0.12));
      if (!solve(random_target(end, -0.1, 0.2, -0.1, 0.25), end) || !good(view(end))) continue;
      const View from = view(start), to = view(end);
      if (head_mode_ == Head::kGaze) {
        constexpr double kFar_m = 0.10;
        if ((to.centre_W - from.centre_W).norm() < kFar_m) continue;
      } else {
        const auto& k = rig_.cameras.front().intrinsics;
        const Eigen::Vector2d way = from.centre_px.front() - to.centre_px.front();
        if (!(way.x() > 0.125 * k.width && way.y() > (25.0 / 240.0) * k.height)) continue;
      }
      double forearm = 0.0;
      if (share_in_view(start, end, &forearm) < 0.97 || forearm < 0.7) continue;
      Trajectory trajectory(start);
      trajectory.move_to(end, duration_s);
      return trajectory;
    }
  }
  const auto metres = [](double min_m, double max_m) {
    char text[64];
    std::snprintf(text, sizeof text, "%.2f to %.2f m", min_m, max_m);
    return std::string(text);
  };
  const auto seen = seen_distances();
  throw DataError(
      "no reach found with the hand in view of all cameras at simulator.motion.distance_min_m to "
      "distance_max_m, " +
      metres(settings_.distance_min_m, settings_.distance_max_m) + "; " +
      (seen ? "this robot's hand is best seen at " + metres(seen->min_m, seen->max_m)
            : std::string("hardly any posture shows this robot's hand")) +
      "; where the head looks is simulator.motion.posture_deg");
}

Eigen::VectorXd MotionPlanner::visible_posture() {
  for (int attempt = 0; attempt < 20000; ++attempt) {
    Eigen::VectorXd q = move_head(random_arm(base_, 1.0));
    if (!solve(random_target(q, 0.0, 1.0, 0.0, 1.0), q)) continue;
    const View v = view(q);
    if (good(v) && v.forearm) return q;
  }
  throw DataError("no posture found with the hand in view of all cameras; check simulator.motion");
}

Eigen::VectorXd MotionPlanner::next_posture(const Eigen::VectorXd& from) {
  for (int attempt = 0; attempt < 4000; ++attempt) {
    // Mostly far moves; nearer ones when the robot has painted itself into a corner.
    Eigen::VectorXd q = attempt < 400 ? visible_posture() : move_head(random_arm(from, 0.15));
    if (attempt >= 400 && (!solve(random_target(q, 0.0, 1.0, 0.0, 1.0), q) || !good(view(q)))) continue;
    if (share_in_view(from, q, nullptr) >= 0.9) return q;
  }
  return from;
}

double MotionPlanner::travel_time(const Eigen::VectorXd& from, const Eigen::VectorXd& to, double speed_deg_s) const {
  return std::max(0.5, degrees((to - from).cwiseAbs().maxCoeff()) / speed_deg_s);
}

Trajectory MotionPlanner::held_babble(double duration_s) {
  constexpr double kHeld_s = 1.0, kDistinct_rad = 0.2;
  std::vector<Eigen::VectorXd> postures = {visible_posture()};
  std::vector<double> times;  // of the moves between them
  double moving_s = 0.0;
  const auto add = [&] {
    Eigen::VectorXd to = next_posture(postures.back());
    const auto like_another = [&](const Eigen::VectorXd& q) {
      return std::any_of(postures.begin(), postures.end(), [&](const Eigen::VectorXd& other) {
        double most = 0.0;
        for (const auto joint : arm_) most = std::max(most, std::abs(q[joint] - other[joint]));
        return most < kDistinct_rad;
      });
    };
    for (int attempt = 0; attempt < 50 && like_another(to); ++attempt) to = next_posture(postures.back());
    const double speed =
        (times.size() % 2 == 0 ? settings_.fast_deg_s : settings_.slow_deg_s) * random_.uniform(0.75, 1.3);
    times.push_back(travel_time(postures.back(), to, speed));
    moving_s += times.back();
    postures.push_back(std::move(to));
  };
  while (static_cast<int>(postures.size()) < settings_.postures ||
         moving_s + kHeld_s * static_cast<double>(postures.size()) < duration_s) {
    add();
  }
  // More than there is time for: the last one is not reached, or all are hurried to and held for less.
  while (static_cast<int>(postures.size()) > std::max(1, settings_.postures) &&
         moving_s + kHeld_s * static_cast<double>(postures.size()) > duration_s) {
    moving_s -= times.back();
    times.pop_back();
    postures.pop_back();
  }
  const double needed_s = moving_s + kHeld_s * static_cast<double>(postures.size());
  const double hurry = std::min(1.0, duration_s / needed_s);
  const double held_s = (duration_s - hurry * moving_s) / static_cast<double>(postures.size());
  Trajectory motion(postures.front());
  motion.hold(held_s);
  for (std::size_t i = 1; i < postures.size(); ++i) {
    motion.move_to(postures[i], hurry * times[i - 1]);
    motion.hold(held_s);
  }
  return motion;
}

Trajectory MotionPlanner::babble(double duration_s) {
  if (settings_.postures > 0) return held_babble(duration_s);
  const Eigen::VectorXd first = visible_posture();
  Trajectory motion(first);
  const auto go = [&](const Eigen::VectorXd& to, double speed_deg_s, double dwell_s) {
    const Eigen::VectorXd from = motion.last();
    if ((to - from).cwiseAbs().maxCoeff() > 1e-9) motion.move_to(to, travel_time(from, to, speed_deg_s));
    motion.hold(dwell_s);
  };
  const auto wander = [&](double until_s) {
    bool fast = random_.uniform() < 0.5;
    while (motion.duration_s() < until_s - 0.5) {
      const Eigen::VectorXd to = next_posture(motion.last());
      const double speed = (fast ? settings_.fast_deg_s : settings_.slow_deg_s) * random_.uniform(0.75, 1.3);
      const double time = travel_time(motion.last(), to, speed);
      const double left = until_s - motion.duration_s();
      if (time > left) {  // no time for the whole way: part of it, at the same speed
        const double share = left / time;
        motion.move_to(Eigen::VectorXd(motion.last() + share * (to - motion.last())), left);
      } else {
        motion.move_to(to, time);
        if (random_.uniform() < 0.3) motion.hold(std::min(0.3, std::max(0.0, until_s - motion.duration_s())));
      }
      fast = !fast;
    }
    motion.hold(until_s - motion.duration_s());
  };

  if (duration_s < 40.0) {
    wander(duration_s);
    return motion;
  }
  // Four postures, there slowly, back fast: both directions through the same places.
  std::vector<Eigen::VectorXd> tour = {first};
  while (tour.size() < 4) tour.push_back(next_posture(tour.back()));
  const double slow = settings_.slow_deg_s * 1.6;
  double tour_s = 0.0;
  for (std::size_t i = 1; i < tour.size(); ++i) tour_s += travel_time(tour[i - 1], tour[i], settings_.fast_deg_s) + 0.3;
  // From wherever the wandering ends, the way back to the first posture may leave the view for a
  // moment; it is short.
  const double way_back_s = 2.0;
  for (std::size_t i = 1; i < tour.size(); ++i) go(tour[i], slow, 0.3);
  for (std::size_t i = tour.size() - 1; i-- > 0;) go(tour[i], settings_.fast_deg_s, 0.3);
  const double hold_s = std::min(settings_.hold_s, 0.25 * duration_s);
  const double middle_s = std::max(motion.duration_s(), 0.5 * (duration_s - hold_s) - 0.5 * tour_s - way_back_s);
  wander(middle_s);
  const auto revisit = [&] {
    motion.move_to(tour[0], way_back_s);
    motion.hold(0.3);
    for (std::size_t i = 1; i < tour.size(); ++i) go(tour[i], settings_.fast_deg_s, 0.3);
  };
  revisit();
  motion.hold(hold_s);
  wander(duration_s - tour_s - way_back_s - 0.3);
  revisit();
  motion.hold(duration_s - motion.duration_s());
  return motion;
}

Trajectory MotionPlanner::poses(int count) {
  constexpr double kHeld_s = 1.0, kShortestMove_s = 0.05;
  Trajectory motion(visible_posture());
  motion.hold(kHeld_s);
  for (int i = 1; i < count; ++i) {
    const Eigen::VectorXd from = motion.last(), to = next_posture(from);
    motion.move_to(to, std::max(kShortestMove_s, degrees((to - from).cwiseAbs().maxCoeff()) / settings_.fast_deg_s));
    motion.hold(kHeld_s);
  }
  return motion;
}

Eigen::VectorXd MotionPlanner::rest_posture(const Eigen::VectorXd& like) {
  Eigen::VectorXd best;
  double best_cost = std::numeric_limits<double>::max();
  for (int attempt = 0; attempt < 20000 && (attempt < 2000 || best.size() == 0); ++attempt) {
    const Eigen::VectorXd q = random_arm(like, 1.0);
    compute(q);
    // Every known point of hand and forearm is well outside both pictures, and below them.
    bool hidden = true;
    const std::size_t cameras = rig_.cameras.size();
    const std::size_t first_camera = X_W_.size() - cameras;
    for (std::size_t c = 0; c < cameras && hidden; ++c) {
      const Pose X_CW = X_W_[first_camera + c].inverse(Eigen::Isometry);
      const auto& k = rig_.cameras[c].intrinsics;
      for (std::size_t l = 0; l < first_camera && hidden; ++l) {
        const Eigen::Vector3d p_C = X_CW * X_W_[l].translation();
        if (p_C.z() < 0.02) {
          hidden = p_C.norm() > 0.25;
          continue;
        }
        const Eigen::Vector2d pixel = k.project(p_C);
        const double room = 0.07 * k.fx / p_C.z();  // the parts are thicker than their frames
        hidden = pixel.x() < -room || pixel.x() > k.width + room || pixel.y() > k.height + room;
      }
    }
    if (!hidden) continue;
    const double cost = (q - like).cwiseAbs().maxCoeff();
    if (cost < best_cost) {
      best_cost = cost;
      best = q;
    }
  }
  if (best.size() == 0) {
    throw DataError(
        "no posture found with the arm out of both views; simulator.motion.background_frames: 0 asks for none");
  }
  return best;
}

}  // namespace bodyschema::simulator
