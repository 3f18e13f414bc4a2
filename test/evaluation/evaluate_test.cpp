#include "bodyschema/evaluation/evaluate.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "bodyschema/core/error.hpp"
#include "experiments.hpp"
#include "test_data.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using ::testing::HasSubstr;

const std::filesystem::path kConfigs = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config";

/// The message of the error that evaluating with such arguments ends in; nothing may be written.
std::string refusal(const std::string& experiment, const std::vector<std::string>& overrides) {
  const TemporaryFolder folder;
  const auto out = folder.path() / "refused";
  const std::filesystem::path file = kConfigs / "icub_right/evaluation.yaml";
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

TEST(Evaluate, RowsOfAnExperimentThatHasNoneAreRefused) {
  const TemporaryFolder folder;
  EvaluationOptions options;
  options.experiment = "all";
  options.rows = {"head"};
  options.out = folder.path() / "all";
  try {
    evaluate(Configuration::load(kConfigs / "icub_right/evaluation.yaml"), kConfigs, options);
    ADD_FAILURE() << "no error";
  } catch (const ConfigurationError& error) {
    EXPECT_STREQ(error.what(), "--rows: 'all' has no rows; expected with everyday, honesty, real");
  }
  EXPECT_FALSE(std::filesystem::exists(options.out));
}

TEST(Evaluate, AModeIsRefusedAsEveryExperimentRunsItsOwn) {
  EXPECT_THAT(refusal("likelihood", {"estimator.mode=paper"}), HasSubstr("estimator.mode: 'paper'"));
}

/// The environment without the variable that names the data, for as long as this lives.
class WithoutData {
 public:
  WithoutData() {
    if (const char* value = std::getenv(kName)) before_ = value;
    unsetenv(kName);
  }
  ~WithoutData() {
    if (before_) setenv(kName, before_->c_str(), 1);
  }

 private:
  static constexpr const char* kName = "BODYSCHEMA_DATA";
  std::optional<std::string> before_;
};

TEST(Evaluate, ExperimentsThatRunAnotherNumberOfTrialsSaySo) {
  const std::map<std::string, std::string> meanings(experiment_names().begin(), experiment_names().end());
  for (const auto& [name, words] : std::map<std::string, std::string>{{"slip", "at most 14 trials"},
                                                                      {"leave", "at most 14 trials"},
                                                                      {"camera", "at most 14 trials"},
                                                                      {"ablation", "at most 10 trials"},
                                                                      {"offsets", "always 6 trials"},
                                                                      {"honesty", "two logs a trial"},
                                                                      {"likelihood", "always one trial"},
                                                                      {"recording", "always one log"}}) {
    EXPECT_THAT(meanings.at(name), HasSubstr(words)) << name;
  }
}

TEST(Evaluate, AProgramThatIsNotThereIsNamedBeforeTheWork) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "bodyschemad") << "";
  try {
    check_live_programs(folder.path());
    ADD_FAILURE() << "no error";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr((folder.path() / "bodyschema-sim").string() + ": no such program"));
  }
}

TEST(Evaluate, WhatOneExperimentFoundIsThereWhenTheNextOneFails) {
  const TemporaryFolder folder;
  const auto file = folder.path() / "summary.json";
  const auto configuration = Configuration::load(kConfigs / "icub_right/evaluation.yaml");
  EvaluationOptions options;
  Json summary;
  std::string table;
  Report report("two experiments");
  ExperimentContext context{configuration, kConfigs, options, summary, table, report};
  const std::vector<ExperimentRun> two = {[](ExperimentContext& c) { c.summary["first"] = 1; },
                                          [](ExperimentContext&) { throw DataError("the second"); }};
  EXPECT_THROW(run_in_turn(two, context, file), DataError);
  EXPECT_EQ(Json::parse(std::ifstream(file))["first"], 1);
}

TEST(Evaluate, ARowOfHonestyThatDoesNotExistIsNamed) {
  EvaluationOptions options;
  options.experiment = "honesty";
  const TemporaryFolder folder;
  options.out = folder.path() / "honesty";
  options.rows = {"heald"};
  try {
    evaluate(Configuration::load(kConfigs / "icub_right/evaluation.yaml"), kConfigs, options);
    ADD_FAILURE() << "no error";
  } catch (const ConfigurationError& error) {
    EXPECT_STREQ(error.what(), "--rows: honesty has no row 'heald'; did you mean 'held'?");
  }
}

TEST(Evaluate, WhatIsSetAboutEstimatingReachesTheRecordingToo) {
  SKIP_WITHOUT("eyehand-sim");
  EvaluationOptions options;
  options.experiment = "recording";
  options.data = data_folder();
  const TemporaryFolder folder;
  options.out = folder.path() / "recording";
  // The simulator's robot is another one; how it is estimated is not.
  options.overrides = {"robot.urdf=/nowhere.urdf", "simulator.seed=1", "filter.particles=minus_one"};
  const WithoutData environment;
  try {
    evaluate(Configuration::load(kConfigs / "icub_right/evaluation.yaml"), kConfigs, options);
    ADD_FAILURE() << "no error";
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("filter.particles"));
  }
  EXPECT_EQ(std::getenv("BODYSCHEMA_DATA"), nullptr) << "what is in the environment is not the library's to change";
  std::filesystem::remove_all(options.out);
}

}  // namespace
}  // namespace bodyschema
