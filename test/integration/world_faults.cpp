#include "world_faults.hpp"

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <random>

#include "bodyschema/bus/log.hpp"

namespace bodyschema::integration::faults {
namespace {

using bot_core::images_t;
using bot_core::joint_state_t;

constexpr const char* kCameras = "ICUB_CAMERAS";
constexpr const char* kJoints = "ICUB_JOINT_STATE";

Fault on_pictures(std::function<bool(images_t&, MessageSink&)> change) {
  return {.pictures = std::move(change), .joints = {}};
}
Fault on_joints(std::function<bool(joint_state_t&, MessageSink&)> change) {
  return {.pictures = {}, .joints = std::move(change)};
}

/// Changes the reading of one joint in every message.
Fault on_joint(const std::string& joint, std::function<void(float&)> change) {
  return on_joints([joint, change = std::move(change)](joint_state_t& j, MessageSink&) {
    for (std::size_t k = 0; k < j.joint_name.size(); ++k) {
      if (j.joint_name[k] == joint) change(j.joint_position[k]);
    }
    return true;
  });
}

images_t grey_and_behind(images_t pictures) {
  for (auto& image : pictures.images) {
    image.utime -= 90'000;
    std::fill(image.data.begin(), image.data.end(), std::uint8_t{90});
  }
  return pictures;
}

template <class Message>
std::function<bool(Message&, MessageSink&)> delayed(Microseconds delay, const char* channel) {
  return [delay, channel, waiting = std::deque<Message>()](Message& message, MessageSink& link) mutable {
    waiting.push_back(message);
    while (message.utime - waiting.front().utime >= delay) {
      link.publish_message(channel, 0, waiting.front());
      waiting.pop_front();
    }
    return false;
  };
}

}  // namespace

Fault camera_dies(std::size_t camera) {
  return on_pictures([which = 1 - camera](images_t& p, MessageSink&) {
    p.images = {p.images.at(which)};
    p.image_types = {p.image_types.at(which)};
    p.n_images = 1;
    return true;
  });
}

Fault both_cameras_die() {
  return on_pictures([](images_t&, MessageSink&) { return false; });
}

Fault camera_freezes(std::size_t camera) {
  return on_pictures([camera, frozen = std::vector<std::uint8_t>()](images_t& p, MessageSink&) mutable {
    if (frozen.empty()) frozen = p.images.at(camera).data;
    p.images[camera].data = frozen;
    return true;
  });
}

Fault cameras_swapped() {
  return on_pictures([](images_t& p, MessageSink&) {
    std::swap(p.images.at(0).data, p.images.at(1).data);
    return true;
  });
}

Fault pictures_doubled() {
  return on_pictures([](images_t& p, MessageSink& link) {
    link.publish_message(kCameras, 0, p);
    return true;
  });
}

Fault pictures_out_of_order() {
  return on_pictures([held = std::optional<images_t>()](images_t& p, MessageSink& link) mutable {
    if (!held) {
      held = p;
      return false;
    }
    link.publish_message(kCameras, 0, p);
    link.publish_message(kCameras, 0, *held);
    held.reset();
    return false;
  });
}

Fault pictures_late(Microseconds delay) {
  return on_pictures(delayed<images_t>(delay, kCameras));
}

Fault picture_size_jumps() {
  return on_pictures([](images_t& p, MessageSink&) {
    for (auto& image : p.images) {
      image.width = 640;
      image.height = 480;
      image.row_stride = 3 * 640;
      image.data.assign(3 * 640 * 480, 0);
      image.size = static_cast<int>(image.data.size());
    }
    return true;
  });
}

Fault pixel_format_jumps() {
  return on_pictures([](images_t& p, MessageSink&) {
    for (auto& image : p.images) image.pixelformat = 0x12345678;
    return true;
  });
}

Fault pixel_format_jumps_to_gray() {
  return on_pictures([](images_t& p, MessageSink&) {
    for (auto& image : p.images) {
      std::vector<std::uint8_t> gray(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
      for (std::size_t i = 0; i < gray.size() && 3 * i + 2 < image.data.size(); ++i) {
        gray[i] = static_cast<std::uint8_t>((image.data[3 * i] + image.data[3 * i + 1] + image.data[3 * i + 2]) / 3);
      }
      image.data = std::move(gray);
      image.size = static_cast<int>(image.data.size());
      image.row_stride = image.width;
      image.pixelformat = bot_core::image_t::PIXEL_FORMAT_GRAY;
    }
    return true;
  });
}

Fault lights_go_off() {
  return on_pictures([](images_t& p, MessageSink&) {
    for (auto& image : p.images) std::fill(image.data.begin(), image.data.end(), std::uint8_t{0});
    return true;
  });
}

Fault hand_leaves_the_view() {
  // The first pictures of the log show the background alone.
  LogReader log(reach_log());
  images_t empty;
  for (LogEvent event; log.next(event);) {
    if (event.channel != kCameras) continue;
    empty.decode(event.data.data(), 0, static_cast<int>(event.data.size()));
    break;
  }
  return on_pictures([empty](images_t& p, MessageSink&) {
    for (std::size_t c = 0; c < p.images.size(); ++c) p.images[c].data = empty.images[c].data;
    return true;
  });
}

Fault second_publisher() {
  return on_pictures([](images_t& p, MessageSink& link) {
    link.publish_message(kCameras, 0, p);
    link.publish_message(kCameras, 0, grey_and_behind(p));
    return false;
  });
}

Fault second_publisher(LcmLink& link) {
  return on_pictures([&link](images_t& p, MessageSink&) {
    link.publish_message(kCameras, 0, grey_and_behind(p));
    return true;
  });
}

Fault encoders_stop() {
  return on_joints([](joint_state_t&, MessageSink&) { return false; });
}

Fault encoders_late(Microseconds delay) {
  return on_joints(delayed<joint_state_t>(delay, kJoints));
}

Fault encoder_not_a_number() {
  return on_joints([](joint_state_t& j, MessageSink&) {
    j.joint_position.at(0) = std::numeric_limits<float>::quiet_NaN();
    return true;
  });
}

void Stall::add(Microseconds stamp, double rad) {
  const std::lock_guard lock(mutex_);
  readings_[stamp] = rad;
}

double Stall::at(Microseconds stamp) const {
  constexpr Microseconds kNear = 100'000;  // further apart are two stalls
  const std::lock_guard lock(mutex_);
  const auto next = readings_.lower_bound(stamp);
  if (next == readings_.end() || next == readings_.begin()) return 0.0;
  const auto before = std::prev(next);
  const Microseconds apart = next->first - before->first;
  if (apart > kNear) return 0.0;
  const double along = static_cast<double>(stamp - before->first) / static_cast<double>(apart);
  return before->second + along * (next->second - before->second);
}

Fault encoder_stalls(const std::string& joint, std::shared_ptr<Stall> stall) {
  return on_joints([joint, stall, stalled = std::optional<float>()](joint_state_t& j, MessageSink&) mutable {
    for (std::size_t k = 0; k < j.joint_name.size(); ++k) {
      if (j.joint_name[k] != joint) continue;
      if (!stalled) stalled = j.joint_position[k];
      stall->add(j.utime, *stalled - j.joint_position[k]);
      j.joint_position[k] = *stalled;
      j.joint_velocity[k] = 0.0f;
    }
    return true;
  });
}

Fault encoder_wraps(const std::string& joint) {
  return on_joint(joint, [](float& q) { q -= 6.2831853f; });
}

Fault encoder_jumps(const std::string& joint) {
  return on_joint(joint, [n = 0](float& q) mutable {
    if (n++ / 2 % 2 == 0) q += 1.05f;
  });
}

Fault joint_missing(const std::string& joint) {
  return on_joints([joint](joint_state_t& j, MessageSink&) {
    std::replace(j.joint_name.begin(), j.joint_name.end(), joint, std::string("somebody_elses"));
    return true;
  });
}

Fault clock_steps_back() {
  constexpr Microseconds kHour = 3'600'000'000;
  return {.pictures =
              [](images_t& p, MessageSink&) {
                p.utime -= kHour;
                for (auto& image : p.images) image.utime -= kHour;
                return true;
              },
          .joints =
              [](joint_state_t& j, MessageSink&) {
                j.utime -= kHour;
                return true;
              }};
}

Fault packets_lost(double chance, unsigned seed) {
  const auto arrives = [chance, random = std::make_shared<std::mt19937>(seed)](int packets) {
    std::uniform_real_distribution<double> uniform;
    bool whole = true;
    for (int i = 0; i < packets; ++i) whole = uniform(*random) >= chance && whole;
    return whole;
  };
  return {.pictures = [arrives](images_t&, MessageSink&) { return arrives(8); },
          .joints = [arrives](joint_state_t&, MessageSink&) { return arrives(1); }};
}

Fault rubbish_between() {
  const auto spoil = [](const char* channel) {
    return [channel, n = 0](auto& message, MessageSink& link) mutable {
      if (++n % 10 != 0) return true;
      std::vector<std::uint8_t> half(static_cast<std::size_t>(message.getEncodedSize()));
      message.encode(half.data(), 0, static_cast<int>(half.size()));
      half.resize(half.size() / 2);
      link.publish(channel, 0, half);
      link.publish(channel, 0, std::vector<std::uint8_t>(33, 0xA5));
      return true;
    };
  };
  return {.pictures = spoil(kCameras), .joints = spoil(kJoints)};
}

std::vector<Named> all(unsigned seed, const std::shared_ptr<Stall>& stall) {
  return {{"left camera dies", [] { return camera_dies(0); }},
          {"right camera dies", [] { return camera_dies(1); }},
          {"both cameras die", both_cameras_die},
          {"left camera freezes", [] { return camera_freezes(0); }},
          {"left and right swapped", cameras_swapped},
          {"pictures twice", pictures_doubled},
          {"pictures out of order", pictures_out_of_order},
          {"pictures 0.5 s late", [] { return pictures_late(500'000); }},
          {"picture size jumps", picture_size_jumps},
          {"pixel format jumps", pixel_format_jumps},
          {"pictures turn gray", pixel_format_jumps_to_gray},
          {"lights off", lights_go_off},
          {"hand leaves the view", hand_leaves_the_view},
          {"second publisher", [] { return second_publisher(); }},
          {"encoders stop", encoders_stop},
          {"encoders 140 ms late", [] { return encoders_late(140'000); }},
          {"encoder reports NaN", encoder_not_a_number},
          {"encoder of r_elbow stalls", [stall] { return encoder_stalls(kStalls, stall); }},
          {"encoder of r_elbow wraps", [] { return encoder_wraps("r_elbow"); }},
          {"encoder of r_elbow jumps", [] { return encoder_jumps("r_elbow"); }},
          {"r_elbow missing", [] { return joint_missing("r_elbow"); }},
          {"clock steps back an hour", clock_steps_back},
          {"5 % of packets lost", [seed] { return packets_lost(0.05, seed); }},
          {"20 % of packets lost", [seed] { return packets_lost(0.2, seed); }},
          {"rubbish between messages", rubbish_between}};
}

}  // namespace bodyschema::integration::faults
