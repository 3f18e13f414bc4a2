#include "bodyschema/bus/yarp_import.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>
#include <string_view>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "picture_file.hpp"

namespace bodyschema {

namespace {

constexpr const char* kUnused = "-";
constexpr std::size_t kMaxLineBytes = 1 << 16;
constexpr std::uintmax_t kMaxDataBytes = 256u << 20;  // rows are kept; an hour of an arm at 100 Hz has some 50 MB

/// One line of a data.log: an encoder row or the name of a picture.
struct Line {
  std::uint64_t number = 0;
  Microseconds utime = 0;
  std::vector<double> values;
  std::string picture;
};

/// What of a folder is left out, and the error of the first.
struct Bad {
  std::uint64_t count = 0;
  std::string first;
  void add(const FileError& error) {
    if (count++ == 0) first = error.what();
  }
  /// Throws the first error where too many are bad.
  void check(std::uint64_t all, const char* what) const {
    if (static_cast<double>(count) <= kMostBadLines * static_cast<double>(all)) return;
    throw FileError(first + (count > 1 ? " (the first of " + std::to_string(count) + " bad " + what + " of " +
                                             std::to_string(all) + ")"
                                       : ""));
  }
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
  for (int c = 0; (c = in.get()) != std::char_traits<char>::eof();) {
    if (c == '\n') return true;
    if (line.size() <= kMaxLineBytes) line += static_cast<char>(c);
  }
  return !line.empty();
}

/// Whether two stamps stand before the values, sender's first: `Stamp: tx+rx;` in info.log.
bool says_two_stamps(const std::filesystem::path& folder) {
  std::ifstream info(folder / "info.log");
  std::string line;
  while (next_line(info, line) && line.size() <= kMaxLineBytes) {
    if (line.rfind("Stamp:", 0) == 0) {
      return line.find("tx") != std::string::npos && line.find("rx") != std::string::npos;
    }
  }
  return false;
}

std::optional<double> as_number(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// Whether the word behind the sender's stamp can only be the receiver's: info.log does not say so when the
/// sender's was forced (--txTime) on messages that had none, which then is 0.
bool is_second_stamp(const std::string& first, const std::string& second) {
  constexpr double kNoReading = 1000.0;  // deg; a clock shows more
  const auto tx = as_number(first), rx = as_number(second);
  return tx && rx && *rx > kNoReading && (*tx == 0.0 || std::abs(*rx - *tx) < 60.0);
}

/// YARP writes lists in parentheses, which carry nothing here.
std::vector<std::string> split(std::string text) {
  std::replace_if(text.begin(), text.end(), [](char c) { return c == '(' || c == ')' || c == '\r' || c == '\t'; }, ' ');
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = text.find_first_not_of(' ', at)) != std::string::npos;) {
    const std::size_t end = std::min(text.find(' ', at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end;
  }
  return words;
}

/// What one data.log holds.
class DataLog {
 public:
  /// @param encoders  null: a folder of pictures
  DataLog(const std::filesystem::path& folder, const std::string& key, const YarpImportOptions::Encoders* encoders)
      : file_(folder / "data.log"), key_(key), encoders_(encoders), two_stamps_(says_two_stamps(folder)) {
    std::ifstream in(file_);
    if (!in) throw FileError(file_.string() + ": cannot be opened");
    file_size_at_most(file_, kMaxDataBytes);
    if (encoders_ != nullptr) columns_ = usual_columns(in);
    std::string text;
    std::uint64_t lines = 0;
    for (std::uint64_t number = 1; next_line(in, text); ++number) {
      const bool too_long = text.size() > kMaxLineBytes;
      const auto words = split(std::move(text));
      if (words.empty()) continue;
      ++lines;
      try {
        if (too_long) {
          throw FileError(where(number) + ": line of more than " + std::to_string(kMaxLineBytes) + " bytes");
        }
        take(words, number);
      } catch (const FileError& error) {
        bad_.add(error);
      }
    }
    if (in.bad()) throw FileError(file_.string() + ": cannot be read");
    if (lines == 0) throw FileError(file_.string() + ": holds no data");
    bad_.check(lines, "lines");
  }

  [[nodiscard]] const std::vector<Line>& lines() const { return lines_; }
  [[nodiscard]] std::string where(std::uint64_t number) const { return file_.string() + ":" + std::to_string(number); }
  /// Of an encoder row.
  [[nodiscard]] std::size_t columns() const { return columns_; }
  [[nodiscard]] const Bad& bad() const { return bad_; }
  [[nodiscard]] std::uint64_t out_of_order() const { return out_of_order_; }

 private:
  /// All columns, or the fewest where most rows have just these. Leaves the file at its beginning.
  std::size_t usual_columns(std::istream& in) const {
    const std::size_t all = encoders_->columns.size(), fewest = encoders_->fewest;
    if (fewest == all) return all;
    std::size_t whole = 0, few = 0;
    for (std::string text; next_line(in, text);) {
      const auto words = split(std::move(text));
      whole += stamps_before(words, all) > 0;
      few += stamps_before(words, fewest) > 0;
    }
    in.clear();
    in.seekg(0);
    return few > whole ? fewest : all;
  }

  /// How many stamps stand before that many values; 0: it is no such row.
  [[nodiscard]] std::size_t stamps_before(const std::vector<std::string>& words, std::size_t values) const {
    if (words.size() == 3 + values && (two_stamps_ || is_second_stamp(words[1], words[2]))) return 2;
    return words.size() == 2 + values && !two_stamps_ ? 1 : 0;
  }

  void take(const std::vector<std::string>& words, std::uint64_t number) {
    if (words.size() < 3) throw FileError(where(number) + ": expected a counter, a time stamp and values");
    parse_number(words[0], where(number));
    Line line;
    line.number = number;
    std::size_t stamps = 1;
    if (encoders_ == nullptr) {
      stamps = words.size() > 3 && as_number(words[2]) ? 2 : 1;
      line.picture = words[1 + stamps];
    } else {
      stamps = stamps_before(words, columns_);
      if (stamps == 0) {
        (void)parse_stamp(words[1], where(number));
        throw FileError(where(number) + ": has " + std::to_string(words.size() - (two_stamps_ ? 3 : 2)) +
                        " values, expected " + std::to_string(columns_) + " (yarp_import." + key_ + ")");
      }
      for (std::size_t i = 1 + stamps; i < words.size(); ++i) {
        line.values.push_back(parse_number(words[i], where(number)));
      }
    }
    line.utime = parse_stamp(words[1], where(number));
    if (stamps == 2 && line.utime == 0) line.utime = parse_stamp(words[2], where(number));
    if (!lines_.empty() && line.utime <= lines_.back().utime) {
      if (out_of_order_++ == 0) {
        spdlog::warn("{}: stamp is not after the one before; such rows are left out", where(number));
      }
      return;
    }
    lines_.push_back(std::move(line));
  }

  std::filesystem::path file_;
  std::string key_;
  const YarpImportOptions::Encoders* encoders_;
  bool two_stamps_;
  std::size_t columns_ = 0;
  std::vector<Line> lines_;
  Bad bad_;
  std::uint64_t out_of_order_ = 0;
};

/// Folders of a recording that hold a data.log, for an error that names what is there.
std::string folders_of(const std::filesystem::path& recording) {
  constexpr int kDeepest = 5;
  constexpr std::size_t kMost = 12;
  std::vector<std::string> folders;
  std::error_code error;
  using Iterator = std::filesystem::recursive_directory_iterator;
  for (Iterator at(recording, error), end; !error && at != end && folders.size() <= kMost; at.increment(error)) {
    if (at.depth() >= kDeepest) at.disable_recursion_pending();
    if (at->path().filename() == "data.log") {
      folders.push_back(at->path().parent_path().lexically_relative(recording).generic_string());
    }
  }
  if (folders.empty()) return "no folder in it holds a data.log";
  std::sort(folders.begin(), folders.end());
  std::string text = "it holds ";
  for (std::size_t i = 0; i < std::min(folders.size(), kMost); ++i) text += (i > 0 ? ", " : "") + folders[i];
  return folders.size() > kMost ? text + " and more" : text;
}

DataLog read_folder(const std::filesystem::path& recording, const std::string& folder, const std::string& key,
                    const YarpImportOptions::Encoders* encoders) {
  if (!std::filesystem::is_directory(recording / folder)) {
    throw FileError((recording / folder).string() + ": no such folder in the recording (yarp_import." + key + "); " +
                    folders_of(recording));
  }
  return DataLog(recording / folder, key, encoders);
}

/// Encoder rows of one folder as joints in radians.
class EncoderRows {
 public:
  EncoderRows(const YarpImportOptions::Encoders& encoders, const YarpImportOptions& options,
              const DataLog& log)
      : columns_(log.columns()) {
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
      add(joint.joint, recipe);
    }
    for (std::size_t c = 0; c < encoders.columns.size(); ++c) {
      const std::string& name = encoders.columns[c];
      if (name == kUnused || combined.count(name) != 0) continue;
      add(name, {{c, unit}});
    }
    for (const Line& line : log.lines()) {
      std::vector<double>& row = rows_.emplace_back();
      for (const Recipe& recipe : recipes_) {
        double q = 0.0;
        for (const auto& [column, factor] : recipe) q += factor * line.values[column];
        row.push_back(q);
      }
      stamps_.push_back(line.utime);
      for (std::size_t c = 0; c < columns_; ++c) {
        if (encoders.columns[c] != kUnused) largest_ = std::max(largest_, std::abs(line.values[c]));
      }
    }
  }

  /// Joints whose columns the recording lacks.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }
  /// Of all columns in use, in the recording's unit.
  [[nodiscard]] double largest() const { return largest_; }
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

  void add(const std::string& joint, const Recipe& recipe) {
    const bool there = std::all_of(recipe.begin(), recipe.end(), [&](const Term& t) { return t.column < columns_; });
    if (!there) {
      missing_.push_back(joint);
      return;
    }
    names_.push_back(joint);
    recipes_.push_back(recipe);
  }

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

  std::size_t columns_;  ///< of the recording's rows
  double largest_ = 0.0;
  std::vector<std::string> missing_;
  std::vector<std::string> names_;
  std::vector<Recipe> recipes_;
  std::vector<Microseconds> stamps_;
  std::vector<std::vector<double>> rows_;
};

/// The pictures of one camera; files are opened one at a time.
struct Pictures {
  std::int16_t type = 0;
  std::filesystem::path folder;
  DataLog log;
  Bad bad{};
  int width = 0;
  int height = 0;
  std::string first_where{};

  [[nodiscard]] bot_core::images_t message(std::size_t i) {
    const Line& line = log.lines()[i];
    const std::string where = log.where(line.number);
    const std::string& name = line.picture;
    // A recording names files beside its data.log; anything else would reach out of it.
    if (name.find('/') != std::string::npos || name.find('\\') != std::string::npos || name.front() == '.') {
      throw FileError(where + ": '" + name + "' is not the name of a picture in this folder");
    }
    if (name.rfind("frame_", 0) == 0) {
      throw FileError(where + ": '" + name + "' is a frame of a video, which cannot be read; record with --type image, "
                      "image_png or image_jpg");
    }
    const auto file = folder / name;
    if (!std::filesystem::is_regular_file(file)) throw FileError(where + ": picture " + name + " is missing");
    const Image image = read_picture_file(file);
    if (width == 0) {
      width = image.width;
      height = image.height;
      first_where = where;
    } else if (image.width != width || image.height != height) {
      throw FileError(where + ": " + name + " is " + std::to_string(image.width) + "x" +
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

std::string list_of(const std::vector<std::string>& names, const std::string& between) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : between) + name;
  return text;
}

/// What becomes of joints that this recording has no column of.
std::string without_columns(const YarpImportOptions::Encoders& port, std::size_t columns,
                            const std::vector<std::string>& missing) {
  return port.folder + ": rows end before '" + port.columns[columns] + "' (" + std::to_string(columns) + " of " +
         std::to_string(port.columns.size()) +
         " columns); the log has no readings of these joints, give them their angles: robot: {fixed_joints_deg: {" +
         list_of(missing, ": 0, ") + ": 0}}";
}

/// Readings that are more likely of the other unit than of the one that is configured.
std::string doubtful_unit(const YarpImportOptions& options, double largest) {
  constexpr double kMostRadians = 3.3, kFewestDegrees = 7.0, kAtZero = 0.05;
  const std::string readings = "no encoder reading is beyond " + std::to_string(largest).substr(0, 4);
  if (options.encoders_in_degrees && largest > kAtZero && largest <= kMostRadians) {
    return readings + ": if these are radians, set yarp_import.encoder_unit: rad (it is deg)";
  }
  if (!options.encoders_in_degrees && largest > kFewestDegrees) {
    return "encoder readings go up to " + std::to_string(static_cast<long>(std::min(largest, 1e9))) +
           ": if these are degrees, set yarp_import.encoder_unit: deg (it is rad)";
  }
  return "";
}

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
  const Configuration optional = yarp_import.section("optional_from");
  for (const std::string& folder : encoders.keys()) {
    // Null or an empty list: an included file names it, the recording has it not.
    if (!encoders.has(folder) || encoders.texts(folder).empty()) continue;
    options.encoders.push_back({folder, encoders.texts(folder)});
    if (optional.has(folder)) {
      auto& port = options.encoders.back();
      const auto first = std::find(port.columns.begin(), port.columns.end(), optional.text(folder));
      if (first == port.columns.end() || first == port.columns.begin()) {
        optional.fail(folder, "a column of this folder, not its first; did you mean '" +
                                  nearest_name(optional.text(folder), port.columns) + "'?");
      }
      port.fewest = static_cast<std::size_t>(first - port.columns.begin());
    }
    for (const std::string& column : options.encoders.back().columns) {
      if (column == kUnused) continue;
      if (!folder_of_column.emplace(column, folder).second) encoders.fail(folder, "column '" + column + "' only once");
      columns.push_back(column);
    }
  }
  if (options.encoders.empty()) {
    yarp_import.fail("encoders", "folders of encoder ports with the name of each column");
  }
  (void)optional.keys();  // those of folders that are taken out again are known as well
  const Configuration combined = yarp_import.section("combined_joints");
  for (const std::string& joint : combined.keys()) {
    if (!combined.has(joint)) continue;  // null: taken out again
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
  const auto leave_out = [&](const Bad& bad, std::uint64_t& count) {
    if (bad.count > 0 && summary.first_bad.empty()) summary.first_bad = bad.first;
    count += bad.count;
  };
  std::vector<EncoderRows> encoders;
  double largest = 0.0;
  for (const auto& port : options.encoders) {
    const DataLog rows = read_folder(recording, port.folder, "encoders." + port.folder, &port);
    leave_out(rows.bad(), summary.bad_lines);
    summary.rows_out_of_order += rows.out_of_order();
    encoders.emplace_back(port, options, rows);
    summary.encoder_rows += encoders.back().size();
    largest = std::max(largest, encoders.back().largest());
    if (const auto& missing = encoders.back().missing(); !missing.empty()) {
      summary.warnings.push_back(without_columns(port, rows.columns(), missing));
    }
  }
  if (auto unit = doubtful_unit(options, largest); !unit.empty()) summary.warnings.push_back(std::move(unit));
  std::vector<Pictures> cameras;
  const auto add_camera = [&](std::int16_t type, const std::string& folder, const char* key) {
    if (folder.empty()) return;
    cameras.push_back({type, recording / folder, read_folder(recording, folder, key, nullptr)});
    leave_out(cameras.back().log.bad(), summary.bad_lines);
    summary.rows_out_of_order += cameras.back().log.out_of_order();
  };
  add_camera(bot_core::images_t::LEFT, options.left_images, "images.left");
  add_camera(bot_core::images_t::RIGHT, options.right_images, "images.right");

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
    for (std::size_t i = 0; i < cameras[c].log.lines().size(); ++i) {
      events.push_back({cameras[c].log.lines()[i].utime, encoders.size() + c, i});
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
        Pictures& camera = cameras[event.source - encoders.size()];
        try {
          writer.publish_message(channels.cameras, event.utime, camera.message(event.index));
          ++(camera.type == bot_core::images_t::LEFT ? summary.left_pictures : summary.right_pictures);
        } catch (const FileError& error) {
          camera.bad.add(error);
        }
      }
      if (progress) progress(++done, events.size());
    }
  }
  for (const Pictures& camera : cameras) {
    camera.bad.check(camera.log.lines().size(), "pictures");
    leave_out(camera.bad, summary.bad_pictures);
  }
  part.rename_to(log);
  return summary;
}

}  // namespace bodyschema
