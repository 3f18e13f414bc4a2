#include "kinds.hpp"

namespace bodyschema::simulator::faults {

/// The sensor is read out more slowly than configured: what moves is slanted further.
FaultKind readout_time() {
  FaultKind kind;
  kind.name = "readout_time";
  kind.parameter = "readout";
  kind.unit = "ms";
  kind.meaning = "true - configured time from the first row of a picture to the last";
  kind.in_catalogue = false;
  kind.make = [](const FaultArguments& arguments, const FaultSite&) {
    const double longer_s = 1e-3 * arguments.number("value", -200.0, 200.0);
    return timing_fault([=](ExposureTiming& timing) { timing.longer_readout_s += longer_s; });
  };
  kind.targets = nowhere;
  return kind;
}

}  // namespace bodyschema::simulator::faults
