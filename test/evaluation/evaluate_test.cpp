#include "bodyschema/evaluation/evaluate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

/// The message of the error that evaluating with such arguments ends in; nothing may be written.
std::string refusal(const std::string& experiment, const std::vector<std::string>& overrides) {
  const auto out = std::filesystem::temp_directory_path() / "bodyschema-evaluate-refused";
  const std::filesystem::path file =
      std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml";
  EvaluationOptions options;
  options.experiment = experiment;
  options.trials = 1;
  options.out = out;
  try {
    evaluate(Configuration::load(file, overrides), file, options);
  } catch (const ConfigurationError& error) {
    EXPECT_FALSE(std::filesystem::exists(out));
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

TEST(Evaluate, AMistypedExperimentIsNamedWithTheNearestOne) {
  EXPECT_THAT(refusal("experimnt2", {}), HasSubstr("did you mean 'experiment2'"));
}

TEST(Evaluate, AMistypedKeyIsAnErrorBeforeTheWork) {
  EXPECT_THAT(refusal("likelihood", {"filter.particless=10"}), HasSubstr("did you mean 'filter.particles'"));
  EXPECT_THAT(refusal("likelihood", {"simulator.blurr_px=1"}), HasSubstr("simulator.blurr_px"));
}

}  // namespace
}  // namespace bodyschema
