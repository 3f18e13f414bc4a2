#include "bodyschema/imports/lerobot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/fmt/fmt.h>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "records.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <class Work>
std::string error_of(const Work& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was wrong";
}

class Lerobot : public ::testing::Test {
 protected:
  ImportTarget target(const std::string& import = "", const std::string& camera = "head") const {
    return ImportTarget::from(Configuration::parse(
        "robot:\n  urdf: " + std::string(BODYSCHEMA_SOURCE_DIR) +
        "/meshes/arm7/arm7.urdf\n  rendered_links: [link2, hand]\n  hand_link: hand\n  estimated_joints: [joint1]\n"
        "  fixed_joints_deg: {joint3: 0, joint4: 0, joint5: 0, joint6: 0, joint7: 0}\n"
        "cameras: {" +
        camera + ": {link: base, pose: unknown, width: 4, height: 2, fx: 4, fy: 4, cx: 1.5, cy: 0.5}}\n" + import));
  }
  static LerobotSet set() { return {"2.1", 10, {0, 1, 2}, {"joint1", "hand", "joint2"}, {"observation.images.cam"}}; }
  /// Rows of joint1, hand and joint2, 0.1 s apart.
  static void episode(RecordedBytes& set, std::int64_t number, const std::vector<double>& stamps,
                      const std::vector<double>& values) {
    std::vector<double> all = stamps;
    all.insert(all.end(), values.begin(), values.end());
    set.add(fmt::format(R"({{"kind": "episode", "episode": {}, "rows": {}, "columns": 3}})", number, stamps.size()),
            RecordedBytes::numbers(all));
  }
  static void frame(RecordedBytes& set, std::int64_t time_us, int width = 4) {
    set.add(fmt::format(
                R"({{"kind": "frame", "camera": "observation.images.cam", "time_us": {}, "width": {}, "height": 2}})",
                time_us, width),
            std::vector<std::uint8_t>(static_cast<std::size_t>(width) * 6, 90));
  }
  static void end_episode(RecordedBytes& set) { set.add(R"({"kind": "episode_end"})"); }
  LerobotImport import(RecordedBytes& records, const LerobotOutput& out, const LerobotOptions& options = {}) const {
    records.add(R"({"kind": "end"})");
    return import_lerobot_records(records, "my_set", set(), {"observation.images.cam"}, to_, options, out);
  }
  LerobotOutput logs() const { return {folder_.path(), false}; }

  struct Event {
    std::string channel;
    Microseconds utime;
    std::vector<float> positions, velocities;
    std::int32_t format = 0;
  };
  static std::vector<Event> events(const fs::path& log) {
    std::vector<Event> all;
    LogReader reader(log);
    LogEvent event;
    while (reader.next(event)) {
      JointStateMessage joints;
      ImagesView images;
      if (decode(event.data, joints).ok()) {
        all.push_back({"joints", joints.utime, joints.position_rad, joints.velocity_rad_s});
      } else if (decode(event.data, images).ok()) {
        all.push_back({"picture", images.utime, {}, {}, images.images.front().pixelformat});
      }
    }
    return all;
  }
  TemporaryFolder folder_;
  ImportTarget to_ = target("import: {joints: {hand: '-', joint2: {joint: joint2, scale: -2, offset: 1}}}\n");
};

TEST_F(Lerobot, RowsBecomeReadingsAndFramesPicturesInOrderOfTime) {
  RecordedBytes records;
  episode(records, 4, {0.0, 0.1, 0.2}, {0.1, 9, 0.5, 0.2, 9, 0.4, 0.4, 9, 0.1});
  frame(records, 0);
  frame(records, 100'000);
  frame(records, 210'000);
  end_episode(records);
  const auto result = import(records, logs());
  ASSERT_EQ(result.logs.size(), 1u);
  EXPECT_EQ(result.logs[0].file, folder_.path() / "episode_000004.lcmlog");
  EXPECT_TRUE(result.logs[0].summary.left_out.empty()) << result.text();
  const auto all = events(result.logs[0].file);
  std::vector<std::string> order;
  for (const Event& e : all) order.push_back(e.channel);
  EXPECT_THAT(order, ElementsAre("joints", "picture", "joints", "picture", "joints", "picture"));
  EXPECT_THAT(all[2].positions, ElementsAre(testing::FloatEq(0.2F), testing::FloatEq(0.2F)));
  EXPECT_THAT(all[2].velocities, ElementsAre(testing::FloatNear(1.5F, 1e-4F), testing::FloatNear(4.0F, 1e-4F)));
  EXPECT_EQ(all[2].utime - all[0].utime, 100'000);
  EXPECT_EQ(all[5].utime - all[0].utime, 210'000);
  EXPECT_EQ(all[1].format, bot_core::image_t::PIXEL_FORMAT_MJPEG);
}

TEST_F(Lerobot, AnEpisodeWithoutAPictureSaysWhatIsWrongWithItsVideo) {
  RecordedBytes records;
  episode(records, 4, {0.0, 0.1}, {0.1, 9, 0.5, 0.2, 9, 0.4});
  records.add(R"({"kind": "broken", "camera": "observation.images.cam", "message": "no moov atom"})");
  end_episode(records);
  EXPECT_THAT(error_of([&] { import(records, logs()); }),
              AllOf(HasSubstr("no picture of any camera"), HasSubstr("observation.images.cam: no moov atom")));
}

TEST_F(Lerobot, PicturesAreKeptRawWhereThatIsAskedFor) {
  RecordedBytes records;
  episode(records, 0, {0.0}, {0.1, 9, 0.5});
  frame(records, 0);
  end_episode(records);
  LerobotOptions options;
  options.raw = true;
  const auto result = import(records, logs(), options);
  EXPECT_EQ(events(result.logs.at(0).file).at(1).format, bot_core::image_t::PIXEL_FORMAT_RGB);
}

TEST_F(Lerobot, WhatIsMissingIsCounted) {
  RecordedBytes records;
  records.add(R"({"kind": "absent", "episode": 0, "message": "no data/e0.parquet"})");
  episode(records, 1, {0.0, 0.1, 0.2, 0.2, 0.3, NAN}, std::vector<double>(18, 0.25));
  frame(records, 0);
  frame(records, 100'000, 3);  // of another size
  frame(records, 900'000);     // after the last row
  records.add(R"({"kind": "broken", "camera": "observation.images.cam", "message": "cut"})");
  end_episode(records);
  records.add(R"({"kind": "absent", "episode": 2, "message": "no data/e2.parquet"})");
  const auto result = import(records, logs());
  ASSERT_EQ(result.logs.size(), 1u);
  EXPECT_EQ(result.episodes_left_out.count, 2u);
  EXPECT_THAT(result.text(), HasSubstr("2 episodes left out, the first: episode 0: no data/e0.parquet"));
  const auto& left = result.logs[0].summary.left_out;
  EXPECT_EQ(left.at("rows").count, 2u);
  EXPECT_EQ(left.at("pictures of camera head").count, 2u);
  EXPECT_EQ(left.at("videos").count, 1u);
  EXPECT_EQ(left.at("pictures that rows should have, camera head").count, 2u);
  EXPECT_THAT(left.at("pictures that rows should have, camera head").first, HasSubstr("4 rows and 2 pictures"));
}

TEST_F(Lerobot, EpisodesFollowEachOtherInOneLog) {
  RecordedBytes records;
  for (int number = 0; number < 2; ++number) {
    episode(records, number, {0.0, 0.1}, {0.1, 9, 0.5, 0.2, 9, 0.4});
    frame(records, 0);
    end_episode(records);
  }
  const auto result = import(records, {folder_.path() / "all.lcmlog", true});
  ASSERT_EQ(result.logs.size(), 1u);
  const auto all = events(result.logs[0].file);
  ASSERT_EQ(all.size(), 6u);
  EXPECT_EQ(all[3].utime - all[2].utime, kEpisodeGap);
  EXPECT_THAT(all[3].velocities[0], testing::FloatNear(1.0F, 1e-4F)) << "no slope over the gap";
}

TEST_F(Lerobot, AnEpisodeThatCannotBeUsedIsLeftOutUnlessAllAre) {
  RecordedBytes records;
  episode(records, 0, {0.0}, {0.1, 9, 0.5});
  end_episode(records);
  EXPECT_THAT(error_of([&] { import(records, logs()); }), HasSubstr("no picture of any camera"));
  EXPECT_FALSE(fs::exists(logs().log_of(0)));
  RecordedBytes two;
  episode(two, 0, {0.0}, {0.1, 9, 0.5});
  end_episode(two);
  episode(two, 1, {0.0}, {0.1, 9, 0.5});
  frame(two, 0);
  end_episode(two);
  const auto result = import(two, logs());
  EXPECT_EQ(result.logs.size(), 1u);
  EXPECT_THAT(result.episodes_left_out.first, AllOf(HasSubstr("episode 0"), HasSubstr("no picture")));
}

TEST_F(Lerobot, RecordsThatLieAreRefused) {
  RecordedBytes rows;
  rows.add(R"({"kind": "episode", "episode": 0, "rows": 100000000, "columns": 3})", RecordedBytes::numbers({1}));
  EXPECT_THAT(error_of([&] { import(rows, logs()); }), HasSubstr("8 bytes for"));
  RecordedBytes columns;
  columns.add(R"({"kind": "episode", "episode": 0, "rows": 1, "columns": 2})", RecordedBytes::numbers({1, 2, 3}));
  EXPECT_THAT(error_of([&] { import(columns, logs()); }), HasSubstr("1 rows of 2 readings, expected 3"));
}

TEST(LerobotEpisodes, AreNamedByNumbersAndRanges) {
  EXPECT_THAT(parse_episodes("all", 3), ElementsAre(0, 1, 2));
  EXPECT_THAT(parse_episodes("5,1-3,2", 6), ElementsAre(1, 2, 3, 5));
  for (const std::string wrong : {"", "6", "3-1", "1,", ",1", "1--2", "-1", "x", "1 2", "1-"}) {
    EXPECT_THAT(error_of([&] { parse_episodes(wrong, 6); }),
                AllOf(HasSubstr("--episodes " + wrong), HasSubstr("at most 5")))
        << wrong;
  }
}

TEST(LerobotOutputs, AreALogOrAFolder) {
  EXPECT_TRUE(LerobotOutput::of("a/all.lcmlog").one_log);
  EXPECT_FALSE(LerobotOutput::of("a/logs").one_log);
}

TEST_F(Lerobot, CamerasAreFoundByNameOrWhereThereIsOne) {
  auto set = Lerobot::set();
  EXPECT_THAT(set.cameras_of(to_), ElementsAre("observation.images.cam"));
  set.cameras = {"observation.images.wrist", "observation.images.head"};
  EXPECT_THAT(set.cameras_of(to_), ElementsAre("observation.images.head"));
  EXPECT_THAT(set.cameras_of(target("import: {cameras: {head: observation.images.wrist}}\n")),
              ElementsAre("observation.images.wrist"));
  EXPECT_THAT(error_of([&] { (void)set.cameras_of(target("", "top")); }),
              AllOf(HasSubstr("camera 'top'"), HasSubstr("observation.images.wrist, observation.images.head"),
                    HasSubstr("import: {cameras: {top: ")));
  EXPECT_THAT(error_of([&] { (void)set.cameras_of(target("import: {cameras: {head: nowhere}}\n")); }),
              HasSubstr("import.cameras.head is 'nowhere'"));
}

}  // namespace
}  // namespace bodyschema
