#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <random>

#include "bodyschema/effects/catalogue.hpp"
#include "diagnosis/binomial.hpp"
#include "diagnosis_trials/trial_robot.hpp"

/// What a log excludes, at the level of silhouettes.
namespace bodyschema {
namespace {

/// The limit on the parameter that a fault's value is; null where there is none.
const ExclusionLimit* limit_of(const DiagnosisReport& report, const TrialFault& fault) {
  const auto at = std::find_if(report.exclusion_limits.begin(), report.exclusion_limits.end(),
                               [&](const auto& limit) { return limit.cause == fault.cause; });
  return at == report.exclusion_limits.end() ? nullptr : &*at;
}

/// How pictures place an outline is no matter of the cause's own size, and shows between no blocks.
TEST(Intervals, IncludeWhatAllPicturesPlaceAlike) {
  constexpr double kPlaced_px = 0.1;
  TrialOptions options;
  options.duration_s = 30.0;
  options.faults = {{{"silhouette_bias", "", ""}, 1.2, 0.0, 0.23}};
  const auto log = make_synthetic_log(test::robot(), options, test::log_seed());
  auto rules = test::usual_options(*log);
  const auto by_blocks = diagnose(*log, rules);
  rules.systematic_error = {{"silhouette_bias", kPlaced_px}};
  const auto with_placing = diagnose(*log, rules);
  ASSERT_EQ(by_blocks.causes.size(), 1u) << by_blocks.sentence;
  ASSERT_EQ(with_placing.causes.size(), 1u) << with_placing.sentence;
  const auto &narrow = by_blocks.causes[0].parameters.at(0), &wide = with_placing.causes[0].parameters.at(0);
  EXPECT_EQ(wide.estimate, narrow.estimate);
  EXPECT_NEAR(wide.ci95[1] - wide.estimate, std::hypot(narrow.ci95[1] - narrow.estimate, 1.96 * kPlaced_px), 1e-9);
  // Of another cause nothing changes.
  const auto limit = [](const DiagnosisReport& report) { return limit_of(report, {{"mesh_scale", "", ""}, 0, 0, 0}); };
  ASSERT_NE(limit(by_blocks), nullptr);
  EXPECT_EQ(limit(by_blocks)->limit, limit(with_placing)->limit);
}

TEST(ExclusionLimits, HoldWhatWasTooSmallToBeFound) {
  // A third of what can be detected: of half of it 24 of 40 logs were found out, and have no limit.
  constexpr int kLogs = 24;
  const auto places = trial_faults(test::robot(), false);
  std::mt19937_64 random(test::seed());
  int limited = 0, held = 0;
  double tightest = 1e9;
  for (int i = 0; i < kLogs; ++i) {
    auto fault = places[random() % places.size()];
    fault.value = 0.35 * fault.detectable;
    fault.second = fault.cause.name == "slip" ? 0.5 : 0.0;
    TrialOptions options;
    options.duration_s = 30.0;
    options.faults = {fault};
    const auto log = make_synthetic_log(test::robot(), options, random());
    const auto report = diagnose(*log, test::usual_options(*log));
    const auto* limit = limit_of(report, fault);
    if (limit == nullptr) continue;
    ++limited;
    held += limit->limit >= std::abs(fault.value);
    tightest = std::min(tightest, limit->limit / fault.detectable);
    if (limit->limit < std::abs(fault.value)) {
      std::cout << fault.cause.text() << " " << fault.value << " is above its limit " << limit->limit << std::endl;
    }
  }
  std::cout << held << " of " << limited << " limits hold; the tightest is " << tightest << " of what can be detected"
            << std::endl;
  EXPECT_GE(limited, kLogs / 4);
  EXPECT_GE(held, test::fewest_right(std::vector<double>(static_cast<std::size_t>(limited), 0.95)));
  EXPECT_LT(tightest, 1.0);
}

TEST(ExclusionLimits, AreOfEveryCauseThatIsNeitherNamedNorUntestable) {
  // A nuisance, a cause of one joint, a slip, and nothing at all.
  const std::vector<std::vector<TrialFault>> logs = {
      {{{"finger_posture", "", ""}, 5.0, 0.0, 0.0}, {{"encoder_gain", "r_elbow", ""}, 5.0, 0.0, 0.0}},
      {{{"slip", "r_elbow", ""}, 2.0, 0.4, 0.0}},
      {}};
  for (const auto& faults : logs) {
    TrialOptions options;
    options.duration_s = 30.0;
    options.faults = faults;
    const auto log = make_synthetic_log(test::robot(), options, test::log_seed());
    const auto report = diagnose(*log, test::usual_options(*log));
    EXPECT_EQ(report.causes.size(), faults.size()) << report.sentence;
    for (const auto& name : effect_names()) {
      if (name == "joint_offset") continue;
      for (const auto& target : effect_targets(name, log->roles())) {
        const CauseName cause{name, target.joint, target.source};
        const auto is = [&](const auto& item) { return item.cause == cause; };
        const auto count = [&](const auto& list) { return std::count_if(list.begin(), list.end(), is); };
        const bool possible = std::any_of(report.causes.begin(), report.causes.end(), [&](const auto& named) {
          return std::find(named.same.begin(), named.same.end(), cause) != named.same.end();
        });
        const bool limited = count(report.exclusion_limits) > 0;
        const auto untestable = count(report.not_testable);
        EXPECT_EQ(possible + limited + untestable, 1)
            << cause.text() << ": named or in a class " << possible << ", limited " << limited << ", not testable "
            << untestable << "; " << report.sentence;
      }
    }
    for (const auto& limit : report.exclusion_limits) EXPECT_TRUE(std::isfinite(limit.limit)) << limit.cause.text();
  }
}

}  // namespace
}  // namespace bodyschema
