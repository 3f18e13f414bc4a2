#include "bodyschema/simulator/simulator_settings.hpp"

namespace bodyschema::simulator {
namespace {

Eigen::Vector3d triple(const Configuration& section, const std::string& key, const Eigen::Vector3d& fallback,
                       double min, double max) {
  const auto values = section.numbers_or(key, {fallback.x(), fallback.y(), fallback.z()});
  if (values.size() != 3) section.fail(key, "three numbers");
  for (const double value : values) {
    if (!(value >= min && value <= max)) {
      section.fail(key, "three numbers from " + std::to_string(min) + " to " + std::to_string(max));
    }
  }
  return {values[0], values[1], values[2]};
}

}  // namespace

SimulatorSettings SimulatorSettings::from(const Configuration& simulator) {
  SimulatorSettings s;
  const auto encoders = simulator.section("encoders");
  s.encoder_rate_hz = encoders.number_or("rate_hz", s.encoder_rate_hz, 10.0, 2000.0);
  s.encoder_noise_deg = encoders.number_or("noise_deg", s.encoder_noise_deg, 0.0, 10.0);
  s.encoder_bits = static_cast<int>(encoders.integer_or("bits", s.encoder_bits, 0, 24));

  const auto cameras = simulator.section("cameras");
  s.camera_rate_hz = cameras.number_or("rate_hz", s.camera_rate_hz, 0.5, 200.0);
  s.right_camera_delay_ms = cameras.number_or("right_delay_ms", s.right_camera_delay_ms, 0.0, 45.0);
  s.stamp_jitter_ms = cameras.number_or("jitter_ms", s.stamp_jitter_ms, 0.0, 5.0);
  s.supersampling = static_cast<int>(cameras.integer_or("supersampling", s.supersampling, 1, 8));
  s.blur_px = cameras.number_or("blur_px", s.blur_px, 0.0, 3.0);
  s.noise_levels = cameras.number_or("noise_levels", s.noise_levels, 0.0, 50.0);
  s.exposure_swing = cameras.number_or("exposure_swing", s.exposure_swing, 0.0, 0.5);
  s.exposure_period_s = cameras.number_or("exposure_period_s", s.exposure_period_s, 0.1, 1e4);

  const auto light = simulator.section("light");
  s.lamp_direction_W = triple(light, "lamp_direction", s.lamp_direction_W, -1e3, 1e3);
  if (s.lamp_direction_W.norm() < 1e-6) light.fail("lamp_direction", "a direction, not zero");
  s.ambient = light.number_or("ambient", s.ambient, 0.0, 1.0);
  s.diffuse = light.number_or("diffuse", s.diffuse, 0.0, 1.0);
  const auto albedo = light.section("albedo");
  for (const auto& link : albedo.keys()) s.albedo[link] = triple(albedo, link, {0.7, 0.7, 0.7}, 0.0, 1.0);

  const auto room = simulator.section("room");
  s.clutter = room.choice_or("background", "single_colour", {"single_colour", "clutter"}) == "clutter";
  s.background_colour = triple(room, "colour", s.background_colour, 0.0, 255.0);
  s.background_unevenness = room.number_or("unevenness", s.background_unevenness, 0.0, 0.5);

  const auto motion = simulator.section("motion");
  auto& m = s.motion;
  m.distance_min_m = motion.number_or("distance_min_m", m.distance_min_m, 0.0, 10.0);
  m.distance_max_m = motion.number_or("distance_max_m", m.distance_max_m, 0.0, 10.0);
  if (m.distance_max_m > 0.0 && m.distance_max_m <= m.distance_min_m)
    motion.fail("distance_max_m", "more than distance_min_m");
  m.border_px = motion.number_or("border_px", m.border_px, -500.0, 500.0);
  m.hand_radius_m = motion.number_or("hand_radius_m", m.hand_radius_m, 0.0, 0.3);
  const auto posture = motion.section("posture_deg");
  for (const auto& joint : posture.keys()) m.posture_deg[joint] = posture.number(joint, -360.0, 360.0);
  m.head_motion_deg = motion.number_or("head_motion_deg", m.head_motion_deg, 0.0, 40.0);
  m.slow_deg_s = motion.number_or("slow_deg_s", m.slow_deg_s, 1.0, 500.0);
  m.fast_deg_s = motion.number_or("fast_deg_s", m.fast_deg_s, 1.0, 500.0);
  m.hold_s = motion.number_or("hold_s", m.hold_s, 0.0, 600.0);
  s.head_moves = motion.choice_or("head", "still", {"still", "moving"}) == "moving";
  s.background_frames = static_cast<int>(motion.integer_or("background_frames", s.background_frames, 0, 10000));
  s.entry_frames = static_cast<int>(motion.integer_or("entry_frames", s.entry_frames, 0, 1000));
  return s;
}

}  // namespace bodyschema::simulator
