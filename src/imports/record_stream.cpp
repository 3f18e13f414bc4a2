#include "bodyschema/imports/record_stream.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"

namespace bodyschema {

struct Record::Header {
  nlohmann::json json;

  [[nodiscard]] const nlohmann::json& at(const Record& record, const char* name) const {
    const auto found = json.find(name);
    if (found == json.end()) fail(record, name, "is not there");
    return *found;
  }
  [[noreturn]] static void fail(const Record& record, const char* name, const char* what) {
    throw FileError("record '" + record.kind() + "': '" + name + "' " + what);
  }
};

bool Record::has(const char* name) const {
  return header_->json.contains(name);
}

std::string Record::text(const char* name) const {
  const auto& value = header_->at(*this, name);
  if (!value.is_string()) Header::fail(*this, name, "is no text");
  return value.get<std::string>();
}

std::int64_t Record::integer(const char* name) const {
  const auto& value = header_->at(*this, name);
  if (!value.is_number_integer()) Header::fail(*this, name, "is no whole number");
  if (value.is_number_unsigned() && value.get<std::uint64_t>() > static_cast<std::uint64_t>(INT64_MAX)) {
    Header::fail(*this, name, "is too large");
  }
  return value.get<std::int64_t>();
}

bool Record::boolean(const char* name) const {
  const auto& value = header_->at(*this, name);
  if (!value.is_boolean()) Header::fail(*this, name, "is neither true nor false");
  return value.get<bool>();
}

std::vector<std::string> Record::texts(const char* name) const {
  const auto& value = header_->at(*this, name);
  if (!value.is_array()) Header::fail(*this, name, "is no list");
  std::vector<std::string> all;
  for (const auto& entry : value) {
    if (!entry.is_string()) Header::fail(*this, name, "holds what is no text");
    all.push_back(entry.get<std::string>());
  }
  return all;
}

std::vector<std::int64_t> Record::integers(const char* name) const {
  const auto& value = header_->at(*this, name);
  if (!value.is_array()) Header::fail(*this, name, "is no list");
  std::vector<std::int64_t> all;
  for (const auto& entry : value) {
    if (!entry.is_number_integer()) Header::fail(*this, name, "holds what is no whole number");
    all.push_back(entry.get<std::int64_t>());
  }
  return all;
}

std::string Record::json(const char* name) const {
  return header_->at(*this, name).dump();
}

std::vector<double> Record::numbers(std::size_t count) const {
  static_assert(std::endian::native == std::endian::little);
  if (count > payload.size() || payload.size() != count * sizeof(double)) {
    throw FileError("record '" + kind_ + "': " + std::to_string(payload.size()) + " bytes for " +
                    std::to_string(count) + " numbers");
  }
  std::vector<double> values(count);
  if (count > 0) std::memcpy(values.data(), payload.data(), payload.size());
  return values;
}

bool RecordStream::next(Record& record) {
  std::array<std::uint8_t, 8> sizes{};
  if (source_.read(sizes) != sizes.size()) throw FileError(name_ + kReaderEnded);
  const auto size_at = [&](std::size_t i) {
    return static_cast<std::uint32_t>(sizes[i] | sizes[i + 1] << 8 | sizes[i + 2] << 16) |
           static_cast<std::uint32_t>(sizes[i + 3]) << 24;
  };
  const std::uint32_t header = size_at(0), payload = size_at(4);
  if (header > kMaxHeader || payload > kMaxPayload) {
    throw FileError(name_ + ": a record of " + std::to_string(header) + " and " + std::to_string(payload) +
                    " bytes; expected at most " + std::to_string(kMaxHeader) + " and " + std::to_string(kMaxPayload));
  }
  const auto fill = [&](std::vector<std::uint8_t>& bytes, std::uint32_t size) {
    constexpr std::size_t kStep = 1u << 20;  // memory for what is there, whatever the size says
    bytes.clear();
    while (bytes.size() < size) {
      const std::size_t at = bytes.size(), step = std::min<std::size_t>(kStep, size - at);
      bytes.resize(at + step);
      if (source_.read({bytes.data() + at, step}) != step) {
        throw FileError(name_ + kReaderEnded);
      }
    }
  };
  std::vector<std::uint8_t> text;
  fill(text, header);
  fill(record.payload, payload);
  auto parsed = std::make_shared<Record::Header>();
  parsed->json = nlohmann::json::parse(text, nullptr, false);
  const auto kind = parsed->json.is_object() ? parsed->json.find("kind") : parsed->json.end();
  if (!parsed->json.is_object() || kind == parsed->json.end() || !kind->is_string()) {
    throw FileError(name_ + ": a record without a kind");
  }
  record.kind_ = kind->get<std::string>();
  record.header_ = std::move(parsed);
  if (record.kind_ == "error") throw FileError(name_ + ": " + record.text("message"));
  return record.kind_ != "end";
}

}  // namespace bodyschema
