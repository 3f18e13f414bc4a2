#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace bodyschema {

/// The most recent durations of one kind, up to a fixed number. One thread.
class RecentDurations {
 public:
  explicit RecentDurations(std::size_t capacity) : values_ms_(capacity) {}
  void add(double ms) { values_ms_[count_++ % values_ms_.size()] = ms; }
  void clear() { count_ = 0; }
  [[nodiscard]] std::size_t size() const { return count_ < values_ms_.size() ? count_ : values_ms_.size(); }
  /// The value that a share `q` (0 to 1) of the durations do not exceed; 0 without any.
  [[nodiscard]] double quantile_ms(double q) const;

 private:
  std::vector<double> values_ms_;
  std::size_t count_ = 0;
};

/// Durations since start, counted in bins of fixed upper bounds. One thread.
class DurationHistogram {
 public:
  /// ms; a further bin has no bound.
  static constexpr std::array<double, 11> kUpper_ms = {2, 5, 10, 15, 20, 33, 50, 100, 200, 500, 1000};
  void add(double ms);
  [[nodiscard]] const std::array<std::int64_t, kUpper_ms.size() + 1>& counts() const { return counts_; }

 private:
  std::array<std::int64_t, kUpper_ms.size() + 1> counts_{};
};

/// The stages of one frame, from a picture's arrival to its published estimate. One thread.
class StageDurations {
 public:
  /// Waiting is arrival to start; latency is all of it.
  static constexpr std::array<const char*, 8> kNames = {"waiting", "segmentation", "kinematics", "scoring",
                                                        "filter",  "refinement",   "publishing", "latency"};
  using Frame = std::array<double, kNames.size()>;  ///< ms

  /// @param window  frames that medians are taken over
  explicit StageDurations(std::size_t window) : stages_(kNames.size(), RecentDurations(window)) {}
  void add(const Frame& frame_ms);
  [[nodiscard]] const RecentDurations& stage(std::size_t i) const { return stages_[i]; }
  /// For people: one row per stage with median, 99th percentile and maximum.
  [[nodiscard]] std::string table() const;

 private:
  std::vector<RecentDurations> stages_;
};

}  // namespace bodyschema
