#include "bodyschema/imports/lerobot.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "bodyschema/bus/messages.hpp"
#include "picture_file.hpp"
#include "python_reader.hpp"
#include "row_slopes.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLeRobotReader = "read_lerobot.py";
constexpr int kJpegQuality = 95;  // of pictures that a video codec has been through already
constexpr std::int64_t kMostEpisodes = 10'000'000;

/// One episode's readings.
struct Rows {
  std::vector<Microseconds> utime;
  std::vector<double> values;  ///< row by row
  std::size_t columns = 0;
  [[nodiscard]] std::span<const double> row(std::size_t i) const { return {values.data() + i * columns, columns}; }
};

/// Writes episodes as they come.
class Episodes {
 public:
  Episodes(const LerobotSet& set, const std::vector<std::string>& cameras, const ImportTarget& target,
           const LerobotOptions& options, const LerobotOutput& out)
      : set_(set), cameras_(cameras), target_(target), options_(options), out_(out) {}

  void take(Record& record) {
    const std::string& kind = record.kind();
    if (kind == "absent") return absent(record);
    if (kind == "episode") return begin(record);
    if (!builder_ || !in_episode_) return;
    if (kind == "frame" || kind == "compressed") return add_picture(record);
    if (kind == "broken") return broken(record);
    if (kind == "episode_end") return end();
  }

  LerobotImport finish() {
    if (builder_) close(out_.path);
    if (result_.logs.empty()) {
      if (result_.episodes_left_out.count == 0) throw FileError("no episode was asked for");
      throw FileError(
          result_.episodes_left_out.first +
          (result_.episodes_left_out.count > 1
               ? fmt::format(" (the first of {} episodes, none of which can be used)", result_.episodes_left_out.count)
               : ""));
    }
    return std::move(result_);
  }

 private:
  void absent(const Record& record) {
    result_.episodes_left_out.add(fmt::format("episode {}: {}", record.integer("episode"), record.text("message")));
  }

  void begin(const Record& record) {
    episode_ = record.integer("episode");
    const std::int64_t rows = record.integer("rows"), columns = record.integer("columns");
    constexpr std::int64_t kMost = 1 << 28;
    if (rows < 0 || columns < 0 || rows > kMost || columns > kMost ||
        columns != static_cast<std::int64_t>(set_.columns.size())) {
      throw FileError(
          fmt::format("episode {}: {} rows of {} readings, expected {}", episode_, rows, columns, set_.columns.size()));
    }
    const auto numbers = record.numbers(static_cast<std::size_t>(rows * (columns + 1)));
    rows_ = {};
    rows_.columns = static_cast<std::size_t>(columns);
    if (!builder_) {
      builder_.emplace(target_, out_.one_log ? out_.path : out_.log_of(episode_));
      base_ = options_.recorded_at + kEpisodeGap;
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows); ++i) {
      const double time_s = numbers[i];
      constexpr double kDay_s = 86400.0;
      if (!(time_s >= 0.0 && time_s <= kDay_s) ||
          (!rows_.utime.empty() && base_ + microseconds(time_s) <= rows_.utime.back())) {
        builder_->leave_out("rows", fmt::format("episode {}: row {} has stamp {} s, expected one after that before it",
                                                episode_, i, time_s));
        continue;
      }
      rows_.utime.push_back(base_ + microseconds(time_s));
      const auto from =
          numbers.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(rows) + i * rows_.columns);
      rows_.values.insert(rows_.values.end(), from, from + static_cast<std::ptrdiff_t>(rows_.columns));
    }
    next_row_ = 0;
    pictures_.assign(cameras_.size(), 0);
    in_episode_ = true;
  }

  /// Half the usual distance of two rows: a picture belongs to the row that is this near.
  [[nodiscard]] Microseconds half_step() const {
    const std::size_t n = rows_.utime.size();
    return n < 2 ? 0 : (rows_.utime.back() - rows_.utime.front()) / static_cast<Microseconds>(n - 1) / 2;
  }

  void add_rows_until(Microseconds utime) {
    for (; next_row_ < rows_.utime.size() && rows_.utime[next_row_] <= utime; ++next_row_) {
      const std::size_t i = next_row_;
      const auto slopes = row_slopes(
          i, rows_.utime.size(), rows_.columns, [&](std::size_t r) { return rows_.utime[r]; },
          [&](std::size_t r, std::size_t c) { return rows_.row(r)[c]; });
      try {
        builder_->add_joints(rows_.utime[i], rows_.utime[i], set_.columns, rows_.row(i), slopes);
      } catch (const FileError& error) {  // of the mapping, so of every row
        throw ConfigurationError(error.what());
      }
    }
  }

  void add_picture(Record& record) {
    const std::string key = record.text("camera");
    const auto c = static_cast<std::size_t>(std::find(cameras_.begin(), cameras_.end(), key) - cameras_.begin());
    if (c == cameras_.size() || key.empty()) return;
    const std::int64_t time_us = record.integer("time_us");
    const std::string where =
        fmt::format("episode {}, {} at {:.3f} s", episode_, key, 1e-6 * static_cast<double>(time_us));
    const std::string what = "pictures of camera " + target_.rig.cameras[c].name;
    constexpr std::int64_t kDay_us = 86'400'000'000;
    if (time_us < 0 || time_us > kDay_us) return builder_->leave_out(what, where + ": its stamp is none");
    const Microseconds utime = base_ + time_us;
    if (rows_.utime.empty() || utime > rows_.utime.back() + half_step()) {
      return builder_->leave_out(what, where + ": after the last row of readings");
    }
    add_rows_until(utime);
    ++pictures_[c];
    try {
      if (record.kind() == "compressed" && is_jpeg(record.payload)) {
        return builder_->add_jpeg(utime, c, utime, record.payload, where);
      }
      const Image image =
          record.kind() == "compressed" ? read_picture(record.payload, where) : pixels_of(record, where);
      if (options_.raw) return builder_->add_picture(utime, c, utime, image, where);
      builder_->add_jpeg(utime, c, utime, to_jpeg_message(image, utime, kJpegQuality).data, where);
    } catch (const FileError& error) {
      builder_->leave_out(what, error.what());
    }
  }

  static Image pixels_of(Record& record, const std::string& where) {
    const std::int64_t width = record.integer("width"), height = record.integer("height");
    if (width < 1 || height < 1 || width > kMaxSide_px || height > kMaxSide_px ||
        record.payload.size() != static_cast<std::size_t>(3 * width * height)) {
      throw FileError(fmt::format("{}: {} bytes for {}x{} px", where, record.payload.size(), width, height));
    }
    Image image;
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    image.channels = 3;
    image.data.swap(record.payload);
    return image;
  }

  void broken(const Record& record) {
    builder_->leave_out("videos",
                        fmt::format("episode {}, {}: {}", episode_, record.text("camera"), record.text("message")));
  }

  void end() {
    in_episode_ = false;
    if (!rows_.utime.empty()) add_rows_until(rows_.utime.back());
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (cameras_[c].empty() || pictures_[c] >= rows_.utime.size()) continue;
      const std::size_t missing = rows_.utime.size() - pictures_[c];
      for (std::size_t i = 0; i < missing; ++i) {
        builder_->leave_out("pictures that rows should have, camera " + target_.rig.cameras[c].name,
                            fmt::format("episode {} has {} rows and {} pictures in {}", episode_, rows_.utime.size(),
                                        pictures_[c], cameras_[c]));
      }
    }
    if (!rows_.utime.empty()) base_ = rows_.utime.back() + kEpisodeGap;
    if (!out_.one_log) close(out_.log_of(episode_));
  }

  void close(const fs::path& log) {
    try {
      result_.logs.push_back({log, builder_->finish()});
    } catch (const FileError& error) {
      result_.episodes_left_out.add(out_.one_log ? error.what()
                                                 : fmt::format("episode {}: {}", episode_, error.what()));
    }
    builder_.reset();
  }

  const LerobotSet& set_;
  const std::vector<std::string>& cameras_;
  const ImportTarget& target_;
  const LerobotOptions& options_;
  const LerobotOutput& out_;
  std::optional<LogBuilder> builder_;
  LerobotImport result_;
  std::int64_t episode_ = 0;
  bool in_episode_ = false;
  Rows rows_;
  std::size_t next_row_ = 0;
  std::vector<std::size_t> pictures_;  ///< of the episode, by camera
  Microseconds base_ = 0;              ///< where the episode's 0 s lie
};

}  // namespace

LerobotOutput LerobotOutput::of(const fs::path& path) {
  const bool log = path.extension() == ".lcmlog" || path.extension() == ".log";
  return {path, log && !fs::is_directory(path)};
}

fs::path LerobotOutput::log_of(std::int64_t episode) const {
  return path / fmt::format("episode_{:06d}.lcmlog", episode);
}

std::string LerobotImport::text() const {
  std::string out;
  for (const Log& log : logs) out += log.summary.text(log.file);
  out += fmt::format("{} log{} written", logs.size(), logs.size() == 1 ? "" : "s");
  if (episodes_left_out.count > 0) {
    out += episodes_left_out.count == 1
               ? "; 1 episode left out, " + episodes_left_out.first
               : fmt::format("; {} episodes left out, the first: {}", episodes_left_out.count, episodes_left_out.first);
  }
  return out + "\n";
}

std::vector<std::int64_t> parse_episodes(const std::string& text, std::int64_t episodes) {
  std::set<std::int64_t> all;
  const auto fail = [&] {
    throw ConfigurationError(fmt::format("--episodes {}: expected 'all' or numbers as 1,3-5, at most {}", text,
                                         std::max<std::int64_t>(episodes - 1, 0)));
  };
  if (text == "all") {
    for (std::int64_t i = 0; i < episodes; ++i) all.insert(i);
    return {all.begin(), all.end()};
  }
  const char *at = text.data(), *end = text.data() + text.size();
  const auto number = [&] {
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(at, end, value);
    if (error != std::errc{} || value < 0 || value >= episodes) fail();
    at = stop;
    return value;
  };
  do {
    const std::int64_t first = number();
    std::int64_t last = first;
    if (at != end && *at == '-') {
      ++at;
      last = number();
    }
    if (last < first || (at != end && (*at != ',' || at + 1 == end))) fail();
    for (std::int64_t i = first; i <= last; ++i) all.insert(i);
  } while (at != end && *at++ == ',');
  return {all.begin(), all.end()};
}

LerobotSet LerobotSet::read(ByteSource& records, const std::string& folder) {
  RecordStream stream(records, folder);
  Record record;
  std::optional<LerobotSet> set;
  while (stream.next(record)) {
    if (record.kind() != "dataset") continue;
    set.emplace();
    set->version = record.text("version");
    set->episodes = record.integer("episodes");
    set->present = record.integers("present");
    set->columns = record.texts("columns");
    set->cameras = record.texts("cameras");
  }
  if (!set || set->episodes < 0 || set->episodes > kMostEpisodes) {
    throw FileError(folder + ": its reader does not say what the data set holds");
  }
  return *set;
}

std::vector<std::string> LerobotSet::cameras_of(const ImportTarget& target) const {
  const auto fail = [&](const std::string& what) {
    throw ConfigurationError(fmt::format("{}; the data set has {}. Which is it? import: {{cameras: {{{}: {}}}}}", what,
                                         cameras.empty() ? "none" : fmt::format("{}", fmt::join(cameras, ", ")),
                                         target.rig.cameras.front().name, cameras.empty() ? "KEY" : cameras.front()));
  };
  std::vector<std::string> keys;
  for (const CameraModel& camera : target.rig.cameras) {
    const auto mapped = target.mapping.cameras.find(camera.name);
    if (mapped != target.mapping.cameras.end()) {
      if (std::find(cameras.begin(), cameras.end(), mapped->second) == cameras.end()) {
        fail(fmt::format("import.cameras.{} is '{}', no pictures of the data set", camera.name, mapped->second));
      }
      keys.push_back(mapped->second);
      continue;
    }
    const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const std::string& key) {
      return key == camera.name || key.ends_with("." + camera.name);
    });
    keys.push_back(found != cameras.end() ? *found : "");
  }
  if (keys.size() == 1 && keys[0].empty() && cameras.size() == 1) keys[0] = cameras[0];
  if (std::all_of(keys.begin(), keys.end(), [](const std::string& key) { return key.empty(); })) {
    fail(fmt::format("no pictures of camera '{}' by name", target.rig.cameras.front().name));
  }
  return keys;
}

LerobotImport import_lerobot_records(ByteSource& records, const std::string& folder, const LerobotSet& set,
                                     const std::vector<std::string>& cameras, const ImportTarget& target,
                                     const LerobotOptions& options, const LerobotOutput& out,
                                     const std::function<void(std::uint64_t)>& progress) {
  RecordStream stream(records, folder);
  Episodes episodes(set, cameras, target, options, out);
  Record record;
  std::uint64_t done = 0;
  while (stream.next(record)) {
    episodes.take(record);
    if (progress && (record.kind() == "episode_end" || record.kind() == "absent")) progress(++done);
  }
  return episodes.finish();
}

LerobotSet LerobotSet::list(const fs::path& folder, const std::function<void(const std::string&)>& say) {
  if (!fs::is_directory(folder)) throw FileError(folder.string() + ": no such folder");
  return read_with_python("lerobot", {kLeRobotReader, folder.string(), "list"}, folder.string(), say,
                          [&](ByteSource& records) { return LerobotSet::read(records, folder.string()); });
}

LerobotImport import_lerobot(const fs::path& folder, const ImportTarget& target, const LerobotOptions& options,
                             const LerobotOutput& out, const std::function<void(const std::string&)>& say,
                             const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  const LerobotSet set = LerobotSet::list(folder, say);
  const auto cameras = set.cameras_of(target);
  const auto episodes = parse_episodes(options.episodes, set.episodes);
  if (!out.one_log) make_folder(out.path);
  std::set<std::string> keys(cameras.begin(), cameras.end());
  keys.erase("");
  const nlohmann::json wanted = {{"episodes", episodes}, {"cameras", keys}};
  const auto count = [&](std::uint64_t done) {
    if (progress) progress(done, episodes.size());
  };
  return read_with_python("lerobot", {kLeRobotReader, folder.string(), "read", wanted.dump()}, folder.string(), say,
                          [&](ByteSource& records) {
                            return import_lerobot_records(records, folder.string(), set, cameras, target, options, out,
                                                          count);
                          });
}

}  // namespace bodyschema
