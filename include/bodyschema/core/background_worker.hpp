#pragma once

#include <condition_variable>
#include <deque>
#include <future>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

namespace bodyschema {

/// One thread that does what it is given, in order; from the first work on it lives as long as this does.
class BackgroundWorker {
 public:
  BackgroundWorker() = default;
  /// Waits for all that was given.
  ~BackgroundWorker() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }
  BackgroundWorker(const BackgroundWorker&) = delete;
  BackgroundWorker& operator=(const BackgroundWorker&) = delete;

  /// @returns what the work returns or throws; unlike that of std::async it does not wait when it is dropped
  template <class Work>
  std::future<std::invoke_result_t<Work>> begin(Work work) {
    std::packaged_task<std::invoke_result_t<Work>()> task(std::move(work));
    auto result = task.get_future();
    {
      const std::lock_guard lock(mutex_);
      waiting_.emplace_back(std::move(task));
      if (!thread_.joinable()) thread_ = std::thread([this] { live(); });
    }
    wake_.notify_one();
    return result;
  }

  /// Two pieces of work at once: `mine` by the caller, `yours` by this thread; returns when both are done. Throws what
  /// `mine` threw, otherwise what `yours` did.
  template <class Mine, class Yours>
  void share(const Mine& mine, const Yours& yours) {
    std::future<void> second = begin([&yours] { yours(); });
    struct Wait {
      const std::future<void>& second;
      ~Wait() {
        if (second.valid()) second.wait();  // it is still at work on what the caller holds
      }
    } const wait{second};
    mine();
    second.get();
  }

 private:
  void live() {
    std::unique_lock lock(mutex_);
    for (;;) {
      wake_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      auto task = std::move(waiting_.front());
      waiting_.pop_front();
      lock.unlock();
      task();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::packaged_task<void()>> waiting_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace bodyschema
