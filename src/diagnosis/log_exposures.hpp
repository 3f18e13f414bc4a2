#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/pipeline/joint_stream.hpp"

namespace bodyschema::diagnosis {

/// Where the joints were in a log's pictures, of which nothing is looked at.
struct LogExposures {
  std::vector<JointSample> pictures;  ///< one for each camera and exposure, velocities from the encoders
  std::size_t cameras = 0;            ///< that gave pictures
  std::vector<JointSample> encoders;

  /// @param picture_rate_hz  at most so many pictures a second and camera
  /// @param wanted  asked after every message, with the pictures so far (velocities as published) and the place in the
  ///   log: whether to read on
  /// Throws FileError.
  static LogExposures read(const std::filesystem::path& log, ObservationStream& stream, JointStream joints,
                           double picture_rate_hz,
                           const std::function<bool(const std::vector<JointSample>&, std::uint64_t)>& wanted);
};

}  // namespace bodyschema::diagnosis
