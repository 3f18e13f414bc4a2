#pragma once

#include <string>
#include <vector>

namespace bodyschema {

/// The URL with a receive buffer asked for, where it is multicast and asks for none: Linux's default
/// holds less than one uncompressed colour picture.
[[nodiscard]] std::string with_receive_buffer(const std::string& lcm_url);

/// What this machine lacks for LCM at `lcm_url`, one plain sentence each with the command that
/// helps: no route for multicast, a receive buffer too small. Empty when all is well.
[[nodiscard]] std::vector<std::string> check_network(const std::string& lcm_url);

}  // namespace bodyschema
