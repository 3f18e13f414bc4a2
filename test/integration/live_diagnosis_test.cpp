#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "harness.hpp"

namespace bodyschema::integration {
namespace {

constexpr Seconds kStart(60.0);

/// The service looks while it runs and publishes what it found; a replay of what it recorded says the same at the same
/// times.
TEST(LiveDiagnosis, AReplaySaysWhatTheServiceSaid) {
  if (const auto why = why_no_lcm(); !why.empty()) GTEST_SKIP() << why;
  const Scratch scratch;
  const std::string url = own_lcm_url();
  Listener listener(url);
  Process service({"bodyschemad", "--config", reach_configuration(), "--lcm-url", url, "--estimates",
                   (scratch / "live.jsonl").string(), "--record", (scratch / "live.lcmlog").string(),
                   "--stop-after-idle", "3", "--set", "silhouette.engine=contour", "--set", "filter.particles=60"},
                  scratch.folder());
  ASSERT_TRUE(service.said("waiting for", kStart)) << service.err();
  Process robot({"bodyschema-sim", "--config", std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml",
                 "--set", "simulator.cameras.rate_hz=5", "--set", "simulator.cameras.supersampling=1", "--babble", "36",
                 "--seed", "3", "--fault", "encoder_gain:joint=r_elbow,value=8", "--lcm-url", url},
                scratch.folder());
  ASSERT_EQ(service.wait(Seconds(120)), 0) << service.err();
  const auto findings = listener.findings();
  ASSERT_FALSE(findings.empty());
  EXPECT_GT(findings.back().blocks, 8) << "it has looked";
  EXPECT_GT(findings.back().z_threshold, 3.0);
  const auto statuses = listener.statuses();
  EXPECT_GT(counter(statuses.back(), "processor_ms.diagnosis"), 0);

  const auto live = estimates_by_utime(scratch / "live.jsonl");
  const auto again = replay_estimates(scratch / "live.lcmlog", scratch / "replay",
                                      {"--set", "silhouette.engine=contour", "--set", "filter.particles=60"});
  ASSERT_EQ(live.size(), again.size());
  for (const auto& [utime, line] : live) {
    const auto one = nlohmann::json::parse(line), other = nlohmann::json::parse(again.at(utime));
    EXPECT_EQ(one.value("findings", nlohmann::json()), other.value("findings", nlohmann::json())) << utime;
  }
}

}  // namespace
}  // namespace bodyschema::integration
