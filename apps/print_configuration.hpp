#pragma once

#include <cstdio>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema::apps {

/// For --print-config: every key with the value in force. The pipeline asks for all of them, so that
/// defaults are shown, and a key that nobody asks for is refused.
inline void print_configuration(const Configuration& configuration) {
  const Pipeline pipeline(configuration);
  configuration.reject_unknown_keys();
  std::fputs(configuration.print().c_str(), stdout);
}

}  // namespace bodyschema::apps
