#include "bodyschema/diagnosis/log_diagnosis.hpp"

#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "../print_configuration.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_diagnose(CLI::App& app) {
  struct Arguments {
    CommonOptions common;
    std::vector<std::string> logs;
    std::string out;
    double rate_hz = 10.0;
    int threads = 2;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("diagnose", "Say what the model of the robot gets wrong, from a recorded log (experimental)");
  command->footer(
      "Example:\n  bodyschema diagnose babble.log --config config/icub_right/estimator.yaml --out out/diagnosis");
  command->add_option("log", a->logs, "LCM log; of several what is common and what changed between them")
      ->required()
      ->expected(1, 100);
  command
      ->add_option("-o,--out", a->out,
                   "Folder for report.html, report.json and extended_model.yaml; for several logs each in a folder of "
                   "its own, beside comparison.html")
      ->required();
  command->add_option("--picture-rate", a->rate_hz, "Pictures used per second and camera")
      ->capture_default_str()
      ->check(number_in(0.5, 120.0));
  command->add_option("--threads", a->threads, "Worker threads")->capture_default_str()->check(number_in(1, 256));
  a->common.add_to(*command);
  command->callback([a] {
    const Configuration configuration = a->common.load();
    if (a->common.print_config) {
      print_configuration(configuration);
      return;
    }
    LogDiagnosisOptions options;
    options.log = a->logs.front();
    options.out = a->out;
    options.configuration = a->common.config;
    options.picture_rate_hz = a->rate_hz;
    options.threads = a->threads;
    DiagnosisReport::prepare(options.out);
    if (a->logs.size() > 1) {
      const std::vector<std::filesystem::path> logs(a->logs.begin(), a->logs.end());
      const auto comparison = diagnose_logs(configuration, options, logs);
      std::printf("%s\ncomparison.html, comparison.json and a folder for each log in %s\n", comparison.sentence.c_str(),
                  a->out.c_str());
      return;
    }
    const auto report = diagnose_log(configuration, options);
    std::printf("%s\n", report.sentence.c_str());
    for (const auto& warning : report.warnings) std::printf("note: %s\n", warning.c_str());
    std::printf("held out: %.3f -> %.3f px, hand %.2f -> %.2f mm, %.2f -> %.2f deg\n", report.before.rms_px,
                report.after.rms_px, report.before.hand_mm, report.after.hand_mm, report.before.hand_deg,
                report.after.hand_deg);
    std::printf("not testable with this log: %zu %s; report.html, report.json and extended_model.yaml in %s\n",
                report.not_testable.size(), report.not_testable.size() == 1 ? "cause" : "causes", a->out.c_str());
    for (const auto& step : report.next_steps) std::printf("next: %s\n", step.c_str());
  });
}

}  // namespace bodyschema::apps
