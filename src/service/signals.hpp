#pragma once

#include <signal.h>

#include <array>

namespace bodyschema {

/// Catches SIGTERM and SIGINT (stop) and SIGHUP (reload) while it lives; one at a time. Other
/// signals keep their meaning.
class Signals {
 public:
  Signals();
  ~Signals();
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

  [[nodiscard]] bool stop_requested() const;
  /// Whether SIGHUP came since the last call.
  [[nodiscard]] bool take_reload_request() const;

 private:
  std::array<struct sigaction, 3> previous_{};
};

}  // namespace bodyschema
