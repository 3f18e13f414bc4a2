#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace bodyschema {

/// Threads that live as long as the pool and share out the indices of a loop.
///
/// `run` is called from one thread at a time; the caller works too. Nothing is allocated per call.
class WorkerPool {
 public:
  /// @param threads  including the caller; 0 means one per core
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  [[nodiscard]] int threads() const { return static_cast<int>(threads_.size()) + 1; }

  /// Calls body(worker, begin, end) over [0, count) in pieces of `grain`, and returns when all are
  /// done. worker is 0 .. threads()-1 and never runs two pieces at once. The body must not throw.
  template <typename Body>
  void run(std::size_t count, std::size_t grain, Body& body) {
    run_job([](void* context, int worker, std::size_t begin,
               std::size_t end) noexcept { (*static_cast<Body*>(context))(worker, begin, end); },
            &body, count, grain);
  }

 private:
  using Job = void (*)(void*, int, std::size_t, std::size_t) noexcept;

  void run_job(Job job, void* context, std::size_t count, std::size_t grain);
  void work(int worker);
  void live(int worker);

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable start_;
  std::condition_variable done_;
  std::uint64_t generation_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  Job job_ = nullptr;
  void* context_ = nullptr;
  std::size_t count_ = 0;
  std::size_t grain_ = 1;
  std::atomic<std::size_t> next_{0};
};

}  // namespace bodyschema
