#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "bodyschema/core/write_file.hpp"

namespace bodyschema {

/// Writes an MCAP file (https://mcap.dev/spec): messages in uncompressed chunks of about 4 MB, each
/// with an index, and a summary at the end, so that readers can seek. Checksums are left at zero,
/// which the format defines as "not available". One thread.
///
/// Written here because Debian has no package of the official library, and Python's would need PyPI for every export.
/// The official reader reads it back in a test (test/install/mcap_reads_back.py).
class McapWriter {
 public:
  using SchemaId = std::uint16_t;
  using ChannelId = std::uint16_t;

  /// The file has its name from close() on. Throws FileError.
  explicit McapWriter(std::filesystem::path file);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  SchemaId add_schema(std::string_view name, std::string_view json_schema);
  /// JSON messages on a topic.
  ChannelId add_channel(std::string_view topic, SchemaId schema);
  /// Times in ns since the Unix epoch.
  void write(ChannelId channel, std::uint64_t log_time, std::uint64_t publish_time, std::string_view json);
  /// Completes the file and gives it its name. Throws DeviceError when the disk is full.
  void close();
  [[nodiscard]] std::uint64_t bytes_written() const { return position_; }

 private:
  /// Throws FileError where MCAP has no number left.
  void check_room(std::size_t id) const;
  /// Little-endian fields of one record.
  class Fields;
  struct ChunkIndex {
    std::uint64_t begin = 0, end = 0;     ///< message times
    std::uint64_t start = 0, length = 0;  ///< of the chunk record in the file
    std::map<ChannelId, std::uint64_t> index_offsets;
    std::uint64_t index_length = 0;
    std::uint64_t size = 0;
  };
  void put(std::string_view bytes);
  void put_record(std::uint8_t opcode, const std::string& content);
  void write_chunk();

  std::filesystem::path file_;
  UnfinishedFile unfinished_;
  std::ofstream stream_;
  std::uint64_t position_ = 0;
  std::vector<std::string> schemas_, channels_;  ///< contents of their records, by id
  std::string chunk_;
  std::uint64_t chunk_begin_ = 0, chunk_end_ = 0;
  std::map<ChannelId, std::vector<std::pair<std::uint64_t, std::uint64_t>>> chunk_index_;
  std::vector<ChunkIndex> chunks_;
  std::vector<std::uint64_t> counts_;
  std::uint64_t begin_ = 0, end_ = 0, messages_ = 0;
};

}  // namespace bodyschema
