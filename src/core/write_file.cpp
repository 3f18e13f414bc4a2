#include "bodyschema/core/write_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

/// Zero, or why not.
int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const auto written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return written < 0 ? errno : EIO;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// @param named  what an error calls the file
void write(const fs::path& file, std::string_view bytes, const fs::path& named) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) throw_write_failure(named, errno);
  int reason = write_all(descriptor, bytes);
  // On some file systems a full disk shows when the file is closed.
  if (::close(descriptor) != 0 && reason == 0 && errno != EINTR) reason = errno;
  if (reason != 0) throw_write_failure(named, reason);
}

/// Also where there is nothing yet, which std::filesystem::canonical does not follow to.
fs::path behind_links(fs::path file) {
  constexpr int kMost = 40;  // as Linux
  std::error_code error;
  for (int i = 0; i < kMost && fs::is_symlink(file, error); ++i) {
    const fs::path next = fs::read_symlink(file, error);
    if (error) break;
    file = file.parent_path() / next;
  }
  return file;
}

}  // namespace

bool write_failure_passes(int reason) {
  constexpr std::array kPassing = {ENOSPC, EDQUOT, EFBIG, EROFS, EIO, EMFILE, ENFILE, ENOMEM, EPIPE};
  return std::find(kPassing.begin(), kPassing.end(), reason) != kPassing.end();
}

void throw_write_failure(const fs::path& file, int reason) {
  const std::string text = file.string() + ": cannot be written: " + std::strerror(reason);
  if (write_failure_passes(reason)) throw DeviceError(text);
  throw FileError(text);
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw_write_failure(folder, error.value());
}

std::ofstream open_to_write(const fs::path& file, std::ios::openmode mode) {
  errno = 0;
  std::ofstream stream(file, mode);
  if (!stream) throw_write_failure(file, errno == 0 ? EIO : errno);
  return stream;
}

void write_file(const fs::path& file, std::string_view bytes) {
  write(file, bytes, file);
}

UnfinishedFile::UnfinishedFile(fs::path file)
    : file_(std::move(file)), target_(behind_links(file_)), part_(part_of(file_)) {}

UnfinishedFile::~UnfinishedFile() {
  if (!finished_ && part_ != target_) ::unlink(part_.c_str());
}

fs::path UnfinishedFile::part_of(const fs::path& file) {
  std::error_code none;
  const fs::path target = behind_links(file);
  const bool plain = !fs::exists(target, none) || fs::is_regular_file(target, none);
  return plain ? fs::path(target.string() + ".part") : target;
}

void UnfinishedFile::finish() {
  if (part_ != target_) {
    std::error_code none;
    if (const auto there = fs::status(target_, none); fs::exists(there))
      fs::permissions(part_, there.permissions(), none);
    if (std::rename(part_.c_str(), target_.c_str()) != 0) throw_write_failure(file_, errno);
  }
  finished_ = true;
}

void replace_file(const fs::path& file, std::string_view bytes) {
  UnfinishedFile unfinished(file);
  write(unfinished.part(), bytes, file);
  unfinished.finish();
}

}  // namespace bodyschema
