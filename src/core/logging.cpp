#include "bodyschema/core/logging.hpp"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {

void set_up_logging(const std::string& level) {
  const auto parsed = spdlog::level::from_str(level == "warn" ? "warning" : level);
  if (parsed == spdlog::level::off && level != "off") {
    throw ConfigurationError("log level is '" + level +
                             "'; expected trace, debug, info, warn, error or off");
  }
  auto logger = spdlog::get("bodyschema");
  if (!logger) logger = spdlog::stderr_color_mt("bodyschema");
  logger->set_pattern("%H:%M:%S %^%l%$ %v");
  logger->set_level(parsed);
  spdlog::set_default_logger(logger);
}

}  // namespace bodyschema
