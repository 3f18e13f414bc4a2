#include "telling_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema::diagnosis {
namespace {

// Physical.
constexpr double kSlow_rad_s = radians(20.0), kQuick_rad_s = radians(60.0);
constexpr double kFarthest_rad = radians(60.0);  ///< of a sweep to either side
constexpr double kHead_rad = radians(15.0);      ///< ... of neck and eyes
constexpr double kHold_s = 1.0;                  ///< at each turning point
constexpr double kStep_rad = radians(2.0);       ///< between places where it is looked whether the hand is in sight
constexpr double kLimit_rad = radians(3.0);      ///< from the URDF's limits
constexpr double kBorder = 0.05;                 ///< share of a picture: the hand stays so far inside

class MotionWriter {
 public:
  MotionWriter(LogFit& fit, const DiagnosisReport& report) : fit_(fit), log_(fit.log()), report_(report) {
    for (const auto& joint : log_.roles().names) joints_.push_back(joint);
    for (const auto& info : log_.robot()->joints()) motion_.slides.push_back(info.slides);
    motion_.joints = joints_;
  }

  std::optional<MotionFile> write() {
    const auto wanted = joints_of_classes();
    if (!some_class_) return std::nullopt;
    const Eigen::VectorXd home = postures_by_depth()[1];
    start(home);
    for (const auto joint : wanted) sweep(home, joint, kFarthest_rad);
    for (const auto& posture : postures_by_depth()) go(posture, kQuick_rad_s);
    for (const auto& posture : corners()) go(posture, kSlow_rad_s);
    go(home, kQuick_rad_s);
    for (const auto joint : log_.roles().neck) sweep(home, joint, kHead_rad);
    for (const auto& posture : corners()) go(posture, kQuick_rad_s);
    go(home, kSlow_rad_s);
    motion_.remark =
        "A motion that would tell what the log could not. Nothing was checked for parts that touch: look at it in the\n"
        "simulator first (bodyschema-sim --motion FILE). deg, mm for sliding joints; go to each line in turn, and hold "
        "still\nwhere two lines are alike.";
    return std::move(motion_);
  }

 private:
  /// The arm's joints of every class of several causes, with those beside them.
  std::vector<Eigen::Index> joints_of_classes() {
    const auto& arm = log_.roles().arm;
    std::vector<Eigen::Index> list;
    const auto add = [&](const std::string& name) {
      const auto at =
          std::find_if(arm.begin(), arm.end(), [&](auto j) { return joints_[static_cast<std::size_t>(j)] == name; });
      if (at == arm.end()) return;
      const auto first = std::max(arm.begin(), at - 1), last = std::min(arm.end(), at + 2);
      for (auto j = first; j != last; ++j) {
        if (std::find(list.begin(), list.end(), *j) == list.end()) list.push_back(*j);
      }
    };
    for (const auto& cause : report_.causes) {
      if (cause.same.size() < 2) continue;
      some_class_ = true;
      for (const auto& name : cause.same) {
        add(name.joint);
        add(name.source);
      }
    }
    return list;
  }

  /// Nearest, middle and farthest of the log's postures in which the hand is well in sight.
  std::array<Eigen::VectorXd, 3> postures_by_depth() {
    std::vector<std::pair<double, std::size_t>> depth;
    for (std::size_t p = 0; p < report_.samples.size(); ++p) {
      if (report_.samples[p].camera == 0 && report_.samples[p].depth_m > 0.0 && sees_hand(posture(p)))
        depth.emplace_back(report_.samples[p].depth_m, p);
    }
    if (depth.empty()) depth.emplace_back(0.0, 0);
    std::sort(depth.begin(), depth.end());
    return {posture(depth.front().second), posture(depth[depth.size() / 2].second), posture(depth.back().second)};
  }

  /// The log's postures in which the hand is furthest out in each quarter of the first camera's picture.
  std::vector<Eigen::VectorXd> corners() {
    std::array<std::pair<double, std::size_t>, 4> best{};
    for (std::size_t p = 0; p < report_.samples.size(); ++p) {
      if (report_.samples[p].camera != 0) continue;
      const Eigen::VectorXd q = posture(p);
      if (!sees_hand(q)) continue;
      const auto pixel = hand_pixel(q, 0);
      const auto& k = log_.rig().cameras[0].intrinsics;
      const double x = pixel.x() - k.cx, y = pixel.y() - k.cy;
      auto& own = best[static_cast<std::size_t>((x > 0.0) + 2 * (y > 0.0))];
      if (std::hypot(x, y) > own.first) own = {std::hypot(x, y), p};
    }
    std::vector<Eigen::VectorXd> list;
    for (const auto& [radius, p] : best) {
      if (radius > 0.0) list.push_back(posture(p));
    }
    return list;
  }

  [[nodiscard]] Eigen::VectorXd posture(std::size_t picture) const { return log_.pictures()[picture].joints.q; }

  Eigen::Vector2d hand_pixel(const Eigen::VectorXd& q, std::size_t camera) {
    auto& projection = fit_.measurement().projection();
    projection.place(q, log_.roles().no_corrections(), camera);
    const Eigen::Vector3d hand = projection.hand().translation();
    const auto& k = log_.rig().cameras[camera].intrinsics;
    if (hand.z() <= 0.0) return Eigen::Vector2d::Constant(-1e9);
    return k.project(hand);
  }

  bool sees_hand(const Eigen::VectorXd& q) {
    for (std::size_t c = 0; c < log_.rig().cameras.size(); ++c) {
      const auto& k = log_.rig().cameras[c].intrinsics;
      const Eigen::Vector2d pixel = hand_pixel(q, c);
      if (pixel.x() < kBorder * k.width || pixel.x() > (1.0 - kBorder) * k.width || pixel.y() < kBorder * k.height ||
          pixel.y() > (1.0 - kBorder) * k.height) {
        return false;
      }
    }
    return true;
  }

  /// How far a joint may turn from a posture, to one side.
  double reach(Eigen::VectorXd q, Eigen::Index joint, double sign, double most) {
    const auto& info = log_.robot()->joints()[static_cast<std::size_t>(joint)];
    const double from = q[joint];
    double far = 0.0;
    while (far + kStep_rad <= most) {
      q[joint] = from + sign * (far + kStep_rad);
      if (q[joint] < info.lower_rad + kLimit_rad || q[joint] > info.upper_rad - kLimit_rad || !sees_hand(q)) break;
      far += kStep_rad;
    }
    return far;
  }

  void start(const Eigen::VectorXd& q) { motion_.postures = {{0.0, q}, {2.0 * kHold_s, q}}; }

  void go(const Eigen::VectorXd& q, double speed_rad_s) {
    const auto& last = motion_.postures.back();
    const double far = (q - last.q).cwiseAbs().maxCoeff();
    if (far < 1e-6) return;
    constexpr double kShortest_s = 0.5;
    const double arrives = last.time_s + std::max(kShortest_s, far / speed_rad_s);
    motion_.postures.push_back({arrives, q});
    motion_.postures.push_back({arrives + kHold_s, q});
  }

  void sweep(const Eigen::VectorXd& home, Eigen::Index joint, double most) {
    for (const double sign : {1.0, -1.0}) {
      const double far = reach(home, joint, sign, most);
      if (far <= 0.0) continue;
      Eigen::VectorXd q = home;
      q[joint] += sign * far;
      go(q, kSlow_rad_s);
      go(home, kQuick_rad_s);
    }
  }

  LogFit& fit_;
  const PictureLog& log_;
  const DiagnosisReport& report_;
  std::vector<std::string> joints_;
  MotionFile motion_;
  bool some_class_ = false;
};

}  // namespace

std::optional<MotionFile> telling_motion(LogFit& fit, const DiagnosisReport& report) {
  return MotionWriter(fit, report).write();
}

}  // namespace bodyschema::diagnosis
