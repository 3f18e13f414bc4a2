#pragma once

#include <cmath>
#include <filesystem>
#include <string>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "temporary_folder.hpp"

namespace bodyschema::testing_logs {

inline constexpr Microseconds kBegin = 1'700'000'000'000'000;

inline std::filesystem::path scratch_file(const std::string& name) {
  static const TemporaryFolder folder;
  return folder.path() / name;
}

inline bot_core::joint_state_t joints(Microseconds utime, float elbow_rad, float neck_rad) {
  bot_core::joint_state_t message;
  message.utime = utime;
  message.num_joints = 2;
  message.joint_name = {"elbow", "neck"};
  message.joint_position = {elbow_rad, neck_rad};
  message.joint_velocity = {0.0f, 0.0f};
  message.joint_effort = {0.0f, 0.0f};
  return message;
}

inline bot_core::images_t pictures(Microseconds utime, const Image& left, const Image& right) {
  bot_core::images_t message;
  message.utime = utime;
  message.n_images = 2;
  message.image_types = {bot_core::images_t::LEFT, bot_core::images_t::RIGHT};
  message.images = {to_message(left, utime), to_jpeg_message(right, utime + 3000, 95)};
  return message;
}

/// Four seconds: the elbow swings 30 deg to and fro once a second, the neck rests; 100 Hz encoders,
/// 10 Hz pictures of which the left ones are raw and the right ones JPEG. Pictures stop for a
/// second in the middle.
inline std::filesystem::path swinging_log(const std::string& name) {
  const auto file = scratch_file(name);
  LogWriter writer(file);
  Image left(32, 24, 3), right(32, 24, 1);
  for (std::size_t i = 0; i < left.data.size(); ++i) left.data[i] = static_cast<std::uint8_t>(i);
  for (Microseconds t = 0; t < 4'000'000; t += 10'000) {
    const double phase = 2.0 * 3.14159265358979 * seconds(t);
    const double elbow = 0.5 - 15.0 / 57.29577951308232 * std::cos(phase);
    writer.publish("ICUB_JOINT_STATE", kBegin + t + 500, encode(joints(kBegin + t, static_cast<float>(elbow), 0.25f)));
    if (t % 100'000 == 0 && (t < 1'000'000 || t >= 2'000'000)) {
      writer.publish("ICUB_CAMERAS", kBegin + t + 6000, encode(pictures(kBegin + t, left, right)));
    }
  }
  return file;
}

}  // namespace bodyschema::testing_logs
