#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bodyschema/core/configuration.hpp"
#include "bodyschema/diagnosis/diagnosis_report.hpp"

namespace bodyschema {

/// What the motion in a log lets a diagnosis test, before anything is estimated.
struct LogTestability {
  double duration_s = 0.0;   ///< between the first and the last usable pair
  std::size_t pictures = 0;  ///< with encoders at their exposure, at most ten a second and camera
  std::string refusal;       ///< why a diagnosis refuses this log as a whole, in its words; empty: it does not
  std::vector<std::string> arm_joints;
  std::vector<CauseName> testable;
  std::vector<NotTestable> not_testable;

  /// For people: causes by name, what is missing and why.
  [[nodiscard]] std::string text() const;
};

/// Reads encoders and the stamps of pictures; looks at no picture, so it is quick. The causes refused
/// here are those that `bodyschema diagnose` would refuse for their motion; it may refuse more once
/// it has seen where the hand was in the pictures. Throws Error.
LogTestability testability_of(const Configuration& configuration, const std::filesystem::path& log);

}  // namespace bodyschema
