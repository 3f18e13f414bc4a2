#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/bus/synchroniser.hpp"
#include "bodyschema/core/configuration.hpp"

namespace bodyschema {

/// Names of the channels, e.g. ICUB_JOINT_STATE.
struct Channels {
  std::string joint_state;     ///< bot_core::joint_state_t, in
  std::string cameras;         ///< bot_core::images_t, in
  std::string joint_offsets;   ///< bodyschema::joint_offsets_t, out
  std::string offsets_status;  ///< bodyschema::offsets_status_t, out
  std::string findings;        ///< bodyschema::findings_t, out
  std::string masks;           ///< bot_core::images_t, in: silhouettes that others found in the pictures
  static Channels with_prefix(const std::string& prefix);
};

/// The `bus` section of the configuration; config/bus.yaml explains every key.
struct BusOptions {
  std::string channel_prefix = "ICUB";
  SynchroniserOptions synchroniser;
  DecodeLimits limits;
  /// Each channel is taken from one source only, until that is silent for this long; nothing: from all.
  std::optional<double> one_source_silence_s;
  /// Observations that may wait for the estimator; beyond it the oldest is shed.
  int queue_frames = 8;

  /// What a message of ours may take: pictures of this many cameras, raw and in colour, each as large as `limits`
  /// allow, with room for what belongs to them; 32 MiB at least and what LCM carries at most.
  [[nodiscard]] std::size_t longest_message_bytes(std::size_t cameras) const;
  [[nodiscard]] Channels channels() const { return Channels::with_prefix(channel_prefix); }
  /// Throws ConfigurationError.
  static BusOptions from(const Configuration& bus);
};

}  // namespace bodyschema
