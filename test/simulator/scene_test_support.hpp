#pragma once

#include <cmath>

#include "bodyschema/simulator/scenes.hpp"
#include "simulator/icub_right.hpp"

namespace bodyschema::simulator {

/// The project's own robot without noise and softness, so that pictures can be compared closely.
inline Stage clean_stage() {
  Stage stage = icub_right();
  stage.settings.noise_levels = 0.0;
  stage.settings.stamp_jitter_ms = 0.0;
  stage.settings.right_camera_delay_ms = 0.0;
  return stage;
}

inline Stage with_scene(const std::string& scene) {
  Stage stage = icub_right();
  apply_scene(stage.settings, scene);
  return stage;
}

/// Mean absolute difference of two pictures, levels.
inline double difference(const Image& a, const Image& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::abs(static_cast<int>(a.data[i]) - b.data[i]);
  return sum / static_cast<double>(a.data.size());
}

inline double mean_level(const Image& image, int channel = -1) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < image.data.size(); ++i) {
    if (channel >= 0 && static_cast<int>(i % 3) != channel) continue;
    sum += image.data[i];
    ++count;
  }
  return sum / static_cast<double>(count);
}

}  // namespace bodyschema::simulator
