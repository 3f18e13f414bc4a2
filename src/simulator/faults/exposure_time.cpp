#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The shutter is open for longer than configured: what moves is smeared further.
FaultKind exposure_time() {
  FaultKind kind;
  kind.name = "exposure_time";
  kind.parameter = "exposure";
  kind.unit = "ms";
  kind.meaning = "true - configured time that each row of a picture is exposed";
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double longer_s = 1e-3 * arguments.number("value", -200.0, 200.0);
    return timing_fault([=](ExposureTiming& timing) { timing.longer_exposure_s += longer_s; });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
