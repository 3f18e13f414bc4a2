#include "bodyschema/core/user_cache.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

class UserCache : public testing::Test {
 protected:
  void SetUp() override {
    unsetenv("XDG_CACHE_HOME");
    unsetenv("HOME");
  }
  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path() / "cache";
};

TEST_F(UserCache, KeepsWhatIsWritten) {
  setenv("XDG_CACHE_HOME", folder_.c_str(), 1);
  EXPECT_FALSE(read_cache("a/b"));
  const std::string bytes("one\0two", 7);
  write_cache("a/b", bytes);
  EXPECT_EQ(read_cache("a/b"), bytes);
  EXPECT_TRUE(fs::exists(folder_ / "bodyschema/a/b"));
}

TEST_F(UserCache, LiesInTheHomeWhereNothingElseIsSaid) {
  setenv("HOME", folder_.c_str(), 1);
  setenv("XDG_CACHE_HOME", "not/absolute", 1);
  write_cache("name", "text");
  EXPECT_TRUE(fs::exists(folder_ / ".cache/bodyschema/name"));
}

TEST_F(UserCache, NothingIsKeptWhereNothingCanBe) {
  write_cache("name", "text");
  EXPECT_FALSE(read_cache("name"));
  fs::create_directories(folder_);
  std::ofstream(folder_ / "file") << "no folder";
  setenv("XDG_CACHE_HOME", (folder_ / "file").c_str(), 1);
  write_cache("name", "text");
  EXPECT_FALSE(read_cache("name"));
}

}  // namespace
}  // namespace bodyschema
