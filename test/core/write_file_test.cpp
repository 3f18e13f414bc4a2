#include "bodyschema/core/write_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class WriteFile : public ::testing::Test {
 protected:
  WriteFile() {
    const auto* running = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        fs::path(::testing::TempDir()) / ("write_file_" + std::string(running->name()) + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  ~WriteFile() override {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  static std::string text(const fs::path& file) {
    std::ifstream in(file);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
  template <typename Error, typename Write>
  static std::string error_of(Write write) {
    try {
      write();
    } catch (const Error& error) {
      return error.what();
    }
    return "no such error";
  }
  fs::path folder_;
};

TEST_F(WriteFile, WritesAllOfItAndNothingElse) {
  const auto file = folder_ / "a";
  write_file(file, std::string(300'000, 'x'));
  EXPECT_EQ(fs::file_size(file), 300'000u);
  write_file(file, "short\n");
  EXPECT_EQ(text(file), "short\n");
}

TEST_F(WriteFile, AFullDiskIsNoWrongFile) {
  EXPECT_THAT(error_of<DeviceError>([] { write_file("/dev/full", "text"); }),
              AllOf(HasSubstr("/dev/full"), HasSubstr("No space left")));
  EXPECT_THAT(error_of<DeviceError>([] { replace_file("/dev/full", "text"); }), HasSubstr("No space left"));
  EXPECT_TRUE(write_failure_passes(ENOSPC));
  EXPECT_FALSE(write_failure_passes(ENOENT));
}

TEST_F(WriteFile, AFolderThatIsNotThereIsAWrongFile) {
  const auto file = folder_ / "none" / "a";
  EXPECT_THAT(error_of<FileError>([&] { write_file(file, "text"); }),
              AllOf(HasSubstr(file.string()), HasSubstr("No such file or directory")));
  EXPECT_THAT(error_of<FileError>([&] { replace_file(file, "text"); }), HasSubstr("No such file or directory"));
}

TEST_F(WriteFile, ReplacesWhatALinkLeadsToAndKeepsItsPermissions) {
  const auto file = folder_ / "robot.urdf", link = folder_ / "corrected.urdf";
  write_file(file, "old");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_write);
  fs::create_symlink("robot.urdf", link);
  replace_file(link, "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(text(file), "new");
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_write);
  EXPECT_FALSE(fs::exists(folder_ / "robot.urdf.part"));
  fs::remove(file);
  replace_file(link, "first");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(text(file), "first");
}

TEST_F(WriteFile, AnUnfinishedFileIsGoneAndADeviceIsNotReplaced) {
  const auto file = folder_ / "a", device = folder_ / "device";
  {
    const UnfinishedFile unfinished(file);
    write_file(unfinished.part(), "half");
    EXPECT_EQ(unfinished.part(), UnfinishedFile::part_of(file));
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  fs::create_symlink("/dev/null", device);
  replace_file(device, "text");
  EXPECT_TRUE(fs::is_character_file(device));
  EXPECT_TRUE(fs::is_symlink(device));
}

TEST_F(WriteFile, OnAnErrorWhatWasThereIsThereStill) {
  const auto file = folder_ / "a";
  write_file(file, "old");
  fs::create_symlink("/dev/full", folder_ / "a.part");
  EXPECT_THAT(error_of<DeviceError>([&] { replace_file(file, "new"); }), HasSubstr("No space left"));
  EXPECT_EQ(text(file), "old");
  EXPECT_FALSE(fs::is_symlink(folder_ / "a.part"));
}

}  // namespace
}  // namespace bodyschema
