#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "harness.hpp"

namespace bodyschema::integration {
namespace {

constexpr Seconds kStart(60.0);

std::string asked_for(const findings_t& message) {
  std::string text;
  for (const auto& f : message.finding) text += f.effect + " " + f.sentence + "; ";
  return text;
}

/// A robot whose pictures come late: the service says so while it runs, by how much, in every place; a replay of what
/// it recorded says the same at the same times.
TEST(LiveDiagnosis, TheServiceSaysThatPicturesComeLate) {
  if (const auto why = why_no_lcm(); !why.empty()) GTEST_SKIP() << why;
  const Scratch scratch;
  const std::string url = private_lcm_url();
  Listener listener(url);
  Process service({"bodyschemad", "--config", reach_configuration(), "--lcm-url", url, "--estimates",
                   (scratch / "live.jsonl").string(), "--record", (scratch / "live.lcmlog").string(),
                   "--stop-after-idle", "3", "--set", "silhouette.engine=contour", "--set", "filter.particles=60"},
                  scratch.folder());
  ASSERT_TRUE(service.said("waiting for", kStart)) << service.err();
  Process robot({"bodyschema-sim", "--config", std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml",
                 "--set", "simulator.cameras.rate_hz=5", "--set", "simulator.cameras.supersampling=1", "--babble", "36",
                 "--seed", "3", "--fault", "latency:value=100", "--lcm-url", url},
                scratch.folder());
  ASSERT_EQ(service.wait(Seconds(120)), 0) << service.err();
  const auto findings = listener.findings();
  ASSERT_FALSE(findings.empty());
  ASSERT_EQ(findings.back().num_findings, 1) << asked_for(findings.back());
  const auto& f = findings.back().finding[0];
  EXPECT_EQ(f.effect, "latency") << asked_for(findings.back());
  ASSERT_EQ(f.parameter_unit, std::vector<std::string>{"ms"});
  EXPECT_NEAR(f.parameter_value[0], 100.0, 15.0);
  EXPECT_GT(f.parameter_stddev[0], 0.0);
  const auto statuses = listener.statuses();
  EXPECT_TRUE(std::any_of(statuses.begin(), statuses.end(), [](const offsets_status_t& s) {
    return s.sentence.find("the pictures ask for: latency") != std::string::npos;
  }));
  EXPECT_GT(counter(statuses.back(), "processor_ms.diagnosis"), 0);

  const auto live = estimates_by_utime(scratch / "live.jsonl");
  const auto again = replay_estimates(scratch / "live.lcmlog", scratch / "replay",
                                      {"--set", "silhouette.engine=contour", "--set", "filter.particles=60"});
  ASSERT_EQ(live.size(), again.size());
  int said = 0;
  for (const auto& [utime, line] : live) {
    const auto one = nlohmann::json::parse(line), other = nlohmann::json::parse(again.at(utime));
    EXPECT_EQ(one.value("findings", nlohmann::json()), other.value("findings", nlohmann::json())) << utime;
    said += one.contains("findings");
  }
  EXPECT_GT(said, 5);
}

}  // namespace
}  // namespace bodyschema::integration
