#include <cstdio>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "../common_options.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/diagnosis/log_testability.hpp"
#include "bodyschema/logs/log_summary.hpp"
#include "bodyschema/logs/mcap_export.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "commands.hpp"

namespace bodyschema::apps {
namespace {

/// Refuses sections that no program reads and keys of the robot's that nobody knows.
std::set<std::string> sliding_joints(const Configuration& configuration) {
  configuration.reject_unknown_sections();
  const Configuration robot = configuration.section("robot");
  const auto model = RobotSetup::from(robot).load();
  robot.leave_to_others("tolerances");
  robot.reject_unknown_keys();
  std::set<std::string> names;
  for (const auto& joint : model->joints()) {
    if (joint.slides) names.insert(joint.name);
  }
  return names;
}

void add_info(CLI::App& log) {
  struct Arguments {
    std::string log;
    std::string config;
    std::vector<std::string> overrides;
    bool json = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = log.add_subcommand("info", "Say what a log holds: channels, rates, gaps, pictures, motion");
  command->footer(
      "Examples:\n"
      "  bodyschema log info reach.lcmlog\n"
      "  bodyschema log info reach.lcmlog --config config/icub_right/estimator.yaml");
  command->add_option("log", a->log, "LCM log")->required();
  command->add_option("-c,--config", a->config,
                      "Tell joints that slide from those that turn, and say what a diagnosis of this robot could "
                      "test with the log");
  command->add_option("--set", a->overrides, "Override one key: --set bus.channel_prefix=LAB (repeatable)");
  command->add_flag("--json", a->json, "Print JSON, without what a diagnosis could test");
  command->callback([a] {
    set_up_logging("warn");
    std::optional<Configuration> configuration;
    std::optional<std::set<std::string>> sliding;
    if (!a->config.empty()) {
      configuration = Configuration::load(find_data_file(a->config), a->overrides);
      sliding = sliding_joints(*configuration);
    }
    const LogSummary summary = summarise_log(a->log, sliding);
    std::fputs((a->json ? summary.json() : summary.text()).c_str(), stdout);
    if (configuration && !a->json) std::printf("\n%s", testability_of(*configuration, a->log).text().c_str());
  });
}

void add_to_mcap(CLI::App& log) {
  auto options = std::make_shared<McapExportOptions>();
  auto config = std::make_shared<std::string>();
  auto overrides = std::make_shared<std::vector<std::string>>();
  CLI::App* command = log.add_subcommand("to-mcap", "Rewrite a log as MCAP, for Foxglove and PlotJuggler");
  command->footer(
      "Example:\n"
      "  bodyschema log to-mcap reach.lcmlog --out reach.mcap\n"
      "Joint states, offsets and status become JSON with a schema, pictures JPEG. Positions are in deg,\n"
      "as if every joint turned, unless --config tells which slide: these are in m then.");
  command->add_option("log", options->log, "LCM log")->required();
  command->add_option("-o,--out", options->out, "MCAP file to write")->required();
  command->add_option("-c,--config", *config, "The robot's configuration, where it has joints that slide");
  command->add_option("--set", *overrides, "Override one key of it (repeatable)");
  command
      ->add_option("--jpeg-quality", options->jpeg_quality, "Of pictures that were not compressed already (default 90)")
      ->check(number_in(1, 100));
  command->callback([options, config, overrides] {
    set_up_logging("warn");
    if (!config->empty()) {
      options->sliding_joints = sliding_joints(Configuration::load(find_data_file(*config), *overrides));
    }
    const McapExportSummary summary = export_mcap(*options);
    std::printf("%s: %.1f MB\n", options->out.c_str(), 1e-6 * static_cast<double>(summary.bytes));
    for (const auto& [topic, count] : summary.messages) {
      std::printf("  %-36s %8llu messages\n", topic.c_str(), static_cast<unsigned long long>(count));
    }
    if (summary.unreadable > 0) {
      std::printf("left out because they cannot be read: %llu\n", static_cast<unsigned long long>(summary.unreadable));
    }
    if (summary.unknown > 0) {
      std::printf("left out because their type is not known here: %llu\n",
                  static_cast<unsigned long long>(summary.unknown));
    }
  });
}

}  // namespace

void add_log(CLI::App& app) {
  CLI::App* log = app.add_subcommand("log", "Look into a recorded log, or rewrite it for other tools");
  log->footer("Example:\n  bodyschema log info reach.lcmlog");
  log->require_subcommand(1);
  add_info(*log);
  add_to_mcap(*log);
}

}  // namespace bodyschema::apps
