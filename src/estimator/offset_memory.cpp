#include "offset_memory.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// Chi-square; what pulls more makes the memory fade faster. The 99.7 % quantile of six degrees of freedom, those of
/// a hand's pose.
constexpr double kUsualPull = 20.0;

}  // namespace

OffsetMemory::Verdict OffsetMemory::judge(double pull, bool fits) {
  pulls_before_ = pulls_;
  const PullJudge::Verdict verdict = pulls_.judge(pull);
  if (verdict == PullJudge::Verdict::kContradicts || !fits) return Verdict::kContradicts;
  return verdict == PullJudge::Verdict::kDoubtful ? Verdict::kDoubtful : Verdict::kAgrees;
}

void OffsetMemory::learn(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2, double pull) {
  surprised_frames_ = 0;
  // What no constant offset explains (an error that is not in the model) shows as frames that keep pulling away; then
  // only recent ones are worth remembering.
  fusion_.fade(std::exp(-std::max(1.0, pull / kUsualPull) / memory_frames_));
  fusion_.add(evidence, x0, variance_px2, 1.0 / correlated_frames_);
}

bool OffsetMemory::contradict(bool found_another, bool keep) {
  pulls_.forget();
  if (empty()) return false;
  ++surprised_frames_;
  if (!found_another && surprised_frames_ <= kPatience_frames) return false;
  if (keep && !young()) shelf_ = {fusion_, pulls_before_, kShelf_frames};
  fusion_.forget_all();
  if (found_another) surprised_frames_ = 0;
  return true;
}

void OffsetMemory::begin(const ContourEvidence& evidence, const Eigen::VectorXd& x0, double variance_px2) {
  fusion_.forget_all();
  fusion_.add(evidence, x0, variance_px2, 1.0 / correlated_frames_);
}

void OffsetMemory::forget_all() {
  fusion_.forget_all();
  pulls_.forget();
  shelf_.reset();
  surprised_frames_ = 0;
}

void OffsetMemory::reconsider(double pull, bool fits) {
  if (!shelf_) return;
  if (shelf_->pulls.judge(pull) == PullJudge::Verdict::kAgrees && fits) {
    fusion_ = shelf_->fusion;
    pulls_ = shelf_->pulls;
    surprised_frames_ = 0;
    shelf_.reset();
  } else if (--shelf_->frames_left == 0) {
    shelf_.reset();
  }
}

}  // namespace bodyschema
