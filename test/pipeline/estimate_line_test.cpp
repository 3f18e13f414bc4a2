#include "bodyschema/pipeline/estimate_line.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace bodyschema {
namespace {

class EstimateLine : public testing::Test {
 protected:
  EstimateLine() {
    estimate.joint_names = {"elbow", "wrist"};
    estimate.offset_rad = Eigen::Vector2d(radians(2.0), 0.0);
    estimate.covariance_rad2 = Eigen::Vector2d(radians(0.1), radians(4.9)).array().square().matrix().asDiagonal();
    estimate.prior_sd_rad = Eigen::Vector2d::Constant(radians(5.0));
    estimate.hand_sd_m = 5e-4;
  }
  [[nodiscard]] nlohmann::json line() const { return nlohmann::json::parse(estimate_line(estimate, {})); }
  Estimate estimate;
};

TEST_F(EstimateLine, EveryNumberCarriesItsUnitAndHowWellItIsKnown) {
  estimate.effects = {{.effect = "head_offset",
                       .joint = "neck_pitch",
                       .source = "",
                       .parameter = "angle",
                       .name = "head_offset of neck_pitch",
                       .unit = "deg",
                       .si_per_unit = kPi / 180.0,
                       .value = radians(-3.0),
                       .sd = radians(0.7),
                       .prior_sd = radians(3.0)},
                      {.effect = "principal_point",
                       .joint = "",
                       .source = "difference",
                       .parameter = "cx",
                       .name = "principal_point difference cx",
                       .unit = "px",
                       .si_per_unit = 1.0,
                       .value = 0.5,
                       .sd = 0.05,
                       .prior_sd = 0.4}};
  const auto json = line();
  EXPECT_NEAR(json.at("offset_deg").at("elbow").get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(json.at("stddev_deg").at("elbow").get<double>(), 0.1, 1e-12);
  EXPECT_EQ(json.at("told"), nlohmann::json({"elbow"}));
  ASSERT_EQ(json.at("effects").size(), 2u);
  const auto& neck = json["effects"][0];
  EXPECT_EQ(neck.at("name"), "head_offset");
  EXPECT_EQ(neck.at("joint"), "neck_pitch");
  EXPECT_FALSE(neck.contains("source"));
  EXPECT_EQ(neck.at("parameter"), "angle");
  EXPECT_EQ(neck.at("unit"), "deg");
  EXPECT_NEAR(neck.at("value").get<double>(), -3.0, 1e-12);
  EXPECT_NEAR(neck.at("stddev").get<double>(), 0.7, 1e-12);
  EXPECT_NEAR(neck.at("prior_stddev").get<double>(), 3.0, 1e-12);
  const auto& point = json["effects"][1];
  EXPECT_EQ(point.at("source"), "difference");
  EXPECT_EQ(point.at("unit"), "px");
  EXPECT_NEAR(point.at("value").get<double>(), 0.5, 1e-12);
  EXPECT_NEAR(json.at("hand_sd_mm").get<double>(), 0.5, 1e-12);
}

TEST_F(EstimateLine, SaysWhatTheFrameSaysOfTheMemoryAndOnlyWhatThereIsToSay) {
  estimate.state = EstimatorState::kModelMisfit;
  estimate.verdict = FrameVerdict::kDoubtful;
  estimate.hand_sd_limit_m = 1e-3;
  estimate.innovation = 30.0;
  estimate.innovation_dof = 9.0;
  estimate.innovation_usual = 1.5;
  estimate.postures = 4;
  estimate.posture_sd_rad = radians(0.07);
  estimate.outline_sd_px = 0.3;
  estimate.outline_alike = 5.0;
  auto json = line();
  EXPECT_EQ(json.at("state"), "model_misfit");
  EXPECT_EQ(json.at("verdict"), "doubtful");
  EXPECT_NEAR(json.at("hand_sd_limit_mm").get<double>(), 1.0, 1e-12);
  const nlohmann::json innovation = {{"nis", 30.0}, {"dof", 9.0}, {"usual", 1.5}};
  EXPECT_EQ(json.at("innovation"), innovation);
  EXPECT_EQ(json.at("postures"), 4);
  EXPECT_NEAR(json.at("posture_sd_deg").get<double>(), 0.07, 1e-12);
  const nlohmann::json outline = {{"stddev_px", 0.3}, {"points_alike", 5.0}};
  EXPECT_EQ(json.at("outline"), outline);
  for (const char* key : {"changed", "misfit", "stalled", "cameras_swapped"}) EXPECT_FALSE(json.contains(key)) << key;

  estimate.changed = "elbow slipped by 4.9 deg";
  estimate.misfit = "postures disagree";
  estimate.stalled_joint = "wrist";
  estimate.stalled_motion_rad = radians(6.0);
  estimate.cameras_swapped = true;
  json = line();
  EXPECT_EQ(json.at("changed"), estimate.changed);
  EXPECT_EQ(json.at("misfit"), estimate.misfit);
  EXPECT_EQ(json.at("stalled").at("joint"), "wrist");
  EXPECT_NEAR(json["stalled"].at("moved_deg").get<double>(), 6.0, 1e-12);
  EXPECT_TRUE(json.at("cameras_swapped"));
}

/// Half a degree, and a third of what was believed before: neither alone is enough, nor are both of a wrong model.
TEST(Told, NeedsMoreThanWasBelievedAndHalfADegree) {
  Estimate estimate;
  estimate.joint_names = {"a", "b", "c"};
  estimate.prior_sd_rad = Eigen::Vector3d(radians(5.0), radians(5.0), radians(0.6));
  estimate.covariance_rad2 =
      Eigen::Vector3d(radians(0.49), radians(0.51), radians(0.3)).array().square().matrix().asDiagonal();
  EXPECT_TRUE(estimate.told(0));
  EXPECT_FALSE(estimate.told(1));
  EXPECT_FALSE(estimate.told(2)) << "hardly more than was believed";
  estimate.state = EstimatorState::kModelMisfit;
  EXPECT_FALSE(estimate.told(0)) << "the pictures contradict what that rests on";
}

}  // namespace
}  // namespace bodyschema
