#include "bodyschema/imports/log_builder.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/core/picture_size.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kMostNames = 4096;        // of one message
constexpr std::size_t kMostSetsOfNames = 1000;  // different lists of names that are kept

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

/// Each missing joint's likely name in the recording, as a mapping has it; of the first alone, where one name would be
/// that of two joints.
std::vector<std::string> guessed_names(const std::vector<std::string>& missing, const std::vector<std::string>& names) {
  std::vector<std::string> rules;
  std::set<std::string> taken;
  for (const std::string& joint : missing) {
    const std::string name = nearest_name(joint, names);
    if (taken.insert(name).second) rules.push_back(name + ": " + joint);
  }
  if (rules.size() < missing.size()) rules.resize(1);
  return rules;
}

/// A robot comes in over one side of the picture or two; what surrounds it fills the border. All robot is no inverse.
bool looks_inverted(const Image& mask) {
  if (std::find(mask.data.begin(), mask.data.end(), kMaskBackground) == mask.data.end()) return false;
  std::size_t border = 0, robot = 0;
  for (int v = 0; v < mask.height; ++v) {
    const int step = v == 0 || v + 1 == mask.height ? 1 : std::max(1, mask.width - 1);
    for (int u = 0; u < mask.width; u += step) {
      ++border;
      robot += *mask.pixel(u, v) == kMaskRobot ? 1 : 0;
    }
  }
  return 2 * robot > border;
}

}  // namespace

void LeftOut::check(std::uint64_t all, const char* what) const {
  if (static_cast<double>(count) <= kMostBadLines * static_cast<double>(all)) return;
  throw FileError(first + (count > 1 ? " (the first of " + std::to_string(count) + " bad " + what + " of " +
                                           std::to_string(all) + ")"
                                     : ""));
}

bool ImportTarget::slides(const std::string& joint) const {
  const auto index = robot->find_joint(joint);
  return index && robot->joints()[static_cast<std::size_t>(*index)].slides;
}

ImportTarget ImportTarget::from(const Configuration& configuration, const std::filesystem::path& mapping) {
  ImportTarget target;
  const Configuration robot = configuration.section("robot"), cameras = configuration.section("cameras"),
                      bus = configuration.section("bus");
  Configuration import = configuration.section("import");
  target.setup = RobotSetup::from(robot);
  target.rig = StereoRig::from(cameras);
  target.bus = BusOptions::from(bus);
  target.mapping = JointMapping::from(import);
  configuration.reject_unknown_sections();
  robot.leave_to_others("tolerances");
  for (const Configuration& read : {robot, cameras, bus, import}) read.reject_unknown_keys();
  if (!mapping.empty()) {
    const Configuration file = Configuration::load(mapping);
    if (!file.has("import")) file.fail("import", "a section 'import'; docs/import_recordings.md explains it");
    import = file.section("import");
    target.mapping = JointMapping::from(import);
    file.reject_unknown_keys();
  }
  RobotSetup no_meshes = target.setup;  // their names still say which joints matter
  no_meshes.model.rendered_links.clear();
  target.robot = load_robot(no_meshes, target.rig);

  target.mapping.check_names(import, *target.robot, target.rig);
  return target;
}

std::string ImportSummary::text(const std::filesystem::path& log) const {
  std::string out = fmt::format("{}: {} joint messages of {} joints", log.string(), joint_messages, joints.size());
  for (const Camera& camera : cameras) {
    out += fmt::format(", {} pictures of camera {}", camera.pictures, camera.name);
    if (camera.masks > 0) out += fmt::format(" and {} masks", camera.masks);
  }
  out += fmt::format(", {:.1f} s\n", duration_s);
  for (const auto& [what, left] : left_out) {
    out += fmt::format("left out, {}: {}; {}{}\n", what, left.count, left.count == 1 ? "" : "the first: ", left.first);
  }
  if (!names_ignored.empty()) {
    out += fmt::format("not in the log, no joints of this robot: {}\n", fmt::join(names_ignored, ", "));
  }
  for (const std::string& sentence : notes) out += "note: " + sentence + "\n";
  return out;
}

LogBuilder::LogBuilder(const ImportTarget& target, const std::filesystem::path& log)
    : target_(target), channels_(target.bus.channels()), log_(log), unfinished_(log),
      writer_(std::make_unique<LogWriter>(unfinished_.part())),
      readings_(static_cast<std::size_t>(target.robot->joint_count()), 0), largest_(readings_.size(), 0.0),
      channels_of_(target.rig.cameras.size(), 0), inverted_(target.rig.cameras.size(), 0) {
  for (const CameraModel& camera : target.rig.cameras) summary_.cameras.push_back({camera.name, 0, 0});
}

LogBuilder::Column LogBuilder::column_of(const std::string& name) {
  const auto in_source = [&](const std::string& joint) {
    return target_.mapping.in_degrees && !target_.slides(joint) ? radians(1.0) : 1.0;
  };
  if (const auto rule = target_.mapping.joints.find(name); rule != target_.mapping.joints.end()) {
    if (rule->second.joint.empty()) return {};
    return {target_.robot->joint_index(rule->second.joint), rule->second.scale.value_or(in_source(rule->second.joint)),
            rule->second.offset};
  }
  if (const auto joint = target_.robot->find_joint(name)) return {*joint, in_source(name), 0.0};
  ignored_.insert(name);
  return {};
}

LogBuilder::Columns& LogBuilder::columns_of(std::span<const std::string> names) {
  for (Columns& known : columns_) {
    if (std::equal(names.begin(), names.end(), known.names.begin(), known.names.end())) return known;
  }
  if (columns_.size() == kMostSetsOfNames) columns_.erase(columns_.begin());
  Columns fresh;
  fresh.names.assign(names.begin(), names.end());
  for (const std::string& name : names) {
    Column column = column_of(name);
    const bool twice = column.joint >= 0 && std::any_of(fresh.columns.begin(), fresh.columns.end(),
                                                        [&](const Column& c) { return c.joint == column.joint; });
    if (twice) {
      throw FileError(fmt::format("'{}' is joint '{}', which another column of the same message is already", name,
                                  target_.robot->joints()[static_cast<std::size_t>(column.joint)].name));
    }
    fresh.columns.push_back(column);
  }
  columns_.push_back(std::move(fresh));
  return columns_.back();
}

bool LogBuilder::stamp_is_good(Microseconds utime, const std::string& what, const std::string& where) {
  if (utime >= 0 && utime <= kLatestStamp) return true;
  leave_out(what, fmt::format("{}: its stamp is {} us, expected 0 to {}", where, utime, kLatestStamp));
  return false;
}

void LogBuilder::note_stamp(Microseconds utime) {
  first_ = first_ < 0 ? utime : std::min(first_, utime);
  last_ = std::max(last_, utime);
}

void LogBuilder::add_joints(Microseconds arrival, Microseconds utime, std::span<const std::string> names,
                            std::span<const double> values, std::span<const double> velocities, Nan nan) {
  const bool fits = names.size() == values.size() && (velocities.empty() || velocities.size() == names.size());
  if (!fits || names.size() > kMostNames) {
    return leave_out("joint messages", fmt::format("{} names, {} positions and {} velocities", names.size(),
                                                   values.size(), velocities.size()));
  }
  if (!stamp_is_good(utime, "joint messages", "joint message")) return;
  Columns& columns = columns_of(names);
  bot_core::joint_state_t& message = columns.message;
  message.utime = utime;
  message.joint_name.clear();
  message.joint_position.clear();
  message.joint_velocity.clear();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Column& column = columns.columns[i];
    if (column.joint < 0 || (std::isnan(values[i]) && nan == Nan::kNoReading)) continue;
    const auto j = static_cast<std::size_t>(column.joint);
    const double q = column.scale * values[i] + column.offset;
    const double qdot = velocities.empty() || !std::isfinite(velocities[i]) ? 0.0 : column.scale * velocities[i];
    if (!std::isfinite(static_cast<float>(q)) || !std::isfinite(static_cast<float>(qdot))) {
      leave_out("readings", fmt::format("'{}' at {:.6f} s is {}, not a finite number", names[i], seconds(utime), q));
      continue;
    }
    message.joint_name.push_back(target_.robot->joints()[j].name);
    message.joint_position.push_back(static_cast<float>(q));
    message.joint_velocity.push_back(static_cast<float>(qdot));
    ++readings_[j];
    largest_[j] = std::max(largest_[j], std::abs(values[i]));
  }
  if (message.joint_name.empty()) return;
  message.num_joints = static_cast<std::int16_t>(message.joint_name.size());
  message.joint_effort.assign(message.joint_name.size(), 0.0F);
  writer_->publish_message(channels_.joint_state, arrival, message);
  ++summary_.joint_messages;
  note_stamp(utime);
}

void LogBuilder::write(const std::string& channel, Microseconds arrival, Microseconds utime, std::size_t camera,
                       bot_core::image_t picture) {
  bot_core::images_t message;
  message.utime = utime;
  message.n_images = 1;
  message.image_types = {static_cast<std::int16_t>(target_.rig.cameras[camera].number())};
  message.images.push_back(std::move(picture));
  writer_->publish_message(channel, arrival, message);
  note_stamp(utime);
}

void LogBuilder::add_picture(Microseconds arrival, std::size_t camera, Microseconds utime, const Image& picture,
                             const std::string& where) {
  const CameraModel& model = target_.rig.cameras[camera];
  const std::string what = "pictures of camera " + model.name;
  if (!stamp_is_good(utime, what, where)) return;
  if (picture.width != model.intrinsics.width || picture.height != model.intrinsics.height) {
    return leave_out(what, fmt::format("{} is {} px, the configuration has {} (cameras.{}.width, .height)", where,
                                       size_text(picture.width, picture.height),
                                       size_text(model.intrinsics.width, model.intrinsics.height), model.name));
  }
  if (channels_of_[camera] == 0) channels_of_[camera] = picture.channels;
  if (channels_of_[camera] != picture.channels) {
    return leave_out(
        what, fmt::format("{} is {}, those before it are not", where, picture.channels == 1 ? "gray" : "in colour"));
  }
  write(channels_.cameras, arrival, utime, camera, to_message(picture, utime));
  ++summary_.cameras[camera].pictures;
}

void LogBuilder::add_jpeg(Microseconds arrival, std::size_t camera, Microseconds utime, Bytes file,
                          const std::string& where) {
  const CameraModel& model = target_.rig.cameras[camera];
  const std::string what = "pictures of camera " + model.name;
  if (!stamp_is_good(utime, what, where)) return;
  const PictureSize size = picture_size(file).value_or(PictureSize{});
  if (size.width != model.intrinsics.width || size.height != model.intrinsics.height) {
    return leave_out(what, fmt::format("{} is {} px, the configuration has {} (cameras.{}.width, .height)", where,
                                       size_text(size.width, size.height),
                                       size_text(model.intrinsics.width, model.intrinsics.height), model.name));
  }
  bot_core::image_t picture;
  picture.utime = utime;
  picture.width = size.width;
  picture.height = size.height;
  picture.row_stride = 0;
  picture.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  picture.size = static_cast<std::int32_t>(file.size());
  picture.data.assign(file.begin(), file.end());
  picture.nmetadata = 0;
  write(channels_.cameras, arrival, utime, camera, std::move(picture));
  ++summary_.cameras[camera].pictures;
}

void LogBuilder::add_mask(Microseconds arrival, std::size_t camera, Microseconds utime, Image mask,
                          const std::string& where) {
  const CameraModel& model = target_.rig.cameras[camera];
  const std::string what = "masks of camera " + model.name;
  if (!stamp_is_good(utime, what, where)) return;
  if (mask.width != model.intrinsics.width || mask.height != model.intrinsics.height) {
    return leave_out(what, fmt::format("{} is {} px, its picture {} px", where, size_text(mask.width, mask.height),
                                       size_text(model.intrinsics.width, model.intrinsics.height)));
  }
  if (const DecodeResult good = to_mask(mask); !good.ok()) return leave_out(what, where + ": " + good.detail);
  write(channels_.masks, arrival, utime, camera, to_message(mask, utime));
  if (looks_inverted(mask)) ++inverted_[camera];
  ++summary_.cameras[camera].masks;
}

/// A joint that moves what is seen and has neither readings nor a configured value makes every picture useless.
void LogBuilder::check_joints() const {
  const auto idle = idle_joints(target_.robot, target_.setup, target_.rig);
  std::vector<std::string> missing;
  for (std::size_t j = 0; j < readings_.size(); ++j) {
    const std::string& name = target_.robot->joints()[j].name;
    if (readings_[j] > 0 || idle.contains(name) || target_.setup.fixed_joints_rad.contains(name) ||
        target_.setup.fixed_joints_m.contains(name)) {
      continue;
    }
    missing.push_back(name);
  }
  if (missing.empty()) return;
  std::string text = fmt::format("no readings of joint{} {}", missing.size() == 1 ? "" : "s", fmt::join(missing, ", "));
  if (!ignored_.empty()) {
    const std::vector<std::string> names(ignored_.begin(), ignored_.end());
    const auto guesses = guessed_names(missing, names);
    text += guesses.size() > 1
                ? "; are these their names in the recording?"
                : fmt::format("; is {} its name in the recording?", nearest_name(missing.front(), names));
    text += fmt::format(" Then say so: import: {{joints: {{{}}}}}", fmt::join(guesses, ", "));
    text += fmt::format(" (names that are no joints of this robot: {})", fmt::join(ignored_, ", "));
  }
  const bool slides = target_.slides(missing.front());
  throw FileError(log_.string() + ": not written: " + text +
                  fmt::format("; a joint that is not recorded needs a value: robot: {{{}: {{{}: 0}}}}",
                              slides ? "fixed_joints_m" : "fixed_joints_deg", missing.front()));
}

/// Readings that are more likely of the other unit than of the one that is configured.
void LogBuilder::doubt_unit() {
  constexpr double kMostRadians = 3.3, kFewestDegrees = 7.0, kAtZero = 0.05;
  double largest = 0.0;
  for (std::size_t j = 0; j < largest_.size(); ++j) {
    const std::string& name = target_.robot->joints()[j].name;
    const auto& rules = target_.mapping.joints;
    const bool scaled = std::any_of(rules.begin(), rules.end(), [&](const auto& rule) {
      return rule.second.joint == name && rule.second.scale.has_value();
    });
    if (!scaled && !target_.slides(name)) largest = std::max(largest, largest_[j]);
  }
  if (target_.mapping.in_degrees && largest > kAtZero && largest <= kMostRadians) {
    note(fmt::format("no reading is beyond {:.2f}: if these are radians, set import.unit: rad (it is deg)", largest));
  } else if (!target_.mapping.in_degrees && largest > kFewestDegrees) {
    note(fmt::format("readings go up to {:.4g}: if these are degrees, set import.unit: deg (it is rad)", largest));
  }
}

ImportSummary LogBuilder::finish() {
  std::uint64_t pictures = 0, masks = 0;
  for (const auto& camera : summary_.cameras) {
    pictures += camera.pictures;
    masks += camera.masks;
  }
  const auto first_picture_lost = std::find_if(summary_.left_out.begin(), summary_.left_out.end(), [](const auto& l) {
    return l.first.starts_with("pictures of camera ") || l.first == "videos";
  });
  if (pictures == 0) {
    throw FileError(log_.string() + ": not written: no picture of any camera" +
                    (first_picture_lost == summary_.left_out.end() ? "" : "; " + first_picture_lost->second.first));
  }
  const auto first_mask_lost = std::find_if(summary_.left_out.begin(), summary_.left_out.end(),
                                            [](const auto& l) { return l.first.starts_with("masks of camera "); });
  if (masks == 0 && first_mask_lost != summary_.left_out.end()) {
    throw FileError(log_.string() + ": not written: no mask can be used; " + first_mask_lost->second.first);
  }
  if (summary_.joint_messages == 0 && ignored_.empty()) {
    // All names that came are known, and none is a joint.
    throw FileError(log_.string() + ": not written: no joint readings" +
                    (columns_.empty() ? ""
                                      : fmt::format("; import.joints leaves out {}: say there which joint each is",
                                                    fmt::join(columns_.front().names, ", "))));
  }
  check_joints();
  doubt_unit();
  for (std::size_t c = 0; c < inverted_.size(); ++c) {
    const auto& camera = summary_.cameras[c];
    if (2 * inverted_[c] <= camera.masks) continue;
    note(
        fmt::format("in {} of {} masks of camera '{}' the robot fills most of the picture's border: are they "
                    "inverted? Expected 0 background, 255 robot",
                    inverted_[c], camera.masks, camera.name));
  }
  for (const auto& camera : summary_.cameras) {
    if (camera.pictures == 0) note("no picture of camera '" + camera.name + "'");
    if (camera.masks == 0 && masks > 0) note("no mask of camera '" + camera.name + "'");
  }
  for (std::size_t j = 0; j < readings_.size(); ++j) {
    if (readings_[j] > 0) summary_.joints.push_back(target_.robot->joints()[j].name);
  }
  summary_.names_ignored.assign(ignored_.begin(), ignored_.end());
  summary_.duration_s = seconds(last_ - first_);
  writer_.reset();
  unfinished_.finish();
  return summary_;
}

}  // namespace bodyschema
