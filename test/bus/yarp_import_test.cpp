#include "bodyschema/bus/yarp_import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class YarpImport : public ::testing::Test {
 protected:
  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() / ("bodyschema_yarp_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory_);
  }
  void TearDown() override { std::filesystem::remove_all(directory_); }

  void write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((directory_ / name).parent_path());
    std::ofstream(directory_ / name, std::ios::binary) << text;
  }
  static std::string ppm(int width, int height, char value) {
    return "P6\n# a comment\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" +
           std::string(static_cast<std::size_t>(3 * width * height), value);
  }
  /// A small sound recording: two head rows, three arm rows, one picture a camera.
  void write_recording() {
    write("head/info.log", "Type: Bottle;\n[1.0] /icub/head [connected]\n");
    write("head/data.log", "-1 100.000000 10.0 4.0\n-1 100.020000 10.0 4.0\n");
    write("arm/info.log", "Type: Bottle;\n");
    write("arm/data.log", "-1 100.001000 90.0 7 (6.0)\n-1 100.011000 91.0 7 (6.0)\n-1 100.021000 92.0 7 (6.0)\n");
    write("left/data.log", "-1 100.010000 a.ppm\n");
    write("left/a.ppm", ppm(4, 2, 'L'));
    write("right/data.log", "-1 100.012000 b.ppm [rgb]\n");
    write("right/b.ppm", ppm(4, 2, 'R'));
  }
  static YarpImportOptions options() {
    const auto configuration = Configuration::parse(R"(
yarp_import:
  encoders: {head: [version, vergence], arm: [elbow, "-", distal]}
  combined_joints:
    l_pan: {version: 1, vergence: 0.5}
    r_pan: {version: 1, vergence: -0.5}
    tip: {distal: 0.5}
  images: {left: left, right: right}
)");
    auto options = YarpImportOptions::from(configuration.section("yarp_import"));
    configuration.reject_unknown_keys();
    return options;
  }
  YarpImportSummary import() {
    return import_yarp(directory_, options(), Channels::with_prefix("ICUB"), directory_ / "out.log");
  }
  std::string error() {
    try {
      import();
    } catch (const FileError& e) {
      EXPECT_FALSE(std::filesystem::exists(directory_ / "out.log"));
      EXPECT_FALSE(std::filesystem::exists(directory_ / "out.log.part"));
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      return e.what();
    }
    return "";
  }
  std::filesystem::path directory_;
};

TEST_F(YarpImport, TurnsRowsAndPicturesIntoMessagesInOrderOfTime) {
  write_recording();
  const auto summary = import();
  EXPECT_EQ(summary.encoder_rows, 5u);
  EXPECT_EQ(summary.left_pictures, 1u);
  EXPECT_EQ(summary.right_pictures, 1u);
  EXPECT_NEAR(summary.duration_s, 0.021, 1e-6);
  LogReader reader(directory_ / "out.log");
  LogEvent event;
  std::vector<std::string> order;
  while (reader.next(event)) {
    if (event.channel == "ICUB_CAMERAS") {
      ImagesView view;
      ASSERT_TRUE(decode(event.data, view).ok());
      ASSERT_EQ(view.images.size(), 1u);
      Image image;
      ASSERT_TRUE(unpack(view.images[0], image).ok());
      EXPECT_EQ(view.images[0].utime, event.time_us);
      order.push_back(std::string(1, static_cast<char>(image.data[0])) + std::to_string(event.time_us % 100'000));
      continue;
    }
    JointStateMessage joints;
    ASSERT_TRUE(decode(event.data, joints).ok());
    EXPECT_EQ(joints.utime, event.time_us);
    order.push_back(joints.names[0] + std::to_string(event.time_us % 100'000));
    if (joints.names[0] == "l_pan") {
      EXPECT_THAT(joints.names, ElementsAre("l_pan", "r_pan"));
      EXPECT_NEAR(joints.position_rad[0], radians(12.0), 1e-6);
      EXPECT_NEAR(joints.position_rad[1], radians(8.0), 1e-6);
      EXPECT_EQ(joints.velocity_rad_s[0], 0.0F);
    } else {
      EXPECT_THAT(joints.names, ElementsAre("tip", "elbow"));
      EXPECT_NEAR(joints.position_rad[0], radians(3.0), 1e-6);
      EXPECT_NEAR(joints.position_rad[1], radians(90.0 + static_cast<double>(event.time_us % 100'000 - 1000) * 1e-4), 1e-5);
      const bool inner = event.time_us % 100'000 == 11'000;  // the ends know one neighbour only
      EXPECT_NEAR(joints.velocity_rad_s[1], inner ? radians(100.0) : 0.0, 1e-4);
    }
  }
  EXPECT_THAT(order, ElementsAre("l_pan0", "tip1000", "L10000", "tip11000", "R12000", "l_pan20000", "tip21000"));
}

TEST_F(YarpImport, TakesTheSendersOfTwoStamps) {
  write_recording();
  write("head/info.log", "Type: Bottle;\nStamp: tx; rx;\n");
  write("head/data.log", "0 100.000000 170.0 10.0 4.0\n");
  EXPECT_NEAR(import().duration_s, 0.021, 1e-6);
}

TEST_F(YarpImport, LeavesOutRowsThatGoBackInTime) {
  write_recording();
  write("head/data.log", "-1 100.0 1 2\n-1 100.1 1 2\n-1 100.05 1 2\n-1 100.1 1 2\n-1 100.2 1 2\n");
  const auto summary = import();
  EXPECT_EQ(summary.rows_out_of_order, 2u);
  EXPECT_EQ(summary.encoder_rows, 6u);
}

TEST_F(YarpImport, NamesFileAndLineOfWhatIsWrong) {
  const auto with = [&](const std::string& name, const std::string& text) {
    write_recording();
    write(name, text);
    return error();
  };
  EXPECT_THAT(with("arm/data.log", "-1 100.0 1 2 3\n-1 100.1 1 x2 3\n"),
              AllOf(HasSubstr("arm/data.log:2"), HasSubstr("'x2' is not a number")));
  EXPECT_THAT(with("arm/data.log", "-1 100.0 1 2 nan\n"), HasSubstr("'nan' is not a finite number"));
  EXPECT_THAT(with("arm/data.log", "-1 100.0 1 2\n"), AllOf(HasSubstr("arm/data.log:1"), HasSubstr("has 2 values, expected 3")));
  EXPECT_THAT(with("arm/data.log", "-1 soon 1 2 3\n"), HasSubstr("'soon' is not a time stamp"));
  EXPECT_THAT(with("arm/data.log", "-1 -5.0 1 2 3\n"), HasSubstr("not a time stamp"));
  EXPECT_THAT(with("arm/data.log", "-1\n"), HasSubstr("expected a counter, a time stamp and values"));
  EXPECT_THAT(with("arm/data.log", ""), HasSubstr("holds no data"));
  EXPECT_THAT(with("arm/data.log", std::string(100'000, '1')), HasSubstr("line of more than 65536 bytes"));
  write_recording();
  std::filesystem::resize_file(directory_ / "arm/data.log", std::uintmax_t{4} << 30);  // takes no room on the disk
  EXPECT_THAT(error(), AllOf(HasSubstr("arm/data.log"), HasSubstr("4294967296 bytes, at most 268435456")));
  EXPECT_THAT(with("left/data.log", "-1 100.0 a.ppm\n-1 100.1 gone.ppm\n"),
              AllOf(HasSubstr("left/data.log:2"), HasSubstr("gone.ppm is missing")));
  EXPECT_THAT(with("left/data.log", "-1 100.0 ../right/b.ppm\n"), HasSubstr("not the name of a picture"));
  EXPECT_THAT(with("left/a.ppm", "P3\n1 1\n255\n0 0 0\n"), HasSubstr("not a binary PPM"));
  EXPECT_THAT(with("left/a.ppm", ppm(4, 2, 'L').substr(0, 30)), AllOf(HasSubstr("a.ppm"), HasSubstr("cut short")));
  EXPECT_THAT(with("left/a.ppm", "P6\n16000 16000\n255\n"), HasSubstr("cut short"));
  EXPECT_THAT(with("left/a.ppm", "P6\n99999999999999 2\n255\n"), HasSubstr("header says"));
  EXPECT_THAT(with("left/a.ppm", "P6\n4 2\n65535\n" + std::string(48, 'x')), HasSubstr("65535"));
  EXPECT_THAT(with("left/a.ppm", ""), HasSubstr("not a binary PPM"));
  write("left/c.ppm", ppm(2, 2, 'c'));
  EXPECT_THAT(with("left/data.log", "-1 100.0 a.ppm\n-1 100.1 c.ppm\n"),
              AllOf(HasSubstr("left/data.log:2"), HasSubstr("2x2"), HasSubstr("4x2")));
}

TEST_F(YarpImport, NamesWhatIsMissing) {
  write_recording();
  std::filesystem::remove_all(directory_ / "arm");
  EXPECT_THAT(error(), AllOf(HasSubstr("no such folder"), HasSubstr("yarp_import.encoders.arm")));
  EXPECT_THROW(import_yarp(directory_ / "nowhere", options(), Channels::with_prefix("A"), directory_ / "out.log"), FileError);
  write_recording();
  EXPECT_THROW(import_yarp(directory_, options(), Channels::with_prefix("A"), directory_ / "no/folder/out.log"), FileError);
}

TEST_F(YarpImport, ConfigurationErrorsNameTheKey) {
  const auto error_in = [](const std::string& text) -> std::string {
    try {
      YarpImportOptions::from(Configuration::parse(text).section("yarp_import"));
    } catch (const ConfigurationError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(error_in("yarp_import: {images: {left: l}}"), HasSubstr("encoders"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: [x]}}"), HasSubstr("images"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: [x, x]}, images: {left: l}}"), HasSubstr("'x' only once"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: [version]}, images: {left: l}, combined_joints: {pan: {verson: 1}}}"),
              HasSubstr("did you mean 'version'"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: [x], b: [y]}, images: {left: l}, combined_joints: {s: {x: 1, y: 1}}}"),
              HasSubstr("columns of one folder"));
}

/// The recording imported and synchronised as replay does it: at every kept picture the encoders must
/// be those of the pose that is held, although poses jump and pictures follow encoders late.
TEST_F(YarpImport, RecordingGivesTheHeldEncodersAtEveryPicture) {
  SKIP_WITHOUT("eyehand-sim");
  const auto recording = data_folder() / "eyehand-sim";
  setenv("BODYSCHEMA_DATA", data_folder().c_str(), 0);
  const auto folder = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_unity";
  const auto import_configuration = Configuration::load(folder / "import.yaml");
  const auto bus = BusOptions::from(import_configuration.section("bus"));
  const auto log = directory_ / "recording.log";
  const auto import_options = YarpImportOptions::from(import_configuration.section("yarp_import"));
  import_configuration.reject_unknown_keys();
  const auto summary = import_yarp(recording / "yarp", import_options, bus.channels(), log);
  EXPECT_EQ(summary.left_pictures, 219u);
  EXPECT_EQ(summary.right_pictures, 219u);
  EXPECT_EQ(summary.rows_out_of_order, 0u);

  const auto robot_configuration = Configuration::load(folder / "robot.yaml");
  const auto setup = RobotSetup::from(robot_configuration.section("robot"));
  const auto robot = setup.load();
  ObservationStream stream(robot, setup, StereoRig::from(robot_configuration.section("cameras")), bus);

  const auto truth = nlohmann::json::parse(std::ifstream(recording / "truth.json"));
  const std::vector<std::string> columns = truth["encoder_joints"];
  struct Hold {
    Microseconds from, to;
    std::vector<double> encoders_deg;
    int pictures = 0;
  };
  std::vector<Hold> holds;
  for (const auto& pose : truth["poses"]) {
    holds.push_back({microseconds(pose["time_s"][0]), microseconds(pose["time_s"][1]), pose["encoders_deg"]});
  }

  LogReader reader(log);
  LogEvent event;
  std::size_t observations = 0;
  const auto check = [&] {
    while (auto arrived = stream.next()) {
      ++observations;
      for (const auto& camera : arrived->observation.cameras) {
        ASSERT_TRUE(camera);
        const auto hold = std::find_if(holds.begin(), holds.end(), [&](const Hold& h) {
          return camera->utime >= h.from && camera->utime <= h.to;
        });
        ASSERT_NE(hold, holds.end()) << camera->utime;
        ++hold->pictures;
        for (std::size_t j = 0; j < columns.size(); ++j) {
          const auto index = robot->find_joint(columns[j]);
          if (!index) continue;  // r_hand_finger moves nothing and is no joint
          EXPECT_NEAR(degrees(camera->joints.q[*index]), hold->encoders_deg[j], 2e-5) << columns[j];
          EXPECT_EQ(camera->joints.qdot[*index], 0.0) << columns[j];
        }
        EXPECT_NEAR(degrees(camera->joints.q[robot->joint_index("r_pinky")]), 117.0, 2e-5);
        EXPECT_NEAR(degrees(camera->joints.q[robot->joint_index("eyes_tilt")]), -10.0, 2e-5);
        EXPECT_EQ(camera->joints.q[robot->joint_index("torso_yaw")], 0.0);
        EXPECT_EQ(camera->image.width, 320);
      }
    }
  };
  while (reader.next(event)) {
    EXPECT_TRUE(stream.receive(event.channel, event.data));
    check();
  }
  stream.finish();
  check();
  for (const Hold& hold : holds) EXPECT_GE(hold.pictures, 4);
  // The head's last row is older than the last pair of pictures.
  EXPECT_EQ(observations, 218u);
  for (const auto& [name, count] : stream.statistics().counters()) {
    EXPECT_EQ(count, name == "dropped.no_encoders" ? 2u : 0u) << name;
  }
}

TEST(YarpImportConfiguration, OfTheOfficialRobotNamesItsJoints) {
  SKIP_WITHOUT("icub-models");
  setenv("BODYSCHEMA_DATA", data_folder().c_str(), 0);
  const auto folder = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_v2_5";
  const auto import_configuration = Configuration::load(folder / "import.yaml");
  const auto options = YarpImportOptions::from(import_configuration.section("yarp_import"));
  const auto robot = RobotSetup::from(Configuration::load(folder / "robot.yaml").section("robot")).load();
  std::set<std::string> columns_combined;
  for (const auto& joint : options.combined_joints) {
    EXPECT_TRUE(robot->find_joint(joint.joint)) << joint.joint;
    for (const auto& [column, factor] : joint.factor_of_column) columns_combined.insert(column);
  }
  for (const auto& port : options.encoders) {
    for (const auto& column : port.columns) {
      EXPECT_TRUE(columns_combined.count(column) == 1 || robot->find_joint(column)) << column;
    }
  }
}

}  // namespace
}  // namespace bodyschema
