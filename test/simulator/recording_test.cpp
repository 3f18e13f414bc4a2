#include "bodyschema/simulator/recording.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "simulator/icub_right.hpp"

namespace bodyschema::simulator {
namespace {

std::string file_name(const std::string& name) {
  static int count = 0;
  return ::testing::TempDir() + "bodyschema_" + std::to_string(::getpid()) + "_" + std::to_string(count++) + "_" + name;
}

std::string read(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

struct Recorded {
  std::string log = file_name("run.log");
  std::string truth = file_name("run.json");
  std::vector<SimulatedFrame> frames;
  explicit Recorded(const SimulationPlan& plan) {
    const auto& stage = icub_right();
    Simulator simulator = stage.simulator(plan);
    LogWriter sink(log);
    TruthWriter writer(truth, simulator, stage.setup);
    FramePublisher publisher(simulator.joint_names(), {});
    while (auto frame = simulator.next()) {
      publisher.publish(*frame, sink);
      writer.add(*frame);
      frames.push_back(std::move(*frame));
    }
    writer.close();
  }
  ~Recorded() {
    std::remove(log.c_str());
    std::remove(truth.c_str());
  }
};

SimulationPlan secret_plan() {
  SimulationPlan plan;
  plan.frames = 6;
  plan.seed = 21;
  plan.offsets_deg = {{"r_elbow", 4.123456789}, {"r_wrist_yaw", -3.987654321}};
  plan.faults = {FaultSpec::parse("backlash:joint=r_elbow,value=0.765432198")};
  return plan;
}

TEST(Recording, TheLogHoldsEncodersAndPicturesInOrderOfTime) {
  const Recorded recorded(secret_plan());
  LogReader reader(recorded.log);
  LogEvent event;
  Microseconds last = 0;
  std::size_t encoders = 0, pictures = 0;
  while (reader.next(event)) {
    EXPECT_GE(event.time_us, last);
    last = event.time_us;
    if (event.channel == "ICUB_JOINT_STATE") {
      JointStateMessage message;
      ASSERT_TRUE(decode(event.data, message).ok());
      EXPECT_EQ(message.names.size(), static_cast<std::size_t>(icub_right().model->joint_count()));
      ++encoders;
    } else {
      ASSERT_EQ(event.channel, "ICUB_CAMERAS");
      ImagesView message;
      ASSERT_TRUE(decode(event.data, message).ok());
      ASSERT_EQ(message.images.size(), 2u);
      for (std::size_t c = 0; c < 2; ++c) {
        const auto& frame = recorded.frames[pictures];
        EXPECT_EQ(message.images[c].utime, frame.cameras[c]->utime);
        EXPECT_EQ(message.images[c].type, static_cast<int>(c));
        Image image;
        ASSERT_TRUE(unpack(message.images[c], image).ok());
        EXPECT_TRUE(image.data == frame.cameras[c]->image.data);
      }
      ++pictures;
    }
  }
  EXPECT_EQ(pictures, recorded.frames.size());
  std::size_t sent = 0;
  for (const auto& frame : recorded.frames) sent += frame.encoders.size();
  EXPECT_EQ(encoders, sent);
}

TEST(Recording, NothingOfTheTruthIsInTheLog) {
  const Recorded recorded(secret_plan());
  const std::string log = read(recorded.log);
  ASSERT_GT(log.size(), 1'000'000u);
  for (const char* word : {"backlash", "offset", "fault", "truth", "background", "phase"}) {
    EXPECT_EQ(log.find(word), std::string::npos) << word;
  }
  // Nor as numbers: the offsets and the fault's size in either unit, the true poses.
  std::vector<double> secrets;
  for (const double value : {4.123456789, -3.987654321, 0.765432198}) {
    secrets.push_back(value);
    secrets.push_back(radians(value));
  }
  for (const auto& frame : recorded.frames) {
    for (const auto& truth : frame.truth) {
      for (int k = 0; k < 3; ++k) secrets.push_back(truth.X_CP.translation()[k]);
    }
  }
  for (const double secret : secrets) {
    std::string bytes(reinterpret_cast<const char*>(&secret), sizeof secret);
    EXPECT_EQ(log.find(bytes), std::string::npos) << secret;
    bytes.assign(bytes.rbegin(), bytes.rend());
    EXPECT_EQ(log.find(bytes), std::string::npos) << secret;
  }
  // Joint messages are in single precision; all they may hold is counts of an encoder.
  LogReader reader(recorded.log);
  LogEvent event;
  double off_grid = 0.0;
  while (reader.next(event)) {
    JointStateMessage message;
    if (event.channel != "ICUB_JOINT_STATE") continue;
    ASSERT_TRUE(decode(event.data, message).ok());
    for (const float position : message.position_rad) {
      const double steps = degrees(position) / (360.0 / 4096.0);
      off_grid = std::max(off_grid, std::abs(steps - std::round(steps)));
    }
  }
  EXPECT_LT(off_grid, 2e-3);
}

TEST(Recording, RunsThatDifferInTruthAloneLogTheSameStampsAndSizes) {
  const auto outline = [](const std::string& log) {
    std::vector<std::pair<Microseconds, std::string>> events;
    LogReader reader(log);
    LogEvent event;
    while (reader.next(event)) events.emplace_back(event.time_us, event.channel + std::to_string(event.data.size()));
    return events;
  };
  auto other = secret_plan();
  other.offsets_deg = {{"r_shoulder_roll", 9.0}};
  other.faults = {FaultSpec::parse("focal_length:value=2")};
  const Recorded a(secret_plan());
  const Recorded b(other);
  EXPECT_EQ(outline(a.log), outline(b.log));
}

TEST(Recording, TheTruthFileSaysWhatWasTrue) {
  const Recorded recorded(secret_plan());
  const auto json = nlohmann::json::parse(read(recorded.truth));
  EXPECT_NEAR(json["offsets_deg"]["r_elbow"], 4.123456789, 1e-8);
  EXPECT_EQ(json["offsets_deg"]["r_shoulder_roll"], 0.0);
  ASSERT_EQ(json["faults"].size(), 1u);
  EXPECT_EQ(json["faults"][0]["name"], "backlash");
  EXPECT_EQ(json["faults"][0]["joint"], "r_elbow");
  EXPECT_EQ(json["faults"][0]["unit"], "deg");
  EXPECT_DOUBLE_EQ(json["faults"][0]["value"], 0.765432198);
  ASSERT_EQ(json["frames"].size(), recorded.frames.size());
  for (std::size_t i = 0; i < recorded.frames.size(); ++i) {
    const auto& frame = recorded.frames[i];
    const auto& line = json["frames"][i];
    EXPECT_EQ(line["utime"], frame.utime);
    EXPECT_NEAR(line["true_joints_deg"]["r_elbow"], degrees(frame.truth[0].q[icub_right().joint("r_elbow")]), 1e-6);
    EXPECT_NEAR(line["hand_in_right_camera"][2][3], frame.truth[1].X_CP.translation().z(), 1e-12);
    EXPECT_EQ(line["fingertips_px_left"].size(), 5u);
    const Eigen::Vector3d tip_P = frame.truth[0].X_CP.inverse() * frame.truth[0].fingertips_C[2];
    EXPECT_NEAR(line["fingertips_in_hand_m"][2][1], tip_P.y(), 1e-6);
  }
}

TEST(Recording, AnUnwritableTruthFileIsAnError) {
  const auto& stage = icub_right();
  Simulator simulator = stage.simulator(joints_only());
  EXPECT_THROW(TruthWriter("/nonexistent/truth.json", simulator, stage.setup), FileError);
}

TEST(Recording, APacerMayStopAFrame) {
  struct Counter : MessageSink {
    int messages = 0;
    void publish(const std::string&, Microseconds, Bytes) override { ++messages; }
  } sink;
  Simulator simulator = icub_right().simulator(secret_plan());
  FramePublisher publisher(simulator.joint_names(), {});
  EXPECT_FALSE(publisher.publish(*simulator.next(), sink, [](Microseconds) { return false; }));
  EXPECT_EQ(sink.messages, 0);
}

}  // namespace
}  // namespace bodyschema::simulator
