#include "bodyschema/simulator/simulator.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <set>

#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/random.hpp"
#include "simulator/icub_right.hpp"

namespace bodyschema::simulator {
namespace {

/// Whether the ray through a pixel's centre meets any triangle: the definition of a silhouette, by
/// Moeller and Trumbore's intersection, with the nominal robot's own kinematics.
class RayCaster {
 public:
  RayCaster(const Stage& stage, const Eigen::VectorXd& q, std::size_t camera) : camera_(stage.rig.cameras[camera]) {
    std::vector<std::string> links;
    for (const auto& mesh : stage.model->meshes()) links.push_back(mesh.link);
    links.push_back(camera_.link);
    ForwardKinematics kinematics(stage.model, links);
    std::vector<Pose> X_W(links.size());
    kinematics.compute(q, X_W);
    const Pose X_CW = X_W.back().inverse();
    for (std::size_t p = 0; p + 1 < links.size(); ++p) {
      const Pose X_CB = X_CW * X_W[p];
      const auto& mesh = stage.model->meshes()[p].mesh;
      for (const auto& t : mesh.triangles) {
        triangles_.push_back({X_CB * mesh.vertices[t[0]].cast<double>(), X_CB * mesh.vertices[t[1]].cast<double>(),
                              X_CB * mesh.vertices[t[2]].cast<double>()});
      }
    }
  }
  [[nodiscard]] bool hit(int u, int v) const {
    const Eigen::Vector3d ray = camera_.intrinsics.ray({u, v});
    for (const auto& [a, b, c] : triangles_) {
      const Eigen::Vector3d e1 = b - a;
      const Eigen::Vector3d e2 = c - a;
      const Eigen::Vector3d p = ray.cross(e2);
      const double det = e1.dot(p);
      if (std::abs(det) < 1e-14) continue;
      const double x = -a.dot(p) / det;
      if (x < 0.0 || x > 1.0) continue;
      const Eigen::Vector3d q = (-a).cross(e1);
      const double y = ray.dot(q) / det;
      if (y < 0.0 || x + y > 1.0) continue;
      if (e2.dot(q) / det > 0.02) return true;
    }
    return false;
  }

 private:
  struct Triangle {
    Eigen::Vector3d a, b, c;
  };
  CameraModel camera_;
  std::vector<Triangle> triangles_;
};

TEST(Simulator, SilhouettesAreWhatRaysMeet) {
  const auto& stage = icub_right();
  SimulationPlan plan;
  plan.seed = 3;
  plan.frames = 3;
  plan.output = Output::kSilhouettes;
  Random random(17, "pixels");
  int pixels = 0, wrong = 0, covered = 0;
  for (const auto& frame : run(stage.simulator(plan))) {
    for (std::size_t c = 0; c < 2; ++c) {
      const RayCaster rays(stage, frame.truth[c].q, c);
      const auto& mask = frame.cameras[c]->silhouette;
      for (int i = 0; i < 500; ++i) {
        const auto u = static_cast<int>(random.below(320));
        const auto v = static_cast<int>(random.below(240));
        ++pixels;
        covered += mask.at(u, v) ? 1 : 0;
        wrong += mask.at(u, v) != rays.hit(u, v) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(covered, 150);
  EXPECT_LE(wrong, 2) << "of " << pixels;  // a centre within rounding of an edge may go either way
}

TEST(Simulator, MasksAndCoverageAgree) {
  SimulationPlan plan;
  plan.frames = 4;
  plan.output = Output::kSilhouettes;
  for (const auto& frame : run(icub_right().simulator(plan))) {
    for (const auto& camera : frame.cameras) {
      double covered = 0.0;
      int contradictions = 0;
      for (int v = 0; v < 240; ++v) {
        for (int u = 0; u < 320; ++u) {
          const int share = camera->coverage[static_cast<std::size_t>(v * 320 + u)];
          covered += share / 255.0;
          if (share == 255 && !camera->silhouette.at(u, v)) ++contradictions;
          if (share == 0 && camera->silhouette.at(u, v)) ++contradictions;
        }
      }
      EXPECT_EQ(contradictions, 0);
      EXPECT_NEAR(covered, static_cast<double>(camera->silhouette.count()), 0.02 * covered);
    }
  }
}

TEST(Simulator, PicturesShowTheHandWhereTheSilhouetteIsAndTheRoomElsewhere) {
  auto stage = icub_right();
  for (const bool clutter : {false, true}) {
    stage.settings.clutter = clutter;
    SimulationPlan plan;
    plan.frames = 3;
    plan.seed = 5;
    Simulator simulator = stage.simulator(plan);
    const Image room = simulator.room(0);
    while (auto frame = simulator.next()) {
      const auto& camera = *frame->cameras[0];
      double square = 0.0, sum = 0.0, hand = 0.0;
      int outside = 0, inside = 0;
      for (int v = 2; v < 238; ++v) {
        for (int u = 2; u < 318; ++u) {
          bool near = false;  // blur mixes neighbours
          for (int dv = -1; dv <= 1; ++dv) {
            for (int du = -1; du <= 1; ++du)
              near |= camera.coverage[static_cast<std::size_t>((v + dv) * 320 + u + du)] > 0;
          }
          for (int k = 0; k < 3; ++k) {
            const double difference = camera.image.pixel(u, v)[k] - room.pixel(u, v)[k];
            // Near black and white the levels end.
            if (!near && room.pixel(u, v)[k] > 15 && room.pixel(u, v)[k] < 240) {
              sum += difference;
              square += difference * difference;
              ++outside;
            } else if (camera.coverage[static_cast<std::size_t>(v * 320 + u)] == 255) {
              hand += std::abs(difference);
              ++inside;
            }
          }
        }
      }
      EXPECT_NEAR(sum / outside, 0.0, 0.1);
      // Noise, and rounding of picture and room.
      EXPECT_NEAR(std::sqrt(square / outside), std::sqrt(2.5 * 2.5 + 2.0 / 12.0), 0.1);
      ASSERT_GT(inside, 3000);
      EXPECT_GT(hand / inside, 20.0);
    }
  }
}

TEST(Simulator, FingertipsLieOnTheirFingers) {
  const auto& stage = icub_right();
  SimulationPlan plan;
  plan.frames = 10;
  plan.output = Output::kSilhouettes;
  for (const auto& frame : run(stage.simulator(plan))) {
    for (std::size_t c = 0; c < 2; ++c) {
      for (std::size_t i = 0; i < frame.truth[c].fingertips_px.size(); ++i) {
        const Eigen::Vector2d& tip = frame.truth[c].fingertips_px[i];
        EXPECT_LT((tip - stage.rig.cameras[c].intrinsics.project(frame.truth[c].fingertips_C[i])).norm(), 1e-9);
        bool near = false;
        for (int dv = -3; dv <= 3; ++dv) {
          for (int du = -3; du <= 3; ++du) {
            const int u = static_cast<int>(std::lround(tip.x())) + du;
            const int v = static_cast<int>(std::lround(tip.y())) + dv;
            near |= u >= 0 && v >= 0 && u < 320 && v < 240 && frame.cameras[c]->silhouette.at(u, v);
          }
        }
        EXPECT_TRUE(near) << "tip " << i << " at " << tip.transpose();
      }
    }
  }
}

TEST(Simulator, EncodersAreTrueAnglesWithOffsetNoiseAndRounding) {
  const auto& stage = icub_right();
  auto plan = joints_only(9);
  plan.motion = Motion::kBabble;
  plan.seconds = 30.0;
  plan.offsets_deg = {{"r_elbow", 3.0}, {"r_wrist_pitch", -7.0}};
  Simulator simulator = stage.simulator(plan);
  const double step = 360.0 / 4096.0;
  double square = 0.0, off_grid = 0.0;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(stage.model->joint_count());
  int count = 0;
  Microseconds last = 0;
  while (auto frame = simulator.next()) {
    for (const auto& sample : frame->encoders) {
      if (last != 0) {
        EXPECT_EQ(sample.utime - last, 10'000);
      }
      last = sample.utime;
      const auto truth = simulator.robot().joints(seconds(sample.utime - simulator.settings().start_utime));
      for (Eigen::Index j = 0; j < sample.q.size(); ++j) {
        const double steps = degrees(sample.q[j]) / step;
        off_grid = std::max(off_grid, std::abs(steps - std::round(steps)));
      }
      for (const auto& name : stage.setup.estimated_joints) {
        const auto j = stage.joint(name);
        const auto offset = plan.offsets_deg.find(name);
        const double error =
            degrees(sample.q[j] - truth[j]) - (offset == plan.offsets_deg.end() ? 0.0 : offset->second);
        sum[j] += error;
        square += error * error;
      }
      ++count;
    }
  }
  EXPECT_GT(count, 2990);
  EXPECT_LT(off_grid, 1e-6);
  // Where an arm stands still the rounding does not average out, so the mean is near, not at, 0.
  for (const auto& name : stage.setup.estimated_joints) EXPECT_NEAR(sum[stage.joint(name)] / count, 0.0, 0.02) << name;
  const double expected = std::sqrt(0.02 * 0.02 + step * step / 12.0);
  EXPECT_NEAR(std::sqrt(square / count / 7.0), expected, 0.1 * expected);
}

TEST(Simulator, EncodersReachBeyondEveryPicture) {
  Simulator simulator = icub_right().simulator(joints_only());
  std::vector<JointSample> history;
  while (auto frame = simulator.next()) {
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    const auto observation = to_observation(*frame, history);
    for (std::size_t c = 0; c < 2; ++c) {
      ASSERT_TRUE(observation.cameras[c]);
      EXPECT_EQ(observation.cameras[c]->joints.utime, frame->cameras[c]->utime);
      EXPECT_LT(history.front().utime, frame->cameras[c]->utime);
      EXPECT_GT(history.back().utime, frame->cameras[c]->utime);
      EXPECT_LT((observation.cameras[c]->joints.q - frame->truth[c].q).cwiseAbs().maxCoeff(), radians(0.2));
    }
  }
}

class Reaches : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(Reaches, CrossTheViewFromLowerRightToUpperLeft) {
  const auto& stage = icub_right();
  auto plan = joints_only(GetParam());
  plan.frames = 100;
  const auto frames = run(stage.simulator(plan));
  ASSERT_EQ(frames.size(), 100u);
  const auto centre = [](const CameraTruth& truth) {
    Eigen::Vector3d sum = truth.X_CP.translation();
    for (const auto& tip : truth.fingertips_C) sum += tip;
    return Eigen::Vector3d(sum / (1.0 + static_cast<double>(truth.fingertips_C.size())));
  };
  int in_view = 0;
  for (const auto& frame : frames) {
    bool inside = true;
    for (const auto& truth : frame.truth) {
      for (const auto& tip : truth.fingertips_px) {
        inside &= tip.x() >= 0 && tip.y() >= 0 && tip.x() <= 319 && tip.y() <= 239;
      }
    }
    in_view += inside ? 1 : 0;
    const Eigen::Vector3d between = 0.5 * (frame.truth[0].X_WC.translation() + frame.truth[1].X_WC.translation());
    const double distance = (frame.truth[0].X_WC * centre(frame.truth[0]) - between).norm();
    EXPECT_GT(distance, 0.245);
    EXPECT_LT(distance, 0.455);
  }
  EXPECT_GE(in_view, 97);
  for (std::size_t c = 0; c < 2; ++c) {
    const auto from = stage.rig.cameras[c].intrinsics.project(centre(frames.front().truth[c]));
    const auto to = stage.rig.cameras[c].intrinsics.project(centre(frames.back().truth[c]));
    EXPECT_LT(to.x(), from.x() - 20.0);
    EXPECT_LT(to.y(), from.y() - 20.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, Reaches, ::testing::Range<std::uint64_t>(100, 112));

TEST(Simulator, StartsAndEndsDifferBySeed) {
  std::set<double> starts;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Simulator simulator = icub_right().simulator(joints_only(seed));
    starts.insert(simulator.robot().joints(0.0)[icub_right().joint("r_elbow")]);
  }
  EXPECT_EQ(starts.size(), 5u);
}

TEST(Simulator, BabblingVisitsItsFirstPosturesAgainStandsStillAndGoesBothWays) {
  const auto& stage = icub_right();
  auto plan = joints_only(2);
  plan.motion = Motion::kBabble;
  plan.seconds = 60.0;
  Simulator simulator = stage.simulator(plan);
  EXPECT_EQ(simulator.frame_count(), 1800);
  const auto& robot = simulator.robot();
  const double begin = robot.site().begin_s;
  const Eigen::VectorXd first = robot.joints(begin);
  double still = 0.0, longest = 0.0;
  std::vector<double> visits;
  bool forward = false, backward = false;
  Eigen::VectorXd before = first;
  const auto j = stage.joint("r_elbow");
  for (double t = 0.1; t < 60.0; t += 0.1) {
    const auto q = robot.joints(begin + t);
    still = (q - before).cwiseAbs().maxCoeff() < 1e-9 ? still + 0.1 : 0.0;
    longest = std::max(longest, still);
    if ((q - first).cwiseAbs().maxCoeff() < 1e-6 && (visits.empty() || t - visits.back() > 5.0)) visits.push_back(t);
    forward |= q[j] - before[j] > radians(1.0);
    backward |= q[j] - before[j] < -radians(1.0);
    before = q;
  }
  int visible = 0;
  while (auto frame = simulator.next()) {
    bool inside = true;
    for (const auto& tip : frame->truth[0].fingertips_px) {
      inside &= tip.x() > -5 && tip.y() > -5 && tip.x() < 325 && tip.y() < 245;
    }
    visible += inside ? 1 : 0;
  }
  EXPECT_GE(longest, 14.5);
  EXPECT_GE(visits.size(), 3u);
  EXPECT_GT(visits.back(), 40.0);
  EXPECT_GT(visible, 1700);
  EXPECT_TRUE(forward && backward);
}

TEST(Simulator, StandsStillInEveryPostureOfStopAndGo) {
  const auto& stage = icub_right();
  auto plan = joints_only(5);
  plan.motion = Motion::kPoses;
  plan.poses = 12;
  Simulator simulator = stage.simulator(plan);
  const auto& robot = simulator.robot();
  const double begin = robot.site().begin_s, end = robot.site().end_s;
  EXPECT_GT(end - begin, 11.0);
  EXPECT_LT(end - begin, 40.0);
  std::vector<Eigen::VectorXd> postures;
  double still_s = 0.0, together_s = 0.0;
  constexpr double kStep_s = 0.02;
  Eigen::VectorXd before = robot.joints(begin);
  for (double t = begin + kStep_s; t < end; t += kStep_s) {
    const auto q = robot.joints(t);
    const bool still = (q - before).cwiseAbs().maxCoeff() < 1e-9;
    still_s = still ? still_s + kStep_s : 0.0;
    together_s += still ? kStep_s : 0.0;
    if (still_s > 0.9 && (postures.empty() || (q - postures.back()).cwiseAbs().maxCoeff() > 1e-6))
      postures.push_back(q);
    before = q;
  }
  EXPECT_EQ(postures.size(), 12u);
  EXPECT_NEAR(together_s, 12.0, 0.8);
  MotionPlanner planner(stage.model, stage.setup, stage.rig, stage.settings.motion, 5);
  for (const auto& q : postures) EXPECT_TRUE(planner.view(q).whole_hand);
}

TEST(Simulator, IsTheSameForOneSeedAndAnyNumberOfThreads) {
  auto stage = icub_right();
  stage.settings.clutter = true;
  stage.settings.head_moves = true;
  SimulationPlan plan;
  plan.frames = 4;
  plan.seed = 11;
  plan.faults = {FaultSpec::parse("random_walk:joint=r_elbow,value=2"), FaultSpec::parse("silhouette_bias:value=0.7")};
  const auto one = run(stage.simulator(plan));
  plan.threads = 2;
  const auto two = run(stage.simulator(plan));
  plan.seed = 12;
  const auto other = run(stage.simulator(plan));
  for (std::size_t i = 0; i < one.size(); ++i) {
    for (std::size_t c = 0; c < 2; ++c) {
      EXPECT_TRUE(one[i].cameras[c]->image.data == two[i].cameras[c]->image.data);
      EXPECT_TRUE(one[i].cameras[c]->coverage == two[i].cameras[c]->coverage);
      EXPECT_EQ(one[i].cameras[c]->utime, two[i].cameras[c]->utime);
      EXPECT_FALSE(one[i].cameras[c]->image.data == other[i].cameras[c]->image.data);
    }
    for (std::size_t k = 0; k < one[i].encoders.size(); ++k) EXPECT_EQ(one[i].encoders[k].q, two[i].encoders[k].q);
  }
}

TEST(Simulator, ShowsTheEmptyRoomFirstAndThenTheArmComingIn) {
  auto stage = icub_right();
  stage.settings.background_frames = 6;
  for (const int entry : {0, 10}) {
    stage.settings.entry_frames = entry;
    SimulationPlan plan;
    plan.frames = 5;
    plan.output = Output::kSilhouettes;
    Simulator simulator = stage.simulator(plan);
    EXPECT_EQ(simulator.frame_count(), 11 + entry);
    EXPECT_EQ(simulator.first_motion_frame(), 6 + entry);
    Microseconds last = 0;
    int in_motion = 0;
    while (auto frame = simulator.next()) {
      EXPECT_GT(frame->utime, last + 25'000);
      last = frame->utime;
      const double share = frame->truth[0].visible_share + frame->truth[1].visible_share;
      if (frame->phase == Phase::kBackground) {
        EXPECT_EQ(share, 0.0);
      }
      if (frame->phase == Phase::kMotion) {
        EXPECT_GT(share, 0.03);
      }
      if (frame->index == 6 + entry - 1 && entry > 0) {
        EXPECT_GT(share, 0.01);
      }
      in_motion += frame->phase == Phase::kMotion ? 1 : 0;
    }
    EXPECT_EQ(in_motion, 5);
  }
}

TEST(Simulator, RestIsEmptyForManySeeds) {
  auto stage = icub_right();
  stage.settings.background_frames = 1;
  for (std::uint64_t seed = 1; seed <= 15; ++seed) {
    SimulationPlan plan;
    plan.seed = seed;
    plan.frames = 2;
    plan.output = Output::kSilhouettes;
    Simulator simulator = stage.simulator(plan);
    const auto frame = simulator.next();
    EXPECT_EQ(frame->truth[0].visible_share, 0.0) << seed;
    EXPECT_EQ(frame->truth[1].visible_share, 0.0) << seed;
  }
}

TEST(Simulator, DeadCamerasFrozenJointsAndMovingHeads) {
  auto stage = icub_right();
  auto plan = joints_only();
  plan.camera_dies = {1, 0.5};
  plan.frozen_joints = {"r_wrist_yaw"};
  stage.settings.head_moves = true;
  Simulator simulator = stage.simulator(plan);
  int right = 0;
  std::set<double> yaw, neck;
  while (auto frame = simulator.next()) {
    EXPECT_TRUE(frame->cameras[0]);
    right += frame->cameras[1] ? 1 : 0;
    yaw.insert(frame->truth[0].q[stage.joint("r_wrist_yaw")]);
    neck.insert(frame->truth[0].q[stage.joint("neck_yaw")]);
    EXPECT_EQ(frame->truth.size(), 2u);
  }
  EXPECT_NEAR(right, 15, 1);
  EXPECT_EQ(yaw.size(), 1u);
  EXPECT_GT(neck.size(), 10u);
  plan.frozen_joints = {"neck_yaw"};
  EXPECT_THROW((void)stage.simulator(plan), ConfigurationError);
}

TEST(Simulator, SaysWhenNoReachIsPossible) {
  auto stage = icub_right();
  stage.settings.motion.distance_min_m = 1.2;
  stage.settings.motion.distance_max_m = 1.3;
  try {
    (void)stage.simulator(joints_only());
    FAIL() << "a reach at 1.2 m with an arm of half that length";
  } catch (const DataError& e) {
    EXPECT_NE(std::string(e.what()).find("1.20 to 1.30 m; this robot's hand is best seen at 0."), std::string::npos)
        << e.what();
  }
}

/// A robot of one's own, with nothing said about where its hand may go.
TEST(Simulator, FindsWhereTheCamerasSeeTheHandWhenNotTold) {
  const auto configuration = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/arm7/robot.yaml");
  Stage stage;
  stage.setup = RobotSetup::from(configuration.section("robot"));
  stage.rig = StereoRig::from(configuration.section("cameras"));
  stage.model = stage.setup.load();
  const auto distances = [&](std::uint64_t seed) {
    const MotionPlanner planner(stage.model, stage.setup, stage.rig, stage.settings.motion, seed);
    return std::pair(planner.settings().distance_min_m, planner.settings().distance_max_m);
  };
  const auto [nearest_m, farthest_m] = distances(1);
  EXPECT_GT(nearest_m, 0.3);  // the cameras stand 1.5 m from the shoulder
  EXPECT_LT(farthest_m, 1.6);
  EXPECT_GT(farthest_m - nearest_m, 0.2);
  EXPECT_EQ(distances(2), distances(1));
  for (const std::uint64_t seed : {1, 2, 3}) EXPECT_EQ(run(stage.simulator(joints_only(seed))).size(), 30u);

  stage.settings.motion.distance_max_m = 1.2;  // one of them given
  EXPECT_EQ(distances(1), std::pair(nearest_m, 1.2));

  for (auto& camera : stage.rig.cameras) camera.link = "camera_left";  // x along the line of sight
  stage.settings.motion = {};
  try {
    (void)distances(1);
    FAIL() << "cameras that look past the robot";
  } catch (const DataError& e) {
    EXPECT_NE(std::string(e.what()).find("hardly any posture of the arm shows its hand 'hand'"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace bodyschema::simulator
