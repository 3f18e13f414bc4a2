#include "bodyschema/imports/stills.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "stills_folder.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Key;
using ::testing::ThrowsMessage;

const std::string kLens = "width: 8, height: 6, fx: 8, fy: 8, cx: 3.5, cy: 2.5";

class Stills : public ::testing::Test {
 protected:
  static std::string robot() {
    return "robot:\n  urdf: " + std::string(BODYSCHEMA_SOURCE_DIR) +
           "/meshes/arm7/arm7.urdf\n"
           "  rendered_links: [link2, hand]\n  hand_link: hand\n  estimated_joints: [joint1, joint2]\n";
  }
  static std::string cameras() {
    return "cameras:\n  left: {link: base, pose: unknown, " + kLens + "}\n  right: {link: base, pose: unknown, " +
           kLens + "}\n";
  }
  ImportTarget target(const std::string& more = "", const std::string& other_cameras = "") const {
    return ImportTarget::from(
        Configuration::parse(robot() + (other_cameras.empty() ? cameras() : other_cameras) + more));
  }
  ImportSummary import(const ImportTarget& to, StillsImportOptions options = {}) const {
    return import_stills(stills_.path(), to, options, log());
  }
  std::string error_of(const ImportTarget& to) const {
    try {
      (void)import(to);
    } catch (const FileError& e) {
      EXPECT_FALSE(fs::exists(log())) << "a log that is not whole has no name";
      return e.what();
    }
    return "nothing was wrong";
  }
  fs::path log() const { return stills_.path() / "out.lcmlog"; }

  /// What replay would see.
  std::vector<Observation> observations(const ImportTarget& to, bool masks = false) const {
    BusOptions bus = to.bus;
    bus.synchroniser.masks = masks;
    ObservationStream stream(to.robot, to.setup, to.rig, bus);
    std::vector<Observation> all;
    LogReader reader(log());
    LogEvent event;
    const auto drain = [&] {
      while (auto arrived = stream.next()) all.push_back(std::move(arrived->observation));
    };
    while (reader.next(event)) {
      stream.receive(event.channel, event.data, event.time_us);
      drain();
    }
    stream.finish();
    drain();
    for (const auto& [name, count] : stream.statistics().counters()) EXPECT_EQ(count, 0u) << name;
    return all;
  }
  SmallStills stills_;
};

TEST_F(Stills, EachIsAPostureSecondsFromTheNext) {
  const auto to = target();
  const auto summary = import(to);
  EXPECT_EQ(summary.cameras[0].pictures, 2u);
  EXPECT_EQ(summary.cameras[1].pictures, 2u);
  EXPECT_EQ(summary.joints.size(), 7u);
  EXPECT_THAT(summary.left_out, IsEmpty());
  EXPECT_THAT(summary.notes, IsEmpty());
  const auto seen = observations(to);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[1].utime - seen[0].utime, kStillPeriod);
  for (std::size_t i = 0; i < 2; ++i) {
    for (const auto& camera : seen[i].cameras) {
      ASSERT_TRUE(camera);
      EXPECT_NEAR(camera->joints.q[to.robot->joint_index("joint3")], i == 0 ? 0.3 : -0.3, 1e-7);
      EXPECT_TRUE(camera->joints.qdot.isZero());
      EXPECT_EQ(camera->image.data[0], 3) << "RGB";
    }
  }
}

TEST_F(Stills, TheSameFolderGivesTheSameLog) {
  const auto to = target();
  (void)import(to);
  const auto bytes = [&] {
    std::ifstream in(log(), std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(in)), {});
  };
  const std::string first = bytes();
  (void)import(to);
  EXPECT_EQ(first, bytes());
  StillsImportOptions later;
  later.recorded_at = 1'700'000'000'000'000;
  (void)import(to, later);
  EXPECT_EQ(observations(to).front().utime, later.recorded_at + kStillPeriod);
}

TEST_F(Stills, MasksGoWithTheirPicturesUnlessTheyAreLeftOut) {
  for (const std::string camera : {"left", "right"}) {
    stills_.mask(camera + "/00.png", 255);
    stills_.mask(camera + "/01.png", 128);
  }
  const auto to = target();
  const auto summary = import(to);
  EXPECT_EQ(summary.cameras[0].masks, 2u);
  const auto seen = observations(to, true);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].cameras[1]->given_mask.data[5], kMaskRobot);
  EXPECT_EQ(seen[1].cameras[0]->given_mask.data[5], kMaskUnknown);

  StillsImportOptions without;
  without.masks = false;
  const auto bare = import(to, without);
  EXPECT_EQ(bare.cameras[0].masks, 0u);
  EXPECT_THAT(bare.notes, Contains(HasSubstr("--no-masks")));
}

TEST_F(Stills, BadMasksAreLeftOutAndSaid) {
  stills_.mask("left/00.png", 1);
  stills_.mask("left/01.png", 255, 9, 6);
  stills_.mask("right/00.png", 255);
  const auto summary = import(target());
  EXPECT_EQ(summary.cameras[0].masks, 0u);
  EXPECT_EQ(summary.cameras[1].masks, 1u);
  const auto& left = summary.left_out.at("masks of camera left");
  EXPECT_EQ(left.count, 2u);
  EXPECT_THAT(left.first, HasSubstr("masks/left/00.png: mask whose largest value is 1; expected 0 background, 128"));
  EXPECT_THAT(summary.text("x"), HasSubstr("left out, masks of camera left: 2; the first: "));
}

/// As where a network was given pictures of another size: a log without any would look as if none had been asked for.
TEST_F(Stills, MasksOfWhichNoneFitsAreOneError) {
  for (const std::string camera : {"left", "right"}) {
    for (const std::string posture : {"00", "01"}) stills_.mask(camera + "/" + posture + ".png", 255, 16, 12);
  }
  EXPECT_THAT(error_of(target()), AllOf(HasSubstr("no mask can be used; "),
                                        HasSubstr("masks/left/00.png is 16x12 px, its picture 8x6 px")));
  StillsImportOptions without;
  without.masks = false;
  EXPECT_EQ(import(target(), without).cameras[0].pictures, 2u);
  stills_.mask("right/01.png", 255);
  const auto summary = import(target());
  EXPECT_EQ(summary.left_out.at("masks of camera left").count, 2u);
  EXPECT_EQ(summary.left_out.at("masks of camera right").count, 1u);
  EXPECT_THAT(summary.notes, ElementsAre("no mask of camera 'left'"));
}

TEST_F(Stills, MasksThatBelongToNoPictureAreSaidWithTheNameThatWasExpected) {
  for (const std::string camera : {"left", "right"}) {
    stills_.mask(camera + "/00_mask.png", 255);
    stills_.mask(camera + "/01_mask.png", 255);
  }
  EXPECT_THAT(error_of(target()),
              AllOf(HasSubstr("no mask can be used; "), HasSubstr("masks/left/00_mask.png: its name ends in no number"),
                    HasSubstr("expected the name of its picture, as 00.png")));
  stills_.mask("right/00.png", 255);
  stills_.mask("right/17.png", 255);
  const auto summary = import(target());
  EXPECT_EQ(summary.cameras[1].masks, 1u);
  EXPECT_EQ(summary.left_out.at("masks of camera left").count, 2u);
  EXPECT_EQ(summary.left_out.at("masks of camera right").count, 3u);
  StillsImportOptions without;
  without.masks = false;
  EXPECT_THAT(import(target(), without).left_out, IsEmpty());
}

TEST_F(Stills, AFolderOfMasksOfNoCameraIsSaid) {
  stills_.mask("Left/00.png", 255);
  stills_.mask("right/00.png", 255);
  const auto summary = import(target());
  EXPECT_THAT(
      summary.left_out.at("masks of camera Left").first,
      HasSubstr("masks/Left/00.png: mask of no picture; no folder images/Left; expected the name of a camera's: "
                "left, right"));
  EXPECT_THAT(import(target("import: {masks: {left: Left}}\n")).left_out, IsEmpty());
}

TEST_F(Stills, AMaskInTheAlphaChannelIsReadAndOneThatContradictsItsColoursRefused) {
  cv::Mat drawn(6, 8, CV_8UC4, cv::Scalar(255, 255, 255, 0));
  drawn.col(3).setTo(cv::Scalar(255, 255, 255, 255));
  stills_.picture("masks/left/00.png", drawn);
  cv::Mat opaque(6, 8, CV_8UC4, cv::Scalar(0, 0, 0, 255));
  opaque.col(3).setTo(cv::Scalar(255, 255, 255, 255));
  stills_.picture("masks/left/01.png", opaque);
  cv::Mat both(6, 8, CV_8UC4, cv::Scalar(0, 0, 0, 0));
  both.col(3).setTo(cv::Scalar(255, 255, 255, 255));
  stills_.picture("masks/right/00.png", both);
  cv::Mat other = both.clone();
  other.col(5).setTo(cv::Scalar(0, 0, 0, 255));
  stills_.picture("masks/right/01.png", other);
  const auto to = target();
  const auto summary = import(to);
  EXPECT_THAT(
      summary.left_out.at("masks of camera right").first,
      HasSubstr("masks/right/01.png: mask whose alpha channel is another than its colours show; expected a gray"));
  stills_.picture("masks/right/01.png", both);
  (void)import(to);
  const auto seen = observations(to, true);
  ASSERT_EQ(seen.size(), 2u);
  for (const Image* mask :
       {&seen[0].cameras[0]->given_mask, &seen[1].cameras[0]->given_mask, &seen[0].cameras[1]->given_mask}) {
    ASSERT_EQ(mask->data.size(), 48u);
    EXPECT_EQ(mask->data[3], kMaskRobot);
    EXPECT_EQ(mask->data[4], kMaskBackground);
  }
}

TEST_F(Stills, MasksThatLookInvertedAreSaid) {
  cv::Mat inverted(6, 8, CV_8UC1, cv::Scalar(255));
  inverted.col(3).setTo(cv::Scalar(0));
  for (const std::string posture : {"00", "01"}) {
    stills_.picture("masks/left/" + posture + ".png", inverted);
    stills_.picture("masks/right/" + posture + ".png", 255 - inverted);
  }
  EXPECT_THAT(
      import(target()).notes,
      ElementsAre(HasSubstr("in 2 of 2 masks of camera 'left' the robot fills most of the picture's border: are "
                            "they inverted? Expected 0 background, 255 robot")));
}

/// As of a pipeline that keeps transparency.
TEST_F(Stills, PicturesWithAnAlphaChannelAreReadWithoutIt) {
  for (const std::string camera : {"left", "right"}) {
    for (const char* name : {"00.png", "01.png"}) {
      stills_.picture("images/" + camera + "/" + name, cv::Mat(6, 8, CV_8UC4, cv::Scalar(1, 2, 3, 77)));
    }
  }
  const auto to = target();
  (void)import(to);
  const auto seen = observations(to);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].cameras[0]->image.channels, 3);
  EXPECT_THAT(std::vector<int>(seen[0].cameras[0]->image.data.begin(), seen[0].cameras[0]->image.data.begin() + 3),
              ElementsAre(3, 2, 1));
}

TEST_F(Stills, WithTimesItIsARecordingInMotion) {
  stills_.write("joints.csv",
                "time_s;joint1;joint2;joint3;joint4;joint5;joint6;joint7;posture\n"
                "100.00;0.00;0;0;0;0;0;0;0\n"
                "100.05;0.01;0;0;0;0;0;0;\n"
                "100.10;0.02;0;0;0;0;0;0;1\n");
  const auto to = target();
  const auto summary = import(to);
  EXPECT_EQ(summary.joint_messages, 3u);
  const auto seen = observations(to);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_EQ(seen[0].utime, 100'000'000);
  EXPECT_EQ(seen[1].utime, 100'100'000);
  EXPECT_NEAR(seen[1].cameras[0]->joints.q[to.robot->joint_index("joint1")], 0.02, 1e-7);
  EXPECT_NEAR(seen[1].cameras[0]->joints.qdot[to.robot->joint_index("joint1")], 0.2, 1e-5);
}

TEST_F(Stills, ColumnsInDegreesOfOtherNamesAndOneCamera) {
  stills_.write("joints.csv",
                "\"frame\",A7,A1,A2,A3,A4,A5,A6,gripper\r\n"
                "1,70,10,20,30,40,50,60,0.5\r\n"
                "0,7,1,2,3,4,5,6,0.5\r\n");
  fs::rename(stills_.path() / "images/right", stills_.path() / "images/realsense");
  fs::remove_all(stills_.path() / "images/left");
  std::string mapping = "import:\n  unit: deg\n  cameras: {eye: realsense}\n  joints:\n";
  for (int i = 1; i <= 7; ++i) mapping += "    A" + std::to_string(i) + ": joint" + std::to_string(i) + "\n";
  const auto to = target(mapping, "cameras:\n  eye: {link: base, pose: unknown, " + kLens + "}\n");
  const auto summary = import(to);
  EXPECT_THAT(summary.names_ignored, ElementsAre("gripper"));
  const auto seen = observations(to);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_NEAR(seen[0].cameras[0]->joints.q[to.robot->joint_index("joint7")], radians(70.0), 1e-6);
  EXPECT_NEAR(seen[1].cameras[0]->joints.q[to.robot->joint_index("joint2")], radians(2.0), 1e-6);
}

/// As a spreadsheet writes it.
TEST_F(Stills, EmptyColumnsNotesAndCapitalsOfATableAreNoMistakes) {
  stills_.write("joints.csv",
                "\" Posture \",joint1,joint2,joint3,joint4,joint5,joint6,joint7,note,temp_C,,\n"
                "1,0.1,0,0,0,0,0,0,ok,,,\n"
                "0,0.2,0,0,0,0,0,0,,31.2,,\n"
                ",,,,,,,,,,,\n");
  const auto to = target();
  const auto summary = import(to);
  EXPECT_THAT(summary.left_out, IsEmpty());
  EXPECT_THAT(summary.notes,
              ElementsAre("joints.csv: column 'note' is no joint and holds text ('ok'); it is not read"));
  EXPECT_THAT(summary.names_ignored, ElementsAre("temp_C"));
  const auto seen = observations(to);
  ASSERT_EQ(seen.size(), 2u);
  EXPECT_NEAR(seen[0].cameras[0]->joints.q[to.robot->joint_index("joint1")], 0.1, 1e-7);
}

TEST_F(Stills, AJointThatMattersAndHasNoColumnIsAsked) {
  stills_.write("joints.csv", "posture,joint_1,joint2,joint3,joint4,joint5,joint6,joint7\n0,1,2,3,4,5,6,7\n");
  EXPECT_THAT(error_of(target()),
              HasSubstr("no readings of joint joint1; is joint_1 its name in the recording? Then say so: import: "
                        "{joints: {joint_1: joint1}}"));
  stills_.write("joints.csv", "posture,joint_1,joint_2,joint3,joint4,joint5,joint6,joint7\n0,1,2,3,4,5,6,7\n");
  EXPECT_THAT(error_of(target()), HasSubstr("are these their names in the recording? Then say so: import: {joints: "
                                            "{joint_1: joint1, joint_2: joint2}}"));
  stills_.write("joints.csv", "posture,elbow,joint3,joint4,joint5,joint6,joint7\n0,1,3,4,5,6,7\n");
  EXPECT_THAT(error_of(target()), HasSubstr("import: {joints: {elbow: joint1}} (names")) << "not of both";
  stills_.write("joints.csv", "posture,joint_1,joint2,joint3,joint4,joint5,joint6,joint7\n0,1,2,3,4,5,6,7\n");
  EXPECT_EQ(import(target("import: {joints: {joint_1: joint1}}\n")).joints.size(), 7u);
}

// As `bodyschema new-robot` writes it where it does not know which column is which joint.
TEST_F(Stills, WhereAllColumnsAreLeftOutTheyAreNamed) {
  stills_.write("joints.csv", "posture,A1,A2\n0,1,2\n");
  EXPECT_THAT(error_of(target("import: {joints: {A1: \"-\", A2: \"-\"}}\n")),
              HasSubstr("no joint readings; import.joints leaves out A1, A2: say there which joint each is"));
}

TEST_F(Stills, AMappingToNoJointIsAnErrorOfTheConfiguration) {
  try {
    (void)target("import: {joints: {A1: joint_one}}\n");
    ADD_FAILURE();
  } catch (const ConfigurationError& e) {
    EXPECT_THAT(e.what(), HasSubstr("import.joints.A1' is 'joint_one', no joint of robot 'arm7'; did you mean"));
  }
  EXPECT_THAT([&] { (void)target("import: {cameras: {middle: x}}\n"); },
              ThrowsMessage<ConfigurationError>(
                  HasSubstr("key 'import.cameras.middle': 'middle' is no camera of the configuration; expected left or "
                            "right")));
  const fs::path mapping = stills_.write("mapping.yaml", "import: {masks: {lfet: x}}\n");
  EXPECT_THAT([&] { (void)ImportTarget::from(Configuration::parse(robot() + cameras()), mapping); },
              ThrowsMessage<ConfigurationError>(HasSubstr("mapping.yaml:1: key 'import.masks.lfet'")));
  EXPECT_THROW((void)target("import: {joints: {A: joint1, B: joint1}}\n"), ConfigurationError);
  EXPECT_THROW((void)target("import: {joints: {A: {joint: joint1, scale: 0}}}\n"), ConfigurationError);
}

/// A sign that a mapping gives a column of another name would be lost without a word.
TEST_F(Stills, AMappingOfWhatTheFolderLacksIsAnError) {
  EXPECT_THAT(error_of(target("import: {joints: {jont1: {joint: joint1, scale: -1}}}\n")),
              HasSubstr("joints.csv: no column 'jont1', which import.joints says is joint 'joint1'; did you mean "
                        "'joint1'?"));
  EXPECT_THAT(error_of(target("import: {cameras: {left: lfet}}\n")),
              HasSubstr("/images: no folder 'lfet', which import.cameras.left names; expected left or right"));
  const auto masks = target("import: {masks: {left: network}}\n");
  stills_.mask("left/00.png", 255);
  EXPECT_THAT(error_of(masks), HasSubstr("/masks: no folder 'network', which import.masks.left names; expected left"));
  fs::remove_all(stills_.path() / "masks");
  EXPECT_EQ(import(masks).cameras[0].pictures, 2u) << "no masks at all are none of a wrong name";
  EXPECT_EQ(import(target("import: {joints: {conveyor: \"-\"}}\n")).joints.size(), 7u);
}

TEST_F(Stills, ReadingsThatLookLikeTheOtherUnitAreSaid) {
  stills_.write("joints.csv", "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n0,90,0,0,0,0,0,0\n");
  EXPECT_THAT(import(target()).notes, Contains(HasSubstr("if these are degrees, set import.unit: deg")));
}

TEST_F(Stills, WhatHasNoCounterpartIsCounted) {
  stills_.write("joints.csv",
                "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n0,0,0,0,0,0,0,0\n7,0,0,0,0,0,0,0\n");
  fs::remove(stills_.path() / "images/right/00.png");
  stills_.picture("images/right/notes.png", cv::Mat(6, 8, CV_8UC3));
  fs::create_directories(stills_.path() / "depth/left");
  const auto summary = import(target());
  EXPECT_EQ(summary.cameras[0].pictures, 1u);
  EXPECT_EQ(summary.cameras[1].pictures, 0u);
  EXPECT_THAT(summary.left_out.at("postures").first, HasSubstr("no picture of posture 7"));
  EXPECT_THAT(summary.left_out.at("pictures of camera left").first, HasSubstr("joints.csv has no posture 1"));
  EXPECT_EQ(summary.left_out.at("files").count, 1u);
  EXPECT_THAT(summary.notes, Contains(HasSubstr("depth/ is not read")));
  EXPECT_THAT(summary.notes, Contains(HasSubstr("no picture of camera 'right'")));
}

TEST_F(Stills, SaysWhereACameraOfTheConfigurationHasNoFolder) {
  EXPECT_THAT(error_of(target("", "cameras:\n  top: {link: base, pose: unknown, " + kLens + "}\n")),
              HasSubstr("no folder of camera 'top'; it has left, right. Which is it? import: {cameras: {top: "));
}

TEST_F(Stills, IntrinsicsThatAreNotThoseOfTheFolderAreSaid) {
  const std::string rest = "\nd: []\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n";
  stills_.write("camera_info/left.yaml", "width: 8\nheight: 6\nk: [20, 0, 3.5, 0, 20, 2.5, 0, 0, 1]" + rest);
  stills_.write("camera_info/right.yaml", "width: 8\nheight: 6\nk: [8.1, 0, 3.5, 0, 8, 2.5, 0, 0, 1]" + rest);
  const auto notes = import(target()).notes;
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_THAT(notes[0], HasSubstr("camera 'left' is configured with fx 8"));
}

TEST_F(Stills, BadInputIsOneClearError) {
  const std::string names = "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n";
  const auto with = [&](const std::string& csv) {
    stills_.write("joints.csv", csv);
    return error_of(target());
  };
  EXPECT_THAT(with(names + "0,nan,0,0,0,0,0,0\n"), HasSubstr("joints.csv:2: 'nan' in column 'joint1' is not a finite"));
  EXPECT_THAT(with(names + "0,,0,0,0,0,0,0\n"), HasSubstr("joints.csv:2: no value in column 'joint1'"));
  EXPECT_THAT(with(names + "0,1,2 deg,0,0,0,0,0\n"),
              HasSubstr("joints.csv:2: '2 deg' in column 'joint2' is not a finite number"));
  EXPECT_THAT(with(names + "first,0,0,0,0,0,0,0\n"), HasSubstr("joints.csv:2: 'first' in column 'posture' is not a"));
  EXPECT_THAT(with("Posture,posture,joint1\n0,0,0\n"), HasSubstr("columns 'posture' and 'Posture'; expected one"));
  EXPECT_THAT(with(",joint1\n0,0\n"), HasSubstr("'' is no name"));
  EXPECT_THAT(with(names + "0,0,0\n"), HasSubstr("joints.csv:2: 3 values, expected 8"));
  EXPECT_THAT(with(names + "0.5,0,0,0,0,0,0,0\n"), HasSubstr("0.5 is no number of a posture"));
  EXPECT_THAT(with(names + "0,0,0,0,0,0,0,0\n0,0,0,0,0,0,0,0\n"), HasSubstr("joints.csv:3: posture 0 comes a second"));
  EXPECT_THAT(with(names), HasSubstr("holds no rows"));
  EXPECT_THAT(with("0,0,0\n0,0,0\n"), HasSubstr("'0' is no name"));
  EXPECT_THAT(with("posture,joint1,joint1\n0,0,0\n"), HasSubstr("column 'joint1' is there twice"));
  EXPECT_THAT(with("posture\n0\n"), HasSubstr("no column of a joint"));
  EXPECT_THAT(with("time_s," + names + "2,0,0,0,0,0,0,0,0\n1,1,0,0,0,0,0,0,0\n"),
              HasSubstr("not after the row before"));
  stills_.write("joints.csv", names + "0,0,0,0,0,0,0,0\n");
  EXPECT_THAT(error_of(target("",
                              "cameras:\n  left: {link: base, pose: unknown, width: 80, height: 6, fx: 8, fy: 8, cx: "
                              "3.5, cy: 2.5}\n")),
              HasSubstr("00.png is 8x6 px, the configuration has 80x6 (cameras.left.width, .height)"));
  stills_.write("images/left/00.png", "not a picture");
  stills_.write("images/right/00.png", "nor this");
  EXPECT_THAT(error_of(target()), HasSubstr("no picture of any camera; " + stills_.path().string()));
  fs::remove(stills_.path() / "joints.csv");
  EXPECT_THAT(error_of(target()), HasSubstr("joints.csv: no such file"));
  fs::remove_all(stills_.path() / "images");
  EXPECT_THAT(error_of(target()), HasSubstr("no folder 'images'"));
}

/// One bad row of many is left out and counted; its posture is missing, and no other.
TEST_F(Stills, AFewBadRowsAreCounted) {
  std::string csv = "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n";
  for (int i = 0; i < 40; ++i) csv += std::to_string(i) + (i == 1 ? ",what" : ",0") + ",0,0,0,0,0,0\n";
  stills_.write("joints.csv", csv);
  const auto summary = import(target());
  EXPECT_EQ(summary.left_out.at("rows").count, 1u);
  EXPECT_EQ(summary.cameras[0].pictures, 1u);
}

/// Rows without a number belong to pictures in order: one that is damaged takes its own picture away, no other's.
TEST_F(Stills, ADamagedRowLeavesTheOthersTheirPictures) {
  for (const std::string camera : {"left", "right"}) {
    stills_.picture("images/" + camera + "/01.png", cv::Mat(6, 8, CV_8UC3, cv::Scalar(1, 2, 9)));
  }
  std::string csv = "joint1,joint2,joint3,joint4,joint5,joint6,joint7\n";
  for (int i = 0; i < 40; ++i) {
    csv += i == 0 ? "0,0,0\n" : "0." + std::to_string(i) + ",0,0,0,0,0,0\n";
    if (i < 2) continue;
    for (const char* camera : {"left", "right"}) {
      for (const char* kind : {"images", "masks"}) {
        const auto folder = stills_.path() / kind / camera;
        if (fs::exists(folder / "01.png")) fs::copy_file(folder / "01.png", folder / (std::to_string(i) + ".png"));
      }
    }
  }
  stills_.write("joints.csv", csv);
  const auto summary = import(target());
  EXPECT_EQ(summary.left_out.at("rows").count, 1u);
  const auto seen = observations(target());
  ASSERT_EQ(seen.size(), 39u);
  EXPECT_NEAR(seen[0].cameras[0]->joints.q(0), 0.1, 1e-6);
  EXPECT_EQ(seen[0].cameras[0]->image.data[0], 9) << "picture 1, not picture 0";
}

TEST_F(Stills, WhatWasThereStaysWhereAnImportFails) {
  (void)import(target());
  const auto before = fs::file_size(log());
  stills_.write("joints.csv", "nothing");
  EXPECT_THROW((void)import(target()), FileError);
  EXPECT_EQ(fs::file_size(log()), before);
  EXPECT_FALSE(fs::exists(log().string() + ".part"));
}

/// Recordings of physical arms, by others.
/// Files that a system leaves beside pictures, with their names.
TEST_F(Stills, HiddenFilesAreNoPictures) {
  stills_.write("images/left/._00.png", "no picture");
  stills_.write("images/left/.DS_Store", "nor this");
  EXPECT_THAT(import(target()).left_out, IsEmpty());
  EXPECT_EQ(observations(target()).size(), 2u);
}

TEST_F(Stills, RowsWithoutNumbersBelongToPicturesInOrder) {
  stills_.write("joints.csv", "joint1,joint2,joint3,joint4,joint5,joint6,joint7\n0.1,0,0,0,0,0,0\n0.2,0,0,0,0,0,0\n");
  for (const std::string camera : {"left", "right"}) {
    fs::rename(stills_.path() / "images" / camera / "01.png", stills_.path() / "images" / camera / "02.png");
    fs::rename(stills_.path() / "images" / camera / "00.png", stills_.path() / "images" / camera / "01.png");
  }
  const auto to = target();
  const auto summary = import(to);
  EXPECT_THAT(summary.left_out, IsEmpty());
  EXPECT_THAT(summary.notes, Contains(HasSubstr("its rows belong to pictures 1, 2, ... in order")));
  const auto all = observations(to);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_NEAR(all[0].cameras[0]->joints.q[to.robot->joint_index("joint1")], 0.1, 1e-6);
}

/// What `calibrate` writes believes something about the robot; an import has no need of it.
TEST_F(Stills, WhatIsBelievedOfTheRobotIsForOthers) {
  auto yaml = robot();
  EXPECT_NO_THROW(
      ImportTarget::from(Configuration::parse(yaml + "  tolerances: {joint_place: {sd_mm: 1}}\n" + cameras())));
  EXPECT_THROW(ImportTarget::from(Configuration::parse(yaml + "  tolerance: {joint_place: {sd_mm: 1}}\n" + cameras())),
               ConfigurationError);
}

TEST(RealStills, OfTwoCamerasWithMasks) {
  for (const auto& [set, postures] : {std::pair{"lbr_zed5", 5u}, std::pair{"lbr_zed10", 10u}}) {
    SCOPED_TRACE(set);
    SKIP_WITHOUT("real");
    const fs::path data = data_folder() / "real";
    const std::string lens = ", width: 960, height: 540, fx: 534.6, fy: 534.6, cx: 478.1, cy: 261}\n";
    const auto to = ImportTarget::from(Configuration::parse(
        "robot:\n  urdf: " + (data / "robots/lbr_med7/lbr_med7.urdf").string() +
        "\n  rendered_links: [lbr_link_0, lbr_link_7]\n  hand_link: lbr_link_7\n  estimated_joints: [lbr_A1]\n"
        "cameras:\n  left: {link: lbr_link_0, pose: unknown" +
        lens + "  right: {link: lbr_link_0, pose: unknown" + lens));
    TemporaryFolder out;
    const auto summary = import_stills(data / set, to, {}, out.path() / "out.lcmlog");
    for (const auto& camera : summary.cameras) {
      EXPECT_EQ(camera.pictures, postures);
      EXPECT_EQ(camera.masks, postures);
    }
    EXPECT_THAT(summary.left_out, IsEmpty());
    EXPECT_THAT(summary.names_ignored, IsEmpty());
  }
}

}  // namespace
}  // namespace bodyschema
