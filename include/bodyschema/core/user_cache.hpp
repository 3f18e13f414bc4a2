#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace bodyschema {

/// $XDG_CACHE_HOME/bodyschema or $HOME/.cache/bodyschema; empty where neither is set to an absolute path.
std::filesystem::path user_cache_folder();

/// What was computed once and can be computed again, kept in files of that folder. Where there is none, or it cannot be
/// read or written, nothing is kept; nothing throws.
/// Files are replaced whole, so that processes at the same time do not disturb each other.
/// @param name  a path below it, e.g. "meshes/0123456789abcdef"
[[nodiscard]] std::optional<std::string> read_cache(const std::filesystem::path& name);
void write_cache(const std::filesystem::path& name, std::string_view bytes);

}  // namespace bodyschema
