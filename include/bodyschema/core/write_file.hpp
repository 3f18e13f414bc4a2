#pragma once

#include <filesystem>
#include <fstream>
#include <string_view>

namespace bodyschema {

/// Whether a write that failed for this reason (errno) may succeed another time, as on a full disk.
[[nodiscard]] bool write_failure_passes(int reason);
/// Throws DeviceError where the failure may pass, else FileError (no such folder, no permission); both name file and
/// reason.
[[noreturn]] void throw_write_failure(const std::filesystem::path& file, int reason);

/// Makes a folder and those above it, where they are not there yet. Throws as throw_write_failure.
void make_folder(const std::filesystem::path& folder);
/// Writes all of the bytes to a file, which is made or emptied; its folder must be there. Throws as
/// throw_write_failure.
void write_file(const std::filesystem::path& file, std::string_view bytes);
/// A stream to a file, which is made or emptied. Throws as throw_write_failure; what is written later may fail too.
[[nodiscard]] std::ofstream open_to_write(const std::filesystem::path& file, std::ios::openmode mode = std::ios::out);

/// A file that gets its name once it is whole: until finish() it is FILE.part, and on an error what was there before
/// is there still. A link is followed, a file's permissions are kept. What is no plain file (a pipe, a device) is
/// written to as it is.
class UnfinishedFile {
 public:
  explicit UnfinishedFile(std::filesystem::path file);
  /// Removes FILE.part unless it was finished.
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  /// Where to write meanwhile.
  [[nodiscard]] const std::filesystem::path& part() const { return part_; }
  /// The same for a file that is yet to be begun.
  static std::filesystem::path part_of(const std::filesystem::path& file);
  /// After all was written and closed. Throws as write_file.
  void finish();

 private:
  std::filesystem::path file_;    ///< as it was named
  std::filesystem::path target_;  ///< behind links
  std::filesystem::path part_;
  bool finished_ = false;
};

/// write_file to an UnfinishedFile.
void replace_file(const std::filesystem::path& file, std::string_view bytes);

}  // namespace bodyschema
