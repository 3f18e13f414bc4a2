#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "bodyschema/imports/log_builder.hpp"
#include "bodyschema/imports/record_stream.hpp"

namespace bodyschema {

/// What a LeRobot data set holds (v2.0, v2.1, v3.0).
struct LerobotSet {
  std::string version;
  std::int64_t episodes = 0;          ///< how many there should be: 0 to episodes - 1
  std::vector<std::int64_t> present;  ///< those whose readings are there
  std::vector<std::string> columns;   ///< names of the readings in observation.state
  std::vector<std::string> cameras;   ///< keys of the pictures

  /// The record of import/read_lerobot.py. Throws as RecordStream.
  static LerobotSet read(ByteSource& records, const std::string& folder);
  /// The same for a folder, with Python. @param say  hears of Python packages that are set up
  static LerobotSet list(const std::filesystem::path& folder, const std::function<void(const std::string&)>& say);

  /// Key of each camera of the rig: as import.cameras says, the one whose last part is the camera's name, or the only
  /// one; "" for a camera of a pair without pictures. Throws ConfigurationError that lists them.
  [[nodiscard]] std::vector<std::string> cameras_of(const ImportTarget& target) const;
};

/// "all" or "1,3-5": numbers of episodes, ascending, each once. Throws ConfigurationError for what is neither and for a
/// number from `episodes` on.
std::vector<std::int64_t> parse_episodes(const std::string& text, std::int64_t episodes);

struct LerobotOptions {
  std::string episodes = "all";
  bool raw = false;              ///< pictures as they are, instead of as JPEG
  Microseconds recorded_at = 0;  ///< when the first episode began
};

struct LerobotImport {
  struct Log {
    std::filesystem::path file;
    ImportSummary summary;
  };
  std::vector<Log> logs;
  LeftOut episodes_left_out;

  /// For people.
  [[nodiscard]] std::string text() const;
};

/// Where episodes go: into logs of their own in a folder, or one behind another into one log.
struct LerobotOutput {
  std::filesystem::path path;
  bool one_log = false;
  /// A name that ends in .lcmlog or .log is one log, any other a folder.
  static LerobotOutput of(const std::filesystem::path& path);
  [[nodiscard]] std::filesystem::path log_of(std::int64_t episode) const;
};

/// Episodes of one log are this far apart.
inline constexpr Microseconds kEpisodeGap = 10'000'000;

/// Turns the records of import/read_lerobot.py into LCM logs. @param cameras  as LerobotSet::cameras_of
/// Throws as RecordStream; FileError of the first episode that cannot be used where none can.
LerobotImport import_lerobot_records(ByteSource& records, const std::string& folder, const LerobotSet& set,
                                     const std::vector<std::string>& cameras, const ImportTarget& target,
                                     const LerobotOptions& options, const LerobotOutput& out,
                                     const std::function<void(std::uint64_t done)>& progress = {});

/// Turns episodes of a LeRobot data set into LCM logs: readings by row, pictures by their stamps in the video. Absent
/// episodes, rows without a picture and pictures without a row are counted. Throws as import_lerobot_records, and
/// DeviceError where Python or its packages cannot be had.
LerobotImport import_lerobot(const std::filesystem::path& folder, const ImportTarget& target,
                             const LerobotOptions& options, const LerobotOutput& out,
                             const std::function<void(const std::string&)>& say,
                             const std::function<void(std::uint64_t done, std::uint64_t total)>& progress = {});

}  // namespace bodyschema
