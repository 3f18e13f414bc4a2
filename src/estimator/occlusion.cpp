#include "occlusion.hpp"

#include <algorithm>
#include <cmath>

#include "limits.hpp"

namespace bodyschema {
namespace {

/// Whether somebody else's mask has robot there. Masks that are made about a prediction have it wherever that is.
bool shows_robot(const CameraObservation* seen, const Eigen::Vector2d& pixel) {
  return seen != nullptr && seen->mask_is_given && seen->mask.shows(pixel.x(), pixel.y());
}

}  // namespace

std::vector<OutlinePoint> without_hidden(std::span<const OutlineSample> samples, std::span<const OutlinePoint> points,
                                         double reach_px, double parallel_px) {
  std::vector<std::size_t> left_out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].odd || samples[i].covered) left_out.push_back(i);
  }
  const auto beside = [&](std::size_t a, std::size_t b) {
    return (samples[a].pixel - samples[b].pixel).squaredNorm() < reach_px * reach_px &&
           samples[a].normal.dot(samples[b].normal) > limits::kSameSide;
  };
  std::vector<char> hidden(samples.size(), 0);
  while (!left_out.empty()) {
    std::vector<std::size_t> piece = {left_out.back()};
    left_out.pop_back();
    double found = 0.0, sum = 0.0, square = 0.0;  // of residuals
    for (std::size_t next = 0; next < piece.size(); ++next) {
      if (const auto& residual = samples[piece[next]].residual_px) {
        found += 1.0;
        sum += *residual;
        square += *residual * *residual;
      }
      const auto rest = std::partition(left_out.begin(), left_out.end(),
                                       [&](std::size_t other) { return !beside(piece[next], other); });
      piece.insert(piece.end(), rest, left_out.end());
      left_out.erase(rest, left_out.end());
    }
    const bool mostly_found = 2.0 * found > static_cast<double>(piece.size());
    const double mean = sum / std::max(1.0, found), spread = square / std::max(1.0, found) - mean * mean;
    if (mostly_found && spread < parallel_px * parallel_px) continue;
    for (const auto i : piece) hidden[i] = 1;
  }
  std::vector<OutlinePoint> shown;
  auto point = points.begin();
  for (std::size_t i = 0; i < samples.size() && point != points.end(); ++i) {
    if (!samples[i].residual_px) continue;
    if (hidden[i] == 0) shown.push_back(*point);
    ++point;
  }
  return shown;
}

Occlusion::Occlusion(FrameModel& model, HypothesisScorer& scorer, const StereoRig& rig, const std::string& hand_link)
    : model_(model), scorer_(scorer), rig_(rig), of_hand_(model.part_count(), false), robot_(rig.cameras.size()),
      X_CB_(model.part_count()) {
  for (const auto& segment : model.roles().segments) {
    if (segment.name != hand_link) continue;
    for (const auto part : segment.parts) of_hand_[part] = true;
  }
}

void Occlusion::cover(Frame& frame, const Eigen::VectorXd& x, double hand_sd_m) {
  frame.covered.clear();
  if (!held_.known()) return;
  frame.covered.resize(frame.seen.size());
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    if (frame.seen[c] == nullptr) continue;
    const auto& k = rig_.cameras[c].intrinsics;
    const Pose X_CP = model_.hand_pose(frame.exposures[c], x);
    if (X_CP.translation().z() <= 0.0) continue;
    const double off_px = 2.0 * k.fx * hand_sd_m / X_CP.translation().z();
    frame.covered[c] = held_.mark(k, X_CP, limits::kCover_px * picture_unit(k) + off_px);
  }
}

void Occlusion::learn(const Frame& frame, const Eigen::VectorXd& x, double hand_sd_m) {
  std::vector<HeldThing::View> views;
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    const auto* seen = frame.seen[c];
    if (seen == nullptr || seen->mask.empty()) continue;
    const auto& k = rig_.cameras[c].intrinsics;
    const Pose X_CP = model_.hand_pose(frame.exposures[c], x);
    if (X_CP.translation().z() <= 0.0) continue;
    const double off_px = limits::kForeign_px * picture_unit(k);
    if (3.0 * k.fx * hand_sd_m / X_CP.translation().z() > off_px) return;
    views.push_back({&k, X_CP, &seen->mask, &seen->valid, &robot_[c]});
  }
  if (views.empty() || !held_.is_new(views.front().X_CP)) return;
  for (std::size_t c = 0; c < frame.seen.size(); ++c) {
    if (frame.seen[c] == nullptr || frame.seen[c]->mask.empty()) continue;
    model_.project(frame.exposures[c], x).parts(X_CB_);
    robot_[c] = scorer_.render(X_CB_, c);
    morphology_.dilate(robot_[c],
                       static_cast<int>(std::lround(limits::kForeign_px * picture_unit(rig_.cameras[c].intrinsics))));
  }
  held_.learn(views);
}

HiddenShare Occlusion::hidden(const Frame& frame, const FrameEvidence& seen) const {
  HiddenShare hidden;
  double hand = 0.0, hand_gone = 0.0, hand_covered = 0.0, hand_within = 0.0, robot = 0.0, robot_gone = 0.0;
  for (std::size_t c = 0; c < seen.samples.size(); ++c) {
    for (const auto& sample : seen.samples[c]) {
      const bool gone = sample.odd || sample.covered;
      robot += 1.0;
      robot_gone += gone;
      if (!of_hand_[sample.part]) continue;
      hand += 1.0;
      hand_gone += gone;
      hand_covered += sample.covered;
      hand_within += gone && !sample.covered && shows_robot(frame.seen[c], sample.pixel);
    }
  }
  if (hand > 0.0) hidden.hand = hand_gone / hand;
  const double missed = hand_gone - hand_covered;
  if (missed > 0.0 && hand_within < limits::kWithinMasks * missed) hidden.hand_missed = missed / (hand - hand_covered);
  if (robot > 0.0) hidden.robot = robot_gone / robot;
  hidden.holds = held_.known();
  return hidden;
}

}  // namespace bodyschema
