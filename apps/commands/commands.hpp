#pragma once

#include <CLI/CLI.hpp>

namespace bodyschema::apps {

/// Each adds one subcommand of `bodyschema`; its callback throws Error on failure.
void add_evaluate(CLI::App& app);
void add_export(CLI::App& app);
void add_replay(CLI::App& app);
void add_import_yarp(CLI::App& app);
void add_diagnose(CLI::App& app);

}  // namespace bodyschema::apps
