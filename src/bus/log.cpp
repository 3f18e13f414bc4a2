#include "bodyschema/bus/log.hpp"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema {

namespace {

// An event: sync word, number (8), time (8), channel length (4), data length (4), channel, data.
// All big-endian. From LCM's eventlog.
constexpr std::uint32_t kSync = 0xEDA1DA01;
constexpr std::size_t kHeaderBytes = 28;
constexpr std::uint32_t kMaxChannelBytes = 63;  // LCM_MAX_CHANNEL_NAME_LENGTH
constexpr std::uint32_t kMaxDataBytes = 256u << 20;
constexpr int kReportedDamages = 5;

using Header = std::array<std::uint8_t, kHeaderBytes>;

template <class Unsigned>
Unsigned get(const std::uint8_t* from) {
  Unsigned value = 0;
  for (std::size_t i = 0; i < sizeof(Unsigned); ++i) value = static_cast<Unsigned>(value << 8) | from[i];
  return value;
}

template <class Unsigned>
void put(std::uint8_t* to, Unsigned value) {
  for (std::size_t i = sizeof(Unsigned); i-- > 0; value = static_cast<Unsigned>(value >> 8)) {
    to[i] = static_cast<std::uint8_t>(value);
  }
}

struct Lengths {
  std::uint32_t channel = 0;
  std::uint32_t data = 0;
};

/// Whether these bytes can begin an event of which `available` bytes are left in the file.
bool plausible(const Header& header, std::uint64_t available, Lengths& lengths) {
  if (get<std::uint32_t>(header.data()) != kSync) return false;
  lengths.channel = get<std::uint32_t>(header.data() + 20);
  lengths.data = get<std::uint32_t>(header.data() + 24);
  return lengths.channel >= 1 && lengths.channel <= kMaxChannelBytes && lengths.data <= kMaxDataBytes &&
         kHeaderBytes + std::uint64_t{lengths.channel} + lengths.data <= available;
}

bool printable(const std::string& channel) {
  return std::all_of(channel.begin(), channel.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
}

/// Whether another event begins there, as far as the file goes.
bool sync_or_end_at(std::FILE* file, std::uint64_t offset, std::uint64_t size) {
  std::array<std::uint8_t, 4> found{}, expected{};
  put(expected.data(), kSync);
  const std::size_t n = std::min<std::uint64_t>(found.size(), size - offset);
  return fseeko(file, static_cast<off_t>(offset), SEEK_SET) == 0 && std::fread(found.data(), 1, n, file) == n &&
         std::equal(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(n), expected.begin());
}

}  // namespace

LogReader::LogReader(std::filesystem::path file) : file_(std::move(file)) {
  std::error_code error;
  const auto status = std::filesystem::status(file_, error);
  if (!std::filesystem::exists(status)) throw FileError(file_.string() + ": no such log file");
  if (!std::filesystem::is_regular_file(status)) throw FileError(file_.string() + ": not a file, expected an LCM log");
  size_ = std::filesystem::file_size(file_, error);
  stream_.reset(std::fopen(file_.c_str(), "rb"));
  if (error || !stream_) throw FileError(file_.string() + ": cannot be opened: " + std::strerror(errno));
  if (size_ == 0) throw FileError(file_.string() + ": is empty, expected an LCM log");
  if (!plausible_header_at(0)) {
    if (!find_event(1)) throw FileError(file_.string() + ": holds no message, expected an LCM log");
    report_damage(0, position_);
  }
}

LogReader::~LogReader() = default;
LogReader::LogReader(LogReader&&) noexcept = default;

bool LogReader::next(LogEvent& event) {
  while (true) {
    const std::uint64_t start = position_;
    switch (read_event(event)) {
      case Outcome::kEvent: return true;
      case Outcome::kEnd: return false;
      case Outcome::kDamaged:
        if (!find_event(start + 1)) position_ = size_;
        report_damage(start, position_);
        break;
    }
  }
}

LogReader::Outcome LogReader::read_event(LogEvent& event) {
  const std::uint64_t available = size_ - position_;
  if (available == 0) return Outcome::kEnd;
  if (fseeko(stream_.get(), static_cast<off_t>(position_), SEEK_SET) != 0) return Outcome::kEnd;
  Header header;
  Lengths lengths;
  if (available < kHeaderBytes || std::fread(header.data(), 1, kHeaderBytes, stream_.get()) != kHeaderBytes ||
      !plausible(header, available, lengths)) {
    return Outcome::kDamaged;
  }
  // A damaged length that happens to be plausible lands in the middle of something: the event is
  // believed only when another one, or the end of the file, follows it. Looked at first, or a file of
  // such events would be read as often as it has any.
  const std::uint64_t end = position_ + kHeaderBytes + lengths.channel + lengths.data;
  if (!sync_or_end_at(stream_.get(), end, size_) ||
      fseeko(stream_.get(), static_cast<off_t>(position_ + kHeaderBytes), SEEK_SET) != 0) {
    return Outcome::kDamaged;
  }
  event.number = static_cast<std::int64_t>(get<std::uint64_t>(header.data() + 4));
  event.time_us =
      std::clamp(static_cast<Microseconds>(get<std::uint64_t>(header.data() + 12)), -kLatestStamp, kLatestStamp);
  event.channel.resize(lengths.channel);
  if (std::fread(event.channel.data(), 1, lengths.channel, stream_.get()) != lengths.channel ||
      !printable(event.channel)) {
    return Outcome::kDamaged;
  }
  event.data.resize(lengths.data);
  if (std::fread(event.data.data(), 1, lengths.data, stream_.get()) != lengths.data) return Outcome::kDamaged;
  position_ = end;
  return Outcome::kEvent;
}

bool LogReader::plausible_header_at(std::uint64_t offset) {
  Header header;
  Lengths lengths;
  return size_ - offset >= kHeaderBytes && fseeko(stream_.get(), static_cast<off_t>(offset), SEEK_SET) == 0 &&
         std::fread(header.data(), 1, kHeaderBytes, stream_.get()) == kHeaderBytes &&
         plausible(header, size_ - offset, lengths);
}

/// Moves to the first plausible event at or after `from`.
bool LogReader::find_event(std::uint64_t from) {
  std::array<std::uint8_t, 4> sync{};
  put(sync.data(), kSync);
  // Little at first: a log with much damage must not cost a large block for every place.
  std::size_t wanted = 4096;
  while (from + kHeaderBytes <= size_) {
    if (fseeko(stream_.get(), static_cast<off_t>(from), SEEK_SET) != 0) return false;
    if (block_.size() < wanted) block_.resize(wanted);
    const std::size_t n = std::fread(block_.data(), 1, wanted, stream_.get());
    wanted = std::min<std::size_t>(2 * wanted, 1 << 20);
    if (n < sync.size()) return false;
    const auto end = block_.begin() + static_cast<std::ptrdiff_t>(n);
    for (auto at = block_.begin(); (at = std::search(at, end, sync.begin(), sync.end())) != end; ++at) {
      const std::uint64_t offset = from + static_cast<std::uint64_t>(at - block_.begin());
      if (plausible_header_at(offset)) {
        position_ = offset;
        return true;
      }
    }
    from += n - (sync.size() - 1);  // a sync word may straddle two blocks
  }
  return false;
}

void LogReader::report_damage(std::uint64_t from, std::uint64_t to) {
  skipped_bytes_ += to - from;
  ++damaged_places_;
  if (damaged_places_ > kReportedDamages) return;
  if (to == size_) {
    spdlog::warn("{}: the last message is cut short; {} bytes at its end are not read", file_.string(), to - from);
  } else {
    spdlog::warn("{}: damaged at byte {}; {} bytes skipped{}", file_.string(), from, to - from,
                 damaged_places_ == kReportedDamages ? "; further places are not reported" : "");
  }
}

LogWriter::LogWriter(std::filesystem::path file) : file_(std::move(file)) {
  descriptor_ = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw_write_failure(file_, errno);
}

LogWriter::~LogWriter() {
  ::close(descriptor_);
}

void LogWriter::publish(const std::string& channel, Microseconds time_us, Bytes message) {
  if (failed_) throw DeviceError(file_.string() + ": recording stopped after a failed write");
  if (channel.empty() || channel.size() > kMaxChannelBytes || message.size() > kMaxDataBytes) {
    throw DataError(file_.string() + ": channel '" + channel + "' with " + std::to_string(message.size()) +
                    " bytes cannot be recorded: names have 1 to 63 letters, messages at most 256 MiB");
  }
  Header header;
  put(header.data(), kSync);
  put(header.data() + 4, static_cast<std::uint64_t>(events_written_));
  put(header.data() + 12, static_cast<std::uint64_t>(time_us));
  put(header.data() + 20, static_cast<std::uint32_t>(channel.size()));
  put(header.data() + 24, static_cast<std::uint32_t>(message.size()));
  std::array<iovec, 3> parts{iovec{header.data(), header.size()},
                             iovec{const_cast<char*>(channel.data()), channel.size()},
                             iovec{const_cast<std::uint8_t*>(message.data()), message.size()}};
  const std::size_t total = header.size() + channel.size() + message.size();
  std::size_t done = 0;
  while (done < total) {
    const ssize_t n = ::writev(descriptor_, parts.data(), static_cast<int>(parts.size()));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int reason = n < 0 ? errno : EIO;
      failed_ = true;
      // Best effort: a tail that stays is skipped by every reader.
      if (::ftruncate(descriptor_, static_cast<off_t>(bytes_written_)) != 0) {
        spdlog::debug("{}: could not be cut back: {}", file_.string(), std::strerror(errno));
      }
      throw DeviceError(file_.string() + ": recording stopped after " + std::to_string(events_written_) +
                        " messages: " + std::strerror(reason));
    }
    done += static_cast<std::size_t>(n);
    auto left = static_cast<std::size_t>(n);
    for (auto& part : parts) {
      const std::size_t taken = std::min(left, part.iov_len);
      part.iov_base = static_cast<char*>(part.iov_base) + taken;
      part.iov_len -= taken;
      left -= taken;
    }
  }
  bytes_written_ += total;
  ++events_written_;
}

}  // namespace bodyschema
