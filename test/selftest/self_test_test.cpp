#include "bodyschema/selftest/self_test.hpp"

#include "bodyschema/selftest/engine_table.hpp"

#include <cstdio>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "own_port.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;

class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) { setenv(name, value.c_str(), 1); }
  ~Environment() { unsetenv(name_); }

 private:
  const char* name_;
};

std::map<std::string, CheckResult> check(const SelfTestOptions& options, CheckLevel* worst = nullptr) {
  std::map<std::string, CheckResult> results;
  const CheckLevel level = run_self_test(options, [&](const CheckResult& r) { results[r.name] = r; });
  if (worst != nullptr) *worst = level;
  return results;
}

SelfTestOptions usual() {
  SelfTestOptions options;
  options.version = "1.2.3";
  options.lcm_url = own_lcm_url();
  return options;
}

TEST(SelfTest, AGoodInstallationPasses) {
  auto results = check(usual());
  EXPECT_THAT(results["version"].sentence, HasSubstr("bodyschema 1.2.3, LCM 1."));
  for (const char* name : {"version", "files", "robot", "engine"}) {
    EXPECT_EQ(results[name].level, CheckLevel::kOk) << name << ": " << results[name].sentence;
  }
  // A slow machine is a warning; a wrong estimate is not.
  EXPECT_NE(results["reach"].level, CheckLevel::kFail) << results["reach"].sentence;
  EXPECT_THAT(results["reach"].sentence, HasSubstr("a simulated reach with wrong encoders: hand off by "));
  EXPECT_TRUE(results.contains("opengl"));
  EXPECT_TRUE(results.contains("network"));
  EXPECT_TRUE(results.contains("lcm"));
  EXPECT_FALSE(results.contains("config"));
}

TEST(EngineTable, NamesAllEnginesAndWhatIsInForce) {
  const std::string table =
      engine_table(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml");
  for (const char* word :
       {"400 silhouettes of ", "contour  - ", "atlas    raster", "atlas    compute", "silhouette.engine in force: "}) {
    EXPECT_THAT(table, HasSubstr(word));
  }
}

TEST(SelfTest, MissingFilesFailAndTheRestIsStillChecked) {
  const Environment share("BODYSCHEMA_SHARE", "/nonexistent");
  CheckLevel worst{};
  auto results = check(usual(), &worst);
  EXPECT_EQ(worst, CheckLevel::kFail);
  EXPECT_EQ(results["files"].level, CheckLevel::kFail);
  EXPECT_THAT(results["files"].sentence, HasSubstr("not in /nonexistent; install the package again"));
  EXPECT_FALSE(results.contains("robot"));
  EXPECT_FALSE(results.contains("reach"));
  EXPECT_EQ(results["engine"].level, CheckLevel::kOk);
  EXPECT_TRUE(results.contains("lcm"));
}

TEST(SelfTest, AReachThatIsTooShortToConvergeFails) {
  // Two frames are too few to converge; so the check can fail.
  auto options = usual();
  options.frames = 2;
  EXPECT_EQ(check(options)["reach"].level, CheckLevel::kFail);
}

TEST(SelfTest, OwnConfigurationIsCheckedToo) {
  auto options = usual();
  options.frames = 2;
  options.own_config = "config/icub_right/estimator.yaml";
  EXPECT_EQ(check(options)["config"].level, CheckLevel::kOk);
  options.own_config = "config/nowhere.yaml";
  const auto wrong = check(options)["config"];
  EXPECT_EQ(wrong.level, CheckLevel::kFail);
  EXPECT_THAT(wrong.sentence, HasSubstr("config/nowhere.yaml"));
}

TEST(SelfTest, WithoutANetworkItSaysSoWithTheCure) {
  const pid_t child = fork();
  if (child == 0) {
    constexpr int kCannot = 77;
    // A network of its own, with nothing in it.
    if (unshare(CLONE_NEWNET) != 0 && unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) _exit(kCannot);
    auto options = usual();
    options.frames = 2;
    auto results = check(options);
    const bool said = results["network"].level == CheckLevel::kWarn &&
                      results["network"].sentence.starts_with("no multicast route to 239.255.76.67") &&
                      results["network"].sentence.find("ip route add 224.0.0.0/4") != std::string::npos &&
                      results["lcm"].level == CheckLevel::kFail;
    if (!said) std::fprintf(stderr, "%s\n%s\n", results["network"].sentence.c_str(), results["lcm"].sentence.c_str());
    _exit(said ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "this user may not make a network namespace";
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace bodyschema
