#include "receiver.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "bodyschema/core/clock.hpp"

namespace bodyschema {

namespace {

constexpr int kPoll_ms = 50;
// LCM keeps this many messages for us while we are busy; at 30 Hz two seconds of pictures.
constexpr int kWaitingPictures = 64;
constexpr int kWaitingJoints = 512;

}  // namespace

Receiver::Receiver(LcmLink& link, ObservationStream stream, ObservationQueue& queue, Recorder* recorder)
    : link_(link), stream_(std::move(stream)), queue_(queue), recorder_(recorder) {
  const auto handler = [this](const std::string& channel, Bytes message, std::int64_t arrived_wall_us) {
    receive(channel, message, arrived_wall_us);
  };
  link_.subscribe(stream_.channels().joint_state, kWaitingJoints, handler);
  link_.subscribe(stream_.channels().cameras, kWaitingPictures, handler);
  if (stream_.expects_masks()) link_.subscribe(stream_.channels().masks, kWaitingPictures, handler);
  facts_.missing_joints = stream_.synchroniser().joints().missing_joints();
}

void Receiver::start() {
  stopping_ = false;
  thread_ = std::thread([this] { work(); });
}

void Receiver::stop() {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
}

void Receiver::finish() {
  stop();
  stream_.finish();
  drain();
}

Receiver::Facts Receiver::facts() const {
  const std::lock_guard lock(mutex_);
  Facts facts = facts_;
  facts.refused = link_.refused_sources();
  const LostMessages lost = link_.lost();
  facts.bus.lost_in_queue = lost.queue;
  facts.bus.lost_incomplete = lost.incomplete;
  // Refused here or where they are decoded: the same to who sent them.
  facts.bus.messages += lost.too_large;
  facts.bus.messages_malformed += lost.too_large;
  facts.bus.faults[static_cast<std::size_t>(MessageFault::kTooLarge)] += lost.too_large;
  return facts;
}

void Receiver::work() {
  try {
    while (!stopping_) link_.handle(kPoll_ms);
  } catch (const std::exception& e) {
    const std::lock_guard lock(mutex_);
    facts_.failure = e.what();
  }
}

void Receiver::receive(const std::string& channel, Bytes message, std::int64_t arrived_wall_us) {
  // LCM stamps arrivals with the wall clock, which may step; what counts is how long ago that was.
  const std::int64_t waited = std::clamp<std::int64_t>(wall_us() - arrived_wall_us, 0, 5'000'000);
  const std::int64_t arrived = monotonic_us() - waited;
  if (recorder_ != nullptr) recorder_->record(channel, arrived_wall_us, message);
  stream_.receive(channel, message, arrived);
  drain();
  newest_arrival_us_ = arrived;

  const std::lock_guard lock(mutex_);
  if (channel == stream_.channels().cameras) facts_.pictures_arrived_us = arrived;
  if (channel == stream_.channels().joint_state) facts_.joints_arrived_us = arrived;
  facts_.bus = stream_.statistics();
  const JointHistory& joints = stream_.synchroniser().joints();
  if (!facts_.missing_joints.empty()) facts_.missing_joints = joints.missing_joints();
  const auto blocking = facts_.bus.synchroniser.blocking_joint;
  facts_.blocking_joint = blocking < 0 ? "" : joints.joint_names()[static_cast<std::size_t>(blocking)];
}

void Receiver::drain() {
  while (auto arrived = stream_.next()) queue_.push(std::move(*arrived));
  const std::lock_guard lock(mutex_);
  facts_.bus = stream_.statistics();
}

}  // namespace bodyschema
