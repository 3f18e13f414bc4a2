#include "bodyschema/simulator/simulator_settings.hpp"

#include <algorithm>
#include <utility>

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
  return from(simulator, {});
}

SimulatorSettings SimulatorSettings::from(const Configuration& simulator, SimulatorSettings defaults) {
  SimulatorSettings s = std::move(defaults);
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

  s.exposure_ms = cameras.number_or("exposure_ms", s.exposure_ms, 0.0, 200.0);
  s.readout_ms = cameras.number_or("readout_ms", s.readout_ms, 0.0, 200.0);
  s.stamp_first_row =
      cameras.choice_or("stamp", s.stamp_first_row ? "first_row" : "middle", {"middle", "first_row"}) == "first_row";
  s.lens_k1 = cameras.number_or("lens_k1", s.lens_k1, -0.4, 0.4);
  s.jpeg_quality = static_cast<int>(cameras.integer_or("jpeg_quality", s.jpeg_quality, 0, 100));
  const auto outline = simulator.section("silhouettes");
  s.outline_noise.sd_px = outline.number_or("noise_px", s.outline_noise.sd_px, 0.0, 3.0);
  s.outline_noise.length_px = outline.number_or("noise_length_px", s.outline_noise.length_px, 1.0, 1000.0);
  s.outline_noise.time_s = outline.number_or("noise_time_s", s.outline_noise.time_s, 0.0, 1e4);

  const auto light = simulator.section("light");
  s.lamp_direction_W = triple(light, "lamp_direction", s.lamp_direction_W, -1e3, 1e3);
  if (s.lamp_direction_W.norm() < 1e-6) light.fail("lamp_direction", "a direction, not zero");
  s.ambient = light.number_or("ambient", s.ambient, 0.0, 1.0);
  s.diffuse = light.number_or("diffuse", s.diffuse, 0.0, 1.0);
  const auto albedo = light.section("albedo");
  for (const auto& link : albedo.keys()) s.albedo[link] = triple(albedo, link, {0.7, 0.7, 0.7}, 0.0, 1.0);

  s.gloss = light.number_or("gloss", s.gloss, 0.0, 1.0);
  s.looks = light.choice_or("looks", s.looks == Looks::kCovers ? "covers" : "grey", {"grey", "covers"}) == "covers"
                ? Looks::kCovers
                : Looks::kGrey;
  s.shadows = light.boolean_or("shadows", s.shadows);
  s.lamp_size_deg = light.number_or("lamp_size_deg", s.lamp_size_deg, 0.0, 60.0);
  s.light_drift = light.number_or("drift", s.light_drift, -0.9, 5.0);
  s.colour_drift = light.number_or("colour_drift", s.colour_drift, -0.5, 0.5);
  s.flicker = light.number_or("flicker", s.flicker, 0.0, 0.5);
  s.flicker_hz = light.number_or("flicker_hz", s.flicker_hz, 0.0, 1000.0);

  const auto room = simulator.section("room");
  const auto background = room.choice_or("background",
                                         s.kitchen   ? "kitchen"
                                         : s.clutter ? "clutter"
                                                     : "single_colour",
                                         {"single_colour", "clutter", "kitchen"});
  s.clutter = background == "clutter";
  s.kitchen = background == "kitchen";
  s.table = room.boolean_or("table", s.table);
  s.background_colour = triple(room, "colour", s.background_colour, 0.0, 255.0);
  s.background_unevenness = room.number_or("unevenness", s.background_unevenness, 0.0, 0.5);

  const auto things = simulator.section("things");
  const std::vector<std::string> kinds = {"none", "box", "bottle", "stick"};
  const auto held = things.choice_or("held", kinds[static_cast<std::size_t>(s.held.kind)], kinds);
  s.held.kind = static_cast<HeldKind>(std::find(kinds.begin(), kinds.end(), held) - kinds.begin());
  s.held.length_m = things.number_or("held_length_m", s.held.length_m, 0.0, 1.0);
  s.held.from_s = things.number_or("held_from_s", s.held.from_s, 0.0, 1e6);
  s.second_arm = things.boolean_or("second_arm", s.second_arm);
  s.person_every_s = things.number_or("person_every_s", s.person_every_s, 0.0, 1e6);
  s.person_first_s = things.number_or("person_first_s", s.person_first_s, 0.0, 1e6);
  s.person_stays_s = things.number_or("person_stays_s", s.person_stays_s, 0.5, 60.0);

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
  m.gaze_range_deg = motion.number_or("gaze_range_deg", m.gaze_range_deg, 0.0, 60.0);
  m.postures = static_cast<int>(motion.integer_or("postures", m.postures, 0, 1000));
  const auto head = motion.choice_or("head",
                                     s.gaze         ? "gaze"
                                     : s.head_moves ? "moving"
                                                    : "still",
                                     {"still", "moving", "gaze"});
  s.head_moves = head == "moving";
  s.gaze = head == "gaze";
  s.background_frames = static_cast<int>(motion.integer_or("background_frames", s.background_frames, 0, 10000));
  s.entry_frames = static_cast<int>(motion.integer_or("entry_frames", s.entry_frames, 0, 1000));
  return s;
}

}  // namespace bodyschema::simulator
