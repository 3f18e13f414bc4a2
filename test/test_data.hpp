#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace bodyschema {

/// Folder of the public recording and of the official models, which are no part of this project:
/// BODYSCHEMA_DATA, to which the configurations of these robots refer; set to where a checkout beside this one would be
/// where it is not.
inline std::filesystem::path data_folder() {
  setenv("BODYSCHEMA_DATA", (std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "../shared/data").c_str(), 0);
  return std::getenv("BODYSCHEMA_DATA");
}

/// Why a test that needs this part of the data is skipped; empty where it is there.
inline std::string why_no_data(const std::string& part) {
  std::error_code none;
  if (std::filesystem::exists(data_folder() / part, none)) return "";
  return part + ", which is no part of this project, is not in " + data_folder().string() +
         "; BODYSCHEMA_DATA names its folder";
}

}  // namespace bodyschema

#define SKIP_WITHOUT(part) \
  if (const auto reason = ::bodyschema::why_no_data(part); !reason.empty()) GTEST_SKIP() << reason
