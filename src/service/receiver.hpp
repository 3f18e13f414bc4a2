#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/observation_queue.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/service/recorder.hpp"

namespace bodyschema {

/// The receiving side of the daemon: a thread that takes messages from the network, records them,
/// and turns them into observations in the queue. `arrival_us` of observations is monotonic_us().
class Receiver {
 public:
  /// Throws DeviceError when the network cannot be used. `queue` and `recorder` (may be null) must
  /// outlive this object.
  Receiver(LcmLink& link, ObservationStream stream, ObservationQueue& queue, Recorder* recorder);
  ~Receiver() { stop(); }
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  /// Messages are taken in from here on; what has come since construction waits. Also after stop().
  void start();
  /// Ends the thread. Observations already in the queue stay.
  void stop();
  /// Ends the thread and puts what still waits for a partner into the queue, as at the end of a log.
  void finish();

  struct Facts {
    BusStatistics bus;
    std::int64_t pictures_arrived_us = -1;  ///< monotonic_us() of the newest message; -1: none
    std::int64_t joints_arrived_us = -1;
    std::vector<std::string> missing_joints;
    std::string blocking_joint;
    RefusedSources refused;
    std::string failure;  ///< why receiving ended by itself; empty: it did not
  };
  [[nodiscard]] Facts facts() const;
  /// monotonic_us() of the newest message on any of our channels; -1: none yet.
  [[nodiscard]] std::int64_t newest_arrival_us() const { return newest_arrival_us_; }

 private:
  void work();
  void receive(const std::string& channel, Bytes message, std::int64_t arrived_wall_us);
  void drain();

  LcmLink& link_;
  ObservationStream stream_;
  ObservationQueue& queue_;
  Recorder* recorder_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::int64_t> newest_arrival_us_{-1};
  mutable std::mutex mutex_;
  Facts facts_;
  std::thread thread_;
};

}  // namespace bodyschema
