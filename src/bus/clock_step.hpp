#pragma once

namespace bodyschema {

/// How many stamps in a row must be far in the past before the clock is believed to have stepped.
inline constexpr int kStepEvidence = 3;

}  // namespace bodyschema
