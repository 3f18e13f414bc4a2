#pragma once

#include <string>

namespace bodyschema {

/// Sets up spdlog's default logger: standard error, "HH:MM:SS level message", or for the journal.
/// `level` is trace, debug, info, warn, error or off; throws ConfigurationError otherwise.
void set_up_logging(const std::string& level);

/// Warns of what a configuration says or lacks, once in a program's life however often it is read.
void warn_once(const std::string& text);

}  // namespace bodyschema
