#include "bodyschema/camera/shutter.hpp"

namespace bodyschema {

Shutter shutter_of(const Configuration& camera) {
  // Read-outs of 10 to 33 ms are usual, and so are cameras without any.
  constexpr double kUnknown_s = 0.015, kMost_ms = 200.0;
  if (!camera.has("readout_ms")) return {};
  if (camera.text("readout_ms") == "unknown") return {.readout_s = 0.0, .sd_s = kUnknown_s};
  return {.readout_s = 1e-3 * camera.number("readout_ms", -kMost_ms, kMost_ms), .sd_s = 0.0};
}

}  // namespace bodyschema
