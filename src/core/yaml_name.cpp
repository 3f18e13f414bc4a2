#include "bodyschema/core/yaml_name.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace bodyschema {

std::string yaml_name(const std::string& name) {
  static constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";
  static constexpr std::array kOtherValues = {"null", "true", "false", "yes", "no", "on", "off", "y", "n"};
  std::string lower = name;
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  const bool value = std::find(kOtherValues.begin(), kOtherValues.end(), lower) != kOtherValues.end() ||
                     (name.size() > 1 && name[0] == '.' && std::isalnum(static_cast<unsigned char>(name[1])) != 0);
  const bool plain = !name.empty() && name.find_first_not_of(kPlain) == std::string::npos && name[0] != '-' && !value;
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
