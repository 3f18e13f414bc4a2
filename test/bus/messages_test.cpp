#include "bodyschema/bus/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

bot_core::joint_state_t joint_state() {
  bot_core::joint_state_t m;
  m.utime = 1'512'784'563'677'179;
  m.num_joints = 3;
  m.joint_name = {"r_shoulder_pitch", "r_elbow", "neck_yaw"};
  m.joint_position = {0.25F, -1.5F, 3e-4F};
  m.joint_velocity = {0.0F, 0.125F, -2.0F};
  m.joint_effort = {1.0F, 2.0F, 3.0F};
  return m;
}

Image picture(int width, int height, int channels, unsigned seed = 1) {
  Image image(width, height, channels);
  std::mt19937 random(seed);
  for (auto& byte : image.data) byte = static_cast<std::uint8_t>(random());
  return image;
}

/// Smooth, so that JPEG keeps it nearly.
Image gradient(int width, int height, int channels) {
  Image image(width, height, channels);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      for (int c = 0; c < channels; ++c) image.pixel(u, v)[c] = static_cast<std::uint8_t>(2 * u + v + 40 * c);
    }
  }
  return image;
}

bot_core::images_t images() {
  bot_core::images_t m;
  m.utime = 1000;
  m.n_images = 2;
  m.image_types = {bot_core::images_t::LEFT, bot_core::images_t::RIGHT};
  m.images = {to_message(picture(7, 5, 3), 1001), to_message(picture(6, 4, 1), 1002)};
  bot_core::image_metadata_t metadata;
  metadata.key = "exposure";
  metadata.n = 2;
  metadata.value = {1, 2};
  m.images[1].nmetadata = 1;
  m.images[1].metadata = {metadata};
  return m;
}

joint_offsets_t joint_offsets() {
  joint_offsets_t m;
  m.utime = 123;
  m.sequence = 7;
  m.latency_ms = 12.5;
  m.state = "tracking";
  m.num_joints = 2;
  m.joint_name = {"r_elbow", "r_wrist_yaw"};
  m.mean_rad = {0.1, -0.2};
  m.covariance_rad2 = {{1e-4, 2e-5}, {2e-5, 3e-4}};
  m.num_particles = 200;
  m.effective_sample_size = 150.25;
  m.best_likelihood = 0.875;
  m.num_cameras = 2;
  m.camera_name = {"left", "right"};
  m.hand_pose_in_camera.resize(2);
  for (int c = 0; c < 2; ++c) {
    for (int i = 0; i < 3; ++i) m.hand_pose_in_camera[c].position_m[i] = c + 0.1 * i;
    for (int i = 0; i < 4; ++i) m.hand_pose_in_camera[c].quaternion_wxyz[i] = 0.5;
  }
  m.num_parameters = 1;
  m.parameter_name = {"vergence"};
  m.parameter_unit = {"deg"};
  m.parameter_value = {0.5};
  m.parameter_stddev = {0.1};
  m.parameter_prior_stddev = {2.0};
  m.told = {1, 0};
  m.hand_stddev_m = 6e-4;
  m.verdict = "agrees";
  m.innovation = 7.5;
  m.innovation_dof = 8.0;
  m.innovation_usual = 1.1;
  m.postures = 5;
  m.posture_stddev_rad = 0.001;
  m.outline_stddev_px = 0.3;
  m.outline_points_alike = 4.0;
  m.changed = "r_elbow slipped by 4.9 deg";
  m.misfit = "";
  m.stalled_joint = "r_elbow";
  m.stalled_motion_rad = 0.1;
  m.cameras_swapped = 0;
  m.model_hash = "abc";
  m.config_hash = "def";
  return m;
}

findings_t findings() {
  findings_t m;
  m.utime = 9;
  m.span_s = 42.5;
  m.blocks = 31;
  m.z_threshold = 4.4;
  m.num_findings = 1;
  m.finding.resize(1);
  auto& f = m.finding[0];
  f.effect = "latency";
  f.sentence = "pictures arrive 58 ms (57 to 59) late against the encoders";
  f.num_parameters = 1;
  f.parameter_name = {"delay"};
  f.parameter_unit = {"ms"};
  f.parameter_value = {58.0};
  f.parameter_stddev = {0.5};
  f.z = 14.0;
  f.hand_m = 0.004;
  f.outline_px = 2.5;
  f.from_utime = 0;
  f.estimated = 0;
  f.num_alike = 1;
  f.alike = {"backlash of r_elbow"};
  return m;
}

offsets_status_t offsets_status() {
  offsets_status_t m;
  m.utime = 5;
  m.uptime_us = 6;
  m.level = offsets_status_t::WARN;
  m.sentence = "encoders late by 140 ms";
  m.state = "tracking";
  m.frames_in = 100;
  m.frames_estimated = 90;
  m.frames_dropped = 10;
  m.gaps = 1;
  m.frame_rate_hz = 29.5;
  m.image_age_ms = 3.0;
  m.encoder_lag_ms = 140.0;
  m.num_counters = 2;
  m.counter_name = {"malformed.truncated", "dropped.overload"};
  m.counter_value = {3, 4};
  m.num_latency_bins = 2;
  m.latency_bin_upper_ms = {10.0, std::numeric_limits<double>::infinity()};
  m.latency_count = {80, 10};
  m.latency_median_ms = 8.0;
  m.latency_p99_ms = 20.0;
  m.num_stages = 1;
  m.stage_name = {"score"};
  m.stage_median_ms = {5.0};
  m.stage_p99_ms = {9.0};
  m.engine = "atlas";
  m.renderer = "llvmpipe";
  m.num_particles = 200;
  m.effective_sample_size = 33.0;
  m.best_likelihood = 0.5;
  m.weakest_direction = "0.8 r_elbow - 0.6 r_wrist_yaw";
  m.weakest_stddev_rad = 0.05;
  m.resident_bytes = 1 << 27;
  m.version = "0.1.0";
  m.model_hash = "abc";
  m.config_hash = "def";
  return m;
}

// The fingerprints that lcm-gen computes for the original bot_core types (public repository
// openhumanoids/bot_core_lcmtypes): whoever publishes those is understood.
TEST(Fingerprints, AreThoseOfBotCore) {
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::joint_state_t::getHash()), 0x3e377b4cebc593a4u);
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::images_t::getHash()), 0x20ba4f05e8f5e33au);
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::image_t::getHash()), 0x14739ffe13d5f5f0u);
  EXPECT_EQ(static_cast<std::uint64_t>(bot_core::image_metadata_t::getHash()), 0x9a4b634d0577fb8eu);
}

TEST(Decode, JointStateComesBack) {
  JointStateMessage out;
  const auto result = decode(encode(joint_state()), out);
  ASSERT_TRUE(result.ok()) << result.detail;
  EXPECT_EQ(out.utime, joint_state().utime);
  EXPECT_EQ(out.names, joint_state().joint_name);
  EXPECT_EQ(out.position_rad, joint_state().joint_position);
  EXPECT_EQ(out.velocity_rad_s, joint_state().joint_velocity);
}

TEST(Decode, ImagesComeBackWithTheirOwnStamps) {
  const auto message = images();
  const auto bytes = encode(message);
  ImagesView out;
  const auto result = decode(bytes, out);
  ASSERT_TRUE(result.ok()) << result.detail;
  ASSERT_EQ(out.images.size(), 2u);
  EXPECT_EQ(out.utime, 1000);
  EXPECT_EQ(out.images[0].type, 0);
  EXPECT_EQ(out.images[0].utime, 1001);
  EXPECT_EQ(out.images[1].type, 1);
  EXPECT_EQ(out.images[1].utime, 1002);
  Image left, right;
  ASSERT_TRUE(unpack(out.images[0], left).ok());
  ASSERT_TRUE(unpack(out.images[1], right).ok());
  EXPECT_EQ(left.data, picture(7, 5, 3).data);
  EXPECT_EQ(left.channels, 3);
  EXPECT_EQ(right.data, picture(6, 4, 1).data);
  EXPECT_EQ(right.channels, 1);
}

TEST(Decode, ImageWithoutStampTakesThatOfItsMessage) {
  auto message = images();
  message.images[0].utime = 0;
  const auto bytes = encode(message);
  ImagesView out;
  ASSERT_TRUE(decode(bytes, out).ok());
  EXPECT_EQ(out.images[0].utime, 1000);
}

TEST(Decode, OffsetsComeBack) {
  joint_offsets_t out;
  const auto bytes = encode(joint_offsets());
  const auto result = decode(bytes, out);
  ASSERT_TRUE(result.ok()) << result.detail;
  EXPECT_EQ(encode(out), bytes);  // every field, as the generated code writes them
  EXPECT_EQ(out.mean_rad, joint_offsets().mean_rad);
}

TEST(Decode, StatusComesBack) {
  offsets_status_t out;
  const auto bytes = encode(offsets_status());
  const auto result = decode(bytes, out);
  ASSERT_TRUE(result.ok()) << result.detail;
  EXPECT_EQ(encode(out), bytes);
  EXPECT_EQ(out.sentence, "encoders late by 140 ms");
}

TEST(Decode, FindingsComeBack) {
  findings_t out;
  const auto bytes = encode(findings());
  const auto result = decode(bytes, out);
  ASSERT_TRUE(result.ok()) << result.detail;
  EXPECT_EQ(encode(out), bytes);
  EXPECT_EQ(out.finding.at(0).alike, findings().finding[0].alike);
}

template <class Out>
void expect_every_truncation_refused(const std::vector<std::uint8_t>& whole) {
  Out out;
  ASSERT_TRUE(decode(whole, out).ok());
  for (std::size_t n = 0; n < whole.size(); ++n) {
    // A copy of exactly n bytes, so that a sanitizer sees any read beyond them.
    const std::vector<std::uint8_t> cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n));
    EXPECT_EQ(decode(cut, out).fault, MessageFault::kTruncated) << "at byte " << n;
  }
  auto longer = whole;
  longer.push_back(0);
  EXPECT_EQ(decode(longer, out).fault, MessageFault::kTrailingBytes);
}

TEST(Decode, RefusesEveryTruncation) {
  expect_every_truncation_refused<JointStateMessage>(encode(joint_state()));
  expect_every_truncation_refused<ImagesView>(encode(images()));
  expect_every_truncation_refused<joint_offsets_t>(encode(joint_offsets()));
  expect_every_truncation_refused<offsets_status_t>(encode(offsets_status()));
  expect_every_truncation_refused<findings_t>(encode(findings()));
}

TEST(Decode, RefusesAnotherType) {
  JointStateMessage joints;
  EXPECT_EQ(decode(encode(images()), joints).fault, MessageFault::kWrongType);
  ImagesView view;
  EXPECT_EQ(decode(encode(joint_state()), view).fault, MessageFault::kWrongType);
}

template <class Out>
void survive_damage(const std::vector<std::uint8_t>& whole, std::mt19937& random) {
  Out out;
  for (int round = 0; round < 20'000; ++round) {
    auto bytes = whole;
    const int changes = 1 + static_cast<int>(random() % 4);
    for (int i = 0; i < changes; ++i) {
      // Half of the changes leave the fingerprint alone, to get past it.
      const std::size_t first = random() % 2 == 0 ? 8 : 0;
      bytes[first + random() % (bytes.size() - first)] = static_cast<std::uint8_t>(random());
    }
    if (random() % 8 == 0) bytes.resize(random() % bytes.size());
    const auto result = decode(bytes, out);
    EXPECT_EQ(result.ok(), result.detail.empty());
    if constexpr (std::is_same_v<Out, ImagesView>) {
      if (!result.ok()) continue;
      for (const auto& view : out.images) {
        Image image;
        if (unpack(view, image).ok()) {
          EXPECT_EQ(image.data.size(), static_cast<std::size_t>(image.width * image.height * image.channels));
        }
      }
    }
  }
  for (int round = 0; round < 2'000; ++round) {  // noise behind a true fingerprint
    std::vector<std::uint8_t> bytes(whole.begin(), whole.begin() + 8);
    bytes.resize(8 + random() % 200);
    for (std::size_t i = 8; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(random());
    (void)decode(bytes, out);
  }
}

TEST(Decode, SurvivesDamagedBytes) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  survive_damage<JointStateMessage>(encode(joint_state()), random);
  survive_damage<ImagesView>(encode(images()), random);
  survive_damage<joint_offsets_t>(encode(joint_offsets()), random);
  survive_damage<offsets_status_t>(encode(offsets_status()), random);
  survive_damage<findings_t>(encode(findings()), random);
}

void put_int32(std::vector<std::uint8_t>& bytes, std::size_t at, std::uint32_t value) {
  for (int i = 3; i >= 0; --i, value >>= 8) bytes[at + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(value);
}

TEST(Decode, RefusesCountsBeforeTakingMemory) {
  // utime and fingerprint take 16 bytes, then n_images.
  auto bytes = encode(images());
  ImagesView out;
  put_int32(bytes, 16, 0x7fffffff);
  EXPECT_EQ(decode(bytes, out).fault, MessageFault::kTooLarge);
  put_int32(bytes, 16, 0xffffffff);
  EXPECT_EQ(decode(bytes, out).fault, MessageFault::kBadCount);
  put_int32(bytes, 16, 16);
  EXPECT_EQ(decode(bytes, out).fault, MessageFault::kTruncated);
  EXPECT_LE(out.images.capacity(), 16u);
}

TEST(Decode, RefusesAPictureThatClaimsTwoGigabytes) {
  auto bytes = encode(images());
  // After 2 types: utime (8), width, height, row_stride, pixelformat (16), then size.
  put_int32(bytes, 16 + 4 + 4 + 24, 0x7fffffff);
  ImagesView out;
  EXPECT_EQ(decode(bytes, out).fault, MessageFault::kTruncated);
}

TEST(Decode, RefusesNaNAndNamesTheJoint) {
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity()}) {
    auto position = joint_state();
    position.joint_position[1] = bad;
    JointStateMessage out;
    const auto result = decode(encode(position), out);
    EXPECT_EQ(result.fault, MessageFault::kNotFinite);
    EXPECT_NE(result.detail.find("r_elbow"), std::string::npos) << result.detail;
    auto velocity = joint_state();
    velocity.joint_velocity[0] = bad;
    EXPECT_EQ(decode(encode(velocity), out).fault, MessageFault::kNotFinite);
  }
}

TEST(Decode, DoesNotLookAtEffort) {
  auto message = joint_state();
  message.joint_effort[2] = std::nanf("");
  JointStateMessage out;
  EXPECT_TRUE(decode(encode(message), out).ok());
}

TEST(Decode, RefusesStampsThatCannotBe) {
  for (const std::int64_t stamp :
       {std::int64_t{-1}, std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min()}) {
    auto message = joint_state();
    message.utime = stamp;
    JointStateMessage out;
    EXPECT_EQ(decode(encode(message), out).fault, MessageFault::kBadStamp);
  }
}

TEST(Decode, RefusesNamesThatAreNotText) {
  auto message = joint_state();
  message.joint_name[0] = "r_elbow\n\x1b[31m";
  JointStateMessage out;
  EXPECT_EQ(decode(encode(message), out).fault, MessageFault::kBadText);
  message.joint_name[0] = std::string(1000, 'a');
  EXPECT_EQ(decode(encode(message), out).fault, MessageFault::kTooLarge);
}

ImageView view_of(const bot_core::image_t& message) {
  return {0, message.utime, message.width, message.height, message.row_stride, message.pixelformat, message.data};
}

TEST(Unpack, ReadsPaddedRowsAndBgr) {
  const Image rgb = picture(5, 3, 3);
  bot_core::image_t message = to_message(rgb, 1);
  message.pixelformat = bot_core::image_t::PIXEL_FORMAT_BGR;
  message.row_stride = 20;
  message.data.assign(60, 99);
  for (int v = 0; v < 3; ++v) {
    for (int u = 0; u < 5; ++u) {
      for (int c = 0; c < 3; ++c) {
        message.data[static_cast<std::size_t>(v * 20 + u * 3 + c)] = rgb.pixel(u, v)[2 - c];
      }
    }
  }
  message.size = 60;
  Image out;
  ASSERT_TRUE(unpack(view_of(message), out).ok());
  EXPECT_EQ(out.data, rgb.data);
  // The padding of the last row may be left out; one byte less is too short, one more than whole too long.
  message.data.resize(55);
  EXPECT_TRUE(unpack(view_of(message), out).ok());
  message.data.resize(54);
  EXPECT_EQ(unpack(view_of(message), out).fault, MessageFault::kWrongSize);
  message.data.resize(61);
  EXPECT_EQ(unpack(view_of(message), out).fault, MessageFault::kWrongSize);
}

TEST(Unpack, TakesStrideZeroAsUnpadded) {
  auto message = to_message(picture(5, 3, 1), 1);
  message.row_stride = 0;
  Image out;
  ASSERT_TRUE(unpack(view_of(message), out).ok());
  EXPECT_EQ(out.data, picture(5, 3, 1).data);
}

TEST(Unpack, RefusesSizesThatDoNotFit) {
  const auto good = to_message(picture(5, 3, 3), 1);
  Image out;
  const auto fault = [&](auto change) {
    auto message = good;
    change(message);
    return unpack(view_of(message), out).fault;
  };
  EXPECT_EQ(fault([](auto& m) { m.width = 0; }), MessageFault::kWrongSize);
  EXPECT_EQ(fault([](auto& m) { m.height = -3; }), MessageFault::kWrongSize);
  EXPECT_EQ(fault([](auto& m) { m.row_stride = -15; }), MessageFault::kWrongSize);
  EXPECT_EQ(fault([](auto& m) { m.row_stride = 14; }), MessageFault::kWrongSize);
  EXPECT_EQ(fault([](auto& m) { m.row_stride = std::numeric_limits<std::int32_t>::max(); }), MessageFault::kWrongSize);
  EXPECT_EQ(fault([](auto& m) { m.width = 2'000'000'000; }), MessageFault::kTooLarge);
  EXPECT_EQ(fault([](auto& m) { m.height = 4097; }), MessageFault::kTooLarge);
  EXPECT_EQ(fault([](auto& m) { m.pixelformat = 4711; }), MessageFault::kUnsupportedFormat);
}

TEST(Unpack, ReadsJpegInColourAndGray) {
  for (const int channels : {1, 3}) {
    const Image image = gradient(64, 48, channels);
    const auto message = to_jpeg_message(image, 5, 95);
    EXPECT_LT(message.data.size(), image.data.size());
    Image out;
    const auto result = unpack(view_of(message), out);
    ASSERT_TRUE(result.ok()) << result.detail;
    ASSERT_EQ(out.channels, channels);
    ASSERT_EQ(out.data.size(), image.data.size());
    double sum = 0.0;
    for (std::size_t i = 0; i < out.data.size(); ++i) sum += std::abs(int(out.data[i]) - int(image.data[i]));
    EXPECT_LT(sum / static_cast<double>(out.data.size()), 4.0);  // red and blue swapped would be 80
  }
}

/// Means of n x n pixels, whatever the format.
TEST(Unpack, ReducesPicturesThatHaveMorePixelsThanAreNeeded) {
  for (const int channels : {1, 3}) {
    const Image image = gradient(64, 48, channels);
    for (const int n : {2, 4}) {
      const Image expected = reduced(image, n);
      Image out;
      ASSERT_TRUE(unpack(view_of(to_message(image, 5)), out, {}, n).ok());
      EXPECT_EQ(out.width, 64 / n);
      EXPECT_EQ(out.height, 48 / n);
      EXPECT_EQ(out.data, expected.data);
      ASSERT_TRUE(unpack(view_of(to_jpeg_message(image, 5, 95)), out, {}, n).ok());
      EXPECT_EQ(out.width, 64 / n);
      EXPECT_EQ(out.channels, channels);
      ASSERT_EQ(out.data.size(), expected.data.size());
      double sum = 0.0;
      for (std::size_t i = 0; i < out.data.size(); ++i) sum += std::abs(int(out.data[i]) - int(expected.data[i]));
      EXPECT_LT(sum / static_cast<double>(out.data.size()), 4.0);
    }
  }
}

TEST(Unpack, RefusesJpegOfAnotherSizeBeforeDecoding) {
  auto message = to_jpeg_message(gradient(64, 48, 3), 5, 90);
  message.width = 65;
  Image out;
  const auto result = unpack(view_of(message), out);
  EXPECT_EQ(result.fault, MessageFault::kWrongSize);
  EXPECT_NE(result.detail.find("64x48"), std::string::npos) << result.detail;
  EXPECT_TRUE(out.empty());
}

TEST(Unpack, RefusesJpegCutShortAtEveryByte) {
  const auto whole = to_jpeg_message(gradient(32, 24, 3), 5, 80);
  for (std::size_t n = 0; n < whole.data.size(); ++n) {
    auto message = whole;
    message.data.resize(n);
    Image out;
    for (const int reduction : {1, 4}) {
      EXPECT_EQ(unpack(view_of(message), out, {}, reduction).fault, MessageFault::kBrokenPicture) << "at byte " << n;
    }
  }
}

TEST(Unpack, SurvivesDamagedJpeg) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto whole = to_jpeg_message(gradient(32, 24, 3), 5, 80);
  for (int round = 0; round < 3000; ++round) {
    auto message = whole;
    for (int i = 0; i < 3; ++i) message.data[random() % message.data.size()] = static_cast<std::uint8_t>(random());
    Image out;
    if (!unpack(view_of(message), out).ok()) continue;
    EXPECT_EQ(out.data.size(), 32u * 24u * static_cast<unsigned>(out.channels));
  }
}

TEST(ToJpegMessage, RefusesAnEmptyPicture) {
  EXPECT_THROW(to_jpeg_message(Image{}, 0, 90), DataError);
}

TEST(Names, AreOnePerValue) {
  EXPECT_EQ(name_of(MessageFault::kNone), "none");
  EXPECT_EQ(name_of(MessageFault::kBrokenPicture), "broken_picture");
}

}  // namespace
}  // namespace bodyschema
