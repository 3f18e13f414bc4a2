#include "bodyschema/core/clock.hpp"

#include <chrono>

namespace bodyschema {
namespace {

template <class Clock>
std::int64_t now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
}

}  // namespace

std::int64_t monotonic_us() {
  return now_us<std::chrono::steady_clock>();
}
Microseconds wall_us() {
  return now_us<std::chrono::system_clock>();
}

}  // namespace bodyschema
