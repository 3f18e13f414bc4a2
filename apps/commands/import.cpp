#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <spdlog/fmt/fmt.h>

#include "../common_options.hpp"
#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/imports/camera_pose_file.hpp"
#include "bodyschema/imports/lerobot.hpp"
#include "bodyschema/imports/ros_bag.hpp"
#include "bodyschema/imports/stills.hpp"
#include "bodyschema/imports/yarp_import.hpp"
#include "commands.hpp"

namespace bodyschema::apps {
namespace {

/// What every kind of import is told.
struct Source {
  std::string recording;
  std::string config;
  std::string out;
  std::vector<std::string> overrides;
  std::string log_level = "info";

  void add_to(CLI::App& command, const std::string& what) {
    command.add_option("recording", recording, what)->required();
    command.add_option("-c,--config", config, "The robot's configuration, e.g. my_arm/estimator.yaml")->required();
    command.add_option("-o,--out", out, "LCM log to write")->required();
    command.add_option("--set", overrides, "Override one key: --set bus.channel_prefix=LAB (repeatable)");
    command.add_option("--log-level", log_level, "trace, debug, info, warn, error or off")
        ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  }
  [[nodiscard]] Configuration load() const {
    set_up_logging(log_level);
    return Configuration::load(find_data_file(config), overrides);
  }
  /// @param mapping  a file that says how to read the recording; empty: none
  [[nodiscard]] ImportTarget target(const std::string& mapping) const {
    return ImportTarget::from(load(), mapping.empty() ? "" : find_data_file(mapping));
  }
};

/// One bar for work whose size is known once it has begun.
class LazyBar {
 public:
  void operator()(std::uint64_t done, std::uint64_t total) {
    if (!bar_) bar_.emplace("import", total);
    bar_->set(done);
  }
  void end() { bar_.reset(); }

 private:
  std::optional<ProgressBar> bar_;
};

void import_yarp_recording(const Source& source) {
  const Configuration configuration = source.load();
  // What the other sections of the file hold is checked by the programs that use them.
  configuration.reject_unknown_sections();
  const Configuration bus_section = configuration.section("bus");
  const BusOptions bus = BusOptions::from(bus_section);
  bus_section.reject_unknown_keys();
  const Configuration import_section = configuration.section("yarp_import");
  const YarpImportOptions options = YarpImportOptions::from(import_section);
  import_section.reject_unknown_keys();

  LazyBar bar;
  const YarpImportSummary summary = import_yarp(source.recording, options, bus.channels(), source.out, std::ref(bar));
  bar.end();
  std::printf("%s: %llu encoder rows, %llu left and %llu right pictures, %.1f s\n", source.out.c_str(),
              static_cast<unsigned long long>(summary.encoder_rows),
              static_cast<unsigned long long>(summary.left_pictures),
              static_cast<unsigned long long>(summary.right_pictures), summary.duration_s);
  if (summary.rows_out_of_order > 0) {
    std::printf("%llu rows left out: their stamp was not after the one before\n",
                static_cast<unsigned long long>(summary.rows_out_of_order));
  }
  if (summary.bad_lines + summary.bad_pictures > 0) {
    std::printf("%llu bad lines and %llu bad pictures left out; the first: %s\n",
                static_cast<unsigned long long>(summary.bad_lines),
                static_cast<unsigned long long>(summary.bad_pictures), summary.first_bad.c_str());
  }
  for (const auto& warning : summary.warnings) std::printf("warning: %s\n", warning.c_str());
}

void add_yarp(CLI::App& app, const std::string& name, const std::string& description) {
  auto source = std::make_shared<Source>();
  CLI::App* command = app.add_subcommand(name, description);
  command->footer(
      "Example:\n  bodyschema import yarp recording/yarp --config config/icub_unity/estimator.yaml "
      "--out recording.log\n\nThe recording holds one folder per port with data.log and info.log; the "
      "section\nyarp_import of the configuration says which column is which joint. Bad lines and "
      "pictures\nare left out and counted, up to 5 % of a folder's.");
  source->add_to(*command, "Folder of the recording");
  command->callback([source] { import_yarp_recording(*source); });
}

/// The poses as configuration beside the log, for a configuration to include.
std::string write_camera_poses(const CameraPoses& poses, const ImportTarget& target, const std::string& source,
                               const std::filesystem::path& log) {
  std::filesystem::path file = log;
  file.replace_extension(".cameras.yaml");
  std::string text = fmt::format(
      "# Camera poses of {} ({}), to be included behind the robot's own file:\n"
      "# include: [estimator.yaml, {}]\n"
      "cameras:\n",
      std::filesystem::path(source).filename().string(), poses.method, file.filename().string());
  for (const CameraModel& camera : target.rig.cameras) {
    const auto pose = poses.X_base_optical.find(camera.name);
    if (pose == poses.X_base_optical.end()) {
      throw FileError(fmt::format("{}: no pose of camera '{}' by '{}'", source, camera.name, poses.method));
    }
    text += fmt::format(
        "  {}: {{link: {}, beside: null, X_beside_optical: null, pose: known, pose_sd_deg: null, pose_sd_mm: null,\n"
        "    X_link_optical: {}}}\n",
        camera.name, poses.base_link, pose_yaml(pose->second));
  }
  replace_file(file, text);
  return file.string();
}

void add_stills(CLI::App& import) {
  struct Arguments {
    Source source;
    std::string mapping;
    bool no_masks = false;
    std::string camera_pose;
    double recorded_at_s = 0.0;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = import.add_subcommand("stills", "Turn a folder of pictures with joint angles into an LCM log");
  command->footer(
      "Example:\n"
      "  bodyschema import stills photographs --config my_arm/estimator.yaml --out photographs.lcmlog\n\n"
      "The folder holds images/CAMERA/NN.png and joints.csv: a line of joint names, then a row in rad for\n"
      "each NN (column `posture`); and, where they are there, masks/CAMERA/NN.png and\n"
      "camera_info/CAMERA.yaml. A column `time_s` makes it a recording in motion.");
  a->source.add_to(*command, "Folder with images/ and joints.csv");
  command->add_option("--mapping", a->mapping, "File whose section `import` says which column is which joint");
  command->add_flag("--no-masks", a->no_masks, "Leave out masks that are there");
  command->add_option("--camera-pose", a->camera_pose,
                      "camera_pose.json, or camera_pose.json:METHOD: writes LOG.cameras.yaml beside the log, for a "
                      "configuration to include. Never read otherwise");
  command
      ->add_option("--recorded-at", a->recorded_at_s,
                   "When the first posture was taken, s since 1970; stamps begin at 0 without it")
      ->check(number_in(0.0, 8e9));
  command->callback([a] {
    const ImportTarget target = a->source.target(a->mapping);
    std::optional<CameraPoses> poses;
    if (!a->camera_pose.empty()) poses = CameraPoses::from_argument(a->camera_pose);
    StillsImportOptions options;
    options.masks = !a->no_masks;
    options.recorded_at = microseconds(a->recorded_at_s);
    LazyBar bar;
    const auto summary = import_stills(a->source.recording, target, options, a->source.out, std::ref(bar));
    bar.end();
    std::fputs(summary.text(a->source.out).c_str(), stdout);
    if (!poses) return;
    std::printf("camera poses: %s\n", write_camera_poses(*poses, target, a->camera_pose, a->source.out).c_str());
  });
}

void say_set_up(const std::string& sentence) {
  std::fprintf(stderr, "%s\n", sentence.c_str());
}

/// "left=/zed/left" taken apart.
void add_named(std::map<std::string, std::string>& all, const std::vector<std::string>& given, const char* option) {
  for (const std::string& text : given) {
    const auto sign = text.find('=');
    if (sign == std::string::npos || sign == 0 || sign + 1 == text.size()) {
      throw CLI::ValidationError(option, "'" + text + "' is not CAMERA=TOPIC");
    }
    if (!all.emplace(text.substr(0, sign), text.substr(sign + 1)).second) {
      throw CLI::ValidationError(option, "camera '" + text.substr(0, sign) + "' is given twice");
    }
  }
}

void list_topics(const std::string& bag, const std::string& info_folder) {
  for (const BagTopic& topic : list_bag(bag, say_set_up)) {
    std::printf("%s\n", topic.text().c_str());
    if (info_folder.empty() || topic.camera_info.empty()) continue;
    const auto file = std::filesystem::path(info_folder) / camera_info_file_name(topic.name);
    make_folder(info_folder);
    replace_file(file, "# " + topic.name + "\n" + topic.camera_info + "\n");
    std::printf("  written to %s\n", file.c_str());
  }
}

struct BagArguments {
  Source source;
  std::string mapping;
  std::vector<std::string> joints, cameras, masks;
  std::map<std::string, std::string> sides;  // --left and its like, which fall back on nothing
  bool list = false;
  std::string camera_info;
};

void run_ros_bag(const BagArguments& a) {
  if (a.list || !a.camera_info.empty()) {
    set_up_logging(a.source.log_level);
    return list_topics(a.source.recording, a.camera_info);
  }
  if (a.source.config.empty()) throw CLI::RequiredError("--config");
  if (a.source.out.empty()) throw CLI::RequiredError("--out");
  RosBagOptions options;
  options.joints = a.joints;
  add_named(options.pictures, a.cameras, "--camera");
  add_named(options.masks, a.masks, "--masks");
  for (const auto& [key, topic] : a.sides) {
    const auto dash = key.find('-');
    if (!topic.empty()) {
      (dash == std::string::npos ? options.pictures
                                 : options.masks)[key.substr(dash == std::string::npos ? 0 : dash + 1)] = topic;
    }
  }
  const ImportTarget target = a.source.target(a.mapping);
  LazyBar bar;
  const auto summary = import_ros_bag(a.source.recording, target, options, a.source.out, say_set_up, std::ref(bar));
  bar.end();
  std::fputs(summary.text(a.source.out).c_str(), stdout);
}

void add_ros_bag(CLI::App& import) {
  auto a = std::make_shared<BagArguments>();
  CLI::App* command = import.add_subcommand("ros-bag", "Turn a ROS bag (MCAP, SQLite or ROS 1) into an LCM log");
  command->footer(
      "Examples:\n"
      "  bodyschema import ros-bag my_bag --list\n"
      "  bodyschema import ros-bag my_bag --config my_arm/estimator.yaml --out my_bag.lcmlog\n\n"
      "Topics are found by their types; where several fit they are listed and asked for. Python reads the\n"
      "bag (PyPI's rosbags, installed once, in ~/.cache/bodyschema). docs/import_ros_bag.md.");
  a->source.add_to(*command, "Bag: the folder of a ROS 2 bag, or a file .mcap, .db3 or .bag");
  command->get_option("--config")->required(false);
  command->get_option("--out")->required(false);
  command->add_option("--joints", a->joints, "Topic of the encoders (repeatable: each with some of the joints)");
  command->add_option("--camera", a->cameras, "CAMERA=TOPIC: pictures of this camera (repeatable)");
  command->add_option("--masks", a->masks, "CAMERA=TOPIC: masks of this camera (repeatable)");
  for (const std::string side : {"left", "right"}) {
    command->add_option("--" + side, a->sides[side], "TOPIC: the same as --camera " + side + "=TOPIC");
    command->add_option("--masks-" + side, a->sides["masks-" + side], "TOPIC: the same as --masks " + side + "=TOPIC");
  }
  command->add_option("--mapping", a->mapping, "File whose section `import` says which name is which joint");
  command->add_flag("--list", a->list, "Print the topics and import nothing; needs no --config");
  command->add_option("--camera-info", a->camera_info,
                      "As --list, and writes each CameraInfo into this folder, for `bodyschema new-robot`");
  command->callback([a] { run_ros_bag(*a); });
}

void print_lerobot_set(const LerobotSet& set) {
  std::printf("LeRobot v%s, %lld episodes, %zu of them here\ncolumns:", set.version.c_str(),
              static_cast<long long>(set.episodes), set.present.size());
  for (const std::string& column : set.columns) std::printf(" %s", column.c_str());
  std::printf("\ncameras:");
  for (const std::string& camera : set.cameras) std::printf(" %s", camera.c_str());
  std::printf("\nepisodes:");
  for (const std::int64_t episode : set.present) std::printf(" %lld", static_cast<long long>(episode));
  std::printf("\n");
}

void add_lerobot(CLI::App& import) {
  struct Arguments {
    Source source;
    std::string mapping;
    LerobotOptions options;
    double recorded_at_s = 0.0;
    bool list = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = import.add_subcommand("lerobot", "Turn episodes of a LeRobot data set into LCM logs");
  command->footer(
      "Examples:\n"
      "  bodyschema import lerobot my_set --list\n"
      "  bodyschema import lerobot my_set --config my_arm/estimator.yaml --mapping my_arm/lerobot.yaml \\\n"
      "      --episodes 0-9 --out logs\n\n"
      "The mapping says which column is which joint, with scale and offset. Python reads the set (PyPI's\n"
      "pyarrow and av, installed once, in ~/.cache/bodyschema). docs/import_lerobot.md.");
  a->source.add_to(*command, "Folder of the data set (v2.0, v2.1 or v3.0), with meta/info.json");
  command->get_option("--config")->required(false);
  command->get_option("--out")->required(false)->description(
      "Folder for a log of each episode; or NAME.lcmlog: one log, episodes 10 s apart");
  command->add_option("--mapping", a->mapping, "File whose section `import` says which column is which joint");
  command->add_option("--episodes", a->options.episodes, "all, or numbers as 1,3-5");
  command->add_flag("--raw", a->options.raw, "Pictures as they are decoded, ten times as large as JPEG");
  command->add_option("--recorded-at", a->recorded_at_s, "When the first episode began, s since 1970")
      ->check(number_in(0.0, 8e9));
  command->add_flag("--list", a->list, "Print columns, cameras and episodes and import nothing; needs no --config");
  command->callback([a] {
    if (a->list) {
      set_up_logging(a->source.log_level);
      return print_lerobot_set(LerobotSet::list(a->source.recording, say_set_up));
    }
    if (a->source.config.empty()) throw CLI::RequiredError("--config");
    if (a->source.out.empty()) throw CLI::RequiredError("--out");
    a->options.recorded_at = microseconds(a->recorded_at_s);
    const ImportTarget target =
        ImportTarget::from(a->source.load(), a->mapping.empty() ? "" : find_data_file(a->mapping));
    LazyBar bar;
    const auto result = import_lerobot(a->source.recording, target, a->options, LerobotOutput::of(a->source.out),
                                       say_set_up, std::ref(bar));
    bar.end();
    std::fputs(result.text().c_str(), stdout);
  });
}

}  // namespace

void add_import(CLI::App& app) {
  CLI::App* import = app.add_subcommand("import", "Turn recordings of any kind into LCM logs");
  import->footer(
      "Example:\n"
      "  bodyschema import stills photographs --config my_arm/estimator.yaml --out photographs.lcmlog\n"
      "bodyschema import KIND --help explains each.");
  import->require_subcommand(1);
  add_stills(*import);
  add_ros_bag(*import);
  add_lerobot(*import);
  add_yarp(*import, "yarp", "Turn a YARP dataplayer recording into an LCM log");
  add_yarp(app, "import-yarp", "The same as `import yarp`");
}

}  // namespace bodyschema::apps
