#include "bodyschema/logs/mcap_export.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "recorded_log.hpp"

/// What is in the file is checked with the official reader, test/install/mcap_reads_back.py.
namespace bodyschema {
namespace {

namespace fs = std::filesystem;

TEST(McapExport, CountsWhatItWrites) {
  const auto out = testing_logs::scratch_file("counts.mcap");
  const auto summary = export_mcap({testing_logs::swinging_log("counts.lcmlog"), out});
  EXPECT_THAT(summary.messages, testing::UnorderedElementsAre(testing::Pair("/ICUB_JOINT_STATE", 400u),
                                                              testing::Pair("/ICUB_CAMERAS/left", 30u),
                                                              testing::Pair("/ICUB_CAMERAS/right", 30u)));
  EXPECT_EQ(summary.unreadable, 0u);
  EXPECT_EQ(summary.bytes, fs::file_size(out));
  EXPECT_FALSE(fs::exists(out.string() + ".part"));
}

TEST(McapExport, LeavesOutWhatCannotBeRead) {
  const auto log = testing_logs::scratch_file("partly.lcmlog");
  {
    LogWriter writer(log);
    auto message = testing_logs::pictures(testing_logs::kBegin, Image(8, 8, 3), Image(8, 8, 1));
    message.images[1].data.resize(20);
    message.images[1].size = 20;
    writer.publish("CAMERAS", 1, encode(message));
    writer.publish("OTHERS", 2, std::vector<std::uint8_t>(9, 1));
  }
  const auto summary = export_mcap({log, testing_logs::scratch_file("partly.mcap")});
  EXPECT_EQ(summary.messages.at("/CAMERAS/left"), 1u);
  EXPECT_EQ(summary.unreadable, 1u);
  EXPECT_EQ(summary.unknown, 1u);
}

TEST(McapExport, FailsWithOneClearErrorAndLeavesNothing) {
  const auto log = testing_logs::scratch_file("nothing.lcmlog");
  LogWriter(log).publish("OTHERS", 2, std::vector<std::uint8_t>(9, 1));
  const auto out = testing_logs::scratch_file("nothing.mcap");
  EXPECT_THROW(export_mcap({log, out}), DataError);
  EXPECT_FALSE(fs::exists(out));
  EXPECT_FALSE(fs::exists(out.string() + ".part"));
  EXPECT_THROW(export_mcap({"/nonexistent.lcmlog", out}), FileError);
  EXPECT_THROW(export_mcap({testing_logs::swinging_log("unwritten.lcmlog"), "/nonexistent/a.mcap"}), FileError);
}

}  // namespace
}  // namespace bodyschema
