#include "bodyschema/pipeline/background_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Geometry>

#include <algorithm>

#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

/// This share of a picture's width beside the predicted outline may be arm, however wrong its offsets.
constexpr int kArmReach = 6;
/// Where the background is as it was learned, next to nothing far from the arm differs from it.
constexpr double kChangedShare = 0.05;
/// rad; encoders of four joints between neck and eye, each rounded to a 4096th of a turn, differ by so much while the
/// head stands.
constexpr double kStands_rad = 0.25 * kPi / 180.0;

}  // namespace

BackgroundWatch::BackgroundWatch(const std::shared_ptr<const RobotModel>& robot,
                                 const std::vector<std::string>& camera_links)
    : eyes_(robot, camera_links), X_WC_(camera_links.size(), Pose::Identity()), X_WC_learned_(X_WC_),
      X_WC_stood_(X_WC_), known_(camera_links.size(), false), stood_(camera_links.size(), false) {}

Pose BackgroundWatch::pose(std::size_t camera, const Eigen::VectorXd& q) {
  eyes_.compute(q, X_WC_);
  return X_WC_[camera];
}

void BackgroundWatch::learned(std::size_t camera, const Eigen::VectorXd& q) {
  if (known_[camera]) return;
  X_WC_learned_[camera] = pose(camera, q);
  known_[camera] = true;
}

double BackgroundWatch::turned(std::size_t camera, const Eigen::VectorXd& q) {
  learned(camera, q);
  const double angle = rotation_distance(X_WC_learned_[camera].linear(), pose(camera, q).linear());
  return angle > kTurn_rad ? angle : 0.0;
}

bool BackgroundWatch::moved_since_last(std::size_t camera, const Eigen::VectorXd& q) {
  const Pose X_WC = pose(camera, q);
  const bool moved = stood_[camera] && rotation_distance(X_WC_stood_[camera].linear(), X_WC.linear()) >= kStands_rad;
  if (moved || !stood_[camera]) X_WC_stood_[camera] = X_WC;
  stood_[camera] = true;
  return moved;
}

bool BackgroundWatch::count(double turned_rad, const BinaryMask& mask, const BinaryMask& valid,
                            const BinaryMask& robot) {
  ++total_.pictures;
  if (turned_rad <= 0.0 || mask.empty()) return false;
  BinaryMask near(robot);
  if (near.empty()) near = BinaryMask(mask.width(), mask.height());
  MaskMorphology().dilate(near, mask.width() / kArmReach);
  BinaryMask judged = valid;
  leave_out(near, judged);
  const std::size_t far = judged.count();
  judged &= mask;
  const std::size_t changed = judged.count();
  if (static_cast<double>(changed) <= kChangedShare * static_cast<double>(far)) return false;
  ++total_.changed;
  total_.turned_rad = std::max(total_.turned_rad, turned_rad);
  return true;
}

std::string describe(const BackgroundTurn& turn) {
  if (turn.changed == 0) return "";
  return fmt::format(
      "the head turned by up to {:.1f} deg from where the background was learned, and the background "
      "changed with it: masks of at least {} of {} pictures are wrong; set vision.method: auto",
      degrees(turn.turned_rad), turn.changed, turn.pictures);
}

}  // namespace bodyschema
