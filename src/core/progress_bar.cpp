#include "bodyschema/core/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

namespace bodyschema {
namespace {

constexpr double kQuiet_s = 2.0;
constexpr double kRedraw_s = 0.1;
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

}  // namespace

ProgressBar::ProgressBar(std::string label, std::uint64_t total)
    : label_(std::move(label)), total_(std::max<std::uint64_t>(total, 1)), start_ns_(now_ns()),
      terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (!drawn_) return;
  const double elapsed_s = static_cast<double>(now_ns() - start_ns_) * 1e-9;
  if (terminal_) {
    std::fprintf(stderr, "\r\033[K%s: %s\n", label_.c_str(), duration_text(elapsed_s).c_str());
  } else {
    std::fprintf(stderr, "%s: ended after %s\n", label_.c_str(), duration_text(elapsed_s).c_str());
  }
}

void ProgressBar::advance(std::uint64_t steps) { set(done_ + steps); }

void ProgressBar::set(std::uint64_t done) {
  done_ = std::min(done, total_);
  draw();
}

void ProgressBar::draw() {
  const std::int64_t now = now_ns();
  const double elapsed_s = static_cast<double>(now - start_ns_) * 1e-9;
  if (elapsed_s < kQuiet_s) return;
  const double share = static_cast<double>(done_) / static_cast<double>(total_);
  const std::string left =
      done_ > 0 ? duration_text(elapsed_s * (1.0 - share) / share) : std::string("?");
  if (terminal_) {
    if (static_cast<double>(now - last_draw_ns_) * 1e-9 < kRedraw_s && done_ < total_) return;
    const int filled = static_cast<int>(share * kWidth);
    std::fprintf(stderr, "\r\033[K%s [%s%s] %3.0f %%, %s left", label_.c_str(),
                 std::string(static_cast<std::size_t>(filled), '#').c_str(),
                 std::string(static_cast<std::size_t>(kWidth - filled), '.').c_str(), share * 100.0,
                 left.c_str());
    std::fflush(stderr);
  } else {
    const int decile = static_cast<int>(share * 10.0);
    if (decile == last_decile_ && drawn_) return;
    last_decile_ = decile;
    std::fprintf(stderr, "%s: %d %%, %s left\n", label_.c_str(), decile * 10, left.c_str());
  }
  last_draw_ns_ = now;
  drawn_ = true;
}

}  // namespace bodyschema
