#pragma once

#include <atomic>
#include <random>
#include <string>
#include <thread>

namespace bodyschema::integration {

/// Passes the UDP packets of one LCM network on to another, losing some and swapping some with the
/// packet after them: a bad network between robot and service, in user space.
class Relay {
 public:
  Relay(const std::string& from_lcm_url, const std::string& to_lcm_url, unsigned seed);
  ~Relay();
  Relay(const Relay&) = delete;
  Relay& operator=(const Relay&) = delete;

  /// Chances of each packet, from the next one on.
  void set(double lost, double swapped);
  [[nodiscard]] std::uint64_t packets() const { return packets_; }
  [[nodiscard]] std::uint64_t lost() const { return lost_count_; }
  [[nodiscard]] std::uint64_t swapped() const { return swapped_count_; }

 private:
  void work(const std::stop_token& stop);
  int in_ = -1, out_ = -1;
  std::mt19937 random_;
  std::atomic<double> lost_{0.0}, swapped_{0.0};
  std::atomic<std::uint64_t> packets_{0}, lost_count_{0}, swapped_count_{0};
  std::jthread thread_;
};

}  // namespace bodyschema::integration
