#include "held_thing.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

// Physical. m: cubes this large around the hand, as far as what a hand holds reaches.
constexpr double kCube_m = 0.012, kReach_m = 0.24;
constexpr int kSide = static_cast<int>(2.0 * kReach_m / kCube_m);
constexpr std::size_t kCubes = static_cast<std::size_t>(kSide) * kSide * kSide;
// A picture that shows a cube as foreign counts one, one that shows background there takes twice as much away: what is
// carried is never seen through, but a mask may miss a piece of it.
constexpr int kForeign = 1, kBackground = -2, kMost = 8, kLeast = -8;
// Physical. m: nothing is nearer to a camera.
constexpr double kNearest_m = 0.05;
// What is foreign in so many pictures more than not is held: two cameras twice, and a chance to be carved.
constexpr int kHeld = 5;
// Physical. The hand shows another side of itself after a turn of this much against the camera, rad, or this far away
// in the picture, as a share of the distance.
constexpr double kTurned_rad = 0.1, kMoved = 0.15;
constexpr std::size_t kViews = 12;
// Fewer held cubes are ragged masks, not a thing: a finger's breadth each way.
constexpr std::size_t kFewestCubes = 8;

/// Whether masks show more beside the robot than one cube: less is ragged outlines.
bool shows_something(const HeldThing::View& view) {
  const double cube_px = kCube_m * view.camera->fx / view.X_CP.translation().z();
  BinaryMask foreign = *view.mask;
  foreign -= *view.robot;
  if (!view.valid->empty()) foreign &= *view.valid;
  return static_cast<double>(foreign.count()) > cube_px * cube_px;
}

}  // namespace

Eigen::Vector3d HeldThing::centre(std::size_t cube) const {
  const auto n = static_cast<std::size_t>(kSide);
  const Eigen::Vector3d at(static_cast<double>(cube % n), static_cast<double>(cube / n % n),
                           static_cast<double>(cube / (n * n)));
  return (at.array() + 0.5) * kCube_m - kReach_m;
}

bool HeldThing::is_new(const Pose& X_CP) const {
  return std::none_of(views_.begin(), views_.end(), [&](const Pose& before) {
    const double turned = rotation_distance(before.linear(), X_CP.linear());
    const double moved = (before.translation() - X_CP.translation()).norm() / X_CP.translation().norm();
    return turned < kTurned_rad && moved < kMoved;
  });
}

void HeldThing::learn(std::span<const View> views) {
  if (views.empty()) return;
  if (evidence_.empty() && std::none_of(views.begin(), views.end(), shows_something)) return;
  views_.push_back(views.front().X_CP);
  if (views_.size() > kViews) views_.erase(views_.begin());
  if (evidence_.empty()) evidence_.assign(kCubes, 0);
  for (const auto& view : views) look(view);
  held_.clear();
  for (std::size_t i = 0; i < kCubes; ++i) {
    if (evidence_[i] >= kHeld) held_.push_back(static_cast<std::uint32_t>(i));
  }
  if (held_.size() < kFewestCubes) held_.clear();
}

void HeldThing::look(const View& view) {
  const auto& k = *view.camera;
  for (std::size_t cube = 0; cube < kCubes; ++cube) {
    const Eigen::Vector3d p_C = view.X_CP * centre(cube);
    if (p_C.z() < kNearest_m) continue;
    const Eigen::Vector2d pixel = k.project(p_C);
    const double u = std::round(pixel.x()), v = std::round(pixel.y());
    if (!(u >= 0.0 && v >= 0.0 && u < k.width && v < k.height)) continue;
    const int column = static_cast<int>(u), row = static_cast<int>(v);
    if (!view.valid->empty() && !view.valid->at(column, row)) continue;
    if (view.robot->at(column, row)) continue;  // in front of it or behind: nobody knows
    auto& evidence = evidence_[cube];
    const int change = view.mask->at(column, row) ? kForeign : kBackground;
    evidence = static_cast<std::int8_t>(std::clamp(evidence + change, kLeast, kMost));
  }
}

BinaryMask HeldThing::mark(const PinholeIntrinsics& camera, const Pose& X_CP, double margin_px) {
  BinaryMask pixels(camera.width, camera.height);
  if (!known() || X_CP.translation().z() < kNearest_m) return pixels;
  for (const auto cube : held_) {
    const Eigen::Vector3d p_C = X_CP * centre(cube);
    if (p_C.z() < kNearest_m) continue;
    const Eigen::Vector2d pixel = camera.project(p_C);
    const long u = std::lround(pixel.x()), v = std::lround(pixel.y());
    if (u >= 0 && v >= 0 && u < camera.width && v < camera.height) pixels.set(static_cast<int>(u), static_cast<int>(v));
  }
  // A cube reaches this far about its centre, whichever way it is turned.
  const double half_px = 0.6 * kCube_m * std::max(camera.fx, camera.fy) / X_CP.translation().z() + margin_px;
  morphology_.dilate(pixels, static_cast<int>(std::ceil(half_px)));
  return pixels;
}

void HeldThing::forget() {
  evidence_.clear();
  held_.clear();
  views_.clear();
}

}  // namespace bodyschema
