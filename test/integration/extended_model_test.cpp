#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "harness.hpp"

/// From a log with something wrong in it to a filter that knows it, through the programs a user runs.
namespace bodyschema::integration {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

const std::string kSimulator = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";

Json read_json(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return Json::parse(stream);
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

class ExtendedModel : public testing::Test {
 protected:
  /// Runs a program to its end; its exit status, with `err` set to what it said.
  int run(const std::vector<std::string>& command, Seconds limit = Seconds(300)) {
    Process process(command, scratch_.folder());
    const auto status = process.wait(limit);
    err = process.err();
    return status.value_or(-1);
  }
  std::string path(const std::string& name) const { return (scratch_ / name).string(); }

  Scratch scratch_;
  std::string err;
};

/// Pictures that come 60 ms late: no joint offset makes up for that in a moving arm.
TEST_F(ExtendedModel, DiagnosedLatencyIsAppliedAndTheHandsErrorFalls) {
  ASSERT_EQ(
      run({"bodyschema-sim", "--config", kSimulator, "--babble", "24", "--seed", "11", "--fault", "latency:value=60",
           "--log", path("late.log"), "--truth", path("truth.json"), "--set", "simulator.cameras.rate_hz=15"}),
      0)
      << err;
  ASSERT_EQ(
      run({"bodyschema", "diagnose", path("late.log"), "--config", reach_configuration(), "--out", path("diagnosis")}),
      0)
      << err;
  const Json report = read_json(scratch_ / "diagnosis/report.json");
  const auto& causes = report.at("causes");
  ASSERT_FALSE(causes.empty()) << report.at("sentence");
  bool found = false;
  for (const auto& cause : causes) {
    if (cause.at("name") != "latency") continue;
    found = true;
    EXPECT_NEAR(cause.at("estimate").get<double>(), 60.0, 6.0);
  }
  EXPECT_TRUE(found) << report.at("sentence");
  const std::string page = read_text(scratch_ / "diagnosis/report.html");
  EXPECT_THAT(page, HasSubstr("latency"));
  EXPECT_THAT(page, HasSubstr("data:image/jpeg;base64,"));
  EXPECT_THAT(page, testing::Not(HasSubstr("src=\"http")));

  const auto error_mm = [&](const std::string& out, const std::vector<std::string>& more) {
    (void)replay_estimates(scratch_ / "late.log", scratch_ / out, [&] {
      std::vector<std::string> all = {"--truth", path("truth.json")};
      all.insert(all.end(), more.begin(), more.end());
      return all;
    }());
    const Json errors = read_json(scratch_ / out / "summary.json").at("errors").at("left");
    return errors.at("final_on_all_frames").at("position_mm").at("after").get<double>();
  };
  const std::vector<std::string> extended = {"--extended-model", path("diagnosis/extended_model.yaml")};
  const double before = error_mm("plain", {});
  const double after = error_mm("extended", extended);
  std::printf("hand error %.2f -> %.2f mm\n", before, after);
  EXPECT_LT(after, before / 3.0);

  std::vector<std::string> command = {
      "bodyschema", "export", path("extended/summary.json"), "--config", reach_configuration(), "--out", path("apply")};
  EXPECT_NE(run(command), 0);
  EXPECT_THAT(err, HasSubstr("--extended-model"));
  command.insert(command.end(), extended.begin(), extended.end());
  ASSERT_EQ(run(command), 0) << err;
  const std::string applied = read_text(scratch_ / "apply/what_was_applied.txt");
  EXPECT_LT(applied.find("cannot hold"), applied.find("latency delay"));
}

TEST_F(ExtendedModel, DiagnoseRefusesInOneSentenceWhatItCannotUse) {
  const auto refused = [&](const std::vector<std::string>& simulation, const std::vector<std::string>& more,
                           const std::string& words) {
    std::vector<std::string> command = {"bodyschema-sim", "--config", kSimulator, "--log", path("log")};
    command.insert(command.end(), simulation.begin(), simulation.end());
    ASSERT_EQ(run(command), 0) << err;
    command = {"bodyschema", "diagnose", path("log"), "--config", reach_configuration(), "--out", path("out")};
    command.insert(command.end(), more.begin(), more.end());
    EXPECT_NE(run(command), 0);
    EXPECT_THAT(err, HasSubstr(words));
    EXPECT_THAT(err, HasSubstr("record"));
  };
  refused({"--frames", "40"}, {}, "too short for a diagnosis: ");
  refused({"--frames", "40"}, {"--set", "bus.channel_prefix=LAB"}, "no encoder readings on channel LAB_JOINT_STATE");
}

}  // namespace
}  // namespace bodyschema::integration
