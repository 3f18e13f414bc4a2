#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class ExtendedModel : public ::testing::Test {
 protected:
  ExtendedModel() : file_(fs::temp_directory_path() / ("extended_" + std::to_string(getpid()) + ".yaml")) {}
  ~ExtendedModel() override { fs::remove(file_); }
  void write(const std::string& text) const { std::ofstream(file_) << text; }
  [[nodiscard]] Pipeline pipeline(bool extended = true) const {
    return Pipeline(
        Configuration::load(fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                            {"robot.extended_model='" + (extended ? file_.string() : std::string()) + "'"}));
  }
  void refuse(const std::string& words) const {
    try {
      (void)pipeline();
      ADD_FAILURE() << "no error: " << words;
    } catch (const ConfigurationError& e) {
      EXPECT_THAT(e.what(), HasSubstr(file_.string()));
      EXPECT_THAT(e.what(), HasSubstr(words));
    }
  }
  fs::path file_;
};

TEST_F(ExtendedModel, ChangesTheRigAndNamesItself) {
  write("version: 1\neffects:\n  - {name: focal_length, parameters: {scale_percent: 2}}\n");
  const Pipeline plain = pipeline(false);
  const Pipeline extended = pipeline();
  EXPECT_FALSE(plain.error_model());
  ASSERT_TRUE(extended.error_model());
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_NEAR(extended.rig().cameras[c].intrinsics.fx, 1.02 * plain.rig().cameras[c].intrinsics.fx, 1e-9);
  }
  EXPECT_EQ(describe(*extended.error_model()), "focal_length scale 2 %");
  EXPECT_NE(plain.model_hash(), extended.model_hash());
}

TEST_F(ExtendedModel, WhatCannotBeReadIsNamed) {
  refuse("cannot be read");
  write("version: 2\neffects: []\n");
  refuse("version is '2', expected 1");
  write("effects: []\n");
  refuse("expected 1");
  write("version: 1\neffects:\n  - {name: latencie, parameters: {delay_ms: 3}}\n");
  refuse(":3: unknown effect 'latencie'; did you mean 'latency'?");
  write("version: 1\neffects:\n  - {name: latency, parameters: {delay_ms: late}}\n");
  refuse("'delay_ms' is 'late', expected a finite number");
  write("version: 1\neffects:\n  - {name: backlash, joint: r_elbo, parameters: {width_deg: 1}}\n");
  refuse("did you mean 'r_elbow'?");
}

}  // namespace
}  // namespace bodyschema
