#include "bodyschema/imports/ros_bag.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "bodyschema/camera/camera_info.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "camera_check.hpp"
#include "picture_file.hpp"
#include "python_reader.hpp"

namespace bodyschema {
namespace {

constexpr const char* kBagReader = "read_ros_bag.py";
constexpr std::size_t kMostTopics = 100'000;

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// "/zed/left_raw" as zed, left, raw.
std::set<std::string> words_of(const std::string& topic) {
  std::set<std::string> words;
  std::string word;
  for (const char c : lower(topic) + '/') {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      word += c;
    } else if (!word.empty()) {
      words.insert(std::exchange(word, ""));
    }
  }
  return words;
}

bool compressed_as_file(const std::string& format) {
  const std::string text = lower(format);
  return text.find("compresseddepth") == std::string::npos &&
         (text.find("jpeg") != std::string::npos || text.find("jpg") != std::string::npos ||
          text.find("png") != std::string::npos);
}

bool is_picture(const BagTopic& topic) {
  return topic.count > 0 && topic.broken.empty() &&
         ((topic.is("Image") && reads_ros_image(topic.picture)) ||
          (topic.is("CompressedImage") && compressed_as_file(topic.picture)));
}

/// Pictures of something else than what a camera saw, by the words of the name.
bool is_derived(const BagTopic& topic) {
  const auto words = words_of(topic.name);
  constexpr std::array<const char*, 7> kDerived = {"mask",      "masks",  "segmentation", "depth",
                                                   "disparity", "labels", "debug"};
  return std::any_of(kDerived.begin(), kDerived.end(), [&](const char* word) { return words.contains(word); });
}

std::string list_text(const std::vector<const BagTopic*>& topics) {
  std::string text;
  for (const BagTopic* topic : topics) text += "\n  " + topic->text();
  return text;
}

class Chooser {
 public:
  Chooser(const std::vector<BagTopic>& topics, const ImportTarget& target, const RosBagOptions& options)
      : topics_(topics), target_(target), options_(options) {}

  BagSelection choose() {
    choose_joints();
    for (const auto* given : {&options_.pictures, &options_.masks}) {
      for (const auto& [camera, topic] : *given) check_camera(camera, given == &options_.masks ? "masks" : "camera");
    }
    for (std::size_t c = 0; c < target_.rig.cameras.size(); ++c) {
      selection_.pictures.push_back(picture_of(target_.rig.cameras[c].name));
      selection_.masks.push_back(mask_of(target_.rig.cameras[c].name));
    }
    for (std::size_t c = 0; c < selection_.pictures.size(); ++c) {
      if (selection_.pictures[c].empty()) continue;
      for (std::size_t other = 0; other < c; ++other) {
        if (selection_.pictures[other] != selection_.pictures[c]) continue;
        throw ConfigurationError(fmt::format("topic {} is given for cameras '{}' and '{}'", selection_.pictures[c],
                                             target_.rig.cameras[other].name, target_.rig.cameras[c].name));
      }
    }
    for (const std::string& topic : selection_.pictures) selection_.infos.push_back(info_of(topic));
    say_of_masks();
    return selection_;
  }

 private:
  const BagTopic& named(const std::string& name, const std::string& option, std::initializer_list<const char*> types) {
    const auto found = std::find_if(topics_.begin(), topics_.end(), [&](const auto& t) { return t.name == name; });
    const auto fits = [&](const BagTopic& t) {
      return std::any_of(types.begin(), types.end(), [&](const char* type) { return t.is(type); });
    };
    if (found != topics_.end() && fits(*found)) return *found;
    std::vector<const BagTopic*> candidates;
    for (const BagTopic& t : topics_) {
      if (fits(t)) candidates.push_back(&t);
    }
    throw ConfigurationError(fmt::format("{} {}: {}; the bag has{}", option, name,
                                         found == topics_.end() ? "no such topic" : "a topic of " + found->type,
                                         candidates.empty() ? " none of that kind" : list_text(candidates)));
  }

  void choose_joints() {
    for (const std::string& name : options_.joints)
      selection_.joints.push_back(named(name, "--joints", {"JointState"}).name);
    if (!selection_.joints.empty()) return;
    std::vector<const BagTopic*> all, of_robot;
    for (const BagTopic& topic : topics_) {
      if (!topic.is("JointState") || topic.count == 0) continue;
      all.push_back(&topic);
      const bool any = std::any_of(topic.joints.begin(), topic.joints.end(), [&](const std::string& name) {
        return target_.mapping.joints.contains(name) || target_.robot->find_joint(name);
      });
      if (any) of_robot.push_back(&topic);
    }
    if (all.empty())
      throw ConfigurationError("the bag has no messages of sensor_msgs/JointState, so no joint readings");
    const auto& fitting = of_robot.empty() ? all : of_robot;
    if (fitting.size() > 1) {
      throw ConfigurationError(
          "several topics have joint readings. Which are the encoders? --joints TOPIC, repeated "
          "where each has some of the joints" +
          list_text(fitting));
    }
    selection_.joints.push_back(fitting.front()->name);
    if (all.size() > 1) selection_.notes.push_back("joints are taken from " + fitting.front()->name);
  }

  void check_camera(const std::string& camera, const std::string& kind) const {
    const auto& rig = target_.rig.cameras;
    if (std::any_of(rig.begin(), rig.end(), [&](const auto& c) { return c.name == camera; })) return;
    std::vector<std::string> names;
    for (const auto& c : rig) names.push_back(c.name);
    throw ConfigurationError(fmt::format("--{} {}=...: '{}' is no camera of the configuration, which has {}", kind,
                                         camera, camera, fmt::join(names, " and ")));
  }

  static const std::string* given(const std::string& camera, const std::map<std::string, std::string>& options,
                                  const std::map<std::string, std::string>& mapping) {
    if (const auto found = options.find(camera); found != options.end()) return &found->second;
    if (const auto found = mapping.find(camera); found != mapping.end()) return &found->second;
    return nullptr;
  }

  std::string picture_of(const std::string& camera) {
    const std::string option = "--camera " + camera + "=";
    if (const std::string* topic = given(camera, options_.pictures, target_.mapping.cameras)) {
      return named(*topic, option, {"Image", "CompressedImage"}).name;
    }
    std::vector<const BagTopic*> all, fitting;
    for (const BagTopic& topic : topics_) {
      if (is_picture(topic) && !is_derived(topic)) all.push_back(&topic);
    }
    for (const BagTopic* topic : all) {
      if (words_of(topic->name).contains(lower(camera))) fitting.push_back(topic);
    }
    const bool alone = target_.rig.cameras.size() == 1;
    if (fitting.empty() && alone) fitting = all;
    if (all.empty()) {
      std::vector<const BagTopic*> others;
      for (const BagTopic& topic : topics_) {
        if (topic.is("Image") || topic.is("CompressedImage")) others.push_back(&topic);
      }
      throw ConfigurationError("the bag has no pictures that can be read" +
                               (others.empty() ? "" : "; of their kind it has" + list_text(others)));
    }
    if (fitting.size() != 1) {
      throw ConfigurationError(fmt::format("{} the pictures of camera '{}'. Which are they? {}TOPIC{}",
                                           fitting.empty() ? "no topic is by its name" : "several topics may be",
                                           camera, option, list_text(fitting.empty() ? all : fitting)));
    }
    if (all.size() > 1) {
      selection_.notes.push_back(fmt::format("pictures of camera {} are taken from {}", camera, fitting.front()->name));
    }
    return fitting.front()->name;
  }

  std::string mask_of(const std::string& camera) {
    const std::string* topic = given(camera, options_.masks, target_.mapping.masks);
    return topic == nullptr ? "" : named(*topic, "--masks " + camera + "=", {"Image", "CompressedImage"}).name;
  }

  void say_of_masks() {
    const bool any =
        std::any_of(selection_.masks.begin(), selection_.masks.end(), [](const auto& t) { return !t.empty(); });
    for (const BagTopic& topic : topics_) {
      const auto words = words_of(topic.name);
      if (any || !is_picture(topic) || !(words.contains("mask") || words.contains("masks"))) continue;
      selection_.notes.push_back(fmt::format("{} is not imported; if these are masks of the robot: --masks CAMERA={}",
                                             topic.name, topic.name));
    }
  }

  /// The CameraInfo that belongs to these pictures: beside them, as ROS places it.
  std::string info_of(const std::string& picture) const {
    std::string folder = picture;
    for (int up = 0; up < 2 && !folder.empty(); ++up) {
      folder.erase(std::min(folder.rfind('/'), folder.size()));
      for (const BagTopic& topic : topics_) {
        if (topic.is("CameraInfo") && topic.name == folder + "/camera_info") return topic.name;
      }
    }
    return "";
  }

  const std::vector<BagTopic>& topics_;
  const ImportTarget& target_;
  const RosBagOptions& options_;
  BagSelection selection_;
};

/// Where tf has a camera, and what moves on the way there.
class Frames {
 public:
  void add(const Record& record) {
    const auto v = record.numbers(7);
    Edge edge{record.text("parent"), Pose::Identity(), record.boolean("moves")};
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); }) || q.norm() < 1e-6) return;
    edge.X_PC.linear() = q.normalized().toRotationMatrix();
    edge.X_PC.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
    parents_.emplace(record.text("child"), edge);
  }

  /// One sentence, or nothing where tf does not lead from the frame to a link of the robot.
  [[nodiscard]] std::optional<std::string> place_of(const std::string& frame, const CameraModel& camera,
                                                    const RobotModel& robot) const {
    Pose X = Pose::Identity();
    bool moves = false;
    std::string at = frame;
    constexpr int kMostSteps = 100;
    for (int step = 0; step < kMostSteps && !robot.has_link(at); ++step) {
      const auto edge = parents_.find(at);
      if (edge == parents_.end()) return std::nullopt;
      X = edge->second.X_PC * X;
      moves = moves || edge->second.moves;
      at = edge->second.parent;
    }
    if (!robot.has_link(at) || at == camera.link) return std::nullopt;
    std::string text = fmt::format("tf has camera '{}' ({}) on link '{}' at {}", camera.name, frame, at, pose_text(X));
    if (moves) text += " at first; it moves there";
    const CameraMount& mount = camera.mount;
    if (mount.knowledge == PlaceKnowledge::kUnknown) return text + "; it is configured as unknown, and stays so";
    if (mount.relative || mount.parent != at) return text + fmt::format("; it is configured on '{}'", mount.parent);
    const double apart_m = (X.translation() - mount.X_PC.translation()).norm();
    const double turned_deg = degrees(rotation_distance(X.linear(), mount.X_PC.linear()));
    constexpr double kSame_m = 1e-3, kSame_deg = 0.1;
    if (!moves && apart_m < kSame_m && turned_deg < kSame_deg) return std::nullopt;
    return text +
           fmt::format("; the configuration has it {:.0f} mm and {:.1f} deg from there", 1e3 * apart_m, turned_deg);
  }

 private:
  struct Edge {
    std::string parent;
    Pose X_PC = Pose::Identity();
    bool moves = false;
  };
  static std::string pose_text(const Pose& X) {
    const Eigen::Vector3d t = X.translation();
    const Eigen::Quaterniond q(X.linear());
    return fmt::format("xyz {:.4f} {:.4f} {:.4f} m, quaternion x y z w {:.5f} {:.5f} {:.5f} {:.5f}", t.x(), t.y(),
                       t.z(), q.x(), q.y(), q.z(), q.w());
  }
  std::map<std::string, Edge> parents_;
};

class BagImport {
 public:
  BagImport(const BagSelection& selection, const ImportTarget& target, const std::filesystem::path& log)
      : selection_(selection), target_(target), builder_(target, log) {
    for (const std::string& note : selection.notes) builder_.note(note);
    frames_of_.resize(target.rig.cameras.size());
  }

  void take(Record& record) {
    const std::string& kind = record.kind();
    if (kind == "joints") return take_joints(record);
    if (kind == "picture" || kind == "compressed") return take_picture(record);
    if (kind == "camera_info") return compare(record);
    if (kind == "transform") return frames_.add(record);
    if (kind == "note") return builder_.note(record.text("text"));
    if (kind == "broken") return builder_.leave_out("messages", record.text("topic") + ": " + record.text("message"));
  }

  ImportSummary finish() {
    for (std::size_t c = 0; c < frames_of_.size(); ++c) {
      const auto place = frames_.place_of(frames_of_[c], target_.rig.cameras[c], *target_.robot);
      if (place) builder_.note(*place);
    }
    if (unstamped_ > 0) {
      builder_.note(fmt::format("{} messages have no stamp (0): the time of their record is used", unstamped_));
    }
    constexpr double kOtherClock_s = 1.0;
    if (joints_late_s_ && pictures_late_s_ && std::abs(*joints_late_s_ - *pictures_late_s_) > kOtherClock_s) {
      builder_.note(
          fmt::format("joints were recorded {:.3f} s after their stamps, pictures {:.3f} s after theirs: "
                      "are they stamped by one clock?",
                      *joints_late_s_, *pictures_late_s_));
    }
    return builder_.finish();
  }

 private:
  struct Place {
    Microseconds arrival = 0, utime = 0;
  };
  Place place_of(const Record& record, std::optional<double>& late_s) {
    constexpr std::int64_t kNanoseconds = 1000;
    const std::int64_t arrival = record.integer("arrival_ns"), stamp = record.integer("stamp_ns");
    Place place{std::max<std::int64_t>(arrival, 0) / kNanoseconds, stamp / kNanoseconds};
    if (stamp < 0) place.utime = -1;  // refused by name
    if (stamp == 0) {
      ++unstamped_;
      place.utime = place.arrival;
    }
    if (!late_s) late_s = seconds(place.arrival) - seconds(place.utime);
    return place;
  }

  void take_joints(const Record& record) {
    const auto names = record.texts("names");
    const std::int64_t positions = record.integer("positions"), velocities = record.integer("velocities");
    const auto count = static_cast<std::int64_t>(names.size());
    if (positions != count) {
      return builder_.leave_out("joint messages", fmt::format("{}: {} names and {} positions", record.text("topic"),
                                                              names.size(), positions));
    }
    const auto values = record.numbers(names.size() + (velocities == count ? names.size() : 0));
    const auto place = place_of(record, joints_late_s_);
    const std::span<const double> all(values);
    builder_.add_joints(place.arrival, place.utime, names, all.first(names.size()), all.subspan(names.size()));
  }

  void take_picture(Record& record) {
    const std::string topic = record.text("topic");
    const auto place = place_of(record, pictures_late_s_);
    const std::string where = fmt::format("{} at {:.6f} s", topic, seconds(place.utime));
    for (std::size_t c = 0; c < frames_of_.size(); ++c) {
      const bool picture = selection_.pictures[c] == topic, mask = selection_.masks[c] == topic;
      if (!picture && !mask) continue;
      const char* what = mask ? "masks of camera " : "pictures of camera ";
      try {
        if (picture && frames_of_[c].empty()) frames_of_[c] = record.text("frame");
        if (picture && record.kind() == "compressed" && is_jpeg(record.payload)) {
          builder_.add_jpeg(place.arrival, c, place.utime, record.payload, where);
          continue;
        }
        Image image = record.kind() == "compressed"
                          ? read_picture(record.payload, where)
                          : decode_ros_image(record.text("encoding"), record.integer("width"), record.integer("height"),
                                             record.integer("step"), record.payload, where);
        if (picture) builder_.add_picture(place.arrival, c, place.utime, image, where);
        if (mask) builder_.add_mask(place.arrival, c, place.utime, std::move(image), where);
      } catch (const FileError& error) {
        builder_.leave_out(what + target_.rig.cameras[c].name, error.what());
      }
    }
  }

  void compare(const Record& record) {
    const std::string topic = record.text("topic");
    if (const int messages = ++compared_[topic]; messages > 1) {
      if (messages > 2) return;
      builder_.note(topic + " changes within the bag; its first message was compared with the configuration");
      return;
    }
    for (std::size_t c = 0; c < selection_.infos.size(); ++c) {
      if (selection_.infos[c] != topic) continue;
      try {
        const CameraInfo info = CameraInfo::from(Configuration::parse(record.json("info")), topic);
        if (const auto difference = camera_difference(target_.rig.cameras[c], info, topic)) builder_.note(*difference);
      } catch (const Error& error) {
        builder_.note(fmt::format("{} was not compared with the configuration: {}", topic, error.what()));
      }
    }
  }

  const BagSelection& selection_;
  const ImportTarget& target_;
  LogBuilder builder_;
  Frames frames_;
  std::vector<std::string> frames_of_;                     ///< of each camera's pictures
  std::map<std::string, int> compared_;                    ///< messages of each topic that says how a camera is built
  std::optional<double> joints_late_s_, pictures_late_s_;  ///< of the first, from its stamp to its record
  std::uint64_t unstamped_ = 0;
};

}  // namespace

bool BagTopic::is(const char* short_type) const {
  return type.ends_with(std::string("/") + short_type);
}

std::string BagTopic::text() const {
  std::string line = fmt::format("{}  {}, {} messages", name, type, count);
  if (width > 0) line += fmt::format(", {}x{}", width, height);
  if (!picture.empty()) line += ", " + picture;
  if (!joints.empty()) {
    constexpr std::size_t kMost = 8;
    line += fmt::format(
        ", {}{}",
        fmt::join(joints.begin(), joints.begin() + static_cast<std::ptrdiff_t>(std::min(joints.size(), kMost)), " "),
        joints.size() > kMost ? " ..." : "");
  }
  if (!broken.empty()) line += ", cannot be read: " + broken;
  return line;
}

BagSelection BagSelection::choose(const std::vector<BagTopic>& topics, const ImportTarget& target,
                                  const RosBagOptions& options) {
  return Chooser(topics, target, options).choose();
}

std::string camera_info_file_name(const std::string& topic) {
  std::string name = topic;
  constexpr std::string_view kEnding = "/camera_info";
  if (name.ends_with(kEnding)) name.erase(name.size() - kEnding.size());
  name.erase(0, std::min(name.find_first_not_of('/'), name.size()));
  for (char& c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return (name.empty() ? "camera" : name) + ".yaml";
}

std::vector<BagTopic> read_bag_topics(ByteSource& records, const std::string& bag) {
  RecordStream stream(records, bag);
  std::vector<BagTopic> topics;
  Record record;
  while (stream.next(record)) {
    if (record.kind() != "topic") continue;
    if (topics.size() == kMostTopics) throw FileError(bag + ": more than " + std::to_string(kMostTopics) + " topics");
    BagTopic topic;
    topic.name = record.text("topic");
    topic.type = record.text("type");
    topic.count = record.integer("count");
    if (record.has("names")) topic.joints = record.texts("names");
    if (record.has("encoding")) topic.picture = record.text("encoding");
    if (record.has("format")) topic.picture = record.text("format");
    if (record.has("width"))
      topic.width = static_cast<int>(std::clamp<std::int64_t>(record.integer("width"), 0, 1 << 30));
    if (record.has("height"))
      topic.height = static_cast<int>(std::clamp<std::int64_t>(record.integer("height"), 0, 1 << 30));
    if (record.has("info")) topic.camera_info = record.json("info");
    if (record.has("broken")) topic.broken = record.text("broken");
    topics.push_back(std::move(topic));
  }
  return topics;
}

ImportSummary import_bag_records(ByteSource& records, const std::string& bag, const BagSelection& selection,
                                 const ImportTarget& target, const std::filesystem::path& log,
                                 const std::function<void(std::uint64_t)>& progress) {
  RecordStream stream(records, bag);
  BagImport import(selection, target, log);
  Record record;
  for (std::uint64_t done = 1; stream.next(record); ++done) {
    import.take(record);
    if (progress) progress(done);
  }
  return import.finish();
}

std::vector<BagTopic> list_bag(const std::filesystem::path& bag, const std::function<void(const std::string&)>& say) {
  if (!std::filesystem::exists(bag)) throw FileError(bag.string() + ": no such bag");
  return read_with_python("ros-bag", {kBagReader, bag.string(), "list"}, bag.string(), say,
                          [&](ByteSource& records) { return read_bag_topics(records, bag.string()); });
}

ImportSummary import_ros_bag(const std::filesystem::path& bag, const ImportTarget& target, const RosBagOptions& options,
                             const std::filesystem::path& log, const std::function<void(const std::string&)>& say,
                             const std::function<void(std::uint64_t, std::uint64_t)>& progress) {
  const auto topics = list_bag(bag, say);
  const BagSelection selection = BagSelection::choose(topics, target, options);
  std::set<std::string> pictures;
  for (const auto* list : {&selection.pictures, &selection.masks}) pictures.insert(list->begin(), list->end());
  std::set<std::string> infos(selection.infos.begin(), selection.infos.end());
  pictures.erase("");
  infos.erase("");
  const nlohmann::json wanted = {{"joints", selection.joints}, {"pictures", pictures}, {"infos", infos}};
  std::uint64_t total = 0;
  for (const BagTopic& topic : topics) {
    const bool read = pictures.contains(topic.name) ||
                      std::find(selection.joints.begin(), selection.joints.end(), topic.name) != selection.joints.end();
    if (read) total += static_cast<std::uint64_t>(std::max<std::int64_t>(topic.count, 0));
  }
  const auto bounded = [&](std::uint64_t done) {
    if (progress) progress(std::min(done, total), total);
  };
  return read_with_python(
      "ros-bag", {kBagReader, bag.string(), "read", wanted.dump()}, bag.string(), say,
      [&](ByteSource& records) { return import_bag_records(records, bag.string(), selection, target, log, bounded); });
}

}  // namespace bodyschema
