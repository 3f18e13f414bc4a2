#include "bodyschema/core/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <thread>
#include <vector>

namespace bodyschema {
namespace {

constexpr double kQuiet_s = 2.0;
constexpr double kRedraw_s = 0.1;
constexpr std::chrono::milliseconds kWatch{500};  // drawn this often between two steps
constexpr double kRepeat_s = 30.0;                // the same without a terminal
constexpr int kWidth = 30;

std::int64_t now_ns() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

std::string duration_text(double duration_s) {
  const auto total = static_cast<long>(std::lround(duration_s));
  char text[32];
  std::snprintf(text, sizeof text, "%ld:%02ld", total / 60, total % 60);
  return text;
}

/// Draws all bars of the process now and then, so that a single long step shows too.
class Watcher {
 public:
  static Watcher& instance() {
    static Watcher watcher;
    return watcher;
  }
  void add(ProgressBar* bar) {
    const std::lock_guard lock(mutex_);
    bars_.push_back(bar);
    if (!thread_.joinable()) thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
  }
  void remove(ProgressBar* bar) {
    const std::lock_guard lock(mutex_);
    std::erase(bars_, bar);
  }
  /// Guards every bar. Recursive: the watcher holds it while it draws.
  [[nodiscard]] std::recursive_mutex& mutex() { return mutex_; }

 private:
  void watch(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      wake_.wait_for(lock, stop, kWatch, [] { return false; });
      for (ProgressBar* bar : bars_) bar->advance(0);
    }
  }

  std::recursive_mutex mutex_;
  std::condition_variable_any wake_;
  std::vector<ProgressBar*> bars_;
  std::jthread thread_;  // last: everything else is there when it starts
};

}  // namespace

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)), total_(std::max<std::uint64_t>(total, 1)), start_ns_(now_ns()),
      terminal_(isatty(STDERR_FILENO) != 0) {
  Watcher::instance().add(this);
}

ProgressBar::~ProgressBar() {
  Watcher::instance().remove(this);
  if (!drawn_) return;
  const double elapsed_s = static_cast<double>(now_ns() - start_ns_) * 1e-9;
  if (terminal_) {
    std::fprintf(stderr, "\r\033[K%s: %s\n", label_.c_str(), duration_text(elapsed_s).c_str());
  } else {
    std::fprintf(stderr, "%s: ended after %s\n", label_.c_str(), duration_text(elapsed_s).c_str());
  }
}

void ProgressBar::advance(std::uint64_t steps) {
  const std::lock_guard lock(Watcher::instance().mutex());
  set(done_ + steps);
}

void ProgressBar::set(std::uint64_t done) {
  const std::lock_guard lock(Watcher::instance().mutex());
  done_ = std::min(done, total_);
  draw();
}

void ProgressBar::draw() {
  const std::int64_t now = now_ns();
  const double elapsed_s = static_cast<double>(now - start_ns_) * 1e-9;
  if (elapsed_s < kQuiet_s) return;
  const double share = static_cast<double>(done_) / static_cast<double>(total_);
  const std::string left = done_ > 0 ? duration_text(elapsed_s * (1.0 - share) / share) : std::string("?");
  if (terminal_) {
    if (static_cast<double>(now - last_draw_ns_) * 1e-9 < kRedraw_s && done_ < total_) return;
    const int filled = static_cast<int>(share * kWidth);
    std::fprintf(stderr, "\r\033[K%s [%s%s] %3.0f %%, %s left", label_.c_str(),
                 std::string(static_cast<std::size_t>(filled), '#').c_str(),
                 std::string(static_cast<std::size_t>(kWidth - filled), '.').c_str(), share * 100.0, left.c_str());
    std::fflush(stderr);
  } else {
    const int decile = static_cast<int>(share * 10.0);
    const bool long_ago = static_cast<double>(now - last_draw_ns_) * 1e-9 > kRepeat_s;
    if (decile == last_decile_ && drawn_ && !long_ago) return;
    last_decile_ = decile;
    std::fprintf(stderr, "%s: %d %%, %s left\n", label_.c_str(), decile * 10, left.c_str());
  }
  last_draw_ns_ = now;
  drawn_ = true;
}

}  // namespace bodyschema
