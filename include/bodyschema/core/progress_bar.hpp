#pragma once

#include <cstdint>
#include <string>

namespace bodyschema {

/// Progress of a long command on standard error: a bar with time left on a terminal, otherwise one
/// plain line every ten per cent. Silent for work that ends within two seconds. Any thread may call.
class ProgressBar {
 public:
  ProgressBar(std::string label, std::uint64_t total);
  ~ProgressBar();  ///< finishes the line
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  void advance(std::uint64_t steps = 1);
  void set(std::uint64_t done);

 private:
  void draw();
  std::string label_;
  std::uint64_t total_;
  std::uint64_t done_ = 0;
  std::int64_t start_ns_;
  std::int64_t last_draw_ns_ = 0;
  int last_decile_ = 0;
  bool terminal_;
  bool drawn_ = false;
};

}  // namespace bodyschema
