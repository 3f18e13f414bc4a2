#include "bodyschema/camera/shutter.hpp"

namespace bodyschema {

std::optional<double> readout_s(const Configuration& camera) {
  constexpr double kMost_ms = 200.0;
  if (!camera.has("readout_ms") || camera.text("readout_ms") == "unknown") return std::nullopt;
  return 1e-3 * camera.number("readout_ms", -kMost_ms, kMost_ms);
}

}  // namespace bodyschema
