#include "bodyschema/logs/log_summary.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "recorded_log.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;
using testing_logs::kBegin;

TEST(LogSummary, CountsChannelsRatesAndGaps) {
  const auto summary = summarise_log(testing_logs::swinging_log("summary.lcmlog"));
  EXPECT_EQ(summary.messages, 430u);
  EXPECT_EQ(summary.begin, kBegin + 500);
  EXPECT_NEAR(summary.duration_s, 3.99, 0.02);
  ASSERT_EQ(summary.channels.size(), 2u);
  EXPECT_EQ(summary.channels[0].channel, "ICUB_CAMERAS");
  EXPECT_EQ(summary.channels[0].type, "bot_core.images_t");
  EXPECT_EQ(summary.channels[0].arrivals.count, 30u);
  EXPECT_EQ(summary.channels[1].type, "bot_core.joint_state_t");
  EXPECT_NEAR(summary.channels[1].arrivals.rate_hz, 100.0, 0.01);
  EXPECT_EQ(summary.channels[1].arrivals.gaps, 0u);

  ASSERT_EQ(summary.pictures.size(), 2u);
  const auto& left = summary.pictures[0];
  EXPECT_EQ(left.camera, "left");
  EXPECT_EQ(left.encoding, "RGB");
  EXPECT_EQ(left.width, 32);
  EXPECT_EQ(left.height, 24);
  EXPECT_EQ(left.stamps.count, 30u);
  EXPECT_EQ(left.stamps.gaps, 1u);
  EXPECT_NEAR(left.stamps.longest_gap_s, 1.1, 1e-6);
  EXPECT_EQ(summary.pictures[1].camera, "right");
  EXPECT_EQ(summary.pictures[1].encoding, "JPEG");
}

TEST(LogSummary, SpansTimesThatCannotBe) {
  const auto file = testing_logs::scratch_file("impossible_times.lcmlog");
  {
    LogWriter writer(file);
    const std::uint8_t byte = 0;
    for (const Microseconds t : {std::numeric_limits<Microseconds>::max(), std::numeric_limits<Microseconds>::min()}) {
      writer.publish("C", t, {&byte, 1});
    }
  }
  EXPECT_GT(summarise_log(file).duration_s, 1e9);
  std::filesystem::remove(file);
}

TEST(LogSummary, TellsHowJointsMoved) {
  const auto summary = summarise_log(testing_logs::swinging_log("motion.lcmlog"));
  ASSERT_EQ(summary.joints.size(), 2u);
  const auto& elbow = summary.joints[0];
  EXPECT_EQ(elbow.name, "elbow");
  EXPECT_NEAR(degrees(elbow.highest_rad - elbow.lowest_rad), 30.0, 0.01);
  EXPECT_NEAR(degrees(elbow.fastest_rad_s), 15.0 * 2.0 * kPi, 1.0);
  EXPECT_EQ(elbow.turns, 7);
  EXPECT_EQ(summary.joints[1].turns, 0);
  const std::string text = summary.text();
  EXPECT_THAT(text, HasSubstr("elbow"));
  EXPECT_THAT(text, HasSubstr("1 joint moved by less than 0.5 deg"));
  EXPECT_THAT(text, HasSubstr("1 gap, the longest 1100 ms"));
}

TEST(LogSummary, CountsPosturesThatDifferInAJointThatTurns) {
  const auto file = testing_logs::scratch_file("postures.lcmlog");
  {
    LogWriter writer(file);
    Microseconds t = kBegin;
    const auto posture = [&](float elbow, float lift, bool pictured) {
      bot_core::joint_state_t joints;
      joints.utime = t += 1'000'000;
      joints.num_joints = 2;
      joints.joint_name = {"elbow", "lift"};
      joints.joint_position = {elbow, lift};
      joints.joint_velocity = joints.joint_effort = {0.0F, 0.0F};
      writer.publish_message("A_JOINT_STATE", t, joints);
      bot_core::images_t images;
      images.utime = t;
      images.n_images = 1;
      images.image_types = {0};
      images.images = {to_message(Image(4, 2, 1), t)};
      if (pictured) writer.publish_message("A_CAMERAS", t, images);
    };
    posture(0.0F, 0.0F, true);
    posture(0.04F, 0.0F, true);  // 2.3 deg on
    posture(0.5F, 0.0F, true);
    posture(0.9F, 0.0F, false);
    posture(0.01F, 0.0F, true);  // the first again
    posture(0.5F, 0.4F, true);
  }
  const auto summary = summarise_log(file, std::set<std::string>{"lift"});
  EXPECT_EQ(summary.postures, 2u);
  EXPECT_THAT(summary.text(), HasSubstr("pictures show 2 different postures (a joint apart by 3 deg or more)\n"));
  EXPECT_EQ(nlohmann::json::parse(summary.json())["postures"], 2);
  EXPECT_EQ(summarise_log(file, std::set<std::string>{}).postures, 3u) << "0.4 rad, were it a joint that turns";
  std::filesystem::remove(file);
}

TEST(LogSummary, JointsThatSlideAreInMetres) {
  const auto file = testing_logs::scratch_file("sliding.lcmlog");
  {
    LogWriter writer(file);
    for (int i = 0; i <= 100; ++i) {  // a lift of 4 mm and an elbow of 0.3 rad
      const float share = 0.01F * static_cast<float>(i);
      auto message = testing_logs::joints(kBegin + 10'000 * i, 0.3F * share, 0.5F + 0.004F * share);
      message.joint_name = {"elbow", "lift"};
      writer.publish("ICUB_JOINT_STATE", message.utime, encode(message));
    }
  }
  const auto summary = summarise_log(file, std::set<std::string>{"lift"});
  EXPECT_THAT(summary.text(), testing::ContainsRegex("\njoint that moved +from deg +to deg"));
  EXPECT_THAT(summary.text(), testing::ContainsRegex("\nelbow +0.0 +17.2"));
  EXPECT_THAT(summary.text(), testing::ContainsRegex("\nsliding joint that moved +from mm +to mm +mm/s at most"));
  EXPECT_THAT(summary.text(), testing::ContainsRegex("\nlift +500.0 +504.0 +4 "));
  EXPECT_THAT(summary.text(), testing::Not(HasSubstr("as if every joint turned")));
  auto json = nlohmann::json::parse(summary.json());
  EXPECT_NEAR(json["joints"][0]["highest_deg"], degrees(0.3), 1e-4);
  EXPECT_NEAR(json["joints"][1]["highest_m"], 0.504, 1e-6);
  EXPECT_NEAR(json["joints"][1]["fastest_m_s"], 0.004, 1e-4);
  EXPECT_FALSE(json["joints"][1].contains("highest_deg"));
  EXPECT_EQ(json["sliding_joints"], nlohmann::json({"lift"}));

  const auto unknown = summarise_log(file);
  EXPECT_THAT(unknown.text(), HasSubstr("as if every joint turned"));
  json = nlohmann::json::parse(unknown.json());
  EXPECT_NEAR(json["joints"][1]["highest_deg"], degrees(0.504), 1e-4);
  EXPECT_TRUE(json["sliding_joints"].is_null());
}

// Arm and head of a YARP recording, half a millisecond apart: together they came at 200 Hz and with a gap after
// every head reading.
TEST(LogSummary, CountsEncodersThatComeInTurnsEachByThemselves) {
  const auto file = testing_logs::scratch_file("ports.lcmlog");
  {
    LogWriter writer(file);
    for (Microseconds t = 0; t < 2'000'000; t += 10'000) {
      auto arm = testing_logs::joints(kBegin + t, 0.1F, 0.2F);
      auto head = testing_logs::joints(kBegin + t + 500, 0.3F, 0.4F);
      head.joint_name = {"tilt", "pan"};
      if (t < 1'000'000 || t >= 1'500'000) writer.publish("ICUB_JOINT_STATE", arm.utime, encode(arm));
      writer.publish("ICUB_JOINT_STATE", head.utime, encode(head));
    }
  }
  const auto summary = summarise_log(file);
  ASSERT_EQ(summary.encoders.size(), 2u);
  EXPECT_THAT(summary.encoders[1].joints, testing::ElementsAre("tilt", "pan"));
  EXPECT_NEAR(summary.encoders[1].stamps.rate_hz, 100.0, 0.01);
  EXPECT_EQ(summary.encoders[0].stamps.gaps, 1u);
  EXPECT_EQ(summary.encoders[1].stamps.gaps, 0u);
  EXPECT_THAT(summary.text(), HasSubstr("encoders: 2 joints (elbow, ...) at 74.9 Hz, 1 gap, the longest 510 ms\n"
                                        "encoders: 2 joints (tilt, ...) at 100.0 Hz, no gaps\n"));
  EXPECT_EQ(nlohmann::json::parse(summary.json())["encoders"][1]["joints"][0], "tilt");
}

TEST(LogSummary, CountsWhatCannotBeReadAndKeepsOtherPeoplesMessages) {
  const auto file = testing_logs::scratch_file("damaged.lcmlog");
  {
    LogWriter writer(file);
    const auto good = encode(testing_logs::joints(kBegin, 0.1f, 0.2f));
    const std::vector<std::uint8_t> half(good.begin(), good.begin() + 30);
    writer.publish("ICUB_JOINT_STATE", kBegin, good);
    writer.publish("ICUB_JOINT_STATE", kBegin + 1, half);
    writer.publish("ICUB_JOINT_STATE", kBegin + 2, std::vector<std::uint8_t>{});
    writer.publish("OTHERS", kBegin + 3, std::vector<std::uint8_t>(17, 0xA5));
  }
  {
    std::ofstream stream(file, std::ios::app | std::ios::binary);
    stream << "\xED\xA1\xDA\x01 cut short";
  }
  const auto summary = summarise_log(file);
  ASSERT_EQ(summary.channels.size(), 2u);
  EXPECT_EQ(summary.channels[0].unreadable, 2u);
  EXPECT_EQ(summary.channels[1].type, "?");
  EXPECT_EQ(summary.channels[1].unreadable, 0u);
  EXPECT_EQ(summary.damaged_places, 1u);
  EXPECT_THAT(summary.text(), HasSubstr("damaged at 1 place"));
}

TEST(LogSummary, JsonHoldsTheSame) {
  const auto summary = summarise_log(testing_logs::swinging_log("json.lcmlog"));
  const auto json = nlohmann::json::parse(summary.json());
  EXPECT_EQ(json["messages"], 430);
  EXPECT_EQ(json["begin_utime"], kBegin + 500);
  EXPECT_EQ(json["pictures"][0]["stamps"]["gaps"], 1);
  EXPECT_EQ(json["joints"][0]["turns"], 7);
}

TEST(LogSummary, RefusesWhatIsNoLog) {
  EXPECT_THROW(summarise_log("/nonexistent.lcmlog"), FileError);
  EXPECT_THROW(summarise_log(BODYSCHEMA_SOURCE_DIR "/README.md"), FileError);
}

}  // namespace
}  // namespace bodyschema
