#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace bodyschema {

/// Bytes as text (RFC 4648, with padding), for pictures inside HTML and JSON.
[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

}  // namespace bodyschema
