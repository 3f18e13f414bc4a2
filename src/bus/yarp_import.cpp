#include "bodyschema/bus/yarp_import.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <set>
#include <string_view>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "netpbm.hpp"

namespace bodyschema {

namespace {

constexpr const char* kUnused = "-";
constexpr std::size_t kMaxLineBytes = 1 << 16;
constexpr std::uintmax_t kMaxDataBytes = 256u << 20;  // rows are kept; an hour of an arm at 100 Hz has some 50 MB

struct Line {
  std::string where;  ///< file:line, for errors
  Microseconds utime = 0;
  std::vector<std::string> values;
};

Microseconds parse_stamp(const std::string& text, const std::string& where) {
  double stamp_s = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), stamp_s);
  if (error != std::errc{} || end != text.data() + text.size() || !(stamp_s >= 0.0) || stamp_s > 9e9) {
    throw FileError(where + ": '" + text + "' is not a time stamp in seconds");
  }
  return microseconds(stamp_s);
}

double parse_number(const std::string& text, const std::string& where) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw FileError(where + ": '" + text + "' is not a number");
  }
  if (!std::isfinite(value)) throw FileError(where + ": '" + text + "' is not a finite number");
  return value;
}

/// The next line; of one that is too long, enough to see that it is.
bool next_line(std::istream& in, std::string& line) {
  line.clear();
  for (int c = 0; line.size() <= kMaxLineBytes && (c = in.get()) != std::char_traits<char>::eof();) {
    if (c == '\n') return true;
    line += static_cast<char>(c);
  }
  return !line.empty();
}

/// How many stamps stand before the values: `Stamp: tx; rx;` in info.log means two, sender's first.
int stamps_per_line(const std::filesystem::path& folder) {
  std::ifstream info(folder / "info.log");
  std::string line;
  while (next_line(info, line) && line.size() <= kMaxLineBytes) {
    if (line.rfind("Stamp:", 0) == 0) {
      return line.find("tx") != std::string::npos && line.find("rx") != std::string::npos ? 2 : 1;
    }
  }
  return 1;
}

/// The lines of one port's data.log: counter, stamps, values. YARP writes lists in parentheses,
/// which carry nothing here.
std::vector<Line> read_data_log(const std::filesystem::path& folder, const std::string& key, std::uint64_t& out_of_order) {
  if (!std::filesystem::is_directory(folder)) {
    throw FileError(folder.string() + ": no such folder in the recording (yarp_import." + key + ")");
  }
  const auto file = folder / "data.log";
  std::ifstream in(file);
  if (!in) throw FileError(file.string() + ": cannot be opened");
  file_size_at_most(file, kMaxDataBytes);
  const auto stamps = static_cast<std::size_t>(stamps_per_line(folder));
  std::vector<Line> lines;
  std::string text;
  std::uint64_t number = 0;
  while (next_line(in, text)) {
    Line line;
    line.where = file.string() + ":" + std::to_string(++number);
    if (text.size() > kMaxLineBytes) throw FileError(line.where + ": line of more than " + std::to_string(kMaxLineBytes) + " bytes");
    std::replace_if(text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == '\r' || c == '\t'; }, ' ');
    std::vector<std::string> words;
    for (std::size_t at = 0; (at = text.find_first_not_of(' ', at)) != std::string::npos;) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      words.push_back(text.substr(at, end - at));
      at = end;
    }
    if (words.empty()) continue;
    if (words.size() < 2 + stamps) throw FileError(line.where + ": expected a counter, a time stamp and values");
    parse_number(words[0], line.where);
    line.utime = parse_stamp(words[1], line.where);
    line.values.assign(words.begin() + 1 + static_cast<std::ptrdiff_t>(stamps), words.end());
    if (!lines.empty() && line.utime <= lines.back().utime) {
      if (out_of_order++ == 0) {
        spdlog::warn("{}: stamp is not after the one before; such rows are left out", line.where);
      }
      continue;
    }
    lines.push_back(std::move(line));
  }
  if (in.bad()) throw FileError(file.string() + ": cannot be read");
  if (lines.empty()) throw FileError(file.string() + ": holds no data");
  return lines;
}

/// Encoder rows of one folder as joints in radians.
class EncoderRows {
 public:
  EncoderRows(const YarpImportOptions::Encoders& encoders, const YarpImportOptions& options,
              const std::vector<Line>& lines) {
    const double unit = options.encoders_in_degrees ? radians(1.0) : 1.0;
    const auto column_of = [&](const std::string& name) {
      return std::find(encoders.columns.begin(), encoders.columns.end(), name) - encoders.columns.begin();
    };
    std::set<std::string> combined;
    for (const auto& joint : options.combined_joints) {
      Recipe recipe;
      for (const auto& [column, factor] : joint.factor_of_column) {
        combined.insert(column);
        if (const auto c = static_cast<std::size_t>(column_of(column)); c < encoders.columns.size()) {
          recipe.push_back({c, factor * unit});
        }
      }
      if (recipe.empty()) continue;  // of another folder
      names_.push_back(joint.joint);
      recipes_.push_back(recipe);
    }
    for (std::size_t c = 0; c < encoders.columns.size(); ++c) {
      const std::string& name = encoders.columns[c];
      if (name == kUnused || combined.count(name) != 0) continue;
      names_.push_back(name);
      recipes_.push_back({{c, unit}});
    }
    for (const Line& line : lines) {
      if (line.values.size() != encoders.columns.size()) {
        throw FileError(line.where + ": has " + std::to_string(line.values.size()) + " values, expected " +
                        std::to_string(encoders.columns.size()) + " (yarp_import.encoders." + encoders.folder + ")");
      }
      std::vector<double> values;
      for (const std::string& text : line.values) values.push_back(parse_number(text, line.where));
      std::vector<double>& row = rows_.emplace_back();
      for (const Recipe& recipe : recipes_) {
        double q = 0.0;
        for (const auto& [column, factor] : recipe) q += factor * values[column];
        row.push_back(q);
      }
      stamps_.push_back(line.utime);
    }
  }

  [[nodiscard]] std::size_t size() const { return rows_.size(); }
  [[nodiscard]] Microseconds stamp(std::size_t i) const { return stamps_[i]; }
  [[nodiscard]] bot_core::joint_state_t message(std::size_t i) const {
    const std::size_t before = i > 0 ? i - 1 : i;
    const std::size_t after = i + 1 < size() ? i + 1 : i;
    bot_core::joint_state_t m;
    m.utime = stamps_[i];
    m.num_joints = static_cast<std::int16_t>(names_.size());
    m.joint_name = names_;
    for (std::size_t j = 0; j < names_.size(); ++j) {
      m.joint_position.push_back(static_cast<float>(rows_[i][j]));
      m.joint_velocity.push_back(static_cast<float>(calmer(slope(before, i, j), slope(i, after, j))));
    }
    m.joint_effort.assign(names_.size(), 0.0F);
    return m;
  }

 private:
  struct Term {
    std::size_t column;
    double factor;
  };
  using Recipe = std::vector<Term>;

  [[nodiscard]] double slope(std::size_t from, std::size_t to, std::size_t joint) const {
    const double span_s = seconds(stamps_[to] - stamps_[from]);
    return span_s > 0.0 ? (rows_[to][joint] - rows_[from][joint]) / span_s : 0.0;
  }
  /// The smaller of two slopes, zero where they disagree about the direction: a jump from one hold
  /// to the next then leaves the velocity of both holds at zero.
  static double calmer(double a, double b) {
    if (a * b <= 0.0) return 0.0;
    return std::abs(a) < std::abs(b) ? a : b;
  }

  std::vector<std::string> names_;
  std::vector<Recipe> recipes_;
  std::vector<Microseconds> stamps_;
  std::vector<std::vector<double>> rows_;
};

/// The pictures of one camera; files are opened one at a time.
struct Pictures {
  std::int16_t type = 0;
  std::filesystem::path folder;
  std::vector<Line> lines;
  int width = 0;
  int height = 0;
  std::string first_where;

  [[nodiscard]] bot_core::images_t message(std::size_t i) {
    const Line& line = lines[i];
    const std::string& name = line.values[0];
    // A recording names files beside its data.log; anything else would reach out of it.
    if (name.find('/') != std::string::npos || name.find('\\') != std::string::npos || name.front() == '.') {
      throw FileError(line.where + ": '" + name + "' is not the name of a picture in this folder");
    }
    const auto file = folder / name;
    if (!std::filesystem::is_regular_file(file)) throw FileError(line.where + ": picture " + name + " is missing");
    const Image image = read_netpbm(file);
    if (width == 0) {
      width = image.width;
      height = image.height;
      first_where = line.where;
    } else if (image.width != width || image.height != height) {
      throw FileError(line.where + ": " + name + " is " + std::to_string(image.width) + "x" +
                      std::to_string(image.height) + " px, the pictures before it are " + std::to_string(width) + "x" +
                      std::to_string(height) + " px (" + first_where + ")");
    }
    bot_core::images_t m;
    m.utime = line.utime;
    m.n_images = 1;
    m.image_types = {type};
    m.images = {to_message(image, line.utime)};
    return m;
  }
};

/// Removes a half-written log unless told that it is whole.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path file) : file_(std::move(file)) {}
  ~TemporaryFile() {
    std::error_code ignored;
    if (!kept_) std::filesystem::remove(file_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return file_; }
  void rename_to(const std::filesystem::path& target) {
    std::error_code error;
    std::filesystem::rename(file_, target, error);
    if (error) throw FileError(target.string() + ": log cannot be created: " + error.message());
    kept_ = true;
  }

 private:
  std::filesystem::path file_;
  bool kept_ = false;
};

}  // namespace

YarpImportOptions YarpImportOptions::from(const Configuration& yarp_import) {
  YarpImportOptions options;
  const Configuration encoders = yarp_import.section("encoders");
  std::vector<std::string> columns;
  std::map<std::string, std::string> folder_of_column;
  for (const std::string& folder : encoders.keys()) {
    options.encoders.push_back({folder, encoders.texts(folder)});
    for (const std::string& column : options.encoders.back().columns) {
      if (column == kUnused) continue;
      if (!folder_of_column.emplace(column, folder).second) encoders.fail(folder, "column '" + column + "' only once");
      columns.push_back(column);
    }
  }
  if (options.encoders.empty()) {
    yarp_import.fail("encoders", "folders of encoder ports with the name of each column");
  }
  const Configuration combined = yarp_import.section("combined_joints");
  for (const std::string& joint : combined.keys()) {
    CombinedJoint entry{joint, {}};
    const Configuration factors = combined.section(joint);
    std::set<std::string> folders;
    for (const std::string& column : factors.keys()) {
      const auto folder = folder_of_column.find(column);
      if (folder == folder_of_column.end()) {
        combined.fail(joint, "names of columns; '" + column + "' is none, did you mean '" + nearest_name(column, columns) + "'?");
      }
      folders.insert(folder->second);
      entry.factor_of_column[column] = factors.number(column);
    }
    if (folders.size() != 1) combined.fail(joint, "columns of one folder, each with its factor");
    options.combined_joints.push_back(std::move(entry));
  }
  const Configuration images = yarp_import.section("images");
  options.left_images = images.text_or("left", "");
  options.right_images = images.text_or("right", "");
  if (options.left_images.empty() && options.right_images.empty()) {
    yarp_import.fail("images", "the folder of the left camera, the right camera, or both");
  }
  options.encoders_in_degrees = yarp_import.choice_or("encoder_unit", "deg", {"deg", "rad"}) == "deg";
  return options;
}

YarpImportSummary import_yarp(const std::filesystem::path& recording, const YarpImportOptions& options,
                              const Channels& channels, const std::filesystem::path& log,
                              const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  if (!std::filesystem::is_directory(recording)) throw FileError(recording.string() + ": no such recording (a folder is expected)");
  YarpImportSummary summary;
  std::vector<EncoderRows> encoders;
  for (const auto& port : options.encoders) {
    const auto lines = read_data_log(recording / port.folder, "encoders." + port.folder, summary.rows_out_of_order);
    encoders.emplace_back(port, options, lines);
    summary.encoder_rows += encoders.back().size();
  }
  std::vector<Pictures> cameras;
  const auto add_camera = [&](std::int16_t type, const std::string& folder, const char* key, std::uint64_t& count) {
    if (folder.empty()) return;
    Pictures pictures;
    pictures.type = type;
    pictures.folder = recording / folder;
    pictures.lines = read_data_log(pictures.folder, key, summary.rows_out_of_order);
    count = pictures.lines.size();
    cameras.push_back(std::move(pictures));
  };
  add_camera(bot_core::images_t::LEFT, options.left_images, "images.left", summary.left_pictures);
  add_camera(bot_core::images_t::RIGHT, options.right_images, "images.right", summary.right_pictures);

  struct Event {
    Microseconds utime;
    std::size_t source;  ///< encoders first, then cameras
    std::size_t index;
  };
  std::vector<Event> events;
  for (std::size_t s = 0; s < encoders.size(); ++s) {
    for (std::size_t i = 0; i < encoders[s].size(); ++i) events.push_back({encoders[s].stamp(i), s, i});
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    for (std::size_t i = 0; i < cameras[c].lines.size(); ++i) {
      events.push_back({cameras[c].lines[i].utime, encoders.size() + c, i});
    }
  }
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) { return a.utime < b.utime; });
  summary.duration_s = seconds(events.back().utime - events.front().utime);

  TemporaryFile part(log.string() + ".part");
  {
    LogWriter writer(part.path());
    std::uint64_t done = 0;
    for (const Event& event : events) {
      if (event.source < encoders.size()) {
        writer.publish_message(channels.joint_state, event.utime, encoders[event.source].message(event.index));
      } else {
        writer.publish_message(channels.cameras, event.utime, cameras[event.source - encoders.size()].message(event.index));
      }
      if (progress) progress(++done, events.size());
    }
  }
  part.rename_to(log);
  return summary;
}

}  // namespace bodyschema
