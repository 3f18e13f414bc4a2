#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

struct DaemonOptions {
  std::string lcm_url;
  /// Log of every message that comes in on our channels or goes out. A file that holds something already
  /// is kept: name.1.lcmlog, name.2.lcmlog, ... are written instead.
  std::optional<std::filesystem::path> record;
  /// estimates.jsonl, as replay writes it; kept in the same way. Not the same file.
  std::optional<std::filesystem::path> estimates;
  std::uint64_t frames = 0;        ///< stop after this many estimates; 0: do not
  double stop_after_idle_s = 0.0;  ///< stop when nothing has come for so long, once something has; 0: do not
  std::optional<int> page_port;    ///< serve the live page on localhost
  bool timings = false;            ///< print a table of stage times at the end
  std::string version;
};

/// Runs the service until SIGTERM, SIGINT or one of the options' ends. SIGHUP calls
/// `load_configuration` again and starts estimating anew with it; a configuration that cannot be
/// used is refused and work goes on as before.
///
/// Three threads of its own: one receives (Receiver), the calling one estimates and publishes, one says
/// how things are once a second; scorer, look-ahead, recorder and page have theirs. Changes the process's signal
/// handlers while it runs. Throws Error.
void run_daemon(const std::function<Configuration()>& load_configuration, const DaemonOptions& options);

}  // namespace bodyschema
