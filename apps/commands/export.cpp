#include <cstdio>
#include <memory>

#include "../common_options.hpp"
#include "../print_configuration.hpp"
#include "bodyschema/pipeline/export_correction.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "commands.hpp"

namespace bodyschema::apps {

void add_export(CLI::App& app) {
  struct Arguments {
    CommonOptions common;
    std::string summary;
    std::string out;
    bool anyway = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command =
      app.add_subcommand("export", "Write a result as corrected URDF, YAML by joint and iCub calibrationDelta");
  command->footer(
      "Example:\n  bodyschema export out/reach/summary.json --config config/icub_right/estimator.yaml --out out/apply");
  command->add_option("summary", a->summary, "summary.json of a replay")->required();
  command->add_option("-o,--out", a->out, "Folder for the files")->required();
  command->add_flag("--anyway", a->anyway,
                    "Also when the replay did not end converged or had another URDF or other cameras");
  a->common.add_to(*command);
  a->common.add_extended_model_to(*command);
  command->callback([a] {
    const Configuration configuration = a->common.load();
    if (a->common.print_config) {
      print_configuration(configuration);
      return;
    }
    const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
    const StereoRig rig = StereoRig::from(configuration.section("cameras"));
    configuration.reject_unknown_sections();
    configuration.section("robot").leave_to_others("tolerances");
    for (const char* read : {"robot", "cameras"}) configuration.section(read).reject_unknown_keys();
    std::fputs(export_correction(a->summary, setup, rig, a->out, a->anyway).c_str(), stdout);
  });
}

}  // namespace bodyschema::apps
