// Everyday conditions, each against what its setting says.
#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "bodyschema/bus/message_sink.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/contact_sheet.hpp"
#include "bodyschema/simulator/recording.hpp"
#include "bodyschema/simulator/things.hpp"
#include "simulator/scene_test_support.hpp"
#include "test_data.hpp"

namespace bodyschema::simulator {
namespace {

using ::testing::HasSubstr;

/// The robot stands still with its hand in view, or does what is given.
SimulationPlan standing(const Stage& stage, double seconds, std::uint64_t seed = 1) {
  MotionPlanner planner(stage.model, stage.setup, stage.rig, stage.settings.motion, seed);
  SimulationPlan plan;
  plan.seed = seed;
  plan.motion = Motion::kGiven;
  plan.given.emplace(planner.visible_posture());
  plan.given->hold(seconds);
  return plan;
}

/// From one posture to another in a time.
SimulationPlan moving(const Stage& stage, double seconds, std::uint64_t seed = 1) {
  MotionPlanner planner(stage.model, stage.setup, stage.rig, stage.settings.motion, seed);
  SimulationPlan plan;
  plan.seed = seed;
  plan.motion = Motion::kGiven;
  plan.given = planner.reach(seconds);
  return plan;
}

std::vector<PaintedPart> covers_of(const Stage& stage) {
  std::vector<PaintedPart> parts;
  for (const auto& link : stage.model->meshes()) parts.push_back({.mesh = link.mesh});
  return parts;
}

/// The things of a run, made anew beside it.
struct SceneOfRun {
  explicit SceneOfRun(const Stage& stage, const SimulationPlan& plan)
      : simulator(stage.simulator(plan)),
        usual(MotionPlanner(stage.model, stage.setup, stage.rig, stage.settings.motion, 1).usual_posture()),
        things(simulator.robot(), stage.setup, stage.rig, stage.settings, covers_of(stage), usual, plan.seed) {
    std::vector<std::string> links;
    for (const auto& mesh : stage.model->meshes()) links.push_back(mesh.link);
    links.push_back(stage.setup.hand_link);
    kinematics = std::make_unique<ForwardKinematics>(stage.model, links);
    X_W.resize(links.size());
    X_WT.resize(things.parts().size());
    hidden.resize(things.parts().size());
  }
  void at(double t_s) {
    kinematics->compute(simulator.robot().joints(t_s), X_W);
    Things::Placer(things).place(t_s, X_W.back(), X_WT, hidden);
  }
  [[nodiscard]] double begin_s() const { return simulator.robot().site().begin_s; }
  [[nodiscard]] double end_s() const { return simulator.robot().site().end_s; }

  Simulator simulator;
  Eigen::VectorXd usual;
  Things things;
  std::unique_ptr<ForwardKinematics> kinematics;
  std::vector<Pose> X_W, X_WT;
  std::vector<char> hidden;
};

SimulationPlan babble(double seconds, std::uint64_t seed = 1) {
  SimulationPlan plan;
  plan.seed = seed;
  plan.motion = Motion::kBabble;
  plan.seconds = seconds;
  return plan;
}

// ---- Scenes by name

TEST(Scenes, AreSettingsByName) {
  // Both ways in give the same pictures, and each scene shows.
  const auto file = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml";
  auto plan = babble(8.0, 3);
  const auto last_frame = [&](SimulatorSettings settings) {
    settings.background_frames = settings.entry_frames = 0;
    settings.camera_rate_hz = 1.5;
    Simulator simulator(icub_right().model, icub_right().setup, icub_right().rig, settings, plan);
    std::vector<SimulatedFrame> frames;
    while (auto frame = simulator.next()) frames.push_back(std::move(*frame));
    return frames;
  };
  const auto plain = last_frame(icub_right().settings);
  for (const auto& scene : scenes()) {
    SimulatorSettings applied = icub_right().settings;
    apply_scene(applied, scene.name);
    const auto configuration = Configuration::load(file, scene.overrides);
    const auto loaded = SimulatorSettings::from(configuration.section("simulator"));
    const auto a = last_frame(applied), b = last_frame(loaded);
    bool shows = false;
    for (std::size_t i = 0; i < a.size(); ++i) {
      EXPECT_TRUE(a[i].cameras[0]->image.data == b[i].cameras[0]->image.data) << scene.name;
      shows |= difference(a[i].cameras[0]->image, plain[i].cameras[0]->image) > 0.03;
    }
    EXPECT_EQ(shows, scene.name != "plain" && scene.name != "object_part") << scene.name;
  }
}

TEST(Scenes, NamesTheNearest) {
  SimulatorSettings settings;
  try {
    apply_scene(settings, "kichen");
    FAIL() << "a scene that is not there";
  } catch (const ConfigurationError& e) {
    EXPECT_THAT(e.what(), HasSubstr("unknown scene 'kichen'; did you mean 'kitchen'?"));
  }
}

TEST(Settings, NameWhatCannotBe) {
  const auto error = [](const std::string& assignment) {
    try {
      const auto c = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/simulator.yaml",
                                         {"simulator." + assignment});
      (void)SimulatorSettings::from(c.section("simulator"));
    } catch (const ConfigurationError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error("things.held=cup"), HasSubstr("none, box, bottle or stick"));
  EXPECT_THAT(error("things.person_every_s=-1"), HasSubstr("simulator.things.person_every_s"));
  EXPECT_THAT(error("cameras.jpeg_quality=101"), HasSubstr("simulator.cameras.jpeg_quality"));
  EXPECT_THAT(error("cameras.exposure_ms=long"), HasSubstr("simulator.cameras.exposure_ms"));
  EXPECT_THAT(error("light.looks=shiny"), HasSubstr("grey or covers"));
  EXPECT_THAT(error("light.drift=-2"), HasSubstr("simulator.light.drift"));
  EXPECT_THAT(error("room.background=garden"), HasSubstr("single_colour, clutter or kitchen"));
  EXPECT_THAT(error("motion.head=nod"), HasSubstr("still, moving or gaze"));
  EXPECT_THAT(error("silhouettes.noise_px=9"), HasSubstr("simulator.silhouettes.noise_px"));
  EXPECT_EQ(error("things.held=box"), "no error");
}

TEST(Kitchen, IsTheSameForOneSeedAndAnyNumberOfThreads) {
  auto stage = with_scene("kitchen");
  stage.settings.camera_rate_hz = 1.0;
  auto plan = babble(8.0, 5);
  const auto one = run(stage.simulator(plan));
  plan.threads = 2;
  const auto two = run(stage.simulator(plan));
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_TRUE(one[i].cameras[c]->image.data == two[i].cameras[c]->image.data);
      EXPECT_TRUE(one[i].cameras[c]->coverage == two[i].cameras[c]->coverage);
      EXPECT_EQ(one[i].truth[c].hidden_share, two[i].truth[c].hidden_share);
    }
  }
}

/// Rows put together from several moments, things in front and behind: of a robot that stands alone it is the picture
/// that is drawn at once.
TEST(Scene, ComposedFromSamplesIsTheSamePicture) {
  auto stage = clean_stage();
  const auto plan = standing(stage, 0.2);
  const auto plain = run(stage.simulator(plan));
  stage.settings.exposure_ms = 8.0;
  stage.settings.readout_ms = 20.0;
  const auto composed = run(stage.simulator(plan));
  for (std::size_t i = 0; i < plain.size(); ++i) {
    for (std::size_t c = 0; c < 2; ++c) {
      const auto &a = *plain[i].cameras[c], &b = *composed[i].cameras[c];
      EXPECT_TRUE(a.silhouette == b.silhouette);
      int most = 0, other = 0;
      for (std::size_t p = 0; p < a.image.data.size(); ++p)
        most = std::max(most, std::abs(a.image.data[p] - b.image.data[p]));
      for (std::size_t p = 0; p < a.coverage.size(); ++p)
        other = std::max(other, std::abs(a.coverage[p] - b.coverage[p]));
      EXPECT_LE(most, 1);
      EXPECT_LE(other, 1);
      EXPECT_NEAR(plain[i].truth[c].visible_share, composed[i].truth[c].visible_share, 1e-6);
    }
  }
}

// ---- Things

TEST(Held, MovesWithTheHandAndComesWhenItShould) {
  auto stage = icub_right();
  stage.settings.held.kind = HeldKind::kBottle;
  stage.settings.held.from_s = 2.0;
  stage.settings.camera_rate_hz = 5.0;
  auto plan = babble(4.0, 2);
  plan.output = Output::kSilhouettes;
  SceneOfRun scene(stage, plan);
  ASSERT_EQ(scene.things.parts().size(), 1u);
  scene.at(scene.begin_s());
  EXPECT_EQ(scene.hidden[0], 1);
  const Pose in_hand = scene.X_W.back().inverse() * scene.X_WT[0];
  for (double t = scene.begin_s() + 2.01; t < scene.end_s(); t += 0.3) {
    scene.at(t);
    EXPECT_EQ(scene.hidden[0], 0);
    EXPECT_LT((scene.X_W.back().inverse() * scene.X_WT[0]).matrix().isApprox(in_hand.matrix(), 1e-9) ? 0.0 : 1.0, 0.5);
  }
  EXPECT_LT(in_hand.translation().norm(), 0.15);  // within reach of the fingers

  auto empty_handed = stage;
  empty_handed.settings.held = {};
  const auto with = run(stage.simulator(plan)), without = run(empty_handed.simulator(plan));
  double hidden = 0.0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const bool held =
        with[i].truth[0].exposure_utime - stage.settings.start_utime >= microseconds(scene.begin_s() + 2.0);
    EXPECT_EQ(with[i].truth[0].holding, held);
    EXPECT_EQ(without[i].truth[0].holding, false);
    EXPECT_EQ(with[i].cameras[0]->coverage == without[i].cameras[0]->coverage, !held) << i;
    if (!held) {
      EXPECT_NEAR(with[i].truth[0].hidden_share, 0.0, 1e-6);
    }
    hidden = std::max(hidden, with[i].truth[0].hidden_share);
    for (std::size_t p = 0; p < with[i].cameras[0]->coverage.size(); ++p) {
      ASSERT_LE(with[i].cameras[0]->coverage[p], without[i].cameras[0]->coverage[p] + 1);
    }
  }
  EXPECT_GT(hidden, 0.05);
  EXPECT_LT(hidden, 0.9);
}

TEST(Held, AsAFaultIsARunsSecret) {
  const auto& stage = icub_right();
  auto plan = joints_only();
  plan.faults = {FaultSpec::parse("held:thing=stick,value=250,at=0.4")};
  plan.output = Output::kSilhouettes;
  const auto frames = run(stage.simulator(plan));
  EXPECT_FALSE(frames[5].truth[0].holding);
  EXPECT_TRUE(frames[20].truth[0].holding);
  EXPECT_GT(frames[20].truth[0].hidden_share, 0.005);
}

TEST(Held, IsAsLongAsItIsSaidToBe) {
  for (const auto kind : {HeldKind::kBox, HeldKind::kBottle, HeldKind::kStick}) {
    auto stage = icub_right();
    stage.settings.held.kind = kind;
    stage.settings.held.length_m = 0.18;
    SceneOfRun scene(stage, joints_only());
    Eigen::Vector3f low(1, 1, 1), high(-1, -1, -1);
    for (const auto& p : scene.things.parts()[0].mesh.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    EXPECT_NEAR((high - low).maxCoeff(), 0.18f, kind == HeldKind::kStick ? 0.02f : 0.002f);
  }
}

TEST(Table, LiesBelowAllThatTheArmPassesThroughAndNothingOnItIsTouched) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    auto stage = icub_right();
    stage.settings.table = true;
    SceneOfRun scene(stage, babble(20.0, seed));
    const auto& room = scene.things.room();
    const Pose X_KW = room.X_WK.inverse();
    EXPECT_GE(scene.things.parts().size(), 4u) << "a table with nothing on it";
    int over = 0;
    for (double t = scene.begin_s(); t < scene.end_s(); t += 0.13) {
      scene.at(t);
      for (std::size_t p = 0; p < stage.model->meshes().size(); ++p) {
        const auto& vertices = stage.model->meshes()[p].mesh.vertices;
        for (std::size_t i = 0; i < vertices.size(); i += 5) {
          const Eigen::Vector3d point_W = scene.X_W[p] * vertices[i].cast<double>();
          const Eigen::Vector3d point = X_KW * point_W;
          if (point.x() > room.table_near_x && std::abs(point.y()) < room.table_half_width) {
            ++over;
            ASSERT_GT(point.z(), room.table_z) << stage.model->meshes()[p].link;
          }
          for (std::size_t thing = 1; thing < scene.things.parts().size(); ++thing) {
            // Within its bounding cylinder?
            const Eigen::Vector3d in_thing = scene.X_WT[thing].inverse() * point_W;
            double radius = 0.0, height = 0.0;
            for (const auto& q : scene.things.parts()[thing].mesh.vertices) {
              radius = std::max(radius, static_cast<double>(q.head<2>().norm()));
              height = std::max(height, static_cast<double>(q.z()));
            }
            ASSERT_FALSE(in_thing.head<2>().norm() < radius && in_thing.z() < height) << "thing " << thing;
          }
        }
      }
    }
    EXPECT_GT(over, 100) << "an arm that is never over the table";
  }
}

TEST(SecondArm, IsAMirrorImageThatNeverTouchesTheFirst) {
  for (const auto& [robot, seed] : {std::pair{"icub_right", 6}, {"icub_right", 7}, {"arm7", 4}, {"arm7", 5}}) {
    Stage stage;
    const auto c = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/" + robot + "/simulator.yaml");
    stage.setup = RobotSetup::from(c.section("robot"));
    stage.rig = StereoRig::from(c.section("cameras"));
    stage.settings = SimulatorSettings::from(c.section("simulator"));
    stage.settings.background_frames = stage.settings.entry_frames = 0;
    stage.settings.second_arm = true;
    stage.model = stage.setup.load();
    SceneOfRun scene(stage, babble(16.0, static_cast<std::uint64_t>(seed)));
    const std::size_t parts = stage.model->meshes().size();
    ASSERT_EQ(scene.things.parts().size(), parts);
    bool moved = false;
    Pose before = Pose::Identity();
    for (double t = scene.begin_s(); t < scene.end_s(); t += 0.4) {
      scene.at(t);
      double nearest = 1.0;
      for (std::size_t p = 0; p < parts; ++p) {
        EXPECT_NEAR(scene.X_WT[p].linear().determinant(), 1.0, 1e-9);
        // What is a right hand's cover is a left hand's.
        const auto& vertices = scene.things.parts()[p].mesh.vertices;
        for (std::size_t i = 0; i < vertices.size(); i += 9) {
          const Eigen::Vector3d point = scene.X_WT[p] * vertices[i].cast<double>();
          for (std::size_t other = 0; other < parts; ++other) {
            const auto& own = stage.model->meshes()[other].mesh.vertices;
            for (std::size_t k = 0; k < own.size(); k += 29) {
              nearest = std::min(nearest, (scene.X_W[other] * own[k].cast<double>() - point).norm());
            }
          }
        }
      }
      EXPECT_GT(nearest, 0.005) << robot << ", seed " << seed << ", at " << t;
      moved |= t > scene.begin_s() && !before.isApprox(scene.X_WT[0], 1e-6);
      before = scene.X_WT[0];
    }
    // Its shoulder is as far to the left as the other's is to the right, or beside it.
    EXPECT_TRUE(moved || robot == std::string("icub_right"));
  }
}

TEST(Person, CrossesWhenItIsTimeAndHides) {
  auto stage = icub_right();
  stage.settings.person_every_s = 6.0;
  stage.settings.person_first_s = 2.0;
  stage.settings.person_stays_s = 2.0;
  stage.settings.camera_rate_hz = 5.0;
  auto plan = babble(16.0, 3);
  plan.output = Output::kSilhouettes;
  SceneOfRun scene(stage, plan);
  double hidden = 0.0;
  int present = 0;
  while (auto frame = scene.simulator.next()) {
    const double t = seconds(frame->truth[0].exposure_utime - stage.settings.start_utime) - scene.begin_s();
    const double phase = std::fmod(t - 2.0 + 6.0, 6.0);
    const bool now = t > 2.0 && phase < 2.0;
    scene.at(t + scene.begin_s());
    EXPECT_EQ(scene.hidden[0] == 0, now) << t;
    present += now ? 1 : 0;
    if (!now) {
      EXPECT_NEAR(frame->truth[0].hidden_share, 0.0, 1e-6) << t;
    }
    hidden = std::max(hidden, frame->truth[0].hidden_share);
  }
  EXPECT_GE(present, 20);
  EXPECT_GT(hidden, 0.2);
}

// ---- Paint and light

TEST(Looks, CoversAreWhiteGlossyAndHaveColouredFingertips) {
  auto stage = clean_stage();
  const auto plan = standing(stage, 0.1, 2);
  const auto grey = run(stage.simulator(plan));
  stage.settings.looks = Looks::kCovers;
  stage.settings.gloss = 0.0;
  const auto mat = run(stage.simulator(plan));
  stage.settings.gloss = 0.8;
  const auto glossy = run(stage.simulator(plan));
  const auto& seen = grey[0].cameras[0]->coverage;
  const auto saturated = [&](const SimulatedFrame& frame) {
    int count = 0;
    for (std::size_t p = 0; p < seen.size(); ++p) {
      if (seen[p] < 255) continue;
      const auto* rgb = frame.cameras[0]->image.data.data() + 3 * p;
      const auto [low, high] = std::minmax({rgb[0], rgb[1], rgb[2]});
      count += high > 40 && low < 0.55 * high ? 1 : 0;
    }
    return count;
  };
  EXPECT_EQ(saturated(grey[0]), 0);
  EXPECT_GT(saturated(mat[0]), 60);  // fingertips
  int brighter = 0, darker = 0, elsewhere = 0, white = 0, dark = 0;
  for (std::size_t p = 0; p < seen.size(); ++p) {
    const int before = mat[0].cameras[0]->image.data[3 * p], after = glossy[0].cameras[0]->image.data[3 * p];
    if (seen[p] == 255) {
      brighter += after > before + 30 ? 1 : 0;
      darker += after < before - 1 ? 1 : 0;
      white += before > 150 ? 1 : 0;
      dark += before < 50 ? 1 : 0;
    }
    elsewhere += seen[p] == 0 && std::abs(after - before) > 30 ? 1 : 0;
  }
  EXPECT_GT(brighter, 20);  // highlights, on the robot alone
  EXPECT_EQ(darker, 0);
  EXPECT_EQ(elsewhere, 0);
  EXPECT_GT(white, 1000);
  EXPECT_GT(dark, 150);
}

TEST(Shadows, FallOnTheTableAndOnlyDarken) {
  auto stage = clean_stage();
  stage.settings.table = true;
  const auto plan = standing(stage, 0.1, 3);
  const auto without = run(stage.simulator(plan));
  stage.settings.shadows = true;
  const auto with = run(stage.simulator(plan));
  const auto &a = *without[0].cameras[0], &b = *with[0].cameras[0];
  int shaded = 0, brighter = 0;
  for (std::size_t p = 0; p < a.coverage.size(); ++p) {
    const int change = b.image.data[3 * p + 1] - a.image.data[3 * p + 1];
    brighter += change > 1 ? 1 : 0;
    if (a.coverage[p] == 0) shaded += change < -20 ? 1 : 0;
  }
  EXPECT_EQ(brighter, 0);
  EXPECT_GT(shaded, 2000);
  EXPECT_TRUE(a.coverage == b.coverage);
}

TEST(Light, DriftsInLevelAndColourOverTheMotion) {
  auto stage = clean_stage();
  stage.settings.camera_rate_hz = 5.0;
  auto plan = standing(stage, 4.0);
  stage.settings.light_drift = -0.3;
  stage.settings.colour_drift = 0.1;
  const auto frames = run(stage.simulator(plan));
  const auto level = [&](std::size_t frame, int channel) {
    return mean_level(frames[frame].cameras[0]->image, channel);
  };
  const std::size_t last = frames.size() - 1;
  EXPECT_NEAR(level(last, 1) / level(0, 1), 0.7, 0.01);
  EXPECT_NEAR(level(last / 2, 1) / level(0, 1), 0.85, 0.01);
  EXPECT_NEAR(level(last, 0) / level(0, 0), 0.7 * 1.1, 0.012);
  EXPECT_NEAR(level(last, 2) / level(0, 2), 0.7 * 0.9, 0.012);
}

TEST(Light, FlickersFromPictureToPicture) {
  auto stage = clean_stage();
  stage.settings.flicker = 0.03;
  const auto plan = standing(stage, 5.0);
  std::vector<double> left, right;
  for (const auto& frame : run(stage.simulator(plan))) {
    left.push_back(mean_level(frame.cameras[0]->image));
    right.push_back(mean_level(frame.cameras[1]->image));
  }
  double sum = 0.0, square = 0.0, after = 0.0;
  for (const double x : left) sum += x / static_cast<double>(left.size());
  for (std::size_t i = 0; i < left.size(); ++i) {
    square += (left[i] - sum) * (left[i] - sum) / static_cast<double>(left.size());
    if (i > 0) after += (left[i] - sum) * (left[i - 1] - sum) / static_cast<double>(left.size());
  }
  EXPECT_NEAR(std::sqrt(square) / sum, 0.03, 0.005);
  EXPECT_NEAR(after / square, 0.0, 0.25);
  EXPECT_NE(left[3] / left[4], right[3] / right[4]);
}

TEST(Light, ALampThatSwingsMakesBandsInARollingPicture) {
  auto stage = clean_stage();
  stage.settings.flicker = 0.1;
  stage.settings.flicker_hz = 100.0;
  stage.settings.readout_ms = 20.0;
  stage.settings.exposure_ms = 2.0;
  stage.settings.background_unevenness = 0.0;
  const auto plan = standing(stage, 0.1);
  const auto bands = [&] {
    // Of the leftmost columns, where no arm is: amplitude and period down the picture.
    const auto image = run(stage.simulator(plan))[0].cameras[0]->image;
    double c = 0.0, s = 0.0, mean = 0.0;
    for (int v = 0; v < 239; ++v) {  // two whole swings
      const double level = image.pixel(2, v)[1];
      const double phase = 2.0 * kPi * 100.0 * 0.020 * v / 239.0;
      c += level * std::cos(phase) / 119.5;
      s += level * std::sin(phase) / 119.5;
      mean += level / 239.0;
    }
    return std::hypot(c, s) / mean;
  };
  const double x = kPi * 100.0 * 0.002;
  EXPECT_NEAR(bands(), 0.1 * std::sin(x) / x, 0.005);
  stage.settings.exposure_ms = 10.0;  // one whole swing
  EXPECT_NEAR(bands(), 0.0, 0.003);
}

// ---- Cameras

TEST(Shutter, RowsAreExposedOneAfterTheOther) {
  auto stage = clean_stage();
  stage.settings.camera_rate_hz = 10.0;
  auto plan = moving(stage, 0.7, 5);
  plan.output = Output::kSilhouettes;
  stage.settings.readout_ms = 30.0;
  const auto rolling = run(stage.simulator(plan));
  auto instant = stage;
  instant.settings.readout_ms = 0.0;
  const std::size_t frame = 3;  // in the middle of the motion
  const auto still = run(instant.simulator(plan));
  EXPECT_EQ(rolling[frame].truth[0].exposure_utime, still[frame].truth[0].exposure_utime);
  double moved_px = 0.0;
  for (const int row : {70, 100, 120, 140, 170, 200, 230}) {
    // That row of a picture taken when the row was.
    auto then = plan;
    const double later_ms = 30.0 * (row / 239.0 - 0.5);
    then.faults = {FaultSpec::of("latency", "", -later_ms)};
    const auto other = run(instant.simulator(then));
    double off = 0.0, to_still = 0.0;
    for (int u = 0; u < 320; ++u) {
      const auto p = static_cast<std::size_t>(row * 320 + u);
      off += std::abs(rolling[frame].cameras[0]->coverage[p] - other[frame].cameras[0]->coverage[p]) / 255.0;
      to_still += std::abs(rolling[frame].cameras[0]->coverage[p] - still[frame].cameras[0]->coverage[p]) / 255.0;
    }
    EXPECT_LT(off, 1.5) << row;  // px, both sides of all that the row cuts
    moved_px = std::max(moved_px, to_still);
  }
  EXPECT_GT(moved_px, 4.0) << "too slow a motion to see anything";
}

TEST(Shutter, SmearsOverTheExposure) {
  auto stage = clean_stage();
  stage.settings.camera_rate_hz = 10.0;
  auto plan = moving(stage, 0.7, 5);
  plan.output = Output::kSilhouettes;
  stage.settings.exposure_ms = 24.0;
  const auto smeared = run(stage.simulator(plan));
  const std::size_t frame = 3;
  std::vector<double> mean(smeared[frame].cameras[0]->coverage.size(), 0.0), middle = mean;
  constexpr int kMoments = 24;
  for (int i = 0; i < kMoments; ++i) {
    auto instant = stage;
    instant.settings.exposure_ms = 0.0;
    auto then = plan;
    then.faults = {FaultSpec::of("latency", "", 24.0 * ((i + 0.5) / kMoments - 0.5))};
    const auto moment = run(instant.simulator(then));
    for (std::size_t p = 0; p < mean.size(); ++p) {
      mean[p] += moment[frame].cameras[0]->coverage[p] / 255.0 / kMoments;
      if (i == kMoments / 2) middle[p] = moment[frame].cameras[0]->coverage[p] / 255.0;
    }
  }
  double off = 0.0, smear = 0.0;
  for (std::size_t p = 0; p < mean.size(); ++p) {
    off += std::abs(smeared[frame].cameras[0]->coverage[p] / 255.0 - mean[p]);
    smear += std::abs(middle[p] - mean[p]);
  }
  EXPECT_GT(smear, 150.0);
  EXPECT_LT(off, 0.12 * smear);
}

TEST(Shutter, StampsAreOfTheMiddleOrOfTheFirstRow) {
  auto stage = clean_stage();
  auto plan = moving(stage, 0.5, 5);
  plan.output = Output::kSilhouettes;
  stage.settings.exposure_ms = 6.0;
  stage.settings.readout_ms = 14.0;
  stage.settings.stamp_first_row = true;
  const auto first = run(stage.simulator(plan));
  stage.settings.stamp_first_row = false;
  plan.faults = {FaultSpec::of("latency", "", -10.0)};  // exposed half of 6 + 14 ms later
  const auto middle = run(stage.simulator(plan));
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].truth[0].exposure_utime - first[i].cameras[0]->utime, 10'000);
    EXPECT_TRUE(first[i].cameras[0]->coverage == middle[i].cameras[0]->coverage);
  }
}

TEST(Lens, AForgottenOneBendsThePicturesAndNothingElse) {
  auto stage = clean_stage();
  auto plan = standing(stage, 0.1, 2);
  plan.output = Output::kSilhouettes;
  const auto straight = run(stage.simulator(plan));
  stage.settings.lens_k1 = -0.3;
  const auto bent = run(stage.simulator(plan));
  stage.settings.lens_k1 = 0.0;
  plan.faults = {FaultSpec::parse("distortion:value=-0.3")};
  const auto fault = run(stage.simulator(plan));
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_TRUE(bent[0].cameras[c]->coverage == fault[0].cameras[c]->coverage);
    EXPECT_FALSE(bent[0].cameras[c]->coverage == straight[0].cameras[c]->coverage);
    EXPECT_TRUE(bent[0].truth[c].X_CP.isApprox(straight[0].truth[c].X_CP));
    const auto& k = stage.rig.cameras[c].intrinsics;
    for (std::size_t i = 0; i < bent[0].truth[c].fingertips_px.size(); ++i) {
      const Eigen::Vector3d& p = bent[0].truth[c].fingertips_C[i];
      const Eigen::Vector2d n(p.x() / p.z(), p.y() / p.z());
      const Eigen::Vector2d expected = (1.0 - 0.3 * n.squaredNorm()) * n;
      EXPECT_LT(
          (bent[0].truth[c].fingertips_px[i] - Eigen::Vector2d(k.fx * expected.x() + k.cx, k.fy * expected.y() + k.cy))
              .norm(),
          1e-6);
    }
  }
}

class Caught final : public MessageSink {
 public:
  void publish(const std::string& channel, Microseconds, Bytes message) override {
    if (channel.find("CAMERA") == std::string::npos && channel.find("camera") == std::string::npos) return;
    messages.emplace_back(message.begin(), message.end());
  }
  std::vector<std::vector<std::uint8_t>> messages;
};

TEST(Jpeg, PicturesAreWhatItLeavesOfThemAndTravelAsTheyAre) {
  auto stage = icub_right();
  const auto plan = standing(stage, 0.1, 2);
  const auto raw = run(stage.simulator(plan));
  std::vector<double> off;
  for (const int quality : {95, 70, 30}) {
    stage.settings.jpeg_quality = quality;
    const auto frames = run(stage.simulator(plan));
    off.push_back(difference(raw[0].cameras[0]->image, frames[0].cameras[0]->image));
    FramePublisher publisher(stage.simulator(plan).joint_names(), {});
    Caught sink;
    publisher.publish(frames[0], sink);
    ASSERT_EQ(sink.messages.size(), 1u);
    ImagesView views;
    ASSERT_TRUE(decode(Bytes(sink.messages[0]), views).ok());
    ASSERT_EQ(views.images.size(), 2u);
    for (std::size_t c = 0; c < 2; ++c) {
      Image received;
      ASSERT_TRUE(unpack(views.images[c], received).ok());
      EXPECT_TRUE(received.data == frames[0].cameras[c]->image.data) << "compressed twice";
      EXPECT_LT(views.images[c].data.size(), received.data.size() / 3);
    }
  }
  EXPECT_GT(off[0], 0.3);
  EXPECT_GT(off[1], 1.1 * off[0]);
  EXPECT_GT(off[2], 1.1 * off[1]);
}

TEST(Masks, TravelInsteadOfPictures) {
  auto stage = icub_right();
  auto plan = standing(stage, 0.1, 2);
  plan.output = Output::kSilhouettes;
  stage.settings.outline_noise.sd_px = 0.5;
  const auto frames = run(stage.simulator(plan));
  FramePublisher::Options options;
  options.format = PictureFormat::kMasks;
  FramePublisher publisher(stage.simulator(plan).joint_names(), options);
  Caught sink;
  publisher.publish(frames[0], sink);
  ImagesView views;
  ASSERT_EQ(sink.messages.size(), 1u);
  ASSERT_TRUE(decode(Bytes(sink.messages[0]), views).ok());
  Image received;
  ASSERT_TRUE(unpack(views.images[1], received).ok());
  EXPECT_EQ(received.channels, 1);
  EXPECT_TRUE(received.data == frames[0].cameras[1]->coverage);
}

TEST(Masks, HaveTheOutlineNoiseOfTheSettings) {
  auto stage = icub_right();
  auto plan = standing(stage, 1.0, 2);
  plan.output = Output::kSilhouettes;
  const auto exact = run(stage.simulator(plan));
  for (const double sd_px : {0.3, 1.0}) {
    stage.settings.outline_noise = {sd_px, 12.0, 0.0};
    const auto noisy = run(stage.simulator(plan));
    double sum = 0.0, net = 0.0, edge = 0.0;
    for (std::size_t i = 0; i < noisy.size(); ++i) {
      const auto &a = *exact[i].cameras[0], &b = *noisy[i].cameras[0];
      for (int v = 0; v < 240; ++v) {
        for (int u = 0; u < 320; ++u) {
          const auto p = static_cast<std::size_t>(v * 320 + u);
          sum += std::abs(b.coverage[p] - a.coverage[p]) / 255.0;
          net += (b.coverage[p] - a.coverage[p]) / 255.0;
          edge += a.silhouette.at(u, v) &&
                          ((u < 319 && !a.silhouette.at(u + 1, v)) || (v < 239 && !a.silhouette.at(u, v + 1)) ||
                           (u > 0 && !a.silhouette.at(u - 1, v)) || (v > 0 && !a.silhouette.at(u, v - 1)))
                      ? 1.0
                      : 0.0;
          EXPECT_EQ(b.silhouette.at(u, v), b.coverage[p] >= 128) << u << " " << v;
        }
      }
    }
    // The mean distance of a Gaussian from its middle is 0.8 of its deviation; outlines are about as long as they
    // have pixels.
    EXPECT_NEAR(sum / edge, 0.8 * sd_px, 0.25 * sd_px);
    EXPECT_NEAR(net / edge, 0.0, 0.12 * sd_px);
  }
}

TEST(Cameras, OneIsEnoughAndAnySizeShowsTheSame) {
  auto stage = with_scene("kitchen");
  stage.settings.noise_levels = 0.0;
  stage.settings.blur_px = 0.0;
  stage.settings.jpeg_quality = 0;
  stage.settings.camera_rate_hz = 2.0;
  stage.rig.cameras.resize(1);
  MotionPlanner planner(stage.model, stage.setup, stage.rig, stage.settings.motion, 7, Head::kGaze);
  SimulationPlan plan;
  plan.motion = Motion::kGiven;
  plan.given = planner.babble(4.0);
  const auto small = run(stage.simulator(plan));
  auto& k = stage.rig.cameras[0].intrinsics;
  k = {1280, 960, 4.0 * k.fx, 4.0 * k.fy, 4.0 * k.cx + 1.5, 4.0 * k.cy + 1.5};
  const auto large = run(stage.simulator(plan));
  ASSERT_EQ(small.size(), large.size());
  for (std::size_t i = 0; i < small.size(); i += 3) {
    ASSERT_EQ(small[i].cameras.size(), 1u);
    const auto &a = *small[i].cameras[0], &b = *large[i].cameras[0];
    EXPECT_EQ(b.image.width, 1280);
    EXPECT_NEAR(small[i].truth[0].visible_share, large[i].truth[0].visible_share, 2e-3);
    EXPECT_NEAR(small[i].truth[0].hidden_share, large[i].truth[0].hidden_share, 1e-2);
    double off = 0.0;
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        double mean = 0.0;
        for (int y = 0; y < 4; ++y) {
          for (int x = 0; x < 4; ++x) mean += b.image.pixel(4 * u + x, 4 * v + y)[1] / 16.0;
        }
        off += std::abs(mean - a.image.pixel(u, v)[1]) / (320.0 * 240.0);
      }
    }
    EXPECT_LT(off, 3.0);
  }
}

// ---- Motion

double correlated(const std::vector<double>& a, const std::vector<double>& b) {
  const auto n = static_cast<double>(a.size());
  double ma = 0.0, mb = 0.0, aa = 0.0, bb = 0.0, ab = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ma += a[i] / n;
    mb += b[i] / n;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
    ab += (a[i] - ma) * (b[i] - mb);
  }
  return ab / std::sqrt(aa * bb);
}

TEST(Gaze, KeepsTheHandInTheMiddleWhileTheHeadTurns) {
  auto stage = icub_right();
  stage.settings.gaze = true;
  stage.settings.camera_rate_hz = 10.0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    auto plan = babble(30.0, seed);
    plan.output = Output::kJoints;
    double low = 10.0, high = -10.0;
    int middle = 0, frames = 0;
    std::vector<double> aside, turn;
    double off = 0.0;
    for (const auto& frame : run(stage.simulator(plan))) {
      Eigen::Vector2d centre = Eigen::Vector2d::Zero();
      for (const auto& tip : frame.truth[0].fingertips_px) centre += tip / 5.0;
      middle += std::abs(centre.x() - 160.0) < 110.0 && std::abs(centre.y() - 120.0) < 100.0 ? 1 : 0;
      ++frames;
      off += (centre - Eigen::Vector2d(160.0, 120.0)).norm();
      const Eigen::Vector3d hand_W =
          frame.truth[0].X_WC * frame.truth[0].fingertips_C[2] - frame.truth[0].X_WC.translation();
      aside.push_back(std::atan2(hand_W.y(), -hand_W.x()));
      turn.push_back(frame.truth[0].q[stage.joint("neck_yaw")]);
      const double yaw = frame.truth[0].q[stage.joint("neck_yaw")];
      low = std::min(low, yaw);
      high = std::max(high, yaw);
    }
    EXPECT_GT(middle, 0.95 * frames) << seed;
    EXPECT_LT(off / frames, 32.0) << seed;                       // px
    EXPECT_GT(std::abs(correlated(aside, turn)), 0.88) << seed;  // the head turns to where the hand is
    EXPECT_GT(degrees(high - low), 12.0) << seed;
  }
}

TEST(Gaze, NeedsAHeadThatTurns) {
  Stage stage;
  const auto c = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/arm7/simulator.yaml");
  stage.setup = RobotSetup::from(c.section("robot"));
  stage.rig = StereoRig::from(c.section("cameras"));
  stage.settings = SimulatorSettings::from(c.section("simulator"));
  stage.settings.gaze = true;
  stage.model = stage.setup.load();
  try {
    (void)stage.simulator(joints_only());
    FAIL() << "a gaze of cameras that stand still";
  } catch (const ConfigurationError& e) {
    EXPECT_THAT(e.what(), HasSubstr("simulator.motion.head is 'gaze'"));
  }
}

TEST(Babble, HoldsAsManyDistinctPosturesAsAskedFor) {
  auto stage = icub_right();
  stage.settings.motion.postures = 8;
  for (const double duration : {30.0, 12.0}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      auto plan = babble(duration, seed);
      plan.output = Output::kJoints;
      Simulator simulator = stage.simulator(plan);
      const auto& robot = simulator.robot();
      EXPECT_NEAR(robot.site().end_s - robot.site().begin_s, duration, 0.1);
      std::vector<Eigen::VectorXd> held;
      double still = 0.0;
      Eigen::VectorXd before = robot.joints(robot.site().begin_s);
      for (double t = robot.site().begin_s + 0.02; t < robot.site().end_s; t += 0.02) {
        const auto q = robot.joints(t);
        still = (q - before).cwiseAbs().maxCoeff() < 1e-9 ? still + 0.02 : 0.0;
        before = q;
        if (still < (duration > 20.0 ? 0.9 : 0.2)) continue;
        const bool known = std::any_of(held.begin(), held.end(), [&](const auto& other) {
          return (other - q).cwiseAbs().maxCoeff() < radians(8.0);
        });
        if (!known) held.push_back(q);
      }
      EXPECT_GE(held.size(), 8u) << duration << " s, seed " << seed;
    }
  }
}

// ---- Robots

TEST(Robots, TheOfficialIcubPlaysTheKitchen) {
  SKIP_WITHOUT("icub-models");
  Stage stage;
  const auto c = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_v2_5/simulator.yaml",
                                     scene("kitchen").overrides);
  stage.setup = RobotSetup::from(c.section("robot"));
  stage.rig = StereoRig::from(c.section("cameras"));
  stage.settings = SimulatorSettings::from(c.section("simulator"));
  stage.settings.camera_rate_hz = 1.0;
  stage.model = stage.setup.load();
  auto plan = babble(8.0, 2);
  plan.faults = {FaultSpec::parse("mesh_scale:part=forearm,value=2"), FaultSpec::parse("finger_posture:value=6")};
  Simulator simulator = stage.simulator(plan);
  ContactSheet sheet(simulator.first_motion_frame(), simulator.frame_count() - simulator.first_motion_frame(), 3, 2);
  int shown = 0, frames = 0;
  while (auto frame = simulator.next()) {
    sheet.add(*frame);
    if (frame->phase != Phase::kMotion) continue;
    ++frames;
    shown += frame->truth[0].visible_share > 0.02 ? 1 : 0;
  }
  EXPECT_EQ(frames, 8);
  EXPECT_GE(shown, 6);
  EXPECT_EQ(sheet.image().width, 3 * 322 - 2);
  EXPECT_EQ(sheet.image().height, 2 * 242 - 2);
  const FaultSite site(stage.model, stage.setup, stage.rig);
  EXPECT_EQ(site.covers_of("fingers").size(), 20u);
  EXPECT_EQ(site.covers_of("palm").size(), 1u);
}

}  // namespace
}  // namespace bodyschema::simulator
