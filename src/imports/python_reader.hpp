#pragma once

#include <sys/types.h>

#include <cstdio>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "bodyschema/imports/record_stream.hpp"

namespace bodyschema {

/// A Python interpreter with the packages that import/KIND.txt names: $BODYSCHEMA_PYTHON where that is set, else an
/// environment of its own, $XDG_CACHE_HOME/bodyschema/python/KIND, which the first call makes with the machine's
/// python3 and PyPI. Two processes may call it at once.
/// @param say  hears, before it is done, that an environment is made and where
/// Throws DeviceError where that cannot be done, with what pip said and what to do without a network.
std::filesystem::path python_for(const std::string& kind, const std::function<void(const std::string&)>& say);

/// import/NAME of the source tree or the installation. Throws FileError.
std::filesystem::path import_file(const std::string& name);

/// A program whose standard output is read while it runs. What it writes to standard error is kept for errors. It does
/// not outlive this.
class PipedProgram : public ByteSource {
 public:
  /// @param arguments  the program first, found in PATH. Throws DeviceError where it cannot be started.
  explicit PipedProgram(const std::vector<std::string>& arguments);
  ~PipedProgram() override;
  PipedProgram(const PipedProgram&) = delete;
  PipedProgram& operator=(const PipedProgram&) = delete;

  std::size_t read(std::span<std::uint8_t> bytes) override;
  /// Waits for its end. Returns its exit status, 128 and more: ended by a signal.
  int wait();
  /// The last lines that it wrote to standard error.
  [[nodiscard]] std::string complaint() const;

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  std::FILE* errors_ = nullptr;
};

/// Throws the FileError about a stream that ended early once more, with what its reader had to say.
[[noreturn]] void rethrow_with_complaint(PipedProgram& reader, const std::string& recording, const FileError& error);

/// Runs import/READER with the arguments behind it, and `work` on the records that it writes.
/// @param kind  of python_for; @param arguments  the reader first; @param recording  for errors
template <class Work>
auto read_with_python(const std::string& kind, std::vector<std::string> arguments, const std::string& recording,
                      const std::function<void(const std::string&)>& say, const Work& work) {
  arguments.front() = import_file(arguments.front()).string();
  // Not Python's own variables, which lead a sourced ROS workspace to other packages; and no files beside the readers.
  arguments.insert(arguments.begin(), {python_for(kind, say).string(), "-E", "-B"});
  PipedProgram reader(arguments);
  try {
    return work(reader);
  } catch (const FileError& error) {
    rethrow_with_complaint(reader, recording, error);
  }
}

}  // namespace bodyschema
