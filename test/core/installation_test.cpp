#include "bodyschema/core/installation.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

class InstallationTest : public testing::Test {
 protected:
  InstallationTest() {
    fs::remove_all(root_);
    for (const char* folder : {"prefix/bin", "prefix/share/bodyschema/config", "prefix/share/bodyschema/meshes",
                               "sources/config", "sources/meshes", "sources/build/release/bin", "elsewhere/bin"}) {
      fs::create_directories(root_ / folder);
    }
  }
  ~InstallationTest() override {
    unsetenv("BODYSCHEMA_SHARE");
    fs::remove_all(root_);
  }
  fs::path root_ = fs::temp_directory_path() / ("installation_test_" + std::to_string(getpid()));
};

TEST_F(InstallationTest, FindsTheInstalledFolderBesideBin) {
  EXPECT_EQ(data_directory_of(root_ / "prefix/bin/bodyschemad"), root_ / "prefix/share/bodyschema");
}

TEST_F(InstallationTest, FindsTheSourceTreeAroundABuild) {
  EXPECT_EQ(data_directory_of(root_ / "sources/build/release/bin/bodyschemad"), root_ / "sources");
}

TEST_F(InstallationTest, IsEmptyWhereThereIsNone) {
  EXPECT_TRUE(data_directory_of(root_ / "elsewhere/bin/bodyschemad").empty());
}

TEST_F(InstallationTest, FilesAreLookedForHereFirstThenInTheDataFolder) {
  setenv("BODYSCHEMA_SHARE", (root_ / "sources").c_str(), 1);
  std::ofstream(root_ / "sources/config/only_installed.yaml") << "version: 1\n";
  EXPECT_EQ(find_data_file("config/only_installed.yaml"), root_ / "sources/config/only_installed.yaml");
  EXPECT_EQ(find_data_file(root_ / "sources/config"), root_ / "sources/config");
  EXPECT_EQ(find_data_file("config/no_such_file.yaml"), "config/no_such_file.yaml");
}

}  // namespace
}  // namespace bodyschema
