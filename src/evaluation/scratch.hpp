#pragma once

#include <filesystem>
#include <string>

namespace bodyschema {

/// A name in the folder for temporary files: the file or folder that is made there is gone at the end.
class Scratch {
 public:
  explicit Scratch(const std::string& name);
  ~Scratch();
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace bodyschema
