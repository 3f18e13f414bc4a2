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

}  // namespace
}  // namespace bodyschema
