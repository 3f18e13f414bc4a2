#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <unistd.h>

#include "bodyschema/core/error.hpp"

/// One target of the fuzzer: bytes from outside go into one decoder, which may refuse them with a
/// typed error and must do nothing else. Built with libFuzzer by scripts/fuzz, and by ctest with a
/// main of its own that runs the corpus and random changes of it (run_corpus.cpp).
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace bodyschema::fuzz {

/// Runs a decoder. Errors of this project are what bad input should give; all else gets through.
template <typename Decoder>
void refuse_or_accept(Decoder&& decoder) {
  try {
    decoder();
  } catch (const Error&) {
  }
}

/// A folder of this process, in memory where there is one; goes with it.
class Folder {
 public:
  Folder() {
    const std::filesystem::path memory = "/dev/shm";
    const auto base = std::filesystem::exists(memory) ? memory : std::filesystem::temp_directory_path();
    path_ = base / ("bodyschema_fuzz_" + std::to_string(getpid()));
    std::filesystem::create_directories(path_);
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The input as a file, for decoders that open one; rewritten for each input.
inline std::filesystem::path as_file(const std::uint8_t* data, std::size_t size, const std::string& name) {
  static const Folder folder;
  const auto file = folder.path() / name;
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return file;
}

inline std::string_view as_text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace bodyschema::fuzz
