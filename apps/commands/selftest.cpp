#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/selftest/self_test.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_selftest(CLI::App& app) {
  struct Arguments {
    std::string config;
    std::optional<std::string> lcm_url;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "selftest", "Check this installation: files, rendering, a simulated reach, LCM; takes about ten seconds");
  command->footer(
      "Examples:\n"
      "  bodyschema selftest\n"
      "  bodyschema selftest --config my_robot/estimator.yaml\n"
      "One line for each check: OK, WARN (works, with something to look at) or FAIL. Exit status: "
      "0\n"
      "without a FAIL, else 1.");
  command->add_option("-c,--config", a->config,
                      "Check this configuration too; default: /etc/bodyschema/estimator.yaml where there is one");
  command->add_option("-l,--lcm-url", a->lcm_url, "LCM network; default: $LCM_DEFAULT_URL, else this machine only");
  command->callback([a] {
    set_up_logging("error");
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
