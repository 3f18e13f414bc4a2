#include "bodyschema/diagnosis/diagnosis_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "effects/roles.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

DiagnosisReport report() {
  DiagnosisReport r;
  r.verdict = "class";
  r.sentence = "Pictures arrive 58 ms late.";
  DiagnosedCause cause;
  cause.cause = {"axis_tilt", "r_elbow", ""};
  cause.sentence = "the axis is tilted";
  cause.parameters = {{"tilt_1", "deg", 0.1, {-0.2, 0.4}}, {"tilt_2", "deg", -2.0, {-2.2, -1.8}}};
  cause.same = {cause.cause, {"joint_coupling", "r_wrist_prosup", "r_elbow"}};
  cause.advice = "Move the two one at a time.";
  cause.z = 9.0;
  cause.heldout_gain = 0.4;
  r.causes = {cause};
  r.not_testable = {{{"payload", "", ""}, "no masses"}};
  r.exclusion_limits = {{{"latency", "", ""}, "delay", "ms", 4.2}};
  r.before = {0.9, 2.0, 0.8, 0.9, 0.95};
  r.offsets_deg_before = {{"r_elbow", 2.0}};
  r.offsets_deg_after = {{"r_elbow", 2.5}};
  r.offsets_ci95_deg = {{"r_elbow", {2.4, 2.6}}};
  r.warnings = {"the head stood still"};
  r.begin_utime = 1'600'000'000'000'000;
  r.duration_s = 60.0;
  r.views = 1200;
  r.blocks = 55;
  r.block_s = 1.0;
  return r;
}

TEST(DiagnosisReport, HasItsKeys) {
  const Json j = Json::parse(report().to_json());
  EXPECT_EQ(j["verdict"], "class");
  EXPECT_EQ(j["sentence"], "Pictures arrive 58 ms late.");
  EXPECT_EQ(j["crowded"], false);
  const auto& cause = j["causes"][0];
  EXPECT_EQ(cause["name"], "axis_tilt");
  EXPECT_EQ(cause["joint"], "r_elbow");
  EXPECT_FALSE(cause.contains("source"));
  // The parameter that stands for the cause is the one that is furthest from zero for its interval.
  EXPECT_EQ(cause["parameter"], "tilt_2");
  EXPECT_EQ(cause["unit"], "deg");
  EXPECT_EQ(cause["estimate"], -2.0);
  EXPECT_EQ(cause["ci95"], Json({-2.2, -1.8}));
  EXPECT_EQ(cause["parameters"].size(), 2u);
  EXPECT_EQ(cause["class"][1]["source"], "r_elbow");
  EXPECT_EQ(cause["motion_that_would_tell"], "Move the two one at a time.");
  EXPECT_EQ(cause["sentence"], "the axis is tilted");
  EXPECT_EQ(cause["z"], 9.0);
  EXPECT_EQ(cause["implausible"], false);
  EXPECT_EQ(cause["heldout_gain"], 0.4);
  EXPECT_EQ(j["not_testable"][0]["reason"], "no masses");
  EXPECT_EQ(j["not_testable"][0]["joint"], nullptr);
  EXPECT_EQ(j["exclusion_limits"][0]["limit"], 4.2);
  EXPECT_EQ(j["exclusion_limits"][0]["unit"], "ms");
  EXPECT_EQ(j["heldout"]["before"]["rms_px"], 0.9);
  EXPECT_EQ(j["heldout"]["before"]["outline_where_seen"], 0.95);
  EXPECT_EQ(j["heldout"]["after"]["hand_mm"], 0.0);
  EXPECT_EQ(j["offsets_deg"]["after"]["r_elbow"], 2.5);
  EXPECT_EQ(j["offsets_ci95_deg"]["r_elbow"], Json({2.4, 2.6}));
  EXPECT_EQ(j["log"]["blocks"], 55);
  EXPECT_EQ(j["log"]["views"], 1200);
  EXPECT_EQ(j["warnings"][0], "the head stood still");
  EXPECT_EQ(j["side_left_over"], nullptr);
  EXPECT_EQ(j["not_in_model"], nullptr);
}

TEST(DiagnosisReport, WhatIsNotKnownIsNull) {
  auto r = report();
  const double inf = std::numeric_limits<double>::infinity();
  r.causes[0].parameters = {{"tilt_1", "deg", 0.1, {-inf, inf}}};
  r.side_left_over = "the left outline of r_hand lies 0.8 px outside";
  const Json j = Json::parse(r.to_json());
  EXPECT_EQ(j["causes"][0]["ci95"], Json({nullptr, nullptr}));
  EXPECT_EQ(j["side_left_over"], r.side_left_over);
  r.causes[0].parameters.clear();
  EXPECT_EQ(Json::parse(r.to_json())["causes"][0]["estimate"], nullptr);
}

TEST(DiagnosisReport, SaysWhenAnEventWas) {
  auto r = report();
  auto& p = r.causes[0].parameters[1];
  EXPECT_EQ(p.when(r.begin_utime), "");
  p.from = r.begin_utime + 48'700'000;
  EXPECT_EQ(p.when(r.begin_utime), "48.7 s into the log");
  p.duration_s = 5.3;
  EXPECT_EQ(p.when(r.begin_utime), "from 48.7 to 54.0 s into the log");
  const Json j = Json::parse(r.to_json());
  EXPECT_EQ(j["causes"][0]["parameters"][1]["from_utime"], 1'600'000'048'700'000);
  EXPECT_EQ(j["causes"][0]["parameters"][1]["duration_s"], 5.3);
}

TEST(CauseName, IsReadAsPeopleSayIt) {
  EXPECT_EQ((CauseName{"latency", "", ""}.text()), "latency");
  EXPECT_EQ((CauseName{"slip", "r_elbow", ""}.text()), "slip of r_elbow");
  EXPECT_EQ((CauseName{"joint_coupling", "r_elbow", "r_shoulder_yaw"}.text()),
            "joint_coupling of r_elbow with r_shoulder_yaw");
  EXPECT_EQ((CauseName{"mesh_scale", "", "r_hand"}.text()), "mesh_scale r_hand");
}

TEST(DiagnosisReport, IsWrittenBesideItsModel) {
  const TemporaryFolder temporary;
  const auto folder = temporary.path() / "report";
  auto r = report();
  ErrorModel model(test::roles());
  model.add("latency", {}).parameters()[0].value = 0.058;
  r.extended_model = model;
  r.write(folder);
  std::ifstream in(folder / "report.json");
  EXPECT_EQ(Json::parse(in)["verdict"], "class");
  EXPECT_NEAR(
      ErrorModel::load(folder / "extended_model.yaml", test::roles()).find("latency", {})->parameters()[0].value, 0.058,
      1e-9);
  fs::remove_all(folder);
  // A folder that cannot be is said before the long work.
  std::ofstream(folder) << "a file";
  EXPECT_THROW(DiagnosisReport::prepare(folder), Error);
}

/// A log's name comes of the file system, which knows no encoding.
TEST(DiagnosisReport, NamesMayBeNoUtf8) {
  DiagnosisReport r = report();
  r.next_steps.push_back("bodyschema replay m\xfcnchen.lcmlog");
  EXPECT_TRUE(Json::accept(r.to_json()));
}

}  // namespace
}  // namespace bodyschema
