#include "bodyschema/imports/stills.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <set>

#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/imports/csv_table.hpp"
#include "camera_check.hpp"
#include "picture_file.hpp"
#include "row_slopes.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostPictures = 1'000'000;

/// The number that a file's name ends in: 7 of "07.png" and "frame_0007.png".
std::optional<std::int64_t> number_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  const auto digits = stem.find_last_not_of("0123456789") + 1;  // npos + 1 is 0
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(stem.data() + digits, stem.data() + stem.size(), number);
  if (error != std::errc{} || digits == stem.size()) return std::nullopt;
  return number;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return text;
}

bool is_joint_column(const std::string& name) {
  return name != "posture" && name != "frame" && name != "time_s";
}

bool is_picture(const fs::path& file) {
  const std::string ending = lower_case(file.extension().string());
  return ending == ".png" || ending == ".jpg" || ending == ".jpeg" || ending == ".ppm" || ending == ".pgm";
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (entries.size() == kMostPictures) throw FileError(folder.string() + ": holds more than a million files");
    if (!at->path().filename().string().starts_with('.')) entries.push_back(at->path());
  }
  if (error) throw FileError(folder.string() + ": cannot be read: " + error.message());
  std::sort(entries.begin(), entries.end());
  return entries;
}

void list_pictures(const fs::path& folder, std::map<std::int64_t, fs::path>& pictures,
                   std::vector<std::string>& unnumbered) {
  for (const fs::path& file : entries_of(folder)) {
    if (!is_picture(file)) continue;
    const auto number = number_of(file);
    if (!number || !pictures.emplace(*number, file).second) unnumbered.push_back(file.string());
  }
}

/// Where pictures of a camera are: in a folder of its name, or in the one that is configured.
std::string folder_of(const std::string& camera, const std::map<std::string, std::string>& given) {
  const auto other = given.find(camera);
  return other != given.end() ? other->second : camera;
}

/// The same of each camera of the rig; empty where there is no such folder.
std::vector<std::string> folders_of(const ImportTarget& target, const std::map<std::string, std::string>& given,
                                    const std::map<std::string, std::map<std::int64_t, fs::path>>& there) {
  std::vector<std::string> folders;
  for (const CameraModel& camera : target.rig.cameras) {
    const std::string name = folder_of(camera.name, given);
    folders.push_back(there.contains(name) ? name : "");
  }
  return folders;
}

/// joints.csv, in which a spreadsheet may have begun the names of columns with a capital.
CsvTable read_joints(const fs::path& folder) {
  CsvTable table = CsvTable::read(folder / "joints.csv");
  for (std::string& name : table.names) {
    const std::string lower = lower_case(name);
    if (is_joint_column(lower) || lower == name) continue;
    if (table.find({lower.c_str()}) != CsvTable::kNone) {
      throw FileError(fmt::format("{}: columns '{}' and '{}'; expected one of them", table.file.string(), lower, name));
    }
    name = lower;
  }
  return table;
}

/// One row of joints.csv and its place in time.
struct Posture {
  const CsvTable::Row* row = nullptr;
  Microseconds utime = 0;
  std::optional<std::int64_t> number;
};

class StillsImport {
 public:
  StillsImport(const fs::path& folder, const ImportTarget& target, const StillsImportOptions& options,
               const fs::path& log)
      : target_(target), options_(options), folder_(StillsFolder::list(folder)), table_(read_joints(folder)),
        builder_(target, log) {}

  ImportSummary run(const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
    find_cameras();
    read_columns();
    read_postures();
    std::uint64_t done = 0;
    for (std::size_t i = 0; i < postures_.size(); ++i) {
      const Posture& posture = postures_[i];
      const bool any = has_picture(posture);
      if (posture.number && !any) {
        builder_.leave_out("postures", fmt::format("{}: no picture of posture {} in any camera",
                                                   table_.where(*posture.row), *posture.number));
      }
      if (moving_) {
        builder_.add_joints(posture.utime, posture.utime, joint_names_, joints_of(posture), velocities(i),
                            LogBuilder::Nan::kNoReading);
        if (any) add_pictures(posture);
      } else if (any) {
        hold(posture);
      }
      if (progress) progress(++done, postures_.size());
    }
    say_what_is_left();
    return builder_.finish();
  }

 private:
  /// A folder that the mapping names and that is not there is a slip of the pen.
  void check_folders(const char* kind, const std::map<std::string, std::string>& given,
                     const std::vector<std::string>& there) const {
    for (const auto& [camera, folder] : given) {
      if (there.empty() || std::find(there.begin(), there.end(), folder) != there.end()) continue;
      throw FileError(fmt::format("{}/{}: no folder '{}', which import.{}.{} names; expected {}",
                                  folder_.folder.string(), kind, folder,
                                  std::string(kind) == "images" ? "cameras" : kind, camera, fmt::join(there, " or ")));
    }
  }

  void check_columns() const {
    for (const auto& [column, rule] : target_.mapping.joints) {
      if (rule.joint.empty() || table_.find({column.c_str()}) != CsvTable::kNone) continue;
      throw FileError(fmt::format("{}: no column '{}', which import.joints says is joint '{}'; did you mean '{}'?",
                                  table_.file.string(), column, rule.joint, nearest_name(column, table_.names)));
    }
  }

  void find_cameras() {
    image_folders_ = folders_of(target_, target_.mapping.cameras, folder_.images);
    mask_folders_ = folders_of(target_, target_.mapping.masks, folder_.masks);
    std::vector<std::string> there;
    for (const auto& [name, pictures] : folder_.images) there.push_back(name);
    check_folders("images", target_.mapping.cameras, there);
    if (options_.masks) check_folders("masks", target_.mapping.masks, folder_.mask_folders());
    for (std::size_t c = 0; c < image_folders_.size(); ++c) {
      const std::string& camera = target_.rig.cameras[c].name;
      if (image_folders_[c].empty() && std::all_of(image_folders_.begin(), image_folders_.end(),
                                                   [](const auto& folder) { return folder.empty(); })) {
        throw FileError(
            fmt::format("{}/images: no folder of camera '{}'; it has {}. Which is it? import: {{cameras: {{{}: {}}}}}",
                        folder_.folder.string(), camera, fmt::join(there, ", "), camera, nearest_name(camera, there)));
      }
    }
    for (const std::string& name : there) {
      if (std::find(image_folders_.begin(), image_folders_.end(), name) == image_folders_.end()) {
        builder_.note(fmt::format("images/{} is not imported: no camera of the configuration has its pictures", name));
      }
    }
    for (std::size_t c = 0; c < image_folders_.size(); ++c) compare_with_camera_info(c);
  }

  /// What the folder itself says of its cameras, against what the configuration believes.
  void compare_with_camera_info(std::size_t c) {
    const auto file = folder_.camera_infos.find(image_folders_[c]);
    if (file == folder_.camera_infos.end()) return;
    try {
      const auto difference =
          camera_difference(target_.rig.cameras[c], CameraInfo::read(file->second), file->second.string());
      if (difference) builder_.note(*difference);
    } catch (const Error& error) {
      builder_.note(fmt::format("not compared with the configuration: {}", error.what()));
    }
  }

  void read_columns() {
    check_columns();
    number_column_ = table_.find({"posture", "frame"});
    time_column_ = table_.find({"time_s"});
    moving_ = time_column_ != CsvTable::kNone;
    for (std::size_t c = 0; c < table_.names.size(); ++c) {
      const std::string& name = table_.names[c];
      if (!is_joint_column(name)) continue;
      const bool joint = is_joint(name);
      if (!joint && hold_words(c)) continue;
      joint_columns_.push_back(c);
      joint_names_.push_back(name);
      is_joint_.push_back(joint);
    }
    if (joint_names_.empty()) throw FileError(table_.file.string() + ": no column of a joint");
  }

  /// Whether the robot or the mapping knows this column.
  [[nodiscard]] bool is_joint(const std::string& column) const {
    const auto rule = target_.mapping.joints.find(column);
    if (rule != target_.mapping.joints.end()) return !rule->second.joint.empty();
    return target_.robot->find_joint(column).has_value();
  }

  /// Whether a column holds words, as somebody's notes; says so.
  bool hold_words(std::size_t column) {
    const auto row = std::find_if(table_.rows.begin(), table_.rows.end(),
                                  [&](const CsvTable::Row& r) { return r.words.contains(column); });
    if (row == table_.rows.end()) return false;
    builder_.note(fmt::format("joints.csv: column '{}' is no joint and holds text ('{}'); it is not read",
                              table_.names[column], row->words.at(column)));
    return true;
  }

  /// Throws where a field that counts is empty or holds words.
  void check_fields(const CsvTable::Row& row) const {
    for (const std::size_t c : {number_column_, time_column_}) {
      if (row.words.contains(c)) throw table_.not_a_number(row, c);
    }
    for (std::size_t k = 0; k < joint_columns_.size(); ++k) {
      const std::size_t c = joint_columns_[k];
      if (!is_joint_[k] || !std::isnan(row.values[c])) continue;
      if (row.words.contains(c)) throw table_.not_a_number(row, c);
      if (moving_) continue;
      throw FileError(fmt::format("{}: no value in column '{}'", table_.where(row), table_.names[c]));
    }
  }

  /// The number of the first picture, where rows that have none are one for each picture, in order; otherwise 0.
  [[nodiscard]] std::int64_t first_number() const {
    std::set<std::int64_t> numbers;
    for (const auto& folder : image_folders_) {
      if (folder.empty()) continue;
      for (const auto& [number, file] : folder_.images.at(folder)) numbers.insert(number);
    }
    const bool one_each = numbers.size() == table_.rows.size() + table_.bad.count && !numbers.empty() &&
                          *numbers.rbegin() - *numbers.begin() + 1 == static_cast<std::int64_t>(numbers.size());
    return one_each ? *numbers.begin() : 0;
  }

  void read_postures() {
    LeftOut bad = table_.bad;
    const std::int64_t first = first_number();
    if (number_column_ == CsvTable::kNone) {
      builder_.note(fmt::format("joints.csv has no column 'posture': its rows belong to pictures {}, {}, ... in order",
                                first, first + 1));
    }
    std::set<std::int64_t> seen;
    for (const CsvTable::Row& row : table_.rows) {
      try {
        check_fields(row);
        Posture posture{&row, 0, std::nullopt};
        if (number_column_ == CsvTable::kNone) {
          posture.number = first + static_cast<std::int64_t>(row.place);
        } else if (const double number = row.values[number_column_]; !std::isnan(number)) {
          constexpr double kMostNumber = 1e15;
          if (number != std::floor(number) || number < 0.0 || number > kMostNumber) {
            throw FileError(fmt::format("{}: {} is no number of a posture", table_.where(row), number));
          }
          posture.number = static_cast<std::int64_t>(number);
        }
        if (posture.number && !seen.insert(*posture.number).second) {
          throw FileError(fmt::format("{}: posture {} comes a second time", table_.where(row), *posture.number));
        }
        if (moving_) {
          const double time_s = row.values[time_column_];
          if (!(time_s >= 0.0 && time_s <= seconds(kLatestStamp))) {
            throw FileError(fmt::format("{}: time_s is {}, expected seconds from 0 on", table_.where(row), time_s));
          }
          posture.utime = microseconds(time_s);
          if (!postures_.empty() && posture.utime <= postures_.back().utime) {
            throw FileError(fmt::format("{}: time_s is not after the row before", table_.where(row)));
          }
        } else {
          posture.utime = options_.recorded_at + static_cast<Microseconds>(postures_.size() + 1) * kStillPeriod;
        }
        postures_.push_back(posture);
      } catch (const FileError& error) {
        bad.add(error);
      }
    }
    bad.check(table_.rows.size() + table_.bad.count, "rows");
    for (std::uint64_t i = 0; i < bad.count; ++i) builder_.leave_out("rows", bad.first);
  }

  [[nodiscard]] bool has_picture(const Posture& posture) const {
    return posture.number && std::any_of(image_folders_.begin(), image_folders_.end(), [&](const auto& folder) {
             return !folder.empty() && folder_.images.at(folder).contains(*posture.number);
           });
  }

  [[nodiscard]] std::vector<double> joints_of(const Posture& posture) const {
    std::vector<double> values;
    for (const std::size_t c : joint_columns_) values.push_back(posture.row->values[c]);
    return values;
  }

  /// Of a moving recording.
  [[nodiscard]] std::vector<double> velocities(std::size_t i) const {
    return row_slopes(
        i, postures_.size(), joint_columns_.size(), [&](std::size_t r) { return postures_[r].utime; },
        [&](std::size_t r, std::size_t k) { return postures_[r].row->values[joint_columns_[k]]; });
  }

  void hold(const Posture& posture) {
    constexpr Microseconds kStep = 25'000;
    const auto values = joints_of(posture);
    for (Microseconds t = posture.utime - kStillHold; t <= posture.utime + kStillHold; t += kStep) {
      builder_.add_joints(t, t, joint_names_, values, {}, LogBuilder::Nan::kNoReading);
      if (t == posture.utime) add_pictures(posture);
    }
  }

  void add_pictures(const Posture& posture) {
    for (std::size_t c = 0; c < image_folders_.size(); ++c) {
      const fs::path* file = file_of(folder_.images, image_folders_[c], posture);
      if (file == nullptr) continue;
      const std::string what = "pictures of camera " + target_.rig.cameras[c].name;
      try {
        builder_.add_picture(posture.utime, c, posture.utime, read_picture_file(*file), file->string());
      } catch (const FileError& error) {
        builder_.leave_out(what, error.what());
      }
    }
    if (!options_.masks) return;
    for (std::size_t c = 0; c < mask_folders_.size(); ++c) {
      const fs::path* file = file_of(folder_.masks, mask_folders_[c], posture);
      if (file == nullptr || file_of(folder_.images, image_folders_[c], posture) == nullptr) continue;
      try {
        builder_.add_mask(posture.utime, c, posture.utime, read_mask_file(*file), file->string());
      } catch (const FileError& error) {
        builder_.leave_out("masks of camera " + target_.rig.cameras[c].name, error.what());
      }
    }
  }

  static const fs::path* file_of(const std::map<std::string, std::map<std::int64_t, fs::path>>& all,
                                 const std::string& folder, const Posture& posture) {
    if (folder.empty() || !posture.number) return nullptr;
    const auto& pictures = all.at(folder);
    const auto file = pictures.find(*posture.number);
    return file == pictures.end() ? nullptr : &file->second;
  }

  void say_what_is_left() {
    std::set<std::int64_t> postures;
    for (const Posture& posture : postures_) {
      if (posture.number) postures.insert(*posture.number);
    }
    for (std::size_t c = 0; c < image_folders_.size(); ++c) {
      if (image_folders_[c].empty()) continue;
      for (const auto& [number, file] : folder_.images.at(image_folders_[c])) {
        if (postures.contains(number)) continue;
        builder_.leave_out("pictures of camera " + target_.rig.cameras[c].name,
                           fmt::format("{}: joints.csv has no posture {}", file.string(), number));
      }
    }
    for (const std::string& file : folder_.unnumbered) {
      builder_.leave_out("files", file + ": its name ends in no number, or in that of another picture");
    }
    const bool has_masks = std::any_of(mask_folders_.begin(), mask_folders_.end(),
                                       [](const std::string& folder) { return !folder.empty(); });
    if (has_masks && !options_.masks) builder_.note("masks are there and are left out, as asked (--no-masks)");
    if (options_.masks) leave_out_lost_masks();
    for (const std::string& name : folder_.not_read)
      builder_.note(name + "/ is not read: nothing here makes use of it");
  }

  /// Masks that belong to no picture of a camera that is imported, or to no camera.
  void leave_out_lost_masks() {
    std::set<std::string> known;
    for (std::size_t c = 0; c < image_folders_.size(); ++c) {
      const std::string& camera = target_.rig.cameras[c].name;
      const std::string masks = folder_of(camera, target_.mapping.masks);
      known.insert(masks);
      if (image_folders_[c].empty()) continue;
      for (const std::string& why : folder_.masks_without_picture(masks, image_folders_[c])) {
        builder_.leave_out("masks of camera " + camera, why);
      }
    }
    for (const std::string& folder : folder_.mask_folders()) {
      if (known.contains(folder) || folder_.images.contains(folder)) continue;  // of a camera that is not imported
      for (const std::string& why : folder_.masks_without_picture(folder, folder)) {
        builder_.leave_out("masks of camera " + folder, why);
      }
    }
  }

  const ImportTarget& target_;
  StillsImportOptions options_;
  StillsFolder folder_;
  CsvTable table_;
  LogBuilder builder_;
  std::vector<std::string> image_folders_, mask_folders_;  ///< by camera; empty: none
  std::size_t number_column_ = CsvTable::kNone, time_column_ = CsvTable::kNone;
  std::vector<std::size_t> joint_columns_;
  std::vector<std::string> joint_names_;
  std::vector<bool> is_joint_;  ///< by joint column: of the robot or the mapping, not something else with numbers
  bool moving_ = false;
  std::vector<Posture> postures_;
};

}  // namespace

StillsFolder StillsFolder::list(const fs::path& folder) {
  if (!fs::is_directory(folder)) throw FileError(folder.string() + ": no such folder");
  StillsFolder found;
  found.folder = folder;
  if (!fs::is_directory(folder / "images")) {
    throw FileError(folder.string() + ": no folder 'images' in it; expected images/CAMERA/NN.png and joints.csv");
  }
  for (const char* kind : {"images", "masks"}) {
    auto& cameras = kind == std::string("images") ? found.images : found.masks;
    if (!fs::is_directory(folder / kind)) continue;
    for (const fs::path& camera : entries_of(folder / kind)) {
      if (!fs::is_directory(camera)) continue;
      std::map<std::int64_t, fs::path> pictures;
      std::vector<std::string> unnumbered;
      list_pictures(camera, pictures, unnumbered);
      if (!unnumbered.empty()) {
        if (&cameras == &found.masks) {
          found.unnumbered_masks[camera.filename().string()] = std::move(unnumbered);
        } else {
          found.unnumbered.insert(found.unnumbered.end(), unnumbered.begin(), unnumbered.end());
        }
      }
      if (!pictures.empty()) cameras[camera.filename().string()] = std::move(pictures);
    }
  }
  if (found.images.empty()) {
    throw FileError((folder / "images").string() + ": no pictures; expected images/CAMERA/NN.png");
  }
  if (fs::is_directory(folder / "camera_info")) {
    for (const fs::path& file : entries_of(folder / "camera_info")) {
      if (file.extension() == ".yaml" || file.extension() == ".yml") found.camera_infos[file.stem().string()] = file;
    }
  }
  for (const fs::path& other : entries_of(folder)) {
    const std::string name = other.filename().string();
    if (!fs::is_directory(other) || name == "images" || name == "masks" || name == "camera_info") continue;
    found.not_read.push_back(name);
  }
  return found;
}

std::vector<std::string> StillsFolder::mask_folders() const {
  std::set<std::string> names;
  for (const auto& [name, files] : masks) names.insert(name);
  for (const auto& [name, files] : unnumbered_masks) names.insert(name);
  return {names.begin(), names.end()};
}

std::vector<std::string> StillsFolder::masks_without_picture(const std::string& masks_of,
                                                             const std::string& images_of) const {
  std::vector<std::string> lost;
  const auto pictures = images.find(images_of);
  const auto expected = [&] {
    if (pictures != images.end()) {
      return fmt::format("expected the name of its picture, as {}",
                         pictures->second.begin()->second.filename().string());
    }
    std::vector<std::string> cameras;
    for (const auto& [name, files] : images) cameras.push_back(name);
    return fmt::format("no folder images/{}; expected the name of a camera's: {}", images_of, fmt::join(cameras, ", "));
  }();
  if (const auto files = unnumbered_masks.find(masks_of); files != unnumbered_masks.end()) {
    for (const std::string& file : files->second) {
      lost.push_back(fmt::format("{}: its name ends in no number, or in that of another mask; {}", file, expected));
    }
  }
  if (const auto files = masks.find(masks_of); files != masks.end()) {
    for (const auto& [number, file] : files->second) {
      if (pictures != images.end() && pictures->second.contains(number)) continue;
      lost.push_back(fmt::format("{}: mask of no picture; {}", file.string(), expected));
    }
  }
  return lost;
}

StillsColumns StillsColumns::read(const fs::path& folder) {
  const CsvTable table = read_joints(folder);
  StillsColumns columns;
  columns.rows = table.rows.size();
  columns.moving = table.find({"time_s"}) != CsvTable::kNone;
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    if (!is_joint_column(table.names[c])) continue;
    columns.names.push_back(table.names[c]);
    double& largest = columns.largest.emplace_back(0.0);
    LeftOut& words = columns.words.emplace_back();
    for (const auto& row : table.rows) {
      if (row.words.contains(c)) words.add(table.not_a_number(row, c));
      if (!std::isnan(row.values[c])) largest = std::max(largest, std::abs(row.values[c]));
    }
  }
  return columns;
}

PictureSize picture_size_in(const fs::path& file) {
  constexpr std::size_t kHeader = 1 << 20;  // a JPEG may begin with a small picture of itself
  std::ifstream in(file, std::ios::binary);
  if (!in) throw FileError(file.string() + ": picture cannot be opened");
  std::vector<std::uint8_t> bytes(kHeader);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  const auto size = picture_size(bytes);
  if (!size || size->width < 1 || size->height < 1) {
    throw FileError(file.string() + ": no picture; expected PNG, JPEG, PPM or PGM");
  }
  return *size;
}

ImportSummary import_stills(const fs::path& folder, const ImportTarget& target, const StillsImportOptions& options,
                            const fs::path& log, const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  return StillsImport(folder, target, options, log).run(progress);
}

}  // namespace bodyschema
