#include "worker_pool.hpp"

#include <algorithm>

namespace bodyschema {

WorkerPool::WorkerPool(int threads) {
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int worker = 1; worker < threads; ++worker) {
    threads_.emplace_back([this, worker] { live(worker); });
  }
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (auto& thread : threads_) thread.join();
}

void WorkerPool::run_job(Job job, void* context, std::size_t count, std::size_t grain) {
  job_ = job;
  context_ = context;
  count_ = count;
  grain_ = std::max<std::size_t>(grain, 1);
  next_.store(0, std::memory_order_relaxed);
  if (threads_.empty() || count <= grain_) {
    work(0);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    ++generation_;
    busy_ = static_cast<int>(threads_.size());
  }
  start_.notify_all();
  work(0);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void WorkerPool::work(int worker) {
  for (;;) {
    const std::size_t begin = next_.fetch_add(grain_, std::memory_order_relaxed);
    if (begin >= count_) return;
    job_(context_, worker, begin, std::min(begin + grain_, count_));
  }
}

void WorkerPool::live(int worker) {
  std::uint64_t seen = 0;
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      start_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
    }
    work(worker);
    {
      const std::lock_guard lock(mutex_);
      if (--busy_ == 0) done_.notify_one();
    }
  }
}

}  // namespace bodyschema
