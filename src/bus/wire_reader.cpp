#include "wire_reader.hpp"

#include <algorithm>

namespace bodyschema {

void WireReader::fail(MessageFault fault, std::string detail) {
  if (!result_.ok()) return;  // the first fault explains the others
  result_ = {fault, std::move(detail)};
  position_ = bytes_.size();
}

bool WireReader::need(std::size_t n) {
  if (!ok()) return false;
  if (bytes_.size() - position_ >= n) return true;
  fail(MessageFault::kTruncated, "ends after " + std::to_string(bytes_.size()) + " bytes");
  return false;
}

void WireReader::fingerprint(std::int64_t expected) {
  const auto found = integer<std::int64_t>();
  if (ok() && found != expected) fail(MessageFault::kWrongType, "has another type's fingerprint");
}

Microseconds WireReader::stamp(const char* field) {
  const auto value = integer<std::int64_t>();
  if (ok() && (value < 0 || value > kLatestStamp)) {
    fail(MessageFault::kBadStamp, std::string(field) + " is " + std::to_string(value));
  }
  return ok() ? value : 0;
}

bool WireReader::check_count(const char* field, std::int64_t n, int max, std::size_t min_item_bytes) {
  if (!ok()) return false;
  const auto says = [&] { return std::string(field) + " is " + std::to_string(n); };
  if (n < 0) {
    fail(MessageFault::kBadCount, says());
  } else if (n > max) {
    fail(MessageFault::kTooLarge, says() + ", at most " + std::to_string(max) + " are accepted");
  } else if (static_cast<std::uint64_t>(n) * min_item_bytes > bytes_.size() - position_) {
    fail(MessageFault::kTruncated, says() + ", more than the message holds");
  }
  return ok();
}

void WireReader::text(const char* field, std::string& out) {
  const auto n = count<std::int32_t>(field, limits_.max_name_bytes + 1, 1);
  if (!ok()) return;
  const Bytes content = raw(static_cast<std::size_t>(n));
  const auto printable = [](std::uint8_t c) { return c >= 0x20 && c != 0x7f; };
  if (content.empty() || content.back() != 0 || !std::all_of(content.begin(), content.end() - 1, printable)) {
    return fail(MessageFault::kBadText, std::string(field) + " is not a printable, terminated string");
  }
  out.assign(reinterpret_cast<const char*>(content.data()), content.size() - 1);
}

void WireReader::texts(const char* field, std::vector<std::string>& out, int n) {
  out.resize(static_cast<std::size_t>(ok() ? n : 0));
  for (auto& item : out) text(field, item);
}

void WireReader::doubles(std::vector<double>& out, int n) {
  if (!check_count("array", n, n, sizeof(double))) n = 0;
  out.resize(static_cast<std::size_t>(n));
  for (auto& item : out) item = float64();
}

Bytes WireReader::raw(std::size_t n) {
  if (!need(n)) return {};
  const Bytes content = bytes_.subspan(position_, n);
  position_ += n;
  return content;
}

DecodeResult WireReader::finish() {
  if (ok() && position_ != bytes_.size()) {
    fail(MessageFault::kTrailingBytes, std::to_string(bytes_.size() - position_) + " bytes follow its end");
  }
  return std::move(result_);
}

}  // namespace bodyschema
