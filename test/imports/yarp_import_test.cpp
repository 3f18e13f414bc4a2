#include "bodyschema/imports/yarp_import.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
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
    std::filesystem::remove(directory_ / "out.log");  // of an import before
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
      EXPECT_NEAR(joints.position_rad[1], radians(90.0 + static_cast<double>(event.time_us % 100'000 - 1000) * 1e-4),
                  1e-5);
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
  EXPECT_THAT(with("arm/data.log", "-1 100.0 1 2\n"),
              AllOf(HasSubstr("arm/data.log:1"), HasSubstr("has 2 values, expected 3")));
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
  EXPECT_THAT(with("left/a.ppm", "P6\n4000 4000\n255\n"), HasSubstr("cut short"));
  EXPECT_THAT(with("left/a.ppm", "P6\n5000 2\n255\n"), AllOf(HasSubstr("5000x2"), HasSubstr("1 to 4096 px a side")));
  EXPECT_THAT(with("left/a.ppm", "P6\n99999999999999 2\n255\n"), HasSubstr("header says"));
  EXPECT_THAT(with("left/a.ppm", "P6\n4 2\n65535\n" + std::string(48, 'x')), HasSubstr("65535"));
  EXPECT_THAT(with("left/a.ppm", ""), HasSubstr("not a binary PPM"));
  write("left/c.ppm", ppm(2, 2, 'c'));
  EXPECT_THAT(with("left/data.log", "-1 100.0 a.ppm\n-1 100.1 c.ppm\n"),
              AllOf(HasSubstr("left/data.log:2"), HasSubstr("2x2"), HasSubstr("4x2")));
}

/// `rows` arm rows with a picture beside every tenth; `bad` replaces row 7.
std::string arm_rows(int rows, const std::string& bad) {
  std::string text;
  for (int i = 1; i <= rows; ++i) {
    text += i == 7 ? bad : "-1 " + std::to_string(100.0 + 0.01 * i) + " 90 7 6\n";
  }
  return text;
}

TEST_F(YarpImport, LeavesOutAFewBadLinesAndCountsThem) {
  for (const std::string bad : {"-1 100.07 90 7\n", "-1 100.07 90 7 nan\n", "-1 100.07 90 7 6x\n", "-1 10",
                                "-1 soon 90 7 6\n", "x 100.07 90 7 6\n", "-1 100.07 90 7 6 5\n", "-1 99999 90 7 6\n"}) {
    write_recording();
    // Cut: two rows run into one.
    write("arm/data.log", arm_rows(40, bad));
    const auto summary = import();
    EXPECT_EQ(summary.bad_lines, 1u) << bad;
    EXPECT_EQ(summary.encoder_rows, bad.back() == '\n' ? 41u : 40u) << bad;
    EXPECT_THAT(summary.first_bad, HasSubstr("arm/data.log:7: ")) << bad;
    write("arm/data.log", arm_rows(19, bad));
    EXPECT_THAT(error(), HasSubstr("arm/data.log:7: ")) << bad << ": 1 of 19 is more than 5 %";
  }
  write_recording();
  write("arm/data.log", arm_rows(40, std::string(100'000, '1') + "\n"));
  EXPECT_EQ(import().bad_lines, 1u);
}

TEST_F(YarpImport, RefusesMoreRowsThanMemoryIsMeantFor) {
  write_recording();
  std::string rows;
  for (int i = 0; i <= 7'200'000; ++i) rows += "1 1 a\n";
  write("left/data.log", rows);
  EXPECT_THAT(error(), AllOf(HasSubstr("left/data.log: more than 7200000 rows")));
}

TEST_F(YarpImport, LeavesOutAFewBadPicturesAndCountsThem) {
  write_recording();
  std::string lines;
  for (int i = 0; i < 40; ++i) {
    lines += "-1 " + std::to_string(100.0 + 0.01 * i) + (i == 5 ? " gone.ppm\n" : i == 6 ? " small.ppm\n" : " a.ppm\n");
  }
  write("left/small.ppm", ppm(2, 2, 's'));
  write("left/data.log", lines);
  const auto summary = import();
  EXPECT_EQ(summary.left_pictures, 38u);
  EXPECT_EQ(summary.bad_pictures, 2u);
  EXPECT_EQ(summary.bad_lines, 0u);
  EXPECT_THAT(summary.first_bad, AllOf(HasSubstr("left/data.log:6"), HasSubstr("gone.ppm is missing")));
  // A name that the file system does not take, and a picture that no log does.
  write("left/vast.ppm", "P5 16384 16384 255\n");  // sparse
  std::filesystem::resize_file(directory_ / "left/vast.ppm", 300'000'000);
  std::string tail;
  for (int i = 41; i < 61; ++i) tail += "-1 " + std::to_string(100.0 + 0.01 * i) + " a.ppm\n";
  write("left/data.log", lines + tail + "-1 101 " + std::string(300, 'x') + "\n");
  EXPECT_EQ(import().bad_pictures, 3u);
  write("left/data.log", "-1 99.9 vast.ppm\n" + lines + tail);
  EXPECT_EQ(import().bad_pictures, 3u);
  write("left/data.log", lines + "-1 100.5 gone.ppm\n");
  EXPECT_THAT(error(), AllOf(HasSubstr("left/data.log:6"), HasSubstr("the first of 3 bad pictures of 41")));
}

/// What yarpdatadumper writes with --txTime, --rxTime, both or neither, with and without stamps in the messages.
TEST_F(YarpImport, TakesOneStampOrTwoAsTheyAreWritten) {
  const auto first_stamp_of = [&](const std::string& info, const std::string& rows) {
    write_recording();
    std::filesystem::remove_all(directory_ / "left");
    write("left/data.log", "0 1600000000.500000 1600000000.600000 a.ppm [rgb]\n");
    write("left/info.log", info);
    write("left/a.ppm", ppm(4, 2, 'L'));
    write("right/data.log", "0 1600000000.500000 b.ppm [mono]\n");
    write("arm/info.log", info);
    write("arm/data.log", rows);
    write("head/data.log", "-1 1600000000.000000 10.0 4.0\n-1 1600000002.000000 10.0 4.0\n");
    import();
    LogReader reader(directory_ / "out.log");
    LogEvent event;
    while (reader.next(event)) {
      JointStateMessage joints;
      if (event.channel == "ICUB_JOINT_STATE" && decode(event.data, joints).ok() && joints.names[0] == "tip") {
        EXPECT_NEAR(joints.position_rad[1], radians(90.0), 1e-5);
        return event.time_us - 1'600'000'000'000'000;
      }
    }
    return std::int64_t{-1};
  };
  const std::string tx = "7 1600000000.100000 ", rx = "7 1600000000.300000 ";
  const std::string values = "90 7 6\n";
  EXPECT_EQ(first_stamp_of("Type: Bottle;\nStamp: tx;\n", tx + values), 100'000);
  EXPECT_EQ(first_stamp_of("Type: Bottle;\nStamp: rx;\n", rx + values), 300'000);
  EXPECT_EQ(first_stamp_of("Type: Bottle;\nStamp: tx+rx;\n", tx + "1600000000.300000 " + values), 100'000);
  // --txTime where messages carry no stamp: the sender's is 0, and info.log speaks of one.
  EXPECT_EQ(first_stamp_of("Type: Bottle;\nStamp: tx;\n", "-1 0.000000 1600000000.300000 " + values), 300'000);
  EXPECT_EQ(first_stamp_of("Type: Bottle;\nStamp: tx+rx;\n", "-1 0.000000 1600000000.300000 " + values), 300'000);
  EXPECT_EQ(first_stamp_of("", tx + "1600000000.300000 " + values), 100'000) << "no info.log";
}

TEST_F(YarpImport, ReadsPngAndJpegPictures) {
  // What `--type image_png` and `--type image_jpg` write; 4x2 px, every pixel (200, 100, 50).
  Image picture(4, 2, 3);
  for (std::size_t i = 0; i < 8; ++i) {
    picture.data[3 * i] = 200;
    picture.data[3 * i + 1] = 100;
    picture.data[3 * i + 2] = 50;
  }
  cv::Mat bgr(2, 4, CV_8UC3, cv::Scalar(50, 100, 200));
  const auto file = [&](const std::string& name) { return (directory_ / name).string(); };
  const auto first_pixel = [&] {
    LogReader reader(directory_ / "out.log");
    LogEvent event;
    while (reader.next(event)) {
      ImagesView view;
      Image image;
      if (event.channel != "ICUB_CAMERAS" || !decode(event.data, view).ok() ||
          view.images[0].type != bot_core::images_t::LEFT || !unpack(view.images[0], image).ok()) {
        continue;
      }
      EXPECT_EQ(image.width, 4);
      EXPECT_EQ(image.height, 2);
      return std::vector<int>(image.data.begin(), image.data.begin() + image.channels);
    }
    return std::vector<int>();
  };
  for (const std::string name : {"00000000.png", "00000000.jpg"}) {
    write_recording();
    write("left/data.log", "0 100.0 " + name + " [rgb]\n");
    ASSERT_TRUE(cv::imwrite(file("left/" + name), bgr));
    import();
    const auto pixel = first_pixel();
    ASSERT_EQ(pixel.size(), 3u) << name;
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(pixel[c], picture.data[c], 3) << name;
    std::filesystem::resize_file(directory_ / "left" / name, std::filesystem::file_size(file("left/" + name)) - 14);
    EXPECT_THAT(error(), HasSubstr(name)) << "cut short";
    std::filesystem::resize_file(directory_ / "left" / name, 10);
    EXPECT_THAT(error(), HasSubstr(name)) << "cut in its header";
  }
  write_recording();
  write("left/data.log", "0 100.0 frame_00000000\n");
  EXPECT_THAT(error(), HasSubstr("is a frame of a video"));
}

TEST_F(YarpImport, WarnsOfReadingsThatLookLikeTheOtherUnit) {
  write_recording();
  EXPECT_TRUE(import().warnings.empty());
  auto in_radians = options();
  in_radians.encoders_in_degrees = false;
  const auto import_with = [&](const YarpImportOptions& o) {
    return import_yarp(directory_, o, Channels::with_prefix("ICUB"), directory_ / "out.log");
  };
  EXPECT_THAT(import_with(in_radians).warnings, ElementsAre(HasSubstr("yarp_import.encoder_unit: deg")));
  write("head/data.log", "-1 100.0 0.17 0.07\n-1 100.02 0.17 0.07\n");
  write("arm/data.log", "-1 100.0 1.57 120 -2.5\n-1 100.01 1.58 120 -2.5\n");  // the second column is not used
  EXPECT_THAT(import().warnings,
              ElementsAre(AllOf(HasSubstr("beyond 2.50"), HasSubstr("yarp_import.encoder_unit: rad"))));
  EXPECT_TRUE(import_with(in_radians).warnings.empty());
}

TEST_F(YarpImport, AnArmWithoutFingersMayHaveFewerColumns) {
  write_recording();
  write("arm/data.log", "-1 100.001 90.0\n-1 100.011 91.0\n-1 100.021 92.0\n");
  EXPECT_THAT(error(), HasSubstr("has 1 values, expected 3"));
  const auto configuration = Configuration::parse(R"(
yarp_import:
  encoders: {head: [version, vergence], arm: [elbow, "-", distal]}
  optional_from: {arm: "-"}
  combined_joints: {l_pan: {version: 1, vergence: 0.5}, tip: {distal: 0.5}}
  images: {left: left}
)");
  const auto with_hand = YarpImportOptions::from(configuration.section("yarp_import"));
  configuration.reject_unknown_keys();
  const auto summary = import_yarp(directory_, with_hand, Channels::with_prefix("ICUB"), directory_ / "out.log");
  EXPECT_EQ(summary.encoder_rows, 5u);
  EXPECT_THAT(summary.warnings, ElementsAre(AllOf(HasSubstr("arm: rows end before '-' (1 of 3 columns)"),
                                                  HasSubstr("robot: {fixed_joints_deg: {tip: 0}}"))));
  write("arm/data.log", "-1 100.001 90.0 1\n");
  EXPECT_THROW(import_yarp(directory_, with_hand, Channels::with_prefix("ICUB"), directory_ / "out.log"), FileError);
  write_recording();
  EXPECT_TRUE(
      import_yarp(directory_, with_hand, Channels::with_prefix("ICUB"), directory_ / "out.log").warnings.empty());
}

TEST_F(YarpImport, FoldersOfAnIncludedFileCanBeTakenOut) {
  write_recording();
  write("base.yaml",
        "yarp_import:\n  encoders: {head: [version, vergence], rightArm: [elbow, '-', distal], leftArm: [x]}\n"
        "  optional_from: {rightArm: '-'}\n"
        "  combined_joints: {l_pan: {version: 1}, r_pan: {x: 1}}\n"
        "  images: {left: images/left, right: images/right}\n");
  write("mine.yaml",
        "include: base.yaml\nyarp_import:\n  encoders: {rightArm: [], leftArm: null, arm: [elbow, '-', distal]}\n"
        "  combined_joints: {r_pan: null}\n  images: {left: left, right: ''}\n");
  const auto configuration = Configuration::load(directory_ / "mine.yaml");
  const auto options = YarpImportOptions::from(configuration.section("yarp_import"));
  configuration.reject_unknown_keys();
  const auto summary = import_yarp(directory_, options, Channels::with_prefix("ICUB"), directory_ / "out.log");
  EXPECT_EQ(summary.encoder_rows, 5u);
  EXPECT_EQ(summary.left_pictures, 1u);
  EXPECT_EQ(summary.right_pictures, 0u);
}

TEST_F(YarpImport, NamesWhatIsMissing) {
  write_recording();
  std::filesystem::remove_all(directory_ / "arm");
  EXPECT_THAT(error(), AllOf(HasSubstr("no such folder"), HasSubstr("yarp_import.encoders.arm"),
                             HasSubstr("it holds head, left, right")));
  EXPECT_THROW(import_yarp(directory_ / "nowhere", options(), Channels::with_prefix("A"), directory_ / "out.log"),
               FileError);
  write_recording();
  EXPECT_THROW(import_yarp(directory_, options(), Channels::with_prefix("A"), directory_ / "no/folder/out.log"),
               FileError);
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
  EXPECT_THAT(
      error_in("yarp_import: {encoders: {a: [version]}, images: {left: l}, combined_joints: {pan: {verson: 1}}}"),
      HasSubstr("did you mean 'version'"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: [x, y]}, optional_from: {a: x}, images: {left: l}}"),
              HasSubstr("a column of this folder, not its first"));
  EXPECT_THAT(error_in("yarp_import: {encoders: {a: []}, images: {left: l}}"), HasSubstr("encoders"));
  EXPECT_THAT(
      error_in("yarp_import: {encoders: {a: [x], b: [y]}, images: {left: l}, combined_joints: {s: {x: 1, y: 1}}}"),
      HasSubstr("columns of one folder"));
}

/// The recording imported and synchronised as replay does it: at every kept picture the encoders must
/// be those of the pose that is held, although poses jump and pictures follow encoders late.
TEST_F(YarpImport, RecordingGivesTheHeldEncodersAtEveryPicture) {
  SKIP_WITHOUT("eyehand-sim");
  const auto recording = data_folder() / "eyehand-sim";
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
        const auto hold = std::find_if(holds.begin(), holds.end(),
                                       [&](const Hold& h) { return camera->utime >= h.from && camera->utime <= h.to; });
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
