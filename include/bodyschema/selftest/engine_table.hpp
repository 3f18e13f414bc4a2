#pragma once

#include <filesystem>
#include <string>

namespace bodyschema {

/// What the silhouette engines take on this machine for a robot's frame (all its particles in all its cameras), as the
/// estimator scores them: a table for people, of what silhouette.engine and gl_pass `auto` choose from. Takes some
/// seconds; the cache is not read. Throws as Configuration::load and RobotModel::load.
/// @param config  an estimator's configuration
std::string engine_table(const std::filesystem::path& config);

}  // namespace bodyschema
