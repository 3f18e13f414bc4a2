#include "bodyschema/fleet/fleet_report.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr Microseconds kBegin = 1'700'000'000'000'000;
constexpr Microseconds kWeek = 7ll * 24 * 3600 * 1'000'000;

class FleetReport : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(results_); }
  void write(const std::string& name, const std::string& content) const {
    const auto file = results_ / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file) << content;
  }
  void add_log(const std::string& log, Microseconds begin, const std::string& outcome,
               const std::string& report) const {
    write(log + "/info.json", "{\"begin_utime\": " + std::to_string(begin) + ", \"duration_s\": 61.5}");
    write(log + "/outcome.txt", outcome + "\n");
    if (!report.empty()) write(log + "/report.json", report);
  }
  static std::string backlash(double estimate, double elbow) {
    nlohmann::json j = {{"verdict", "named"},
                        {"sentence", "backlash of r_elbow"},
                        {"causes",
                         {{{"name", "backlash"},
                           {"joint", "r_elbow"},
                           {"parameter", "backlash"},
                           {"unit", "deg"},
                           {"estimate", estimate},
                           {"ci95", {estimate - 0.1, estimate + 0.1}}}}},
                        {"offsets_deg", {{"before", {{"r_elbow", 9.0}}}, {"after", {{"r_elbow", elbow}}}}}};
    return j.dump();
  }
  const TemporaryFolder folder_;
  const fs::path results_ = folder_.path() / "results";
};

TEST_F(FleetReport, FollowsACauseOverWeeks) {
  // Names sort against the dates: the dates count.
  add_log("alpha/c", kBegin, "diagnosed", backlash(0.8, 1.0));
  add_log("alpha/b", kBegin + kWeek, "diagnosed", backlash(1.0, 1.5));
  add_log("alpha/a", kBegin + 3 * kWeek, "diagnosed", backlash(1.4, 2.5));
  add_log("beta/only", kBegin, "diagnosed", R"({"verdict": "none", "sentence": "fine", "causes": []})");
  const auto robots = gather_fleet(results_);
  ASSERT_EQ(robots.size(), 2u);
  EXPECT_EQ(robots[0].name, "alpha");
  ASSERT_EQ(robots[0].logs.size(), 3u);
  EXPECT_EQ(robots[0].logs[0].name, "c");
  ASSERT_EQ(robots[0].causes.size(), 1u);
  EXPECT_EQ(robots[0].causes[0].name, "backlash of r_elbow");
  EXPECT_THAT(robots[0].causes[0].week, testing::ElementsAre(0.0, 1.0, 3.0));
  EXPECT_NEAR(robots[0].causes[0].per_week, 0.2, 1e-9);
  EXPECT_NEAR(robots[0].offsets.at(0).per_week, 0.5, 1e-9);
  EXPECT_EQ(robots[0].sentence(),
            "3 of 3 logs diagnosed; backlash of r_elbow in 3 logs (0.8 to 1.4 deg, +0.2 a week); "
            "the offset of r_elbow moved most, 1.00 to 2.50 deg");
  EXPECT_EQ(robots[1].sentence(), "1 of 1 logs diagnosed; nothing wrong beside the offsets");
}

// Before: "nothing wrong beside the offsets" of logs that none of the causes explained, and whose offset moved most.
TEST_F(FleetReport, OfLogsThatNothingExplainsItDoesNotSayThatNothingIsWrong) {
  const auto report = [](const char* verdict, double elbow) {
    return nlohmann::json{
        {"verdict", verdict}, {"causes", nlohmann::json::array()}, {"offsets_deg", {{"after", {{"r_elbow", elbow}}}}}}
        .dump();
  };
  add_log("alpha/a", kBegin, "diagnosed", report("unexplained", 1.0));
  add_log("alpha/b", kBegin + kWeek, "diagnosed", report("unexplained", 4.0));
  EXPECT_EQ(gather_fleet(results_).at(0).sentence(), "2 of 2 logs diagnosed; 2 logs hold what no known cause explains");
  add_log("alpha/c", kBegin + 2 * kWeek, "diagnosed", report("none", 2.0));
  EXPECT_EQ(gather_fleet(results_).at(0).sentence(),
            "3 of 3 logs diagnosed; nothing wrong beside the offsets in 1 of these; 2 logs hold what no known cause "
            "explains");
}

TEST_F(FleetReport, SaysWhyALogWasNotDiagnosed) {
  add_log("alpha/short", kBegin, "short.lcmlog: 4.0 s, at least 10 s are needed", "");
  add_log("alpha/broken", kBegin + 1, "diagnosed", "{\"verdict\": \"na");
  add_log("alpha/other", kBegin + 2, "diagnosed", R"({"something": "else"})");
  write("alpha/empty/info.json", "[]");
  const auto robots = gather_fleet(results_);
  ASSERT_EQ(robots.at(0).logs.size(), 4u);
  for (const auto& log : robots[0].logs) EXPECT_EQ(log.verdict, "not diagnosed") << log.name;
  EXPECT_THAT(robots[0].logs[1].sentence, HasSubstr("at least 10 s are needed"));
  EXPECT_THAT(robots[0].logs[2].sentence, HasSubstr("report.json: not valid JSON"));
  EXPECT_THAT(robots[0].logs[3].sentence, HasSubstr("no 'verdict'"));
  EXPECT_EQ(robots[0].sentence(), "0 of 4 logs diagnosed");
}

TEST_F(FleetReport, WritesOnePageForPeopleAndOneFileForPrograms) {
  add_log("alpha/a", kBegin, "diagnosed", backlash(0.8, 1.0));
  add_log("alpha/b", kBegin + kWeek, "diagnosed", backlash(1.0, 1.5));
  const auto out = results_.string() + "-report";
  const std::string lines = write_fleet_report(gather_fleet(results_), out);
  EXPECT_THAT(lines, HasSubstr("alpha: 2 of 2 logs diagnosed"));
  std::stringstream page;
  page << std::ifstream(fs::path(out) / "report.html").rdbuf();
  EXPECT_THAT(page.str(), HasSubstr("backlash of r_elbow: 0.8 deg (0.7 to 0.9)"));
  EXPECT_THAT(page.str(), HasSubstr("2023-11-14 22:13"));
  std::ifstream file(fs::path(out) / "fleet.json");
  const auto json = nlohmann::json::parse(file);
  EXPECT_EQ(json["robots"][0]["logs"][1]["causes"][0]["estimate"], 1.0);
  EXPECT_NEAR(json["robots"][0]["causes"][0]["per_week"].get<double>(), 0.2, 1e-9);
}

std::string elbow_of(double offset, double half_interval) {
  return nlohmann::json{{"verdict", "none"},
                        {"sentence", "fine"},
                        {"causes", nlohmann::json::array()},
                        {"offsets_deg", {{"after", {{"r_elbow", offset}, {"r_wrist", 1.0}}}}},
                        {"offsets_ci95_deg", {{"r_elbow", {offset - half_interval, offset + half_interval}}}}}
      .dump();
}

TEST_F(FleetReport, NamesTheLogThatDisagreesWithTheOthers) {
  // The one that stands alone is sure of itself: a mean of all would follow it.
  add_log("alpha/a", kBegin, "diagnosed", elbow_of(1.0, 0.4));
  add_log("alpha/b", kBegin + 8 * kWeek, "diagnosed", elbow_of(3.0, 0.02));
  add_log("alpha/c", kBegin + 16 * kWeek, "diagnosed", elbow_of(1.3, 0.4));
  add_log("alpha/d", kBegin + 24 * kWeek, "diagnosed", elbow_of(1.1, 0.4));
  add_log("undated/1", 10'000'000, "diagnosed", elbow_of(1.0, 0.4));  // as imports without --recorded-at
  add_log("undated/2", 10'000'000, "diagnosed", elbow_of(1.0, 0.4));
  add_log("beta/a", kBegin, "diagnosed", elbow_of(1.0, 0.4));
  add_log("beta/b", kBegin + kWeek, "diagnosed", elbow_of(1.5, 0.4));  // 0.5 +- 0.57
  const auto robots = gather_fleet(results_);
  const auto& found = robots.at(0).disagreements;
  ASSERT_EQ(found.size(), 4u);  // each of the others disagrees with that one
  EXPECT_EQ(found[0].log, "b");
  EXPECT_EQ(found[0].joint, "r_elbow");
  EXPECT_EQ(found[0].with, 3);
  EXPECT_EQ(found[0].of, 3);
  EXPECT_NEAR(found[0].others_deg, 1.1, 1e-9);
  EXPECT_EQ(found[1].with, 1);
  EXPECT_THAT(robots[0].sentence(), HasSubstr("; 4 logs disagree, most of all b on r_elbow (3.00 deg, others 1.10)"));
  EXPECT_TRUE(robots.at(1).disagreements.empty());
  const auto out = folder_.path() / "report";
  write_fleet_report(robots, out);
  std::stringstream page;
  page << std::ifstream(out / "report.html").rdbuf();
  EXPECT_THAT(page.str(), HasSubstr("3.00 (2.98 to 3.02)"));
  EXPECT_THAT(page.str(), HasSubstr("months since the first log"));
  EXPECT_THAT(page.str(), HasSubstr("days since the first log"));
  EXPECT_THAT(page.str(), HasSubstr("number of the log, by name"));
  EXPECT_THAT(page.str(), testing::Not(HasSubstr("1970-")));
  std::ifstream file(out / "fleet.json");
  EXPECT_EQ(nlohmann::json::parse(file)["robots"][0]["disagreements"][0]["with"], 3);
}

TEST_F(FleetReport, RefusesAFolderWithoutResults) {
  EXPECT_THROW((void)gather_fleet(results_), FileError);
  EXPECT_THROW((void)gather_fleet("/nonexistent"), FileError);
}

}  // namespace
}  // namespace bodyschema
