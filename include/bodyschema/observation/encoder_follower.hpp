#pragma once

#include <cstddef>

#include "bodyschema/observation/observation.hpp"

namespace bodyschema {

/// Something that sees every encoder sample where they come in, at their full rate, and adds what it
/// knows to each exposure: an extended model (OnlineErrorModel), of which the bus knows nothing.
class EncoderFollower {
 public:
  virtual ~EncoderFollower() = default;
  /// Every sample in order of time; exposures follow later than the samples around them.
  virtual void observe(const JointSample& sample) = 0;
  /// Exposures in order of time. Fills in `corrections`.
  virtual void annotate(CameraObservation& seen, std::size_t camera) = 0;
  /// Back to the state before the first sample (clock step).
  virtual void forget() = 0;
};

}  // namespace bodyschema
