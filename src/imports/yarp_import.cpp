#include "bodyschema/imports/yarp_import.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "picture_file.hpp"
#include "yarp_data_log.hpp"

namespace bodyschema {

namespace {

/// Encoder rows of one folder as joints in radians.
class EncoderRows {
 public:
  EncoderRows(const YarpImportOptions::Encoders& encoders, const YarpImportOptions& options, const YarpDataLog& log)
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
      if (name == JointMapping::kUnused || combined.count(name) != 0) continue;
      add(name, {{c, unit}});
    }
    for (const YarpLine& line : log.lines()) {
      std::vector<double>& row = rows_.emplace_back();
      for (const Recipe& recipe : recipes_) {
        double q = 0.0;
        for (const auto& [column, factor] : recipe) q += factor * line.values[column];
        row.push_back(q);
      }
      stamps_.push_back(line.utime);
      for (std::size_t c = 0; c < columns_; ++c) {
        if (encoders.columns[c] != JointMapping::kUnused) largest_ = std::max(largest_, std::abs(line.values[c]));
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
  YarpDataLog log;
  LeftOut bad{};
  int width = 0;
  int height = 0;
  std::string first_where{};

  [[nodiscard]] bot_core::images_t message(std::size_t i) {
    const YarpLine& line = log.lines()[i];
    const std::string where = log.where(line.number);
    const std::string& name = line.picture;
    // A recording names files beside its data.log; anything else would reach out of it.
    if (name.find('/') != std::string::npos || name.find('\\') != std::string::npos || name.front() == '.') {
      throw FileError(where + ": '" + name + "' is not the name of a picture in this folder");
    }
    if (name.rfind("frame_", 0) == 0) {
      throw FileError(where + ": '" + name +
                      "' is a frame of a video, which cannot be read; record with --type image, "
                      "image_png or image_jpg");
    }
    const auto file = folder / name;
    std::error_code unreadable;  // a name of more than 255 bytes, for one
    if (!std::filesystem::is_regular_file(file, unreadable)) {
      throw FileError(where + ": picture " + name + " is missing");
    }
    const Image image = read_picture_file(file);
    if (width == 0) {
      width = image.width;
      height = image.height;
      first_where = where;
    } else if (image.width != width || image.height != height) {
      throw FileError(where + ": " + name + " is " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                      " px, the pictures before it are " + std::to_string(width) + "x" + std::to_string(height) +
                      " px (" + first_where + ")");
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
      if (column == JointMapping::kUnused) continue;
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
        combined.fail(
            joint, "names of columns; '" + column + "' is none, did you mean '" + nearest_name(column, columns) + "'?");
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
  if (!std::filesystem::is_directory(recording))
    throw FileError(recording.string() + ": no such recording (a folder is expected)");
  YarpImportSummary summary;
  const auto leave_out = [&](const LeftOut& bad, std::uint64_t& count) {
    if (bad.count > 0 && summary.first_bad.empty()) summary.first_bad = bad.first;
    count += bad.count;
  };
  std::vector<EncoderRows> encoders;
  double largest = 0.0;
  for (const auto& port : options.encoders) {
    const YarpDataLog rows(recording, port.folder, "encoders." + port.folder, &port);
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
    cameras.push_back({type, recording / folder, YarpDataLog(recording, folder, key, nullptr)});
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

  UnfinishedFile unfinished(log);
  {
    LogWriter writer(unfinished.part());
    std::uint64_t done = 0;
    for (const Event& event : events) {
      if (event.source < encoders.size()) {
        writer.publish_message(channels.joint_state, event.utime, encoders[event.source].message(event.index));
      } else {
        Pictures& camera = cameras[event.source - encoders.size()];
        try {
          writer.publish_message(channels.cameras, event.utime, camera.message(event.index));
          ++(camera.type == bot_core::images_t::LEFT ? summary.left_pictures : summary.right_pictures);
        } catch (const DeviceError&) {  // of the log that is written
          throw;
        } catch (const Error& error) {
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
  unfinished.finish();
  return summary;
}

}  // namespace bodyschema
