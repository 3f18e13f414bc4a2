#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

/// A camera that turned beside a background that was learned, or given, for another line of sight.
struct BackgroundTurn {
  std::uint64_t pictures = 0;  ///< of all cameras
  std::uint64_t changed = 0;   ///< of them: the camera had turned, and what is far from the arm had changed with it
  double turned_rad = 0.0;     ///< the largest turn among `changed`
};

/// Notices that the background has changed because the cameras turned: by the encoders of the joints
/// that move them, and by the pictures. A background that looks the same wherever the head looks (a
/// plain wall) does no harm and is not counted. One per pipeline, one thread.
class BackgroundWatch {
 public:
  /// From here a turn counts; beyond the noise and rounding of encoders.
  static constexpr double kTurn_rad = 0.5 * kPi / 180.0;

  BackgroundWatch(const std::shared_ptr<const RobotModel>& robot, const std::vector<std::string>& camera_links);

  /// The background of this camera is that of this posture; only the first one counts.
  void learned(std::size_t camera, const Eigen::VectorXd& q);
  /// What the other one has learned from, with the same cameras.
  void take_from(const BackgroundWatch& other) {
    X_WC_learned_ = other.X_WC_learned_;
    known_ = other.known_;
  }
  /// How far the camera has turned since; 0 below kTurn_rad.
  [[nodiscard]] double turned(std::size_t camera, const Eigen::VectorXd& q);
  /// Whether the camera has turned by more than noise and rounding of encoders since this was last
  /// true, or first asked.
  [[nodiscard]] bool moved_since_last(std::size_t camera, const Eigen::VectorXd& q);
  /// Counts a picture. @return whether the background has changed with the turn
  /// @param turned_rad  what turned() said
  /// @param robot  where the robot is thought to be; looked at only where the camera has turned
  bool count(double turned_rad, const BinaryMask& mask, const BinaryMask& valid, const BinaryMask& robot);

  [[nodiscard]] const BackgroundTurn& total() const { return total_; }

 private:
  Pose pose(std::size_t camera, const Eigen::VectorXd& q);

  ForwardKinematics eyes_;
  std::vector<Pose> X_WC_, X_WC_learned_, X_WC_stood_;
  std::vector<bool> known_, stood_;
  BackgroundTurn total_;
};

/// One sentence for people: what happened and what to set. Empty where nothing did.
[[nodiscard]] std::string describe(const BackgroundTurn& turn);

}  // namespace bodyschema
