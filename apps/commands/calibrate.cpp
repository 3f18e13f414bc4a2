#include "bodyschema/calibration/calibrate.hpp"

#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "../print_configuration.hpp"
#include "bodyschema/core/installation.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_calibrate(CLI::App& app) {
  struct Arguments {
    CommonOptions common;
    CalibrationOptions options;
    std::string log, out;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("calibrate", "Offsets, camera poses and intrinsics from a whole log");
  command->footer(
      "Example:\n  bodyschema calibrate stills.log --config out/robot/estimator.yaml --out out/calibration\n\n"
      "Exit status: 0 when the calibration is good, 3 when it is not (calibration.json, state and sentence, says "
      "why).");
  command->add_option("log", a->log, "LCM log, of a moving arm or of stills (bodyschema import)")->required();
  command->add_option("-o,--out", a->out, "Folder for calibration.json, report.html, corrected.urdf, ...")->required();
  command->add_option("--rate", a->options.picture_rate_hz, "Pictures a second and camera that are looked at, at most")
      ->capture_default_str()
      ->check(number_in(0.01, 1000.0));
  command->add_flag("--all-parameters", a->options.all_parameters,
                    "Put into the files what the pictures do not tell, too");
  command->add_option("--threads", a->options.threads, "0: one per core")
      ->capture_default_str()
      ->check(number_in(0, 1024));
  a->common.add_to(*command);
  command->callback([a] {
    const Configuration configuration = a->common.load();
    if (a->common.print_config) {
      print_configuration(configuration);
      return;
    }
    a->options.log = a->log;
    a->options.configuration = find_data_file(a->common.config);
    a->options.out = a->out;
    const Calibration calibration = calibrate(configuration, a->options);
    std::fputs(to_table(calibration).c_str(), stdout);
    std::printf("\nresults in %s\n", a->out.c_str());
    if (calibration.state != CalibrationState::kGood) throw CLI::RuntimeError(3);
  });
}

}  // namespace bodyschema::apps
