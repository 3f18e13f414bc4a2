#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/bus/message_sink.hpp"

namespace bodyschema {

/// One recorded message.
struct LogEvent {
  std::int64_t number = 0;   ///< counted by the writer from 0
  Microseconds time_us = 0;  ///< when it was received
  std::string channel;
  std::vector<std::uint8_t> data;
};

/// Reads a log in LCM's event format, as lcm-logger and LogWriter leave it.
///
/// Damage does not end the reading: whatever does not parse is skipped up to the next event, which
/// is reported once per place (at most five times) and counted. A last event that is cut short, as
/// a killed logger leaves it, is skipped the same way. No length in the file is believed before it
/// is compared with what the file holds. One thread.
class LogReader {
 public:
  /// Throws FileError when the file is missing, empty, or holds no event at all.
  explicit LogReader(std::filesystem::path file);
  ~LogReader();
  LogReader(LogReader&&) noexcept;

  /// The next event, or false at the end. Reuses the memory of `event`.
  bool next(LogEvent& event);

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  /// For progress: bytes read and bytes in all.
  [[nodiscard]] std::uint64_t position() const { return position_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Places at which bytes had to be skipped, and how many bytes.
  [[nodiscard]] std::uint64_t damaged_places() const { return damaged_places_; }
  [[nodiscard]] std::uint64_t skipped_bytes() const { return skipped_bytes_; }

 private:
  enum class Outcome { kEvent, kDamaged, kEnd };
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  Outcome read_event(LogEvent& event);
  bool find_event(std::uint64_t from);
  bool plausible_header_at(std::uint64_t offset);
  void report_damage(std::uint64_t from, std::uint64_t to);

  std::filesystem::path file_;
  std::unique_ptr<std::FILE, CloseFile> stream_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;
  std::uint64_t damaged_places_ = 0;
  std::uint64_t skipped_bytes_ = 0;
  std::vector<std::uint8_t> block_;  ///< of find_event
};

/// Writes a log in LCM's event format. Every event reaches the kernel in one call before publish()
/// returns, so that a log whose writer is killed is readable up to the last message that publish()
/// returned from (the kernel may leave a part of the one after it, which LogReader skips); a write
/// that fails half-way (disk full) is taken back to the last whole event. One thread.
class LogWriter : public MessageSink {
 public:
  /// Replaces an existing file. Throws FileError when it cannot be created.
  explicit LogWriter(std::filesystem::path file);
  ~LogWriter() override;
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Throws DeviceError naming the file when the disk is full or fails; the log stays readable and
  /// later calls throw again. Throws DataError for a channel name LCM does not allow.
  void publish(const std::string& channel, Microseconds time_us, Bytes message) override;

  [[nodiscard]] const std::filesystem::path& file() const { return file_; }
  [[nodiscard]] std::uint64_t bytes_written() const { return bytes_written_; }
  [[nodiscard]] std::int64_t events_written() const { return events_written_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t bytes_written_ = 0;
  std::int64_t events_written_ = 0;
  bool failed_ = false;
};

}  // namespace bodyschema
