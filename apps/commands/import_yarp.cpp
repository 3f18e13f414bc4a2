#include <cstdio>
#include <memory>
#include <optional>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/yarp_import.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_import_yarp(CLI::App& app) {
  struct Arguments {
    std::string recording;
    std::string config;
    std::string out;
    std::vector<std::string> overrides;
    std::string log_level = "info";
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("import-yarp", "Turn a YARP dataplayer recording into an LCM log");
  command->footer(
      "Example:\n  bodyschema import-yarp recording/yarp --config config/icub_unity/estimator.yaml "
      "--out recording.log\n\nThe recording holds one folder per port with data.log and info.log; the "
      "section\nyarp_import of the configuration says which column is which joint. Bad lines and "
      "pictures\nare left out and counted, up to 5 % of a folder's.");
  command->add_option("recording", a->recording, "Folder of the recording")->required();
  command->add_option("-c,--config", a->config, "Configuration file with the section yarp_import")->required();
  command->add_option("-o,--out", a->out, "LCM log to write")->required();
  command->add_option("--set", a->overrides, "Override one key: --set bus.channel_prefix=LAB (repeatable)");
  command->add_option("--log-level", a->log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  command->callback([a] {
    set_up_logging(a->log_level);
    const Configuration configuration = Configuration::load(find_data_file(a->config), a->overrides);
    // What the other sections of the file hold is checked by the programs that use them.
    configuration.reject_unknown_sections();
    const Configuration bus_section = configuration.section("bus");
    const BusOptions bus = BusOptions::from(bus_section);
    bus_section.reject_unknown_keys();
    const Configuration import_section = configuration.section("yarp_import");
    const YarpImportOptions options = YarpImportOptions::from(import_section);
    import_section.reject_unknown_keys();

    std::optional<ProgressBar> bar;
    const YarpImportSummary summary =
        import_yarp(a->recording, options, bus.channels(), a->out, [&](std::uint64_t done, std::uint64_t total) {
          if (!bar) bar.emplace("import", total);
          bar->set(done);
        });
    bar.reset();
    std::printf("%s: %llu encoder rows, %llu left and %llu right pictures, %.1f s\n", a->out.c_str(),
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
  });
}

}  // namespace bodyschema::apps
