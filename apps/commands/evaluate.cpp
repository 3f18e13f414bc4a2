#include "bodyschema/evaluation/evaluate.hpp"

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "../common_options.hpp"
#include "bodyschema/core/installation.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_evaluate(CLI::App& app) {
  struct Arguments {
    CommonOptions common;
    EvaluationOptions options;
    std::string out;
  };
  auto a = std::make_shared<Arguments>();
  a->common.config = "config/icub_right/evaluation.yaml";
  a->common.log_level = "warn";
  CLI::App* command = app.add_subcommand("evaluate", "Run the paper's experiments and print their figures");
  std::string footer = "Experiments:\n";
  for (const auto& [name, meaning] : experiment_names()) footer += "  " + name + ": " + meaning + '\n';
  footer += "\nExample:\n  bodyschema evaluate paper --trials 10 --seed 1 --out out/paper";
  command->footer(footer);
  command->add_option("experiment", a->options.experiment, "Which experiment")->required();
  command
      ->add_option("--trials", a->options.trials,
                   "Seeded trials of each experiment, unless its line below says otherwise")
      ->capture_default_str()
      ->check(number_in(1, 100000));
  command->add_option("--seed", a->options.seed, "Seed of the first trial")
      ->capture_default_str()
      ->check(whole_number());
  command->add_option("--threads", a->options.threads, "Trials side by side; 0: one per core")
      ->capture_default_str()
      ->check(number_in(0, 1024));
  command->add_flag(
      "--masks", a->options.masks,
      "diagnosis: logs of masks with noisy outlines, 40 s at 5 Hz, instead of pictures; five times as fast");
  command
      ->add_option("--minutes", a->options.minutes,
                   "diagnosis: begin no further log after so many, and sum up what is done; 0: run all")
      ->check(number_in(0, 100000));
  command->add_flag("--resume", a->options.resume,
                    "diagnosis: keep the logs that trials.jsonl in --out has of the same seed, as after a run that was "
                    "stopped");
  command->add_option("--rows", a->options.rows, "Of `everyday`, `honesty` and `real`, these rows only");
  command->add_option("--seconds", a->options.everyday_s, "Of `everyday`, length of a log, s")
      ->capture_default_str()
      ->check(number_in(5, 3600));
  command->add_option("-o,--out", a->out, "Folder for summary.json and report.html")->required();
  a->common.add_to(*command);
  command->get_option("--config")->required(false);
  command->remove_option(command->get_option("--mode"));  // every experiment runs the modes it compares
  command->callback([a] {
    const Configuration configuration = a->common.load();
    if (a->common.print_config) {
      std::fputs(configuration.print().c_str(), stdout);
      return;
    }
    a->options.out = a->out;
    a->options.overrides = a->common.choices();
    if (const char* data = std::getenv("BODYSCHEMA_DATA")) a->options.data = data;
    std::fputs(evaluate(configuration, data_directory() / "config", a->options).c_str(), stdout);
    std::printf("\nresults in %s/summary.json and report.html\n", a->out.c_str());
  });
}

}  // namespace bodyschema::apps
