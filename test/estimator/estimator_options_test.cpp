#include "bodyschema/estimator/estimator_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

const std::filesystem::path kShipped = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/estimator.yaml";

TEST(EstimatorOptions, ShippedFileHoldsKnownKeysAndUnitsAreConverted) {
  const Configuration configuration =
      Configuration::load(kShipped, {"filter.spread_deg=2", "estimator.best.converged_hand_sd_mm=3"});
  const EstimatorOptions options = EstimatorOptions::from(configuration);
  EXPECT_NO_THROW(configuration.reject_unknown_keys());
  EXPECT_EQ(options.mode, EstimatorMode::kBest);
  EXPECT_DOUBLE_EQ(options.filter.spread_rad, radians(2.0));
  EXPECT_DOUBLE_EQ(options.converged_hand_sd_m, 3e-3);
  EXPECT_GT(options.priors.head_rad, 0.0);
}

TEST(EstimatorOptions, WhatCannotBeIsAnErrorThatNamesTheKey) {
  for (const std::string wrong : {"filter.particles=0", "filter.spread_decay=1.5", "estimator.mode=worst",
                                  "silhouette.threads=-1", "estimator.best.residual_sd_px=0"}) {
    try {
      EstimatorOptions::from(Configuration::load(kShipped, {wrong}));
      ADD_FAILURE() << wrong << " was taken";
    } catch (const ConfigurationError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr(wrong.substr(0, wrong.find('='))));
    }
  }
}

}  // namespace
}  // namespace bodyschema
