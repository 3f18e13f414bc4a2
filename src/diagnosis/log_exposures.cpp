#include "log_exposures.hpp"

#include <algorithm>
#include <cstdlib>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/observation/joint_motion.hpp"

namespace bodyschema::diagnosis {

LogExposures LogExposures::read(const std::filesystem::path& log, ObservationStream& stream, JointStream joints,
                                double picture_rate_hz,
                                const std::function<bool(const std::vector<JointSample>&, std::uint64_t)>& wanted) {
  const Microseconds period = microseconds(1.0 / picture_rate_hz);
  Microseconds due = 0;
  LogExposures result;
  std::vector<bool> seen;
  const auto drain = [&] {
    while (const auto arrived = stream.next()) {
      const auto& observation = arrived->observation;
      if (observation.encoders_begin_anew) {  // as PictureLog::add
        std::erase_if(result.pictures, [&](const JointSample& s) { return s.utime >= observation.utime; });
      }
      if (!result.pictures.empty() && observation.utime < due && due - observation.utime <= period) continue;
      due = result.pictures.empty() || std::abs(observation.utime - due) > period ? observation.utime + period
                                                                                  : due + period;
      seen.resize(observation.cameras.size());
      for (std::size_t c = 0; c < seen.size(); ++c) {
        if (!observation.cameras[c]) continue;
        result.pictures.push_back(observation.cameras[c]->joints);
        seen[c] = true;
      }
    }
  };
  LogReader reader(log);
  LogEvent event;
  bool on = true;
  while (on && reader.next(event)) {
    if (event.channel == stream.channels().joint_state) joints.take(event.data);
    if (stream.receive(event.channel, event.data, event.time_us)) drain();
    on = wanted(result.pictures, reader.position());
  }
  stream.finish();
  drain();
  result.cameras = static_cast<std::size_t>(std::count(seen.begin(), seen.end(), true));
  result.encoders = joints.finish();
  Eigen::VectorXd qddot;
  for (auto& sample : result.pictures) {
    joint_motion(result.encoders, sample.utime, sample.qdot, qddot);
    sample.qdot.conservativeResize(sample.q.size());
  }
  return result;
}

}  // namespace bodyschema::diagnosis
