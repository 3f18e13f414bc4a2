#pragma once

#include <string>
#include <vector>

#include "bodyschema/simulator/simulator_settings.hpp"

namespace bodyschema::simulator {

/// An everyday condition by name: settings that make it, on top of whatever else is set.
struct Scene {
  std::string name;
  std::string meaning;                 ///< one line
  std::vector<std::string> overrides;  ///< "simulator.key=value", as for Configuration::load and --set
};
/// All of them; the last one, "kitchen", is all conditions at once.
const std::vector<Scene>& scenes();
/// Throws ConfigurationError naming the nearest one.
const Scene& scene(const std::string& name);
/// Puts a scene's settings over others. Throws as `scene`.
void apply_scene(SimulatorSettings& settings, const std::string& name);

}  // namespace bodyschema::simulator
