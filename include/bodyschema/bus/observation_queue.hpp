#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>

#include "bodyschema/bus/synchroniser.hpp"

namespace bodyschema {

/// Hands observations from the receiving thread to the estimating one. Bounded: when full the
/// oldest is shed and counted, so that the estimator always works on the newest. Any thread.
class ObservationQueue {
 public:
  explicit ObservationQueue(std::size_t capacity) : capacity_(capacity == 0 ? 1 : capacity) {}

  void push(ArrivedObservation observation) {
    {
      const std::lock_guard lock(mutex_);
      if (waiting_.size() >= capacity_) {
        keep_encoders(waiting_.front().observation,
                      waiting_.size() > 1 ? waiting_[1].observation : observation.observation);
        waiting_.pop_front();
        ++shed_;
      }
      waiting_.push_back(std::move(observation));
    }
    filled_.notify_one();
  }

  /// The oldest; nothing when none comes in time or the queue is closed and empty.
  std::optional<ArrivedObservation> pop(std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    filled_.wait_for(lock, timeout, [this] { return !waiting_.empty() || closed_; });
    if (waiting_.empty()) return std::nullopt;
    std::optional<ArrivedObservation> oldest = std::move(waiting_.front());
    waiting_.pop_front();
    return oldest;
  }

  /// Wakes whoever waits; pop() no longer waits afterwards.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    filled_.notify_all();
  }

  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return waiting_.size();
  }

  /// Pictures may be left out, encoders may not: what has a memory lives on all of them.
  static void keep_encoders(const Observation& shed, Observation& next) {
    if (next.encoders_begin_anew) return;
    next.encoders.insert(next.encoders.begin(), shed.encoders.begin(), shed.encoders.end());
    next.encoders_begin_anew = shed.encoders_begin_anew;
  }

  /// Observations shed since construction.
  [[nodiscard]] std::uint64_t shed() const {
    const std::lock_guard lock(mutex_);
    return shed_;
  }

 private:
  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable filled_;
  std::deque<ArrivedObservation> waiting_;
  std::uint64_t shed_ = 0;
  bool closed_ = false;
};

}  // namespace bodyschema
