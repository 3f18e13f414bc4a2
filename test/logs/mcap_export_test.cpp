#include "bodyschema/logs/mcap_export.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "bodyschema/logs/log_summary.hpp"
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

/// Chunks are not compressed: what was written stands in the file.
std::string written(const McapExportOptions& options) {
  (void)export_mcap(options);
  std::ifstream stream(options.out, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TEST(McapExport, JointsThatSlideAreInMetres) {
  const auto log = testing_logs::scratch_file("sliding.lcmlog");
  auto message = testing_logs::joints(testing_logs::kBegin, 0.5f, 0.25f);
  message.joint_velocity = {0.0f, 0.125f};
  message.joint_name = {"elbow", "lift"};
  LogWriter(log).publish("JOINTS", 1, encode(message));
  McapExportOptions options{log, testing_logs::scratch_file("sliding.mcap")};
  EXPECT_THAT(written(options), testing::Not(testing::HasSubstr("position_m")));
  options.sliding_joints = {"lift"};
  const std::string known = written(options);
  EXPECT_THAT(known, testing::HasSubstr(R"("position_m":{"lift":0.25},"velocity_m_s":{"lift":0.125}})"));
  EXPECT_THAT(known, testing::HasSubstr(R"("position_deg":{"elbow":28.6)"));
}

TEST(McapExport, NamesThatAreNoUtf8AreReplacedNotRefused) {
  const auto log = testing_logs::scratch_file("latin.lcmlog");
  auto message = testing_logs::joints(testing_logs::kBegin, 0.1f, 0.2f);
  message.joint_name[0] = "coud\xe9";
  LogWriter(log).publish("JOINTS", 1, encode(message));
  const auto summary = export_mcap({log, testing_logs::scratch_file("latin.mcap")});
  EXPECT_EQ(summary.messages.at("/JOINTS"), 1u);
  EXPECT_NO_THROW((void)summarise_log(log).json());
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

TEST(McapExport, NeverOverwritesTheLog) {
  const auto log = testing_logs::swinging_log("kept.lcmlog.part");
  const auto bytes = [&] {
    std::ifstream stream(log, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(stream), {});
  };
  const std::string before = bytes();
  const auto link = testing_logs::scratch_file("link.lcmlog");
  fs::remove(link);
  fs::create_symlink(log, link);
  const auto becomes_it = testing_logs::scratch_file("kept.lcmlog");  // ".part" is added while it is written
  const std::vector<McapExportOptions> wrong = {{log, log}, {link, log}, {log, link}, {log, becomes_it}};
  for (const auto& options : wrong) {
    EXPECT_THAT([&] { (void)export_mcap(options); },
                testing::ThrowsMessage<FileError>(testing::AllOf(testing::HasSubstr(options.log.string()),
                                                                 testing::HasSubstr(options.out.string()))));
    EXPECT_EQ(bytes(), before) << options.log << " to " << options.out;
  }
}

}  // namespace
}  // namespace bodyschema
