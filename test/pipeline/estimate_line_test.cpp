#include "bodyschema/pipeline/estimate_line.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace bodyschema {
namespace {

TEST(EstimateLine, EveryNumberCarriesItsUnitAndHowWellItIsKnown) {
  Estimate estimate;
  estimate.joint_names = {"elbow"};
  estimate.offset_rad = Eigen::VectorXd::Constant(1, radians(2.0));
  estimate.covariance_rad2 = Eigen::MatrixXd::Constant(1, 1, radians(0.1) * radians(0.1));
  estimate.nuisance_names = {"neck_pitch", "vergence", "principal_difference_x", "mesh_scale"};
  estimate.nuisance_units = {"rad", "rad", "px", "1"};
  estimate.head_joints = 1;
  estimate.nuisance = Eigen::Vector4d(radians(-3.0), 0.01, 0.5, 0.002);
  estimate.nuisance_sd = Eigen::Vector4d(radians(0.7), 0.001, 0.05, 0.0002);
  const auto json = nlohmann::json::parse(estimate_line(estimate, {}));
  EXPECT_NEAR(json.at("offset_deg").at("elbow").get<double>(), 2.0, 1e-12);
  EXPECT_NEAR(json.at("stddev_deg").at("elbow").get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(json.at("head_offset_deg").at("neck_pitch").get<double>(), -3.0, 1e-12);
  EXPECT_NEAR(json.at("head_stddev_deg").at("neck_pitch").get<double>(), 0.7, 1e-12);
  const nlohmann::json values = {{"vergence_rad", 0.01}, {"principal_difference_x_px", 0.5}, {"mesh_scale", 0.002}};
  EXPECT_EQ(json.at("nuisance"), values);
  const nlohmann::json sds = {{"vergence_rad", 0.001}, {"principal_difference_x_px", 0.05}, {"mesh_scale", 0.0002}};
  EXPECT_EQ(json.at("nuisance_stddev"), sds);
}

}  // namespace
}  // namespace bodyschema
