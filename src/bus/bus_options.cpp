#include "bodyschema/bus/bus_options.hpp"

#include <algorithm>

#include "bodyschema/bus/udpm_assembler.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

namespace {
Microseconds milliseconds(const Configuration& section, const std::string& key, Microseconds fallback, double max_ms) {
  return microseconds(section.number_or(key, seconds(fallback) * 1e3, 0.0, max_ms) * 1e-3);
}
}  // namespace

Channels Channels::with_prefix(const std::string& prefix) {
  return {prefix + "_JOINT_STATE",    prefix + "_CAMERAS",  prefix + "_JOINT_OFFSETS",
          prefix + "_OFFSETS_STATUS", prefix + "_FINDINGS", prefix + "_MASKS"};
}

std::size_t BusOptions::longest_message_bytes(std::size_t cameras) const {
  constexpr std::size_t kBeside = 1u << 20;
  constexpr std::size_t kLcm = 256u << 20;
  const std::size_t picture =
      3 * static_cast<std::size_t>(limits.max_width_px) * static_cast<std::size_t>(limits.max_height_px);
  return std::clamp(cameras * picture + kBeside, UdpmAssembler::Limits{}.message_bytes, kLcm);
}

BusOptions BusOptions::from(const Configuration& bus) {
  BusOptions options;
  options.channel_prefix = bus.text_or("channel_prefix", options.channel_prefix);
  const bool plain = std::all_of(options.channel_prefix.begin(), options.channel_prefix.end(), [](unsigned char c) {
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-';
  });
  // LCM allows 63 letters in a channel's name; "_OFFSETS_STATUS" takes 15 of them.
  if (!plain || options.channel_prefix.empty() || options.channel_prefix.size() > 48) {
    bus.fail("channel_prefix", "1 to 48 letters, digits, '_' or '-'");
  }
  SynchroniserOptions& sync = options.synchroniser;
  sync.pairing_window = milliseconds(bus, "pairing_window_ms", sync.pairing_window, 1e4);
  sync.camera_wait = milliseconds(bus, "camera_wait_ms", sync.camera_wait, 1e5);
  sync.encoder_wait = milliseconds(bus, "encoder_wait_ms", sync.encoder_wait, 1e5);
  sync.mask_wait = milliseconds(bus, "mask_wait_ms", sync.mask_wait, 1e5);
  sync.max_image_gap = milliseconds(bus, "max_image_gap_ms", sync.max_image_gap, 1e6);
  sync.allow_mono = bus.boolean_or("allow_mono", sync.allow_mono);
  sync.clock_step = milliseconds(bus, "clock_step_ms", sync.clock_step, 1e7);
  sync.max_waiting = static_cast<int>(bus.integer_or("max_waiting", sync.max_waiting, 1, 10'000));
  JointHistoryOptions& joints = sync.joints;
  joints.max_gap = milliseconds(bus, "max_encoder_gap_ms", joints.max_gap, 1e5);
  joints.max_still_gap = milliseconds(bus, "max_still_encoder_gap_ms", joints.max_still_gap, 1e5);
  joints.max_speed_rad_s = radians(bus.number_or("max_joint_speed_deg_s", degrees(joints.max_speed_rad_s), 0.0, 1e6));
  joints.samples = static_cast<int>(bus.integer_or("encoder_samples", joints.samples, 2, 1'000'000));
  joints.velocity_from_differences =
      bus.choice_or("joint_velocity", "published", {"published", "differences"}) == "differences";
  options.limits.max_joints = static_cast<int>(bus.integer_or("max_joints", options.limits.max_joints, 1, 32'767));
  options.limits.max_width_px =
      static_cast<int>(bus.integer_or("max_width_px", options.limits.max_width_px, 1, 32'768));
  options.limits.max_height_px =
      static_cast<int>(bus.integer_or("max_height_px", options.limits.max_height_px, 1, 32'768));
  const double silence_s = bus.number_or("one_source_silence_s", 2.0, 0.1, 3600.0);
  if (bus.boolean_or("one_source", false)) options.one_source_silence_s = silence_s;
  options.queue_frames = static_cast<int>(bus.integer_or("queue_frames", options.queue_frames, 1, 10'000));
  return options;
}

}  // namespace bodyschema
