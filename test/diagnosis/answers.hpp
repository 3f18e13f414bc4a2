#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "bodyschema/diagnosis/diagnosis_report.hpp"

namespace bodyschema::test {

/// The cause in whose class this one is; null: none.
inline const DiagnosedCause* found(const DiagnosisReport& report, const CauseName& cause) {
  const auto at = std::find_if(report.causes.begin(), report.causes.end(), [&](const DiagnosedCause& c) {
    return std::find(c.same.begin(), c.same.end(), cause) != c.same.end();
  });
  return at == report.causes.end() ? nullptr : &*at;
}

/// Something of this part of the body is named, and nothing else.
inline bool names_only_part(const DiagnosisReport& report, const std::string& part) {
  return !report.causes.empty() && std::all_of(report.causes.begin(), report.causes.end(),
                                               [&](const DiagnosedCause& c) { return c.cause.source == part; });
}

inline bool is_named(const DiagnosisReport& report) {
  return report.verdict == "named" || report.verdict == "class";
}

/// Named first itself, with this size: right sign, within twice the 95 % interval or a tenth.
inline void expect_size(const DiagnosisReport& report, const CauseName& cause, const std::string& parameter,
                        double value) {
  const auto* c = found(report, cause);
  ASSERT_NE(c, nullptr) << cause.text() << ": " << report.sentence;
  ASSERT_EQ(c->cause, cause) << report.sentence;
  EXPECT_GT(c->heldout_gain, 0.0);
  for (const auto& p : c->parameters) {
    if (p.parameter != parameter) continue;
    EXPECT_NEAR(p.estimate, value, std::max(p.ci95[1] - p.ci95[0], 0.1 * std::abs(value))) << report.sentence;
    return;
  }
  ADD_FAILURE() << cause.text() << " has no " << parameter;
}

}  // namespace bodyschema::test
