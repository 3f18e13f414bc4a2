#include "bodyschema/bus/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bodyschema/camera/picture_reduction.hpp"
#include "jpeg.hpp"
#include "wire_reader.hpp"

namespace bodyschema {

namespace {

constexpr std::size_t kMinText = 5;   // length word and terminating zero
constexpr int kMaxParameters = 4096;  // joints' offsets are few; extended models hold more
constexpr int kMaxStatusEntries = 4096;
constexpr int kMaxFindings = 256;

/// Sentences and names of renderers are longer than joint names.
DecodeLimits with_long_text(DecodeLimits limits) {
  limits.max_name_bytes = std::max(limits.max_name_bytes, 4096);
  return limits;
}

void read_pose(WireReader& in, pose_t& pose) {
  for (double& value : pose.position_m) value = in.float64();
  for (double& value : pose.quaternion_wxyz) value = in.float64();
}

void read_image(WireReader& in, ImageView& image) {
  image.utime = in.stamp("utime");
  image.width = in.integer<std::int32_t>();
  image.height = in.integer<std::int32_t>();
  image.row_stride = in.integer<std::int32_t>();
  image.pixelformat = in.integer<std::int32_t>();
  const auto size = in.count<std::int32_t>("size", std::numeric_limits<std::int32_t>::max(), 1);
  image.data = in.raw(static_cast<std::size_t>(size));
  const auto n_metadata = in.count<std::int32_t>("nmetadata", in.limits().max_metadata, kMinText + 4);
  std::string key;
  for (int i = 0; i < n_metadata && in.ok(); ++i) {
    in.text("metadata key", key);
    const auto n = in.count<std::int32_t>("n", std::numeric_limits<std::int32_t>::max(), 1);
    in.raw(static_cast<std::size_t>(n));
  }
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace

std::string_view name_of(MessageFault fault) {
  static constexpr std::array<std::string_view, kMessageFaultCount> kNames{
      "none",      "wrong_type", "truncated",  "trailing_bytes",     "bad_count",      "too_large",  "bad_text",
      "bad_stamp", "not_finite", "wrong_size", "unsupported_format", "broken_picture", "other_kind", "bad_mask"};
  return kNames[static_cast<std::size_t>(fault)];
}

DecodeResult decode(Bytes message, JointStateMessage& out, const DecodeLimits& limits) {
  WireReader in(message, limits);
  in.fingerprint(bot_core::joint_state_t::getHash());
  out.utime = in.stamp("utime");
  const auto n = static_cast<std::size_t>(
      in.count<std::int16_t>("num_joints", std::min(limits.max_joints, 32767), kMinText + 3 * sizeof(float)));
  in.texts("joint_name", out.names, static_cast<int>(n));
  const auto read = [&](const char* field, std::vector<float>& values) {
    values.resize(n);
    for (std::size_t i = 0; i < n && in.ok(); ++i) {
      values[i] = in.float32();
      if (in.ok() && !std::isfinite(values[i])) {
        in.fail(MessageFault::kNotFinite, std::string(field) + " of " + out.names[i] + " is not finite");
      }
    }
  };
  read("joint_position", out.position_rad);
  read("joint_velocity", out.velocity_rad_s);
  in.raw(n * sizeof(float));  // effort
  return in.finish();
}

DecodeResult decode(Bytes message, ImagesView& out, const DecodeLimits& limits) {
  // utime, width, height, row_stride, pixelformat, size and nmetadata
  constexpr std::size_t kMinImage = 8 + 6 * 4;
  WireReader in(message, limits);
  in.fingerprint(bot_core::images_t::getHash());
  out.utime = in.stamp("utime");
  const auto n = in.count<std::int32_t>("n_images", limits.max_images, 2 + kMinImage);
  out.images.resize(static_cast<std::size_t>(n));
  for (auto& image : out.images) image.type = in.integer<std::int16_t>();
  for (auto& image : out.images) {
    read_image(in, image);
    if (image.utime == 0) image.utime = out.utime;
  }
  return in.finish();
}

DecodeResult decode(Bytes message, joint_offsets_t& out, const DecodeLimits& given) {
  const DecodeLimits limits = with_long_text(given);
  WireReader in(message, limits);
  in.fingerprint(joint_offsets_t::getHash());
  out.utime = in.stamp("utime");
  out.sequence = in.integer<std::int64_t>();
  out.latency_ms = in.float64();
  in.text("state", out.state);
  const int n = out.num_joints = in.count<std::int32_t>("num_joints", limits.max_joints, kMinText + 8);
  in.texts("joint_name", out.joint_name, n);
  in.doubles(out.mean_rad, n);
  out.covariance_rad2.resize(static_cast<std::size_t>(in.ok() ? n : 0));
  for (auto& row : out.covariance_rad2) in.doubles(row, n);
  out.told.resize(static_cast<std::size_t>(in.ok() ? n : 0));
  for (auto& told : out.told) told = in.integer<std::int8_t>();
  out.num_particles = in.integer<std::int32_t>();
  out.effective_sample_size = in.float64();
  out.best_likelihood = in.float64();
  const int cameras = out.num_cameras = in.count<std::int32_t>("num_cameras", limits.max_images, kMinText + 7 * 8);
  in.texts("camera_name", out.camera_name, cameras);
  out.hand_pose_in_camera.resize(static_cast<std::size_t>(in.ok() ? cameras : 0));
  for (auto& pose : out.hand_pose_in_camera) read_pose(in, pose);
  const int parameters = out.num_parameters =
      in.count<std::int32_t>("num_parameters", kMaxParameters, 2 * kMinText + 3 * 8);
  in.texts("parameter_name", out.parameter_name, parameters);
  in.texts("parameter_unit", out.parameter_unit, parameters);
  in.doubles(out.parameter_value, parameters);
  in.doubles(out.parameter_stddev, parameters);
  in.doubles(out.parameter_prior_stddev, parameters);
  out.hand_stddev_m = in.float64();
  in.text("verdict", out.verdict);
  out.innovation = in.float64();
  out.innovation_dof = in.float64();
  out.innovation_usual = in.float64();
  out.postures = in.integer<std::int32_t>();
  out.posture_stddev_rad = in.float64();
  out.outline_stddev_px = in.float64();
  out.outline_points_alike = in.float64();
  in.text("changed", out.changed);
  in.text("misfit", out.misfit);
  in.text("stalled_joint", out.stalled_joint);
  out.stalled_motion_rad = in.float64();
  out.cameras_swapped = in.integer<std::int8_t>();
  in.text("model_hash", out.model_hash);
  in.text("config_hash", out.config_hash);
  return in.finish();
}

DecodeResult decode(Bytes message, findings_t& out, const DecodeLimits& given) {
  // Four texts, two counts, three numbers and a stamp.
  constexpr std::size_t kMinFinding = 4 * kMinText + 2 * 4 + 4 * 8 + 1;
  const DecodeLimits limits = with_long_text(given);
  WireReader in(message, limits);
  in.fingerprint(findings_t::getHash());
  out.utime = in.stamp("utime");
  out.span_s = in.float64();
  out.blocks = in.integer<std::int32_t>();
  out.z_threshold = in.float64();
  const int n = out.num_findings = in.count<std::int32_t>("num_findings", kMaxFindings, kMinFinding);
  out.finding.resize(static_cast<std::size_t>(in.ok() ? n : 0));
  for (auto& f : out.finding) {
    in.text("effect", f.effect);
    in.text("joint", f.joint);
    in.text("source", f.source);
    in.text("sentence", f.sentence);
    const int parameters = f.num_parameters =
        in.count<std::int32_t>("num_parameters", kMaxFindings, 2 * kMinText + 2 * 8);
    in.texts("parameter_name", f.parameter_name, parameters);
    in.texts("parameter_unit", f.parameter_unit, parameters);
    in.doubles(f.parameter_value, parameters);
    in.doubles(f.parameter_stddev, parameters);
    f.z = in.float64();
    f.hand_m = in.float64();
    f.outline_px = in.float64();
    f.from_utime = in.stamp("from_utime");
    f.estimated = in.integer<std::int8_t>();
    const int alike = f.num_alike = in.count<std::int32_t>("num_alike", kMaxFindings, kMinText);
    in.texts("alike", f.alike, alike);
  }
  return in.finish();
}

DecodeResult decode(Bytes message, offsets_status_t& out, const DecodeLimits& given) {
  const DecodeLimits limits = with_long_text(given);
  WireReader in(message, limits);
  in.fingerprint(offsets_status_t::getHash());
  out.utime = in.stamp("utime");
  out.uptime_us = in.integer<std::int64_t>();
  out.level = in.integer<std::int8_t>();
  in.text("sentence", out.sentence);
  in.text("state", out.state);
  out.frames_in = in.integer<std::int64_t>();
  out.frames_estimated = in.integer<std::int64_t>();
  out.frames_dropped = in.integer<std::int64_t>();
  out.gaps = in.integer<std::int64_t>();
  out.frame_rate_hz = in.float64();
  out.image_age_ms = in.float64();
  out.encoder_lag_ms = in.float64();
  const int counters = out.num_counters = in.count<std::int32_t>("num_counters", kMaxStatusEntries, kMinText + 8);
  in.texts("counter_name", out.counter_name, counters);
  out.counter_value.resize(static_cast<std::size_t>(in.ok() ? counters : 0));
  for (auto& value : out.counter_value) value = in.integer<std::int64_t>();
  const int bins = out.num_latency_bins = in.count<std::int32_t>("num_latency_bins", kMaxStatusEntries, 16);
  in.doubles(out.latency_bin_upper_ms, bins);
  out.latency_count.resize(static_cast<std::size_t>(in.ok() ? bins : 0));
  for (auto& value : out.latency_count) value = in.integer<std::int64_t>();
  out.latency_median_ms = in.float64();
  out.latency_p99_ms = in.float64();
  const int stages = out.num_stages = in.count<std::int32_t>("num_stages", kMaxStatusEntries, kMinText + 16);
  in.texts("stage_name", out.stage_name, stages);
  in.doubles(out.stage_median_ms, stages);
  in.doubles(out.stage_p99_ms, stages);
  in.text("engine", out.engine);
  in.text("renderer", out.renderer);
  out.num_particles = in.integer<std::int32_t>();
  out.effective_sample_size = in.float64();
  out.best_likelihood = in.float64();
  in.text("weakest_direction", out.weakest_direction);
  out.weakest_stddev_rad = in.float64();
  out.resident_bytes = in.integer<std::int64_t>();
  in.text("version", out.version);
  in.text("model_hash", out.model_hash);
  in.text("config_hash", out.config_hash);
  return in.finish();
}

DecodeResult unpack(const ImageView& view, Image& out, const DecodeLimits& limits, int reduction) {
  using bot_core::image_t;
  if (view.width <= 0 || view.height <= 0) {
    return {MessageFault::kWrongSize, "picture of " + size_text(view.width, view.height)};
  }
  if (view.width > limits.max_width_px || view.height > limits.max_height_px) {
    return {MessageFault::kTooLarge, "picture of " + size_text(view.width, view.height)};
  }
  if (view.pixelformat == image_t::PIXEL_FORMAT_MJPEG) {
    return decompress_jpeg(view.data, view.width, view.height, reduction, out);
  }
  const bool gray = view.pixelformat == image_t::PIXEL_FORMAT_GRAY;
  const bool bgr = view.pixelformat == image_t::PIXEL_FORMAT_BGR;
  if (!gray && !bgr && view.pixelformat != image_t::PIXEL_FORMAT_RGB) {
    return {MessageFault::kUnsupportedFormat, "pixel format " + std::to_string(view.pixelformat)};
  }
  const int channels = gray ? 1 : 3;
  const auto row_bytes = static_cast<std::size_t>(view.width) * static_cast<std::size_t>(channels);
  // Some publishers leave the stride zero where rows are not padded.
  const std::int64_t stride = view.row_stride == 0 ? static_cast<std::int64_t>(row_bytes) : view.row_stride;
  const std::int64_t needed = stride * (view.height - 1) + static_cast<std::int64_t>(row_bytes);
  const std::int64_t whole = stride * view.height;
  const auto held = static_cast<std::int64_t>(view.data.size());
  if (stride < static_cast<std::int64_t>(row_bytes) || held < needed || held > whole) {
    return {MessageFault::kWrongSize, std::to_string(held) + " bytes for " + size_text(view.width, view.height) +
                                          " with rows of " + std::to_string(view.row_stride) + " bytes"};
  }
  reduce(view.data.data(), static_cast<std::size_t>(stride), view.width, view.height, channels, reduction, out);
  if (bgr) {
    for (std::size_t i = 0; i < out.data.size(); i += 3) std::swap(out.data[i], out.data[i + 2]);
  }
  return {};
}

DecodeResult to_mask(Image& picture) {
  const std::size_t pixels = static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  if (picture.channels == 3) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::uint8_t* p = picture.data.data() + 3 * i;
      if (p[0] != p[1] || p[1] != p[2]) {
        return {MessageFault::kBadMask, "mask in colour; expected gray: 0 background, 128 not known, 255 robot"};
      }
      picture.data[i] = p[0];
    }
    picture.data.resize(pixels);
    picture.channels = 1;
  }
  constexpr std::uint8_t kLastBackground = 63, kFirstRobot = 192;
  std::uint8_t largest = 0;
  for (std::uint8_t& level : picture.data) {
    largest = std::max(largest, level);
    level = level >= kFirstRobot ? kMaskRobot : level > kLastBackground ? kMaskUnknown : kMaskBackground;
  }
  if (largest > 0 && largest <= kLastBackground) {
    return {MessageFault::kBadMask, "mask whose largest value is " + std::to_string(largest) +
                                        "; expected 0 background, 128 not known, 255 robot"};
  }
  return {};
}

bot_core::image_t to_message(const Image& image, Microseconds utime) {
  bot_core::image_t message;
  message.utime = utime;
  message.width = image.width;
  message.height = image.height;
  message.row_stride = image.width * image.channels;
  message.pixelformat = bot_core::image_t::PIXEL_FORMAT_RGB;
  if (image.channels == 1) message.pixelformat = bot_core::image_t::PIXEL_FORMAT_GRAY;
  message.size = static_cast<std::int32_t>(image.data.size());
  message.data = image.data;
  message.nmetadata = 0;
  return message;
}

bot_core::image_t to_jpeg_message(const Image& image, Microseconds utime, int quality) {
  bot_core::image_t message;
  message.data = compress_jpeg(image, quality);
  message.utime = utime;
  message.width = image.width;
  message.height = image.height;
  message.row_stride = 0;
  message.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  message.size = static_cast<std::int32_t>(message.data.size());
  message.nmetadata = 0;
  return message;
}

}  // namespace bodyschema
