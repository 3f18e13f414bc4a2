#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"

namespace bodyschema::apps {

/// Options every program that reads a configuration shares.
struct CommonOptions {
  std::string config;
  std::vector<std::string> overrides;
  std::string engine;
  std::string mode;
  std::string log_level = "info";
  std::string extended_model;
  bool print_config = false;

  void add_to(CLI::App& app);
  /// --extended-model, for the programs that can apply one.
  void add_extended_model_to(CLI::App& app);
  /// The configuration with the command line's choices on top.
  [[nodiscard]] Configuration load() const;
  /// Those choices as overrides, "filter.particles=500".
  [[nodiscard]] std::vector<std::string> choices() const;
};

/// For values of options: a number from `least` to `most` (int or double). CLI::Range lets NaN pass.
template <class Number>
CLI::Validator number_in(Number least, Number most);
/// For values of unsigned options: CLI11 takes a number with a sign for a large one.
CLI::Validator whole_number();

/// How --help is laid out in every program: as CLI11 does, without saying a value's type twice.
std::shared_ptr<CLI::Formatter> help_formatter();

/// Runs `action`, turning every exception into one line on standard error. The value is the program's exit status:
/// 0; 2 after a wrong command line, configuration or file, where starting again would not help; 3 for data that
/// cannot be used (a log too short); 1 after any other error. Where `action` parses the command line, CLI11 says what
/// is wrong with it, --help and --version included (0).
int run_and_report(const char* program, const CLI::App& app, const std::function<void()>& action);

}  // namespace bodyschema::apps
