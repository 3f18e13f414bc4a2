#pragma once

#include <string>

namespace bodyschema {

/// Sets up spdlog's default logger: standard error, "HH:MM:SS level message", or for the journal.
/// `level` is trace, debug, info, warn, error or off; throws ConfigurationError otherwise.
void set_up_logging(const std::string& level);

}  // namespace bodyschema
