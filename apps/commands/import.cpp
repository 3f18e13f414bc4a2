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
  command->add_option("--recorded-at", a->recorded_at_s,
                      "When the first posture was taken, s since 1970; stamps begin at 0 without it")
      ->check(number_in(0.0, 8e9));
  command->callback([a] {
    const ImportTarget target = ImportTarget::from(a->source.load(), a->mapping);
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

}  // namespace

void add_import(CLI::App& app) {
  CLI::App* import = app.add_subcommand("import", "Turn recordings of any kind into LCM logs");
  import->footer(
      "Example:\n"
      "  bodyschema import stills photographs --config my_arm/estimator.yaml --out photographs.lcmlog\n"
      "bodyschema import KIND --help explains each.");
  import->require_subcommand(1);
  add_stills(*import);
  add_yarp(*import, "yarp", "Turn a YARP dataplayer recording into an LCM log");
  add_yarp(app, "import-yarp", "The same as `import yarp`");
}

}  // namespace bodyschema::apps
