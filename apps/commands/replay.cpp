#include "bodyschema/diagnosis/live_diagnosis.hpp"
#include "bodyschema/pipeline/replay.hpp"

#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "../print_configuration.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_replay(CLI::App& app) {
  struct Arguments {
    CommonOptions common;
    std::string log;
    std::string out;
    std::string truth;
    int overlays = 3;
    bool masks = false;
    bool learn_online = false;
    std::string looks;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("replay", "Run a recorded log through the estimator");
  command->footer(
      "Example:\n  bodyschema replay reach.log --config config/icub_right/estimator.yaml --out out/reach\n\n"
      "Exit status: 0 when the log was read to its end, converged or not; the last lines and\n"
      "summary.json (estimate.state) say how it ended, and bodyschema export refuses the latter.");
  command->add_option("log", a->log, "LCM log")->required();
  command->add_option("-o,--out", a->out, "Folder for estimates.jsonl, summary.json and pictures")->required();
  command->add_option("--truth", a->truth, "Ground truth (JSON): adds errors to the results");
  command->add_option("--overlays", a->overlays, "Overlay pictures spread over the log")
      ->capture_default_str()
      ->check(number_in(0, 100000));
  command->add_flag("--masks", a->masks, "Write the observed masks too");
  command->add_flag("--learn-background-online", a->learn_online,
                    "Learn the background from the first pictures, as bodyschemad does, not from the whole log");
  command->add_option("--looks", a->looks,
                      "The robot's colours (vision.method: auto): read where the file is there, written at the end");
  a->common.add_to(*command);
  a->common.add_extended_model_to(*command);
  command->callback([a] {
    const Configuration configuration = a->common.load();
    if (a->common.print_config) {
      print_configuration(configuration);
      return;
    }
    ReplayOptions options;
    options.log = a->log;
    options.out = a->out;
    if (!a->truth.empty()) options.truth = a->truth;
    options.overlays = a->overlays;
    options.masks = a->masks;
    options.learn_background_online = a->learn_online;
    if (!a->looks.empty()) options.looks = a->looks;
    options.watcher = [](const Pipeline& pipeline) -> ReplayOptions::Watcher {
      if (!pipeline.options().live_diagnosis) return {};
      auto live = std::make_shared<LiveDiagnosis>(pipeline, true);
      return [live](const Observation& observation, Estimate& estimate) { live->watch(observation, estimate); };
    };
    std::fputs(replay(configuration, options).c_str(), stdout);
    std::printf("\nresults in %s\n", a->out.c_str());
  });
}

}  // namespace bodyschema::apps
