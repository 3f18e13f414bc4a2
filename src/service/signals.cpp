#include "signals.hpp"

#include <atomic>

namespace bodyschema {

namespace {
constexpr std::array<int, 3> kSignals = {SIGTERM, SIGINT, SIGHUP};
std::atomic<bool> stop{false};
std::atomic<bool> reload{false};
static_assert(std::atomic<bool>::is_always_lock_free, "handlers may only touch lock-free flags");

void handle(int signal) {
  (signal == SIGHUP ? reload : stop) = true;
}
}  // namespace

Signals::Signals() {
  stop = false;
  reload = false;
  for (std::size_t i = 0; i < kSignals.size(); ++i) {
    struct sigaction action {};
    action.sa_handler = handle;
    action.sa_flags = SA_RESTART;
    sigemptyset(&action.sa_mask);
    sigaction(kSignals[i], &action, &previous_[i]);
  }
}

Signals::~Signals() {
  for (std::size_t i = 0; i < kSignals.size(); ++i) sigaction(kSignals[i], &previous_[i], nullptr);
}

bool Signals::stop_requested() const {
  return stop;
}
bool Signals::take_reload_request() const {
  return reload.exchange(false);
}

}  // namespace bodyschema
