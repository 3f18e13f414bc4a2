#include "bodyschema/estimator/parameter.hpp"

#include <gmock/gmock.h>

#include "bodyschema/estimator/estimator_options.hpp"
#include "estimator/own_robot.hpp"

namespace bodyschema {
namespace {

using ParametersOfOwnRobot = OwnRobot;
using ::testing::Contains;
using ::testing::ElementsAreArray;
using ::testing::Not;

std::vector<std::string> names(const std::vector<Parameter>& parameters) {
  std::vector<std::string> result;
  for (const auto& p : parameters) result.push_back(p.name);
  return result;
}

TEST_F(ParametersOfOwnRobot, PaperModeEstimatesTheArmAlone) {
  EstimatorOptions options = EstimatorOptions::from(configuration_);
  options.mode = EstimatorMode::kPaper;
  const auto parameters = estimated_parameters(robot_, setup_, rig_, options);
  EXPECT_THAT(names(parameters), ElementsAreArray(setup_.estimated_joints));
  for (const auto& p : parameters) {
    EXPECT_EQ(p.joint, robot_->joint_index(p.name));
    EXPECT_EQ(p.prior_sd, options.filter.initial_sd_rad);
  }
}

TEST_F(ParametersOfOwnRobot, OfTheHeadOnlyWhatMovesBothEyes) {
  EstimatorOptions options = EstimatorOptions::from(configuration_);
  options.mode = EstimatorMode::kBest;
  options.priors.head_rad = 0.05;
  const auto parameters = names(estimated_parameters(robot_, setup_, rig_, options));
  for (const char* joint : {"neck_pitch", "neck_roll", "neck_yaw", "eyes_tilt"}) {
    EXPECT_THAT(parameters, Contains(joint));
  }
  for (const char* joint : {"l_eye_pan", "r_eye_pan"}) EXPECT_THAT(parameters, Not(Contains(joint)));
}

TEST_F(ParametersOfOwnRobot, APriorOfZeroLeavesANuisanceOutAndOneCameraHasNoDifferences) {
  EstimatorOptions options = EstimatorOptions::from(configuration_);
  options.mode = EstimatorMode::kBest;
  options.priors.vergence_rad = 0.01;
  options.priors.principal_difference_px = 0.4;
  options.priors.mesh_scale = 0.0;
  const auto two_eyes = names(estimated_parameters(robot_, setup_, rig_, options));
  EXPECT_THAT(two_eyes, Contains("vergence"));
  EXPECT_THAT(two_eyes, Contains("principal_difference_x"));
  EXPECT_THAT(two_eyes, Not(Contains("mesh_scale")));
  rig_.cameras.resize(1);
  const auto one_eye = names(estimated_parameters(robot_, setup_, rig_, options));
  EXPECT_THAT(one_eye, Not(Contains("vergence")));
  EXPECT_THAT(one_eye, Not(Contains("principal_difference_x")));
}

}  // namespace
}  // namespace bodyschema
