#include "fused_state.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "limits.hpp"

namespace bodyschema {
namespace {

/// What is believed of all but joints' offsets, whose prior is as wide as they may be off, may turn out to be too
/// narrow: of an effect wherever it is, as one description has them all.
MemoryLayout doubted(MemoryLayout layout, const State& state) {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < state.parameters().size(); ++k) {
    if (layout.is_joint[k]) {
      layout.effect.push_back(-1);
      continue;
    }
    const auto& name = state.model()[state.parameters()[k].ref.effect].name();
    const auto seen = std::find(names.begin(), names.end(), name);
    layout.effect.push_back(seen - names.begin());
    if (seen == names.end()) names.push_back(name);
  }
  return layout;
}

}  // namespace

FusedState::FusedState(const State& state, MemoryLayout layout, const MemoryOptions& options, std::size_t least)
    : memory(doubted(std::move(layout), state), options), stalled(state.joints()), x(state.prior_mean()),
      in_frame(memory.estimate()), least_postures(least), prior_mean_(x), joints_(state.joints()) {}

Eigen::VectorXd FusedState::where_it_was() const {
  Eigen::VectorXd result = memory.estimate().x;
  for (const auto joint : memory.loose()) result[joint] = x[joint];
  for (const auto joint : resumed_now_) result[joint] = x[joint];
  return result;
}

double FusedState::disagreement() const {
  return std::max(1.0, memory.dispersion());
}

void FusedState::hand_was_missed(double share) {
  ++postures_;
  const bool missed = share > limits::kBreakdown;
  postures_missed_ += missed;
  missed_lately_ +=
      ((missed ? 1.0 : 0.0) - missed_lately_) / std::min(static_cast<double>(postures_), limits::kRecentPostures);
  postures_without_hand_ += share > limits::kMostHidden;
}

void FusedState::read(const Eigen::VectorXd& reading_rad, double time_s) {
  for (const auto& resumed : stalled.look(reading_rad, time_s)) believe_again(resumed, time_s);
  memory.loosen(stalled.suspects());
}

/// From here on, or, where all was one slip, since that.
void FusedState::believe_again(const StalledEncoders::Resumed& resumed, double time_s) {
  if (resumed.went_on) {
    memory.release(std::vector{resumed.joint}, time_s);
    x[resumed.joint] = resumed.before_rad;  // most encoders that stalled go on as they were
    resumed_now_.push_back(resumed.joint);
  } else {
    memory.tighten_since(resumed.joint, resumed.stepped_s);
  }
}

void FusedState::see_loose_joints() {
  if (memory.loose().empty()) return;
  for (const auto joint : memory.loose()) x[joint] = in_frame.x[joint];
  stalled.seen(in_frame.x.head(joints_), in_frame.covariance.diagonal().head(joints_).cwiseMax(0.0).cwiseSqrt());
}

void FusedState::forget() {
  memory.forget_all();
  forget_missed();
  memory.loosen({});
  alternative.reset();
  x = prior_mean_;
  stalled = StalledEncoders(joints_);
}

}  // namespace bodyschema
