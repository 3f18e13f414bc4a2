#include "bodyschema/diagnosis/diagnosis_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>
#include <string_view>

#include "bodyschema/geometry/pose.hpp"
#include "random_seed.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

/// A report in which the elbow's correction follows its angle before the extension and nothing after.
DiagnosisReport report() {
  DiagnosisReport r;
  r.verdict = "named";
  r.sentence = "The log asks for: encoder_gain of r_elbow.";
  DiagnosedCause cause;
  cause.cause = {"encoder_gain", "r_elbow", ""};
  cause.parameters = {{"gain", "%", 4.0, {3.5, 4.5}}};
  cause.same = {cause.cause, {"eccentricity", "r_elbow", ""}};
  cause.advice = "Sweep r_elbow through more than 90 deg.";
  cause.z = 12.0;
  cause.heldout_gain = 0.31;
  r.causes = {cause};
  r.arm_joints = {"r_shoulder_roll", "r_elbow"};
  r.bars = {{"encoder_gain of r_elbow", false, 12.0, 0.5}, {"latency", false, 1.0, 0.7}, {"payload", false, 0.0, 0.0}};
  r.z_threshold = 4.5;
  r.before = {0.9, 2.0, 0.8};
  r.after = {0.3, 0.2, 0.1, 0.61, 0.93};
  r.offsets_deg_before = {{"r_shoulder_roll", 1.0}, {"r_elbow", 2.0}};
  r.offsets_deg_after = {{"r_shoulder_roll", 1.5}, {"r_elbow", 2.5}};
  r.not_testable = {{{"payload", "", ""}, "the robot's URDF has no masses"}};
  r.exclusion_limits = {{{"latency", "", ""}, "delay", "ms", 4.2}};
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, 0.05);
  for (int i = 0; i < 300; ++i) {
    ResidualSample s;
    s.time_s = 0.2 * i;
    s.before.rms_px = 0.9;
    s.after.rms_px = 0.3;
    s.angle_deg = {10.0, 60.0 + 30.0 * std::sin(0.1 * i)};
    s.velocity_deg_s = {0.0, 15.0 * std::cos(0.1 * i)};
    s.torque_nm = {0.0, 0.0};
    s.before.apparent_deg = {normal(random), 0.04 * (s.angle_deg[1] - 60.0) + normal(random)};
    s.after.apparent_deg = {normal(random), normal(random)};
    s.noise = s.after;
    r.samples.push_back(std::move(s));
  }
  return r;
}

std::string page_of(const DiagnosisReport& r) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "page.html";
  diagnosis_page(r, "babble.log", {}).write(file);
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The values of a line of the chart whose title begins so.
std::vector<double> line_of(const std::string& page, const std::string& title, const std::string& name) {
  constexpr std::string_view kBegin = "new Chart(document.getElementById('";
  for (auto at = page.find(kBegin); at != std::string::npos; at = page.find(kBegin, at + 1)) {
    const auto begin = page.find('{', at), end = page.find(");\n", begin);
    const auto chart = nlohmann::json::parse(page.substr(begin, end - begin));
    if (!chart["options"]["plugins"]["title"]["text"].get<std::string>().starts_with(title)) continue;
    std::vector<double> values;
    for (const auto& series : chart["data"]["datasets"]) {
      if (series["label"] != name) continue;
      for (const auto& point : series["data"]) values.push_back(point["y"]);
    }
    return values;
  }
  return {};
}

TEST(DiagnosisPage, BeginsWithTheVerdictAndShowsEveryPart) {
  const auto page = page_of(report());
  const auto verdict = page.find("The log asks for: encoder_gain of r_elbow.");
  const auto gain = page.find("What the extension gains"), chart = page.find("All candidates");
  ASSERT_NE(verdict, std::string::npos);
  EXPECT_LT(verdict, gain);
  EXPECT_LT(gain, chart);
  for (const char* part : {"3.5 to 4.5", "31.0 %", "Sweep r_elbow", "eccentricity of r_elbow", "0.900 px", "0.300 px",
                           "threshold 4.5", "What this log cannot test", "no masses", "latency", "4.2 ms", "61 %",
                           "93 %", "z = 4.5", "rising against falling"}) {
    EXPECT_THAT(page, HasSubstr(part));
  }
}

TEST(DiagnosisPage, ShowsTheJointThatFollowsItsVariable) {
  const auto page = page_of(report());
  EXPECT_THAT(page, HasSubstr("r_elbow against its angle (strongest of 2 joints)"));
  EXPECT_THAT(page, Not(HasSubstr("against its gravity torque")));  // nobody knows the torques
}

/// What no effect explains stays in the charts; taken for noise that stays alike it made its own bands so wide that
/// nothing stood out of them, and another joint was shown.
TEST(DiagnosisPage, ACurveThatNothingExplainsStandsOut) {
  auto r = report();
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, 0.1);
  for (auto& s : r.samples) {
    s.noise.apparent_deg = {normal(random), normal(random)};
    s.before.apparent_deg = s.noise.apparent_deg;
    s.before.apparent_deg[1] += std::sin(0.2 * s.time_s);
    s.after = s.before;
  }
  const auto page = page_of(r);
  EXPECT_THAT(page, HasSubstr("r_elbow over time (strongest of 2 joints)"));
  // Root mean square of the sine, before and after, where the table has the other joint's noise.
  const auto row = page.find(">r_elbow<", page.find("deg, before &gt; after"));
  ASSERT_NE(row, std::string::npos);
  EXPECT_THAT(page.substr(row, page.find("</tr>", row) - row), ContainsRegex("0\\.[67][0-9] &gt; 0\\.[67]"));
}

/// A wobble that goes round within one of the few points of a line was averaged away, and a slower, stronger joint
/// was shown where the sentence names another.
TEST(DiagnosisPage, ShowsWhatTheSentenceCallsUnexplained) {
  auto r = report();
  r.causes.front().cause = {"unexplained", "r_elbow", ""};
  r.causes.front().variable = "time";
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal(0.0, 0.05);
  const auto samples = r.samples;
  r.samples.clear();
  for (int i = 0; i < 1200; ++i) {
    auto s = samples.front();
    s.time_s = 0.05 * i;
    s.noise.apparent_deg = {normal(random), normal(random)};
    s.before.apparent_deg = s.noise.apparent_deg;
    s.before.apparent_deg[0] += 0.5 * std::sin(0.05 * s.time_s);
    s.before.apparent_deg[1] += std::sin(2.0 * kPi / 4.2 * s.time_s);
    s.after = s.before;
    r.samples.push_back(std::move(s));
  }
  const auto page = page_of(r);
  EXPECT_THAT(page, HasSubstr("r_shoulder_roll over time (strongest of 2 joints)"));
  EXPECT_LT(page.find("r_elbow over time (named above)"), page.find("r_elbow against its angle"));
  const auto values = line_of(page, "r_elbow over time (named above)", "extended");
  ASSERT_FALSE(values.empty());
  EXPECT_GT(*std::max_element(values.begin(), values.end()), 0.8);
  EXPECT_LT(*std::min_element(values.begin(), values.end()), -0.8);
  const auto averaged = line_of(page, "r_shoulder_roll over time", "extended");
  EXPECT_EQ(averaged.size(), 14u) << "the other lines stay as smooth as they were";
}

TEST(DiagnosisPage, ShowsAnAccelerationThatTheSentenceNames) {
  auto r = report();
  r.causes.front().cause = {"unexplained", "r_elbow", ""};
  r.causes.front().variable = "acceleration";
  for (std::size_t i = 0; i < r.samples.size(); ++i) {
    r.samples[i].acceleration_deg_s2 = {0.0, std::sin(0.3 * static_cast<double>(i))};
  }
  EXPECT_THAT(page_of(r), HasSubstr("r_elbow against its acceleration (named above)"));
}

TEST(DiagnosisPage, OfNothingFoundSaysNothingOfCauses) {
  auto r = report();
  r.causes.clear();
  r.sentence = "The model explains the log to its noise.";
  const auto page = page_of(r);
  EXPECT_THAT(page, HasSubstr("How well the model predicts"));
  EXPECT_THAT(page, Not(HasSubstr("What was found")));
}

TEST(DiagnosisPage, SaysWhatTheModelLacksAndWhatIsLeftOver) {
  auto r = report();
  r.not_in_model = "14 cm2 beside the robot, in 96 % of the log";
  r.side_left_over = "the left outline of r_hand lies 0.8 px outside";
  const auto page = page_of(r);
  EXPECT_THAT(page, HasSubstr(r.not_in_model));
  EXPECT_THAT(page, HasSubstr(r.side_left_over));
}

TEST(DiagnosisPage, NeedsNoSamples) {
  auto r = report();
  r.samples.clear();
  r.bars.clear();
  EXPECT_THAT(page_of(r), HasSubstr("The log asks for"));
}

}  // namespace
}  // namespace bodyschema
