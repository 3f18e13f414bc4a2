#pragma once

#include <filesystem>

namespace bodyschema {

/// The folder that holds `config/` and `meshes/`: $BODYSCHEMA_SHARE when set; otherwise, from where
/// this program lies, `../share/bodyschema` (installed) or the source tree around its build folder.
/// Empty when there is none.
[[nodiscard]] std::filesystem::path data_directory();

/// The same for a program at `executable`, without looking at the environment; for tests.
[[nodiscard]] std::filesystem::path data_directory_of(const std::filesystem::path& executable);

/// A configuration, robot or mesh named on the command line: `path` itself when it exists, else
/// below data_directory(), so that `config/icub_right/estimator.yaml` works from any folder. A path
/// found nowhere is returned as it is, for the reader's error to name.
[[nodiscard]] std::filesystem::path find_data_file(const std::filesystem::path& path);

}  // namespace bodyschema
