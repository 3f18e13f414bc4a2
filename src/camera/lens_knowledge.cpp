#include "bodyschema/camera/lens_knowledge.hpp"

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

constexpr const char* kExpected = "five numbers [k1, k2, p1, p2, k3], 'none', or 'unknown' where nobody calibrated it";

std::string word_of(const Configuration& camera) {
  try {
    return camera.text("distortion");
  } catch (const ConfigurationError&) {
    return {};  // a list
  }
}

}  // namespace

LensKnowledge lens_knowledge(const Configuration& camera) {
  if (!camera.has("distortion")) return LensKnowledge::kUnknown;
  if (camera.is_mapping("distortion")) camera.fail("distortion", kExpected);
  const std::string word = word_of(camera);
  if (word == "none") return LensKnowledge::kNone;
  if (word == "unknown") return LensKnowledge::kUnknown;
  if (!word.empty()) camera.fail("distortion", kExpected);
  const auto numbers = camera.numbers("distortion");
  constexpr std::size_t kCoefficients = 5;
  if (numbers.size() != kCoefficients) camera.fail("distortion", kExpected);
  return LensKnowledge::kCalibrated;
}

double lens_sd(LensKnowledge knowledge) {
  constexpr double kUncalibrated = 0.2, kCalibrated = 0.03;
  switch (knowledge) {
    case LensKnowledge::kUnknown: return kUncalibrated;
    case LensKnowledge::kCalibrated: return kCalibrated;
    case LensKnowledge::kNone: break;
  }
  return 0.0;
}

}  // namespace bodyschema
