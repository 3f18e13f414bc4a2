#pragma once

#include <CLI/CLI.hpp>

namespace bodyschema::apps {

/// Each adds one subcommand of `bodyschema`; its callback throws Error on failure, or
/// CLI::RuntimeError with the exit status when everything has been said.
void add_evaluate(CLI::App& app);
void add_export(CLI::App& app);
void add_replay(CLI::App& app);
/// `import` with a subcommand for each kind of recording, and `import-yarp`.
void add_import(CLI::App& app);
void add_calibrate(CLI::App& app);
void add_diagnose(CLI::App& app);
void add_selftest(CLI::App& app);
void add_log(CLI::App& app);
void add_fleet(CLI::App& app);
void add_new_robot(CLI::App& app);

}  // namespace bodyschema::apps
