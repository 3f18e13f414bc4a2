#include "scratch.hpp"

#include <atomic>
#include <unistd.h>

#include <spdlog/fmt/fmt.h>

namespace bodyschema {

Scratch::Scratch(const std::string& name) {
  static std::atomic<int> number{0};
  path_ = std::filesystem::temp_directory_path() / fmt::format("bodyschema_{}_{}_{}", getpid(), number++, name);
}

Scratch::~Scratch() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

}  // namespace bodyschema
