#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>

namespace {

/// The simulator must not know the estimator's view of the world: whatever it shares, it cannot
/// test. What it links is checked by CMake (test/simulator/CMakeLists.txt), what it includes here.
TEST(HouseRule, TheSimulatorIncludesNothingOfTheEstimator) {
  const std::filesystem::path root = BODYSCHEMA_SOURCE_DIR;
  const std::set<std::string> forbidden = {"effects", "silhouette", "estimator",  "diagnosis", "filter",
                                           "vision",  "pipeline",   "evaluation", "service",   "report"};
  const std::regex include(R"re(^\s*#\s*include\s*["<]bodyschema/([a-z_]+)/)re");
  int files = 0;
  for (const auto& folder : {root / "src/simulator", root / "include/bodyschema/simulator"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      const auto extension = entry.path().extension();
      if (extension != ".cpp" && extension != ".hpp") continue;
      ++files;
      std::ifstream stream(entry.path());
      for (std::string line; std::getline(stream, line);) {
        std::smatch match;
        if (std::regex_search(line, match, include)) {
          EXPECT_FALSE(forbidden.contains(match[1])) << entry.path() << ": " << line;
        }
      }
    }
  }
  EXPECT_GT(files, 40);
}

}  // namespace
