#include <CLI/CLI.hpp>
#include <cstdio>

#include "commands/commands.hpp"

/// The offline program: one subcommand per workflow, each in apps/commands/.
int main(int argc, char** argv) {
  CLI::App app{"Body Schema: markerless calibration of a humanoid's arm from its own eyes"};
  app.require_subcommand(1);
  app.set_version_flag("--version", BODYSCHEMA_VERSION);
  bodyschema::apps::add_import_yarp(app);
  bodyschema::apps::add_replay(app);
  bodyschema::apps::add_export(app);
  bodyschema::apps::add_evaluate(app);
  bodyschema::apps::add_diagnose(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "bodyschema: error: %s\n", e.what());
    return 1;
  }
  return 0;
}
