#include <cstdio>
#include <memory>

#include "bodyschema/core/logging.hpp"
#include "bodyschema/fleet/fleet_report.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_fleet(CLI::App& app) {
  struct Arguments {
    std::string results;
    std::string out;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("fleet-report", "One report on many diagnosed logs: which robot, which cause, how it moved");
  command->footer(
      "Example:\n"
      "  snakemake -s /usr/share/bodyschema/workflow/Snakefile --cores 4 --config logs=logs "
      "out=fleet\n"
      "diagnoses all logs of a folder and runs bodyschema fleet-report fleet/robots --out fleet at "
      "its end.");
  command->add_option("results", a->results, "Folder with <robot>/<log>/: info.json, outcome.txt, report.json")
      ->required();
  command->add_option("-o,--out", a->out, "Folder for report.html and fleet.json")->required();
  command->callback([a] {
    set_up_logging("warn");
    std::fputs(write_fleet_report(gather_fleet(a->results), a->out).c_str(), stdout);
    std::printf("report in %s/report.html\n", a->out.c_str());
  });
}

}  // namespace bodyschema::apps
