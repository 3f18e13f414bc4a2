#include "common_options.hpp"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <sstream>
#include <type_traits>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"

namespace bodyschema::apps {
namespace {

/// Exit statuses, the same in every program. The systemd unit knows the first.
constexpr int kWrongInput = 2;
constexpr int kUnusableData = 3;
constexpr int kFailure = 1;

template <class Number>
bool reads_as(const std::string& text, Number& value) {
  if (std::is_unsigned_v<Number> && text.find('-') != std::string::npos) return false;
  errno = 0;
  return CLI::detail::lexical_cast(text, value) && errno != ERANGE;
}

}  // namespace

template <class Number>
CLI::Validator number_in(Number least, Number most) {
  std::ostringstream range;
  range << "in [" << least << " - " << most << ']';
  return {[least, most, where = range.str()](const std::string& text) {
            Number value{};
            if (reads_as(text, value) && value >= least && value <= most) return std::string();
            return "'" + text + "' is not a number " + where;
          },
          CLI::detail::type_name<Number>() + (" " + range.str())};
}
template CLI::Validator number_in(int least, int most);
template CLI::Validator number_in(double least, double most);

CLI::Validator whole_number() {
  return {[](const std::string& text) {
            std::uint64_t value = 0;
            return reads_as(text, value) ? std::string() : "'" + text + "' is not a whole number from 0 on";
          },
          ""};
}

void CommonOptions::add_to(CLI::App& app) {
  app.add_option("-c,--config", config, "Configuration file, e.g. config/icub_right/estimator.yaml")->required();
  app.add_option("--set", overrides, "Override one key: --set filter.particles=500 (repeatable)");
  app.add_option("--engine", engine, "Silhouette engine: auto, atlas or contour")
      ->check(CLI::IsMember({"auto", "atlas", "contour"}));
  app.add_option("--mode", mode, "Estimator: best, or paper (the published filter, literally)")
      ->check(CLI::IsMember({"best", "paper"}));
  app.add_option("--log-level", log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  app.add_flag("--print-config", print_config, "Print the configuration in force and stop");
}

void CommonOptions::add_extended_model_to(CLI::App& app) {
  app.add_option("--extended-model", extended_model,
                 "extended_model.yaml of `bodyschema diagnose` (robot.extended_model)");
}

Configuration CommonOptions::load() const {
  set_up_logging(log_level);
  return Configuration::load(find_data_file(config), choices());
}

std::vector<std::string> CommonOptions::choices() const {
  std::vector<std::string> all = overrides;
  if (!engine.empty()) all.push_back("silhouette.engine=" + engine);
  if (!mode.empty()) all.push_back("estimator.mode=" + mode);
  if (!extended_model.empty()) {
    // As quoted YAML, so that any file name stays one text.
    std::string quoted;
    for (const char c : extended_model) quoted += c == '\'' ? "''" : std::string(1, c);
    all.push_back("robot.extended_model='" + quoted + "'");
  }
  return all;
}

namespace {

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text = CLI::Formatter::make_option_opts(option);
    for (const std::string twice : {"INT:", "FLOAT:", "TEXT:"}) {
      if (const auto at = text.find(twice); at != std::string::npos) text.erase(at, twice.size());
    }
    return text;
  }
};

}  // namespace

std::shared_ptr<CLI::Formatter> help_formatter() {
  return std::make_shared<HelpFormatter>();
}

int run_and_report(const char* program, const CLI::App& app, const std::function<void()>& action) {
  const auto failed = [program](const std::exception& e, int status) {
    std::fprintf(stderr, "%s: error: %s\n", program, e.what());
    return status;
  };
  try {
    action();
    return 0;
  } catch (const CLI::RuntimeError& e) {  // all has been said
    return e.get_exit_code();
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kWrongInput;
  } catch (const ConfigurationError& e) {
    return failed(e, kWrongInput);
  } catch (const FileError& e) {
    return failed(e, kWrongInput);
  } catch (const DataError& e) {
    return failed(e, kUnusableData);
  } catch (const std::exception& e) {
    return failed(e, kFailure);
  }
}

}  // namespace bodyschema::apps
