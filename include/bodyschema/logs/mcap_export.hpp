#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

namespace bodyschema {

struct McapExportOptions {
  std::filesystem::path log;
  std::filesystem::path out;
  int jpeg_quality = 90;  ///< of pictures that were not compressed already
  /// The robot's joints whose readings are m, not rad. A log itself does not say: without, all count as turning.
  std::set<std::string> sliding_joints = {};
};

struct McapExportSummary {
  std::map<std::string, std::uint64_t> messages;  ///< written, by topic
  std::uint64_t unreadable = 0;                   ///< messages and pictures left out because they do not decode
  std::uint64_t unknown = 0;                      ///< messages of types this project does not know, left out
  std::uint64_t bytes = 0;                        ///< of the file written
};

/// Rewrites a log as MCAP for Foxglove and PlotJuggler: joint states, offsets and status as JSON
/// with a schema (angles in degrees, of sliding joints m, by joint name), pictures as JPEG in
/// foxglove.CompressedImage.
/// A topic is "/" and the channel's name, with "/left" or "/right" for pictures. Log time is when a
/// message was recorded, publish time its own stamp. The file appears under its name when it is
/// complete. Throws FileError, also where `out` is the log itself, DataError when there is nothing to
/// write, DeviceError when the disk is full.
McapExportSummary export_mcap(const McapExportOptions& options);

}  // namespace bodyschema
