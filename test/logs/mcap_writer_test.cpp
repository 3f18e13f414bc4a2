#include "mcap_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "logs/recorded_log.hpp"

namespace bodyschema {
namespace {

TEST(McapWriter, RefusesMoreChannelsThanThereAreNumbers) {
  McapWriter writer(testing_logs::scratch_file("many.mcap"));
  const auto schema = writer.add_schema("s", "{}");
  for (int i = 0; i <= 65535; ++i) (void)writer.add_channel("/t", schema);
  EXPECT_THAT([&] { (void)writer.add_channel("/t", schema); },
              testing::ThrowsMessage<FileError>(testing::HasSubstr("65535")));
}

TEST(McapWriter, FollowsALinkAndDoesNotReplaceADevice) {
  const auto link = testing_logs::scratch_file("link.mcap"), file = testing_logs::scratch_file("file.mcap");
  std::filesystem::remove(link);
  std::filesystem::create_symlink(file, link);
  {
    McapWriter writer(link);
    writer.close();
  }
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_GT(std::filesystem::file_size(file), 16u);
  std::filesystem::remove(link);
  std::filesystem::create_symlink("/dev/full", link);
  const auto write_to_full_disk = [&] {
    McapWriter writer(link);
    const auto channel = writer.add_channel("/t", writer.add_schema("s", "{}"));
    writer.write(channel, 1, 1, std::string(100'000, ' '));
    writer.close();
  };
  EXPECT_THROW(write_to_full_disk(), DeviceError);
  EXPECT_TRUE(std::filesystem::is_symlink(link));
  EXPECT_FALSE(std::filesystem::exists(link.string() + ".part"));
}

}  // namespace
}  // namespace bodyschema
