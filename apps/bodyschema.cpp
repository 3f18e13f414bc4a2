#include <CLI/CLI.hpp>

#include "commands/commands.hpp"
#include "common_options.hpp"

/// The offline program: one subcommand per workflow, each in apps/commands/.
int main(int argc, char** argv) {
  CLI::App app{"Body Schema: markerless calibration of a humanoid's arm from its own eyes"};
  app.formatter(bodyschema::apps::help_formatter());  // before the commands, which take it over
  app.require_subcommand(1);
  app.footer(
      "Example:\n"
      "  bodyschema replay reach.lcmlog --config config/icub_right/estimator.yaml --out out/reach\n"
      "bodyschema COMMAND --help explains each. Exit status: 0 done, 2 wrong command line,\n"
      "configuration or file, 3 data that cannot be used (a log too short), 1 any other failure.");
  app.set_version_flag("--version", BODYSCHEMA_VERSION);
  bodyschema::apps::add_import(app);
  bodyschema::apps::add_replay(app);
  bodyschema::apps::add_export(app);
  bodyschema::apps::add_evaluate(app);
  bodyschema::apps::add_calibrate(app);
  bodyschema::apps::add_diagnose(app);
  bodyschema::apps::add_fleet(app);
  bodyschema::apps::add_log(app);
  bodyschema::apps::add_new_robot(app);
  bodyschema::apps::add_selftest(app);
  return bodyschema::apps::run_and_report("bodyschema", app, [&] { app.parse(argc, argv); });
}
