#include <CLI/CLI.hpp>
#include <cstdio>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/service/daemon.hpp"
#include "bodyschema/service/start_up_checks.hpp"
#include "common_options.hpp"
#include "print_configuration.hpp"

namespace {

using namespace bodyschema;

void check_configuration(const apps::CommonOptions& common, const std::string& lcm_url) {
  const Configuration configuration = common.load();
  Pipeline pipeline(configuration);
  configuration.reject_unknown_keys();
  const Channels channels = pipeline.bus().channels();
  std::printf(
      "%s: good\nrobot: %s, %zu joints, offsets of %zu estimated\ncameras: %zu\n"
      "silhouettes: %s\nchannels: %s and %s in, %s, %s and %s out\n",
      common.config.c_str(), pipeline.robot().name().c_str(), pipeline.robot().joints().size(),
      pipeline.setup().estimated_joints.size(), pipeline.rig().cameras.size(),
      pipeline.estimator().engine_description().c_str(), channels.joint_state.c_str(), channels.cameras.c_str(),
      channels.joint_offsets.c_str(), channels.findings.c_str(), channels.offsets_status.c_str());
  if (const auto& model = pipeline.error_model()) {
    std::printf("extended model: %s\n", describe(*model).c_str());
  }
  for (const auto& complaint : check_network(lcm_url)) std::printf("network: %s\n", complaint.c_str());
  try {
    const LcmLink link(lcm_url);
  } catch (const DeviceError& e) {
    std::printf("network: %s\n", e.what());
  }
}

}  // namespace

/// The service: encoders and pictures in over LCM, joint offsets out.
int main(int argc, char** argv) {
  CLI::App app{
      "Body Schema's service: estimates the joint offsets of an arm from encoders and stereo\n"
      "pictures that come in over LCM, and publishes them with each pair of pictures"};
  app.formatter(apps::help_formatter());
  app.set_version_flag("--version", BODYSCHEMA_VERSION);
  app.footer(
      "Examples:\n"
      "  bodyschemad --config config/icub_right/estimator.yaml\n"
      "  bodyschemad --config config/icub_right/estimator.yaml --record reach.lcmlog --page 8080\n"
      "SIGTERM stops, SIGHUP reads the configuration again. Exit status: 0 stopped as asked, 2 wrong\n"
      "command line, configuration or file, 1 any other failure.");
  apps::CommonOptions common;
  DaemonOptions options;
  options.version = BODYSCHEMA_VERSION;
  std::string lcm_url;
  std::string record;
  std::string estimates;
  int page = 0;
  bool check_config = false;
  common.add_to(app);
  common.add_extended_model_to(app);
  app.add_option("-l,--lcm-url", lcm_url, "LCM network; default: $LCM_DEFAULT_URL, else this machine only");
  app.add_option("--record", record,
                 "Record all messages in and out to this log; what is there already is kept, NAME.1 follows");
  app.add_option("--estimates", estimates,
                 "Write one JSON line per estimate, as bodyschema replay does; kept as with --record");
  app.add_option("--frames", options.frames, "Stop after so many estimates")->check(apps::whole_number());
  app.add_option("--stop-after-idle", options.stop_after_idle_s,
                 "Stop when nothing has come for so many seconds, once something has")
      ->check(apps::number_in(0.1, 1e6));
  app.add_option("--page", page, "Serve the live page on this port of localhost: http://localhost:PORT/")
      ->check(apps::number_in(1, 65535));
  app.add_flag("--timings", options.timings, "Print the time of each stage at the end");
  app.add_flag("--check-config", check_config, "Check configuration, robot and engine, and stop");
  return apps::run_and_report("bodyschemad", app, [&] {
    app.parse(argc, argv);
    options.lcm_url = resolve_lcm_url(lcm_url);
    if (!record.empty()) options.record = record;
    if (!estimates.empty()) options.estimates = estimates;
    if (page > 0) options.page_port = page;
    if (check_config) {
      check_configuration(common, options.lcm_url);
    } else if (common.print_config) {
      apps::print_configuration(common.load());
    } else {
      run_daemon([&common] { return common.load(); }, options);
    }
  });
}
