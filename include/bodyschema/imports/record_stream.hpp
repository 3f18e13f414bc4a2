#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bodyschema {

/// Where bytes come from, one after another: a pipe, or memory in tests.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Fills `bytes` from the front. Returns how many; fewer than asked for only at the end.
  virtual std::size_t read(std::span<std::uint8_t> bytes) = 0;
};

/// One record of a reader of recordings (import/framing.py): a header by name, and bytes.
/// Every getter throws FileError naming kind and name where there is no such value of that type.
class Record {
 public:
  std::vector<std::uint8_t> payload;

  [[nodiscard]] const std::string& kind() const { return kind_; }
  [[nodiscard]] bool has(const char* name) const;
  [[nodiscard]] std::string text(const char* name) const;
  [[nodiscard]] std::int64_t integer(const char* name) const;
  [[nodiscard]] bool boolean(const char* name) const;
  [[nodiscard]] std::vector<std::string> texts(const char* name) const;
  [[nodiscard]] std::vector<std::int64_t> integers(const char* name) const;
  /// A value of any type as it is written in JSON.
  [[nodiscard]] std::string json(const char* name) const;
  /// The payload as 64-bit floating point numbers, little-endian. Throws FileError for `count` others than these.
  [[nodiscard]] std::vector<double> numbers(std::size_t count) const;

 private:
  friend class RecordStream;
  struct Header;
  std::shared_ptr<const Header> header_;
  std::string kind_;
};

/// How the error about a stream that ended early ends.
inline constexpr const char* kReaderEnded = ": its reader ended before the recording did";

/// Takes records off a stream: two unsigned 32-bit numbers, little-endian, the bytes of header and payload; then a JSON
/// object with "kind"; then the payload. Sizes are bounded before memory is taken. One thread.
class RecordStream {
 public:
  static constexpr std::uint32_t kMaxHeader = 4u << 20, kMaxPayload = 256u << 20;

  /// @param source  outlives this
  /// @param name    of the recording, for errors
  RecordStream(ByteSource& source, std::string name) : source_(source), name_(std::move(name)) {}

  /// The next record, its memory used again; false behind the one of kind "end". Throws FileError for the reader's own
  /// "error", for a stream that ends before either, and for what is no record.
  bool next(Record& record);

 private:
  ByteSource& source_;
  std::string name_;
};

}  // namespace bodyschema
