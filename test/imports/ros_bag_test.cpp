#include "bodyschema/imports/ros_bag.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "bodyschema/core/error.hpp"
#include "records.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

const std::string kLens = "width: 4, height: 2, fx: 4, fy: 4, cx: 1.5, cy: 0.5";
const std::string kJoints = R"("names": ["joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7"])";

template <class Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was wrong";
}

class RosBag : public ::testing::Test {
 protected:
  ImportTarget target(const std::string& cameras = "left: {link: base, pose: unknown, " + kLens +
                                                   "}, right: {link: base, pose: unknown, " + kLens + "}",
                      const std::string& more = "") const {
    return ImportTarget::from(Configuration::parse(
        "robot:\n  urdf: " + std::string(BODYSCHEMA_SOURCE_DIR) +
        "/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n  hand_link: hand\n  estimated_joints: [joint1]\n"
        "cameras: {" +
        cameras + "}\n" + more));
  }
  static BagTopic topic(const std::string& name, const std::string& type, const std::string& picture = "") {
    BagTopic t;
    t.name = name;
    t.type = "sensor_msgs/msg/" + type;
    t.count = 3;
    t.picture = picture;
    if (type == "JointState") t.joints = {"joint1", "joint2"};
    return t;
  }
  static std::vector<BagTopic> usual() {
    return {topic("/joint_states", "JointState"), topic("/zed/left/image", "Image", "bgr8"),
            topic("/zed/right/image", "Image", "bgr8"), topic("/zed/left/camera_info", "CameraInfo")};
  }
  static void joints(RecordedBytes& bag, std::int64_t utime, std::vector<double> q = {.1, .2, .3, .4, .5, .6, .7}) {
    bag.add(fmt::format(R"({{"kind": "joints", "topic": "/j", "arrival_ns": {}, "stamp_ns": {}, "positions": {},
                            "velocities": 0, {}}})",
                        utime * 1000, utime * 1000, q.size(), kJoints),
            RecordedBytes::numbers(q));
  }
  static void picture(RecordedBytes& bag, const std::string& topic, std::int64_t utime, std::int64_t stamp,
                      const std::string& encoding = "rgb8", int width = 4, int height = 2, std::size_t bytes = 24) {
    bag.add(fmt::format(R"({{"kind": "picture", "topic": "{}", "arrival_ns": {}, "stamp_ns": {}, "frame": "optical",
                            "encoding": "{}", "width": {}, "height": {}, "step": 0}})",
                        topic, utime * 1000, stamp * 1000, encoding, width, height),
            std::vector<std::uint8_t>(bytes, 200));
  }
  ImportSummary import(RecordedBytes& bag, const ImportTarget& to,
                       const std::vector<std::string>& infos = {"/i", ""}) const {
    BagSelection selection;
    selection.joints = {"/j"};
    selection.pictures = {"/l", "/r"};
    selection.masks = {"/ml", ""};
    selection.infos = infos;
    return import_bag_records(bag, "my.bag", selection, to, folder_.path() / "out.lcmlog");
  }
  TemporaryFolder folder_;
};

TEST_F(RosBag, TopicsAreFoundByTheirTypesAndTheCamerasNames) {
  const auto chosen = BagSelection::choose(usual(), target(), {});
  EXPECT_THAT(chosen.joints, ElementsAre("/joint_states"));
  EXPECT_THAT(chosen.pictures, ElementsAre("/zed/left/image", "/zed/right/image"));
  EXPECT_THAT(chosen.infos, ElementsAre("/zed/left/camera_info", ""));
  EXPECT_THAT(chosen.masks, ElementsAre("", ""));
}

TEST_F(RosBag, TheOnlyPicturesAreThoseOfTheOnlyCamera) {
  const auto chosen = BagSelection::choose(
      {topic("/joint_states", "JointState"), topic("/cam/color", "Image", "rgb8"), topic("/cam/raw", "Image", "16UC1"),
       topic("/cam/depth/image", "Image", "mono8"), topic("/cam/x", "CompressedImage", "16UC1; compressedDepth png")},
      target("head: {link: base, pose: unknown, " + kLens + "}"), {});
  EXPECT_THAT(chosen.pictures, ElementsAre("/cam/color"));
}

TEST_F(RosBag, WhereSeveralFitTheyAreListedAndAskedFor) {
  auto topics = usual();
  topics.push_back(topic("/joint_commands", "JointState"));
  EXPECT_THAT(error_of([&] { BagSelection::choose(topics, target(), {}); }),
              AllOf(HasSubstr("--joints TOPIC"), HasSubstr("\n  /joint_states"), HasSubstr("\n  /joint_commands")));
  RosBagOptions options;
  options.joints = {"/joint_states"};
  topics.push_back(topic("/zed/left/image/compressed", "CompressedImage", "jpeg"));
  EXPECT_THAT(error_of([&] { BagSelection::choose(topics, target(), options); }),
              AllOf(HasSubstr("--camera left=TOPIC"), HasSubstr("/zed/left/image/compressed"),
                    Not(HasSubstr("/zed/right/image"))));
  options.pictures = {{"left", "/zed/left/image/compressed"}};
  EXPECT_THAT(BagSelection::choose(topics, target(), options).infos, ElementsAre("/zed/left/camera_info", ""));
}

TEST_F(RosBag, JointsOfAnotherRobotAreNotThisOnes) {
  auto topics = usual();
  topics.push_back(topic("/gripper/joint_states", "JointState"));
  topics.back().joints = {"finger"};
  EXPECT_THAT(BagSelection::choose(topics, target(), {}).joints, ElementsAre("/joint_states"));
}

TEST_F(RosBag, WhatIsNamedMustBeThereAndOfItsKind) {
  RosBagOptions options;
  options.joints = {"/joint_stats"};
  EXPECT_THAT(error_of([&] { BagSelection::choose(usual(), target(), options); }),
              AllOf(HasSubstr("/joint_stats: no such topic"), HasSubstr("\n  /joint_states")));
  options = {};
  options.pictures = {{"left", "/joint_states"}};
  EXPECT_THAT(error_of([&] { BagSelection::choose(usual(), target(), options); }),
              HasSubstr("a topic of sensor_msgs/msg/JointState"));
  options.pictures = {{"middle", "/zed/left/image"}};
  EXPECT_THAT(error_of([&] { BagSelection::choose(usual(), target(), options); }), HasSubstr("'middle' is no camera"));
  options.pictures = {{"left", "/zed/left/image"}, {"right", "/zed/left/image"}};
  EXPECT_THAT(error_of([&] { BagSelection::choose(usual(), target(), options); }),
              HasSubstr("is given for cameras 'left' and 'right'"));
  EXPECT_THAT(error_of([&] { BagSelection::choose({topic("/i", "Image", "rgb8")}, target(), {}); }),
              HasSubstr("no joint readings"));
  EXPECT_THAT(error_of([&] { BagSelection::choose({topic("/j", "JointState")}, target(), {}); }),
              HasSubstr("no pictures"));
}

TEST_F(RosBag, MasksAreTakenWhereTheyAreNamedAndMentionedWhereNot) {
  auto topics = usual();
  topics.push_back(topic("/zed/left/mask", "Image", "mono8"));
  EXPECT_THAT(BagSelection::choose(topics, target(), {}).notes, Contains(HasSubstr("--masks CAMERA=/zed/left/mask")));
  RosBagOptions options;
  options.masks = {{"left", "/zed/left/mask"}};
  EXPECT_THAT(BagSelection::choose(topics, target(), options).masks, ElementsAre("/zed/left/mask", ""));
}

TEST_F(RosBag, EncodingsBecomeGrayOrRgb) {
  const std::vector<std::uint8_t> bytes = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  const auto pixels = [&](const std::string& encoding, int width, int height, int step) {
    return decode_ros_image(encoding, width, height, step, bytes, "here").data;
  };
  EXPECT_THAT(pixels("mono8", 2, 2, 14), ElementsAre(1, 2, 15, 16));  // rows are padded
  EXPECT_THAT(pixels("8UC1", 16, 1, 0), testing::ElementsAreArray(bytes));
  EXPECT_THAT(pixels("rgb8", 2, 2, 8), ElementsAre(1, 2, 3, 4, 5, 6, 9, 10, 11, 12, 13, 14));
  EXPECT_THAT(pixels("bgr8", 1, 1, 0), ElementsAre(3, 2, 1));
  EXPECT_THAT(pixels("rgba8", 2, 1, 8), ElementsAre(1, 2, 3, 5, 6, 7));
  EXPECT_THAT(pixels("bgra8", 2, 1, 8), ElementsAre(3, 2, 1, 7, 6, 5));
  // A picture of one level is that level, whatever the pattern or the order of its colours.
  const std::vector<std::uint8_t> gray(64, 128);
  for (const std::string encoding : {"bayer_rggb8", "bayer_gbrg8"}) {
    EXPECT_THAT(decode_ros_image(encoding, 8, 8, 8, gray, "").data, testing::Each(128));
  }
  EXPECT_THAT(decode_ros_image("yuv422", 4, 4, 8, gray, "").data,
              testing::Each(testing::AllOf(testing::Ge(129), testing::Le(132))));
}

TEST_F(RosBag, ABayerPatternIsNamedByItsFirstTwoRows) {
  std::vector<std::uint8_t> red(36, 0);
  for (std::size_t v = 0; v < 6; v += 2) {
    for (std::size_t u = 0; u < 6; u += 2) red[6 * v + u] = 200;  // where rggb has red
  }
  const Image image = decode_ros_image("bayer_rggb8", 6, 6, 6, red, "");
  EXPECT_EQ(image.pixel(2, 2)[0], 200);
  EXPECT_EQ(image.pixel(2, 2)[2], 0);
}

TEST_F(RosBag, PicturesThatCannotBeAreRefused) {
  const std::vector<std::uint8_t> bytes(24);
  const auto refused = [&](const std::string& encoding, std::int64_t width, std::int64_t height, std::int64_t step) {
    return error_of([&] { (void)decode_ros_image(encoding, width, height, step, bytes, "here"); });
  };
  EXPECT_THAT(refused("16UC1", 4, 2, 0), AllOf(HasSubstr("here: encoding '16UC1'"), HasSubstr("mono8")));
  EXPECT_THAT(refused("rgb8", 4, 3, 0), HasSubstr("24 bytes in rows of 12 for 4x3 px"));
  EXPECT_THAT(refused("rgb8", 4, 2, 11), HasSubstr("rows of 11"));
  EXPECT_THAT(refused("rgb8", 4, 2, 1LL << 62), HasSubstr("rows of"));
  EXPECT_THAT(refused("rgb8", 0, 2, 0), HasSubstr("0x2"));
  EXPECT_THAT(refused("rgb8", 1LL << 40, 1LL << 40, 0), HasSubstr("expected 1 to"));
  EXPECT_THAT(refused("yuyv", 3, 2, 0), HasSubstr("3x2"));
}

TEST_F(RosBag, MessagesBecomeALogAndWhatIsBadIsCounted) {
  RecordedBytes bag;
  joints(bag, 1'000'000);
  picture(bag, "/l", 1'000'000, 990'000);
  picture(bag, "/r", 1'000'000, 0);                            // no stamp
  picture(bag, "/l", 1'100'000, 1'100'000, "rgb8", 3, 2, 18);  // another size
  picture(bag, "/l", 1'200'000, 1'200'000, "32FC1");
  picture(bag, "/l", 1'300'000, -5);
  picture(bag, "/ml", 1'300'000, 990'000, "mono8", 4, 2, 8);
  joints(bag, 1'400'000, {.1, .2, NAN, .4, .5, .6, .7});
  joints(bag, 1'500'000, {.1, .2});
  bag.add(R"({"kind": "broken", "topic": "/l", "message": "cut"})");
  bag.add(R"({"kind": "end"})");
  const auto summary = import(bag, target());
  EXPECT_EQ(summary.joint_messages, 2u);
  EXPECT_EQ(summary.cameras[0].pictures, 1u);
  EXPECT_EQ(summary.cameras[0].masks, 1u);
  EXPECT_EQ(summary.cameras[1].pictures, 1u);
  EXPECT_EQ(summary.left_out.at("pictures of camera left").count, 3u);
  EXPECT_EQ(summary.left_out.at("joint messages").count, 1u);
  EXPECT_EQ(summary.left_out.at("readings").count, 1u);
  EXPECT_THAT(summary.left_out.at("readings").first, HasSubstr("is nan, not a finite number"));
  EXPECT_EQ(summary.left_out.at("messages").count, 1u);
  EXPECT_THAT(summary.notes, Contains(HasSubstr("1 messages have no stamp")));
}

/// One description for both cameras is none that changes; one that does is said once, however often it changes.
TEST_F(RosBag, OneDescriptionMayBeOfTwoCameras) {
  const auto notes = [&](int descriptions) {
    RecordedBytes bag;
    joints(bag, 1'000'000);
    picture(bag, "/l", 1'000'000, 1'000'000);
    for (int i = 0; i < descriptions; ++i) {
      bag.add(R"({"kind": "camera_info", "topic": "/i", "info": {"width": 4, "height": 2, "k": [)" +
              std::to_string(8 + i) + R"(, 0, 1.5, 0, 8, 0.5, 0, 0, 1]}})");
    }
    bag.add(R"({"kind": "end"})");
    return import(bag, target(), {"/i", "/i"}).notes;
  };
  const auto once = notes(1);
  EXPECT_THAT(once, Not(Contains(HasSubstr("changes within the bag"))));
  EXPECT_EQ(std::count_if(once.begin(), once.end(), [](const auto& n) { return n.find("/i has 8") != n.npos; }), 2);
  const auto thrice = notes(3);
  EXPECT_EQ(std::count_if(thrice.begin(), thrice.end(), [](const auto& n) { return n.find("changes") != n.npos; }), 1);
}

TEST_F(RosBag, WhatTheBagSaysOfACameraIsComparedWithTheConfiguration) {
  const auto notes = [&](const std::string& info, const std::string& frames, const std::string& cameras) {
    RecordedBytes bag;
    joints(bag, 1'000'000);
    picture(bag, "/l", 1'000'000, 1'000'000);
    bag.add(R"({"kind": "camera_info", "topic": "/i", "info": )" + info + "}");
    if (!frames.empty()) {
      bag.add(R"({"kind": "transform", "child": "optical", "static": true, )" + frames + "}",
              RecordedBytes::numbers({0.1, 0.2, 0.3, 0, 0, 0, 1}));
    }
    bag.add(R"({"kind": "end"})");
    return import(bag, target(cameras)).notes;
  };
  const std::string same = R"({"width": 4, "height": 2, "k": [4, 0, 1.5, 0, 4, 0.5, 0, 0, 1]})";
  const std::string pair =
      "left: {link: base, pose: unknown, " + kLens + "}, right: {beside: left, pose: unknown, " + kLens + "}";
  EXPECT_THAT(notes(same, "", pair), Not(Contains(HasSubstr("is configured with"))));
  EXPECT_THAT(notes(R"({"width": 4, "height": 2, "k": [8, 0, 1.5, 0, 8, 0.5, 0, 0, 1]})", "", pair),
              Contains(HasSubstr("/i has 8, 8")));
  EXPECT_THAT(notes(R"({"width": 8, "height": 2, "k": [8, 0, 1.5, 0, 8, 0.5, 0, 0, 1]})", "", pair),
              Contains(HasSubstr("/i has 8x2")));
  EXPECT_THAT(notes(R"({"width": 4, "height": 2, "k": [0]})", "", pair), Contains(HasSubstr("/i was not compared")));
  EXPECT_THAT(notes(same, R"("parent": "base", "moves": false)", pair),
              Contains(AllOf(HasSubstr("tf has camera 'left' (optical) on link 'base' at xyz 0.1000 0.2000 0.3000"),
                             HasSubstr("configured as unknown"))));
  const std::string known = "left: {link: base, X_link_optical: {xyz_m: [0.1, 0.2, 0.31], rpy_rad: [0, 0, 0]}, " +
                            kLens + "}, right: {beside: left, pose: unknown, " + kLens + "}";
  EXPECT_THAT(notes(same, R"("parent": "base", "moves": true)", known),
              Contains(AllOf(HasSubstr("it moves there"), HasSubstr("10 mm and 0.0 deg"))));
  EXPECT_THAT(notes(same, R"("parent": "elsewhere", "moves": false)", known), Not(Contains(HasSubstr("tf has"))));
}

TEST_F(RosBag, ALogIsWrittenOnlyOfAWholeStream) {
  const auto imported = [&](const std::function<void(RecordedBytes&)>& spoil) {
    RecordedBytes bag;
    joints(bag, 1'000'000);
    picture(bag, "/l", 1'000'000, 1'000'000);
    spoil(bag);
    const std::string error = error_of([&] { (void)import(bag, target()); });
    EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out.lcmlog"));
    return error;
  };
  EXPECT_THAT(imported([](auto&) {}), HasSubstr("my.bag: its reader ended before the recording did"));
  EXPECT_THAT(imported([](auto& bag) { bag.bytes.resize(bag.bytes.size() - 3); }), HasSubstr("ended before"));
  EXPECT_THAT(imported([](auto& bag) { bag.add(R"({"kind": "error", "message": "cut short"})"); }),
              HasSubstr("my.bag: cut short"));
  EXPECT_THAT(imported([](auto& bag) { bag.add("no JSON"); }), HasSubstr("without a kind"));
  EXPECT_THAT(imported([](auto& bag) { bag.bytes.insert(bag.bytes.end(), 8, 0xFF); }), HasSubstr("at most"));
  EXPECT_THAT(imported([](auto& bag) { bag.add(R"({"kind": "joints", "names": [1]})"); }), HasSubstr("'names'"));
}

TEST(CameraInfoFile, IsNamedAfterItsTopic) {
  EXPECT_EQ(camera_info_file_name("/zed/left/camera_info"), "zed_left.yaml");
  EXPECT_EQ(camera_info_file_name("/camera_info"), "camera.yaml");
}

}  // namespace
}  // namespace bodyschema
