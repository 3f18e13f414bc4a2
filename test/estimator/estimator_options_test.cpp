#include "bodyschema/estimator/estimator_options.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

const std::filesystem::path kShipped = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/estimator.yaml";

TEST(EstimatorOptions, ShippedFileHoldsKnownKeysAndUnitsAreConverted) {
  const Configuration configuration =
      Configuration::load(kShipped, {"filter.spread_deg=2", "estimator.best.converged_hand_sd_mm=3"});
  const EstimatorOptions options = EstimatorOptions::from(configuration);
  // What is believed of a robot is read with the robot (Beliefs): here its keys are known, effect by effect.
  const Configuration state = configuration.section("estimator").section("state");
  for (const auto& effect : state.keys()) EXPECT_NO_THROW((void)effect_kind(effect.substr(0, effect.find(' '))));
  for (const auto& effect : state.keys()) static_cast<void>(state.section(effect).keys());
  EXPECT_NO_THROW(configuration.reject_unknown_keys());
  EXPECT_EQ(options.mode, EstimatorMode::kBest);
  EXPECT_DOUBLE_EQ(options.filter.spread_rad, radians(2.0));
  EXPECT_DOUBLE_EQ(options.converged_hand_sd_m, 3e-3);
}

/// What is in force once the options have been read, by key with dots; numbers however they are written.
std::map<std::string, std::string> in_force(const Configuration& configuration) {
  EstimatorOptions::from(configuration);
  std::map<std::string, std::string> values;
  std::vector<std::string> sections = {""};
  std::istringstream text(configuration.print());
  for (std::string line; std::getline(text, line);) {
    const std::size_t indent = line.find_first_not_of(' '), colon = line.find(':');
    sections.resize(indent / 2 + 1);
    const std::string key = sections.back() + line.substr(indent, colon - indent);
    if (colon + 1 == line.size()) {
      sections.push_back(key + ".");
      continue;
    }
    if (sections.back().starts_with("estimator.state.")) continue;  // what is believed of a robot: Beliefs
    const std::string value = line.substr(colon + 2);
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    values[key] = *end == '\0' ? std::to_string(number) : value;
  }
  return values;
}

// Who leaves config/estimator.yaml out gets the same estimator.
TEST(EstimatorOptions, WhatAConfigurationLeavesOutIsAsShipped) {
  const auto shipped = in_force(Configuration::load(kShipped));
  EXPECT_GT(shipped.size(), 25u);
  EXPECT_EQ(in_force(Configuration::parse("{}")), shipped);
}

TEST(EstimatorOptions, WhatCannotBeIsAnErrorThatNamesTheKey) {
  for (const std::string wrong :
       {"filter.particles=0", "filter.spread_decay=1.5", "estimator.mode=worst", "silhouette.threads=-1",
        "estimator.best.outline_sd_px=0", "estimator.best.most_postures=1", "estimator.best.converged_hand_sd_mm=soon",
        "estimator.best.search_renders=0"}) {
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
