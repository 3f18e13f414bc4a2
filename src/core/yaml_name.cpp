#include "bodyschema/core/yaml_name.hpp"

#include <spdlog/fmt/fmt.h>

namespace bodyschema {

std::string yaml_name(const std::string& name) {
  static constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";
  const bool plain = !name.empty() && name.find_first_not_of(kPlain) == std::string::npos && name[0] != '-';
  const bool number = plain && name[0] >= '0' && name[0] <= '9';
  if (plain && !number) return name;
  std::string text = "\"";
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f) {
      text += fmt::format("\\x{:02x}", byte);
    } else {
      if (c == '"' || c == '\\') text += '\\';
      text += c;
    }
  }
  return text + "\"";
}

}  // namespace bodyschema
