#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/selftest/engine_table.hpp"
#include "bodyschema/selftest/self_test.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_selftest(CLI::App& app) {
  struct Arguments {
    std::string config;
    std::optional<std::string> lcm_url;
    bool bench = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "selftest", "Check this installation: files, rendering, a simulated reach, LCM; takes about ten seconds");
  command->footer(
      "Examples:\n"
      "  bodyschema selftest\n"
      "  bodyschema selftest --config my_robot/estimator.yaml\n"
      "  bodyschema selftest --bench --config config/icub_right/estimator.yaml\n"
      "One line for each check: OK, WARN (works, with something to look at) or FAIL. Exit status: "
      "0\n"
      "without a FAIL, else 1.");
  command->add_option("-c,--config", a->config,
                      "Check this configuration too; default: /etc/bodyschema/estimator.yaml where there is one");
  command->add_option("-l,--lcm-url", a->lcm_url, "LCM network; default: $LCM_DEFAULT_URL, else this machine only");
  command->add_flag("--bench", a->bench,
                    "Print what the silhouette engines take here for this robot (default: our own), and nothing else");
  command->callback([a] {
    set_up_logging("error");
    if (a->bench) {
      std::fputs(
          engine_table(find_data_file(a->config.empty() ? "config/icub_right/estimator.yaml" : a->config)).c_str(),
          stdout);
      return;
    }
    SelfTestOptions options;
    options.version = BODYSCHEMA_VERSION;
    options.lcm_url = resolve_lcm_url(a->lcm_url);
    options.own_config = a->config;
    const std::filesystem::path service = "/etc/bodyschema/estimator.yaml";
    std::error_code ignored;
    if (a->config.empty() && std::filesystem::exists(service, ignored)) options.own_config = service;
    const CheckLevel worst = run_self_test(options, [](const CheckResult& result) {
      std::printf("%-5s %-8s %s\n", to_string(result.level), result.name.c_str(), result.sentence.c_str());
      std::fflush(stdout);
    });
    if (worst == CheckLevel::kFail) throw CLI::RuntimeError(1);
  });
}

}  // namespace bodyschema::apps
