#include "bodyschema/selftest/engine_table.hpp"

#include <spdlog/fmt/fmt.h>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/outline/robot_projection.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/search/fastest_engine.hpp"
#include "bodyschema/search/search_level.hpp"

namespace bodyschema {

std::string engine_table(const std::filesystem::path& config) {
  constexpr double kSeconds = 3.0;
  const Configuration configuration = Configuration::load(config);
  const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  const StereoRig rig = StereoRig::from(configuration.section("cameras"));
  const auto options = EstimatorOptions::from(configuration);
  const auto robot = setup.load();
  const auto cameras = rig.intrinsics();
  const SearchLevel level = search_level(silhouette_model(*robot, setup), cameras);
  std::size_t triangles = 0;
  for (const auto& part : level.model.parts) triangles += part.triangles.size();
  const std::size_t silhouettes = options.filter.particles * cameras.size();
  const auto timings = time_engines(level.model, level.cameras, options.silhouette, silhouettes, kSeconds);
  std::string table =
      fmt::format("{} silhouettes of {}, {} triangles, {}x{} px\n\n{:<8} {:<8} {:>9}\n", silhouettes, robot->name(),
                  triangles, level.cameras[0].width, level.cameras[0].height, "engine", "gl_pass", "ms");
  for (const auto& t : timings) {
    table +=
        fmt::format("{:<8} {:<8} {:>9}  {}\n", t.engine, t.gl_pass.empty() ? "-" : t.gl_pass,
                    t.error.empty() ? fmt::format("{:.2f}", t.ms) : "-", t.error.empty() ? t.description : t.error);
  }
  std::string reason;
  const auto chosen = fastest_engine(level.model, level.cameras, options.silhouette, silhouettes, reason);
  return table + fmt::format("\nsilhouette.engine in force: {} ({})\n",
                             chosen.engine + (chosen.engine == "atlas" ? " " + chosen.gl_pass : ""), reason);
}

}  // namespace bodyschema
