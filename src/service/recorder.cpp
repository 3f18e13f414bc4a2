#include "bodyschema/service/recorder.hpp"

#include <spdlog/spdlog.h>

namespace bodyschema {
namespace {

/// What a waiting message takes beside its data; without it, empty ones could wait without end.
constexpr std::size_t kOverhead_bytes = 160;

}  // namespace

Recorder::Recorder(const std::filesystem::path& file, std::size_t max_waiting_bytes)
    : writer_(file), max_waiting_bytes_(max_waiting_bytes), thread_([this] { work(); }) {}

Recorder::~Recorder() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  filled_.notify_all();
  thread_.join();
}

void Recorder::record(const std::string& channel, Microseconds time_us, Bytes message) {
  {
    const std::lock_guard lock(mutex_);
    const std::size_t bytes = message.size() + kOverhead_bytes;
    if (!state_.failure.empty() || (!waiting_.empty() && waiting_bytes_ + bytes > max_waiting_bytes_)) {
      ++state_.lost;
      return;
    }
    waiting_.push_back({channel, time_us, {message.begin(), message.end()}});
    waiting_bytes_ += bytes;
  }
  filled_.notify_one();
}

void Recorder::set_room(std::size_t max_waiting_bytes) {
  const std::lock_guard lock(mutex_);
  max_waiting_bytes_ = max_waiting_bytes;
}

Recorder::State Recorder::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Recorder::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    filled_.wait(lock, [this] { return closing_ || !waiting_.empty(); });
    if (waiting_.empty()) return;
    const Message message = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= message.data.size() + kOverhead_bytes;
    lock.unlock();
    std::string failure;
    try {
      writer_.publish(message.channel, message.time_us, message.data);
    } catch (const std::exception& e) {
      failure = e.what();
      spdlog::error("recording has ended: {}", failure);
    }
    lock.lock();
    if (failure.empty()) {
      ++state_.written;
    } else {
      // What was written stays readable; nothing more is tried.
      state_.failure = failure;
      state_.lost += 1 + waiting_.size();
      waiting_.clear();
      waiting_bytes_ = 0;
    }
  }
}

}  // namespace bodyschema
