#include "mcap_writer.hpp"

#include <algorithm>
#include <limits>
#include <type_traits>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 4u << 20;

enum Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

}  // namespace

class McapWriter::Fields {
 public:
  template <class Unsigned>
  Fields& number(Unsigned value) {
    static_assert(std::is_unsigned_v<Unsigned>);
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) {
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 0xFF);
    }
    return *this;
  }
  Fields& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    return raw(value);
  }
  Fields& raw(std::string_view value) {
    bytes_ += value;
    return *this;
  }
  /// A map or list: its size in bytes, then its content.
  template <class Items, class Write>
  Fields& list(const Items& items, Write write) {
    Fields inner;
    for (const auto& item : items) write(inner, item);
    return text(inner.bytes_);
  }
  operator const std::string&() const { return bytes_; }

 private:
  std::string bytes_;
};

McapWriter::McapWriter(std::filesystem::path file) : file_(std::move(file)), unfinished_(file_) {
  stream_ = open_to_write(unfinished_.part(), std::ios::binary | std::ios::trunc);
  put(kMagic);
  put_record(kHeader, Fields().text("").text("bodyschema"));
}

McapWriter::SchemaId McapWriter::add_schema(std::string_view name, std::string_view json_schema) {
  check_room(schemas_.size() + 1);
  const auto id = static_cast<SchemaId>(schemas_.size() + 1);  // 0 stands for "no schema"
  schemas_.push_back(Fields().number(id).text(name).text("jsonschema").text(json_schema));
  put_record(kSchema, schemas_.back());
  return id;
}

McapWriter::ChannelId McapWriter::add_channel(std::string_view topic, SchemaId schema) {
  check_room(channels_.size());
  const auto id = static_cast<ChannelId>(channels_.size());
  channels_.push_back(Fields().number(id).number(schema).text(topic).text("json").number(std::uint32_t{0}));
  counts_.push_back(0);
  put_record(kChannel, channels_.back());
  return id;
}

void McapWriter::check_room(std::size_t id) const {
  if (id > std::numeric_limits<std::uint16_t>::max()) {
    throw FileError(file_.string() + ": more channels than MCAP can number, 65535");
  }
}

void McapWriter::write(ChannelId channel, std::uint64_t log_time, std::uint64_t publish_time, std::string_view json) {
  if (chunk_.empty()) chunk_begin_ = chunk_end_ = log_time;
  if (messages_ == 0) begin_ = end_ = log_time;
  chunk_begin_ = std::min(chunk_begin_, log_time);
  chunk_end_ = std::max(chunk_end_, log_time);
  begin_ = std::min(begin_, log_time);
  end_ = std::max(end_, log_time);
  const auto sequence = static_cast<std::uint32_t>(counts_[channel]++);
  ++messages_;
  chunk_index_[channel].emplace_back(log_time, chunk_.size());
  const std::string content = Fields().number(channel).number(sequence).number(log_time).number(publish_time).raw(json);
  chunk_ += static_cast<char>(kMessage);
  chunk_ += static_cast<const std::string&>(Fields().number(std::uint64_t{content.size()}));
  chunk_ += content;
  if (chunk_.size() >= kChunkBytes) write_chunk();
}

void McapWriter::write_chunk() {
  if (chunk_.empty()) return;
  ChunkIndex index{chunk_begin_, chunk_end_, position_, 0, {}, 0, chunk_.size()};
  put_record(kChunk, Fields()
                         .number(chunk_begin_)
                         .number(chunk_end_)
                         .number(std::uint64_t{chunk_.size()})
                         .number(std::uint32_t{0})
                         .text("")
                         .number(std::uint64_t{chunk_.size()})
                         .raw(chunk_));
  index.length = position_ - index.start;
  for (auto& [channel, entries] : chunk_index_) {
    std::sort(entries.begin(), entries.end());
    index.index_offsets[channel] = position_;
    put_record(kMessageIndex, Fields().number(channel).list(
                                  entries, [](Fields& f, const auto& e) { f.number(e.first).number(e.second); }));
  }
  index.index_length = position_ - index.start - index.length;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  chunk_index_.clear();
}

void McapWriter::close() {
  write_chunk();
  put_record(kDataEnd, Fields().number(std::uint32_t{0}));
  const std::uint64_t summary = position_;
  Fields offsets;
  std::string offset_records;
  const auto group = [&](Opcode opcode, const auto& items, const auto& content) {
    const std::uint64_t start = position_;
    for (const auto& item : items) put_record(opcode, content(item));
    if (position_ == start) return;
    const std::string record = Fields().number(std::uint8_t{opcode}).number(start).number(position_ - start);
    offset_records += static_cast<char>(kSummaryOffset);
    offset_records += static_cast<const std::string&>(Fields().number(std::uint64_t{record.size()}));
    offset_records += record;
  };
  const auto as_it_is = [](const std::string& content) -> const std::string& { return content; };
  group(kSchema, schemas_, as_it_is);
  group(kChannel, channels_, as_it_is);
  std::map<ChannelId, std::uint64_t> counts;
  for (std::size_t i = 0; i < counts_.size(); ++i) counts[static_cast<ChannelId>(i)] = counts_[i];
  const auto pairs = [](Fields& f, const auto& entry) { f.number(entry.first).number(entry.second); };
  const std::vector<std::string> statistics = {Fields()
                                                   .number(messages_)
                                                   .number(static_cast<std::uint16_t>(schemas_.size()))
                                                   .number(static_cast<std::uint32_t>(channels_.size()))
                                                   .number(std::uint32_t{0})
                                                   .number(std::uint32_t{0})
                                                   .number(static_cast<std::uint32_t>(chunks_.size()))
                                                   .number(begin_)
                                                   .number(end_)
                                                   .list(counts, pairs)};
  group(kStatistics, statistics, as_it_is);
  group(kChunkIndex, chunks_, [&](const ChunkIndex& c) -> std::string {
    return Fields()
        .number(c.begin)
        .number(c.end)
        .number(c.start)
        .number(c.length)
        .list(c.index_offsets, pairs)
        .number(c.index_length)
        .text("")
        .number(c.size)
        .number(c.size);
  });
  const std::uint64_t summary_offsets = position_;
  put(offset_records);
  put_record(kFooter, Fields().number(summary).number(summary_offsets).number(std::uint32_t{0}));
  put(kMagic);
  stream_.close();
  if (!stream_) throw DeviceError(file_.string() + ": cut short, is the disk full?");
  unfinished_.finish();
}

void McapWriter::put(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  position_ += bytes.size();
  if (!stream_) throw DeviceError(file_.string() + ": cut short, is the disk full?");
}

void McapWriter::put_record(std::uint8_t opcode, const std::string& content) {
  put(std::string(1, static_cast<char>(opcode)));
  put(Fields().number(std::uint64_t{content.size()}).operator const std::string&());
  put(content);
}

}  // namespace bodyschema
