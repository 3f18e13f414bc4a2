#include "bodyschema/simulator/fault.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>

#include "bodyschema/core/error.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/gravity_torques.hpp"
#include "robot/tilting_eyes.hpp"
#include "simulator/icub_right.hpp"

namespace bodyschema::simulator {
namespace {

using ::testing::HasSubstr;

SimulationPlan with(const std::string& fault, std::uint64_t seed = 1) {
  auto plan = joints_only(seed);
  plan.faults = {FaultSpec::parse(fault)};
  return plan;
}

/// A run with a fault beside the same run without.
struct Pair {
  std::vector<SimulatedFrame> good, bad;
  explicit Pair(SimulationPlan plan) {
    bad = run(icub_right().simulator(plan));
    plan.faults.clear();
    good = run(icub_right().simulator(plan));
  }
  /// Change of one true joint in deg.
  [[nodiscard]] double dq_deg(std::size_t frame, const std::string& joint) const {
    const auto j = icub_right().joint(joint);
    return degrees(bad[frame].truth[0].q[j] - good[frame].truth[0].q[j]);
  }
  [[nodiscard]] double largest(
      const std::function<double(const SimulatedFrame&, const SimulatedFrame&)>& change) const {
    double most = 0.0;
    for (std::size_t i = 0; i < good.size(); ++i) most = std::max(most, change(good[i], bad[i]));
    return most;
  }
};

TEST(FaultSpec, ReadsAndWritesItself) {
  const auto spec = FaultSpec::parse("slip:joint=r_elbow,value=-5,at=2.5");
  EXPECT_EQ(spec.name, "slip");
  EXPECT_EQ(spec.arguments.at("joint"), "r_elbow");
  EXPECT_DOUBLE_EQ(spec.value(), -5.0);
  EXPECT_EQ(FaultSpec::parse(spec.text()), spec);
  EXPECT_EQ(FaultSpec::parse(FaultSpec::of("latency", "", 0.1 + 0.2).text()).value(), 0.3);
}

TEST(FaultSpec, NamesWhatIsWrong) {
  const auto error = [](const std::string& text) {
    try {
      (void)icub_right().simulator(with(text));
    } catch (const ConfigurationError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_THAT(error("backlsh:joint=r_elbow,value=1"), HasSubstr("did you mean 'backlash'"));
  EXPECT_THAT(error("backlash:joint=r_elbo,value=1"), HasSubstr("did you mean 'r_elbow'"));
  EXPECT_THAT(error("backlash:jont=r_elbow,value=1"), HasSubstr("did you mean 'joint'"));
  EXPECT_THAT(error("backlash:joint=r_elbow"), HasSubstr("value is missing"));
  EXPECT_THAT(error("backlash:joint=r_elbow,value=-1"), HasSubstr("expected a number from 0 to 45"));
  EXPECT_THAT(error("backlash:joint=r_elbow,value=nan"), HasSubstr("value is 'nan'"));
  EXPECT_THAT(error("backlash:joint=r_elbow,value=1,value=2"), HasSubstr("given twice"));
  EXPECT_THAT(error("backlash:joint"), HasSubstr("expected name:key=value"));
  EXPECT_THAT(error("principal_point:source=middle,value=1"), HasSubstr("one of left, right, common, difference"));
}

/// What a fault touches: true joints at a stamp, encoders, hand pose at given true joints, the left
/// exposure, the pictures.
struct Touches {
  const char* fault;
  bool joints, encoders, pose, exposure, silhouette;
};
constexpr Touches kCatalogue[] = {
    {"joint_offset:joint=r_elbow,value=5", false, true, false, false, false},
    {"compliance:joint=r_shoulder_roll,value=0.5", true, false, false, false, true},
    {"payload:value=1.2", true, false, false, false, true},
    {"backlash:joint=r_elbow,value=1.5", true, false, false, false, true},
    {"encoder_gain:joint=r_elbow,value=3", false, true, false, false, false},
    {"eccentricity:joint=r_elbow,value=1.5", false, true, false, false, false},
    {"joint_coupling:joint=r_elbow,source=r_shoulder_yaw,value=4", true, false, false, false, true},
    {"latency:value=60", true, false, false, true, true},
    {"camera_skew:value=60", false, false, false, false, true},
    {"link_length:joint=r_wrist_prosup,value=5", false, false, true, false, true},
    {"axis_tilt:joint=r_elbow,value=2", false, false, true, false, true},
    {"axis_shift:joint=r_elbow,along=2,value=5", false, false, true, false, true},
    {"head_offset:joint=neck_pitch,value=-4", false, true, false, false, false},
    {"vergence:value=0.6", true, false, false, false, true},
    {"baseline:value=2", false, false, true, false, true},
    {"focal_length:value=3", false, false, false, false, true},
    {"principal_point:source=right,value=3", false, false, false, false, true},
    {"distortion:value=0.1", false, false, false, false, true},
    {"silhouette_bias:value=1", false, false, false, false, true},
    {"mesh_scale:value=3", false, false, false, false, true},
    {"hand_size:value=3", false, false, false, false, true},
    {"finger_posture:value=5", true, false, false, false, true},
    {"drift:joint=r_elbow,value=3", true, false, false, false, true},
    {"slip:joint=r_elbow,value=3,at=0", true, false, false, false, true},
    {"wobble:joint=r_elbow,value=2", true, false, false, false, true},
    {"velocity_lag:joint=r_elbow,value=100", true, false, false, false, true},
    {"acceleration_lag:joint=r_elbow,value=2", true, false, false, false, true},
    {"local_kink:joint=r_elbow,value=3", true, false, false, false, true},
    {"random_walk:joint=r_elbow,value=3", true, false, false, false, true},
    {"camera_rotation:source=left,axis=y,value=2", false, false, true, false, true},
    {"camera_position:axis=z,value=5", false, false, true, false, true},
    {"cover_dilation:part=hand,value=2", false, false, false, false, true},
    {"held:thing=box", false, false, false, false, true},
    {"stalled_encoder:joint=r_elbow,at=0.2", false, true, false, false, false},
    {"exposure_time:value=80", false, false, false, false, true},
    {"readout_time:value=80", false, false, false, false, true}};

class EveryFault : public ::testing::TestWithParam<Touches> {};

TEST_P(EveryFault, ChangesWhatItShouldAndNothingElse) {
  const Touches& expected = GetParam();
  const auto& stage = icub_right();
  auto plan = with(expected.fault);
  plan.output = Output::kSilhouettes;
  plan.frames = 12;
  const Pair pair(plan);
  const auto moved =
      pair.largest([](const auto& a, const auto& b) { return (a.truth[0].q - b.truth[0].q).cwiseAbs().maxCoeff(); });
  EXPECT_EQ(moved > 5e-5, expected.joints) << moved;
  const auto misread = pair.largest([](const auto& a, const auto& b) {
    double most = 0.0;
    for (std::size_t i = 0; i < a.encoders.size(); ++i) {
      most = std::max(most, (a.encoders[i].q - b.encoders[i].q).cwiseAbs().maxCoeff());
    }
    return most;
  });
  EXPECT_EQ(misread > 1e-5, expected.encoders) << misread;
  EXPECT_EQ(pair.largest([](const auto& a, const auto& b) {
    return std::abs(static_cast<double>(a.truth[0].exposure_utime - b.truth[0].exposure_utime));
  }) > 100,
            expected.exposure);
  // The pose that the nominal robot has at the true joints, against the true pose.
  ForwardKinematics nominal(stage.model, {stage.setup.hand_link, stage.rig.cameras[0].link, stage.rig.cameras[1].link});
  double pose_change = 0.0;
  for (const auto& frame : pair.bad) {
    std::vector<Pose> X_W(3);
    for (std::size_t c = 0; c < 2; ++c) {
      nominal.compute(frame.truth[c].q, X_W);
      const Pose X_CP = X_W[1 + c].inverse() * X_W[0];
      pose_change = std::max(pose_change, (X_CP.matrix() - frame.truth[c].X_CP.matrix()).cwiseAbs().maxCoeff());
    }
  }
  EXPECT_EQ(pose_change > 1e-6, expected.pose) << pose_change;
  EXPECT_EQ(pair.largest([](const auto& a, const auto& b) {
    return a.cameras[0]->coverage == b.cameras[0]->coverage && a.cameras[1]->coverage == b.cameras[1]->coverage ? 0.0
                                                                                                                : 1.0;
  }) > 0.5,
            expected.silhouette);
}

INSTANTIATE_TEST_SUITE_P(Catalogue, EveryFault, ::testing::ValuesIn(kCatalogue), [](const auto& row) {
  const std::string name = row.param.fault;
  return name.substr(0, name.find(':'));
});

TEST(Catalogue, EveryKindHasItsRowAbove) {
  std::set<std::string> rows, kinds;
  for (const auto& row : kCatalogue) rows.insert(FaultSpec::parse(row.fault).name);
  for (const auto& kind : fault_kinds()) kinds.insert(kind.name);
  EXPECT_EQ(rows, kinds);
}

TEST(Compliance, SagsByComplianceTimesTorqueAtTheTruePosture) {
  const auto& stage = icub_right();
  const auto j = stage.joint("r_shoulder_roll");
  const Pair pair(with("compliance:joint=r_shoulder_roll,value=0.8"));
  GravityTorques torques(stage.model);
  double most = 0.0;
  for (std::size_t i = 0; i < pair.good.size(); ++i) {
    const double sag = pair.dq_deg(i, "r_shoulder_roll");
    EXPECT_NEAR(sag, 0.8 * torques.compute(pair.bad[i].truth[0].q, stage.setup.gravity_W)[j], 2e-3);
    most = std::max(most, std::abs(sag));
  }
  EXPECT_GT(most, 0.1);
}

TEST(Payload, PullsTheHandDown) {
  const Pair pair(with("payload:value=1"));
  const auto& stage = icub_right();
  ForwardKinematics hand(stage.model, {stage.setup.hand_link});
  for (std::size_t i = 0; i < pair.good.size(); ++i) {
    Pose with_load, without;
    hand.compute(pair.bad[i].truth[0].q, {&with_load, 1});
    hand.compute(pair.good[i].truth[0].q, {&without, 1});
    EXPECT_LT(with_load.translation().z(), without.translation().z() - 1e-3);
  }
}

TEST(Backlash, TrailsByHalfItsWidthInBothDirections) {
  auto plan = with("backlash:joint=r_elbow,value=1");
  plan.motion = Motion::kBabble;
  plan.seconds = 20.0;
  const Pair pair(plan);
  const auto j = icub_right().joint("r_elbow");
  int up = 0, down = 0;
  for (std::size_t i = 6; i < pair.good.size(); ++i) {
    const double lag = pair.dq_deg(i, "r_elbow");
    EXPECT_LE(std::abs(lag), 0.5 + 1e-3);
    bool rises = true, falls = true;
    for (std::size_t k = i - 5; k <= i; ++k) {
      const double step = pair.good[k].truth[0].q[j] - pair.good[k - 1].truth[0].q[j];
      rises &= step > radians(0.4);
      falls &= step < -radians(0.4);
    }
    if (rises) {
      EXPECT_NEAR(lag, -0.5, 1e-3);
    }
    if (falls) {
      EXPECT_NEAR(lag, 0.5, 1e-3);
    }
    up += rises ? 1 : 0;
    down += falls ? 1 : 0;
  }
  EXPECT_GT(up, 10);
  EXPECT_GT(down, 10);
}

TEST(Backlash, OneWayMotionShowsOneSideOnly) {
  auto plan = with("backlash:joint=r_elbow,value=1");
  plan.motion = Motion::kOneWay;
  plan.seconds = 10.0;
  const Pair pair(plan);
  std::set<int> signs;
  for (std::size_t i = pair.good.size() / 3; i < pair.good.size(); ++i) {
    const double lag = pair.dq_deg(i, "r_elbow");
    if (std::abs(lag) > 0.4) signs.insert(lag > 0 ? 1 : -1);
  }
  EXPECT_EQ(signs.size(), 1u);
}

TEST(EncoderFaults, FollowTheirDefinitions) {
  const auto& stage = icub_right();
  const auto check = [&](const std::string& text, const std::string& joint, const std::function<double(double)>& dq) {
    auto plan = with(text);
    plan.offsets_deg = {{joint, 2.0}};
    const auto j = stage.joint(joint);
    Simulator simulator = stage.simulator(plan);
    double most = 0.0;
    for (double t = 0.0; t < simulator.duration_s(); t += 0.05) {
      Eigen::VectorXd encoder;
      simulator.robot().encoders(t, encoder);
      const double reading = encoder[j] - radians(2.0);
      const double change = simulator.robot().trajectory().position(t)[j] - reading;
      EXPECT_NEAR(change, dq(reading), 1e-9) << text;
      most = std::max(most, std::abs(change));
    }
    EXPECT_GT(most, radians(0.1)) << text;
  };
  check("encoder_gain:joint=r_elbow,value=-2", "r_elbow", [](double q) { return -0.02 * q; });
  check("encoder_gain:joint=r_elbow,value=2,reference_deg=10", "r_elbow",
        [](double q) { return 0.02 * (q - radians(10)); });
  check("eccentricity:joint=r_elbow,value=0.7,cosine_deg=-0.4", "r_elbow",
        [](double q) { return radians(0.7) * std::sin(q) - radians(0.4) * std::cos(q); });
  check("head_offset:joint=neck_roll,value=6", "neck_roll", [](double) { return radians(6.0); });
}

TEST(JointCoupling, TurnsWithItsSource) {
  const Pair pair(with("joint_coupling:joint=r_elbow,source=r_shoulder_yaw,value=-5"));
  for (std::size_t i = 0; i < pair.good.size(); ++i) {
    const double source = degrees(pair.good[i].truth[0].q[icub_right().joint("r_shoulder_yaw")]);
    EXPECT_NEAR(pair.dq_deg(i, "r_elbow"), -0.05 * source, 1e-3);
  }
}

TEST(Timing, LatencyShowsThePastAndSkewTheFutureInTheRightEye) {
  const auto check = [](const std::string& fault, double left_s, double right_s) {
    Simulator simulator = icub_right().simulator(with(fault));
    while (auto frame = simulator.next()) {
      for (std::size_t c = 0; c < 2; ++c) {
        const double shift = c == 0 ? left_s : right_s;
        EXPECT_NEAR(static_cast<double>(frame->truth[c].exposure_utime - frame->cameras[c]->utime), 1e6 * shift, 1.0);
        const double t = seconds(frame->cameras[c]->utime - simulator.settings().start_utime) + shift;
        EXPECT_LT((frame->truth[c].q - simulator.robot().trajectory().position(t)).norm(), 1e-4);
      }
    }
  };
  check("latency:value=80", -0.08, -0.08);
  check("camera_skew:value=25", 0.0, 0.025);
}

TEST(LinkLength, PutsElbowAndWristFurtherOut) {
  const auto& stage = icub_right();
  const auto distance = [&](const std::string& fault, const std::string& from, const std::string& to) {
    Simulator simulator = stage.simulator(with(fault));
    TrueKinematics kinematics(stage.model, simulator.robot().body(), {from, to});
    std::vector<Pose> X(2);
    kinematics.compute(simulator.robot().joints(0.3), X);
    return (X[1].translation() - X[0].translation()).norm();
  };
  const double upper = distance("link_length:joint=r_shoulder_yaw,value=0", "r_shoulder_2", "r_elbow_1");
  EXPECT_NEAR(distance("link_length:joint=r_shoulder_yaw,value=5", "r_shoulder_2", "r_elbow_1") - upper, 5e-3, 2e-4);
  EXPECT_NEAR(distance("link_length:joint=r_shoulder_yaw,value=-5", "r_shoulder_2", "r_elbow_1") - upper, -5e-3, 2e-4);
  const double fore = distance("link_length:joint=r_wrist_prosup,value=0", "r_elbow_1", "r_wrist_1");
  EXPECT_NEAR(distance("link_length:joint=r_wrist_prosup,value=5", "r_elbow_1", "r_wrist_1") - fore, 5e-3, 1e-4);
}

/// In the upper arm of the official iCub a sensor is fixed between two joints, and the arm hangs down its axis.
TEST(LinkLength, IsAwayFromTheRootAlsoBehindASensor) {
  const auto file =
      std::filesystem::temp_directory_path() / ("bodyschema_true_sensor_" + std::to_string(::getpid()) + ".urdf");
  std::ofstream(file)
      << R"(<robot name="two"><link name="root"/><link name="one"/><link name="sensor"/><link name="two"/>
    <joint name="a" type="revolute"><parent link="root"/><child link="one"/><axis xyz="0 0 1"/>
      <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
    <joint name="s" type="fixed"><parent link="one"/><child link="sensor"/><origin xyz="0 0 -0.1"/></joint>
    <joint name="b" type="revolute"><parent link="sensor"/><child link="two"/><axis xyz="0 1 0"/>
      <origin xyz="0 0 -0.2"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>)";
  const auto model = RobotModel::load({.urdf = file, .mesh_search_roots = {}, .rendered_links = {}});
  std::filesystem::remove(file);
  TrueBody longer;
  JointMisplacement& upper_arm = longer.misplacements.emplace_back();
  upper_arm.joint = 0;
  upper_arm.lengthening_m = 0.01;
  TrueKinematics kinematics(model, longer, {"two"});
  Pose X;
  kinematics.compute(Eigen::Vector2d(0.4, 0.2), {&X, 1});
  EXPECT_NEAR(X.translation().z(), -0.31, 1e-12);
}

TEST(AxisTilt, LeavesTheZeroPostureAndTurnsAboutATiltedAxis) {
  const auto& stage = icub_right();
  TrueBody tilted;
  const auto j = stage.joint("r_elbow");
  tilted.misplacements.push_back({.joint = j, .tilt_1_rad = radians(2.0)});
  TrueKinematics bent(stage.model, tilted, {"r_hand"});
  TrueKinematics straight(stage.model, TrueBody{}, {"r_hand"});
  Pose a, b;
  Eigen::VectorXd q = Eigen::VectorXd::Constant(stage.model->joint_count(), 0.3);
  q[j] = 0.0;
  bent.compute(q, {&a, 1});
  straight.compute(q, {&b, 1});
  EXPECT_LT((a.matrix() - b.matrix()).norm(), 1e-12);
  // The motion from 0 to 60 deg is a turn by 60 deg about an axis 2 deg off.
  const auto turn = [&](TrueKinematics& kinematics) {
    Pose from, to;
    q[j] = 0.0;
    kinematics.compute(q, {&from, 1});
    q[j] = radians(60.0);
    kinematics.compute(q, {&to, 1});
    return Eigen::AngleAxisd(Eigen::Matrix3d(to.linear() * from.linear().transpose()));
  };
  const auto with_tilt = turn(bent);
  const auto without = turn(straight);
  EXPECT_NEAR(with_tilt.angle(), radians(60.0), 1e-9);
  EXPECT_NEAR(degrees(std::acos(with_tilt.axis().dot(without.axis()))), 2.0, 1e-6);
}

TEST(AxisShift, MovesAllBeyondAcrossTheAxisAndAlongWithTheLinkThatCarriesIt) {
  const auto& stage = icub_right();
  const auto j = stage.joint("r_elbow");
  for (const int along : {1, 2}) {
    TrueBody body;
    body.misplacements.push_back(
        {.joint = j, .shift_1_m = along == 1 ? 0.01 : 0.0, .shift_2_m = along == 2 ? 0.01 : 0.0});
    TrueKinematics moved(stage.model, body, {"r_upper_arm", "r_elbow_1", "r_hand"});
    TrueKinematics nominal(stage.model, TrueBody{}, {"r_upper_arm", "r_elbow_1", "r_hand"});
    std::vector<Pose> a(3), b(3);
    Eigen::Vector3d first_P = Eigen::Vector3d::Zero();
    for (const double angle : {0.2, 0.9}) {
      const Eigen::VectorXd q = Eigen::VectorXd::Constant(stage.model->joint_count(), angle);
      moved.compute(q, a);
      nominal.compute(q, b);
      EXPECT_LT((a[0].matrix() - b[0].matrix()).norm(), 1e-12);
      EXPECT_LT((a[2].linear() - b[2].linear()).norm(), 1e-12);
      const Eigen::Vector3d shift_W = a[2].translation() - b[2].translation();
      EXPECT_LT((a[1].translation() - b[1].translation() - shift_W).norm(), 1e-12);
      EXPECT_NEAR(shift_W.norm(), 0.01, 1e-12);
      EXPECT_NEAR(shift_W.dot(b[1].linear().col(2)), 0.0, 1e-12);  // the elbow turns about its z axis
      const Eigen::Vector3d shift_P = b[0].linear().transpose() * shift_W;
      if (first_P.isZero()) first_P = shift_P;
      EXPECT_LT((shift_P - first_P).norm(), 1e-12);
    }
  }
}

TEST(TrueKinematics, SeveralMisplacementsComposeAlongTheChain) {
  // Lengthening the forearm moves the hand along the forearm of the arm as it is, tilted elbow and all.
  const auto& stage = icub_right();
  TrueBody tilted;
  tilted.misplacements.push_back({.joint = stage.joint("r_elbow"), .tilt_1_rad = radians(5.0)});
  TrueBody both = tilted;
  both.misplacements.insert(both.misplacements.begin(),
                            {.joint = stage.joint("r_wrist_prosup"), .lengthening_m = 0.01});
  TrueKinematics one(stage.model, tilted, {"r_hand", "r_elbow_1", "r_forearm"});
  TrueKinematics two(stage.model, both, {"r_hand", "r_elbow_1", "r_forearm"});
  std::vector<Pose> a(3), b(3);
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(stage.model->joint_count(), 0.6);
  one.compute(q, a);
  two.compute(q, b);
  EXPECT_LT((a[1].matrix() - b[1].matrix()).norm(), 1e-12);
  // The pronation turns about the forearm's z axis, which points back to the elbow.
  const Eigen::Vector3d along = -a[2].linear().col(2);
  EXPECT_LT((b[0].translation() - a[0].translation() - 0.01 * along).norm(), 1e-9);
  EXPECT_GT((b[0].translation() - b[1].translation()).norm(), (a[0].translation() - a[1].translation()).norm());
  EXPECT_LT((a[0].linear() - b[0].linear()).norm(), 1e-12);
}

TEST(Cameras, FaultsHaveTheStatedSigns) {
  const auto& stage = icub_right();
  const auto frames = [&](const std::string& fault) { return run(stage.simulator(with(fault))); };
  const auto nominal = run(stage.simulator(joints_only()));
  const auto wide = frames("baseline:value=2");
  const auto inwards = frames("vergence:value=1");
  const auto longer = frames("focal_length:value=2");
  const auto shifted = frames("principal_point:source=difference,axis=y,value=3");
  for (std::size_t i = 0; i < nominal.size(); ++i) {
    const auto eyes = [](const SimulatedFrame& f) {
      return (f.truth[1].X_WC.translation() - f.truth[0].X_WC.translation()).norm();
    };
    EXPECT_NEAR(eyes(wide[i]) - eyes(nominal[i]), 2e-3, 1e-6);
    // Optical axes that meet in front: left looks to the right of the right one.
    const Eigen::Vector3d left = inwards[i].truth[0].X_WC.linear().col(2);
    const Eigen::Vector3d right = inwards[i].truth[1].X_WC.linear().col(2);
    const Eigen::Vector3d to_right = inwards[i].truth[0].X_WC.linear().col(0);
    EXPECT_NEAR(degrees(std::acos(left.dot(right))), 1.0, 1e-6);
    EXPECT_GT((left - right).dot(to_right), 0.0);
    for (std::size_t c = 0; c < 2; ++c) {
      const Eigen::Vector2d middle(stage.rig.cameras[c].intrinsics.cx, stage.rig.cameras[c].intrinsics.cy);
      const Eigen::Vector2d tip = nominal[i].truth[c].fingertips_px[1] - middle;
      EXPECT_LT((longer[i].truth[c].fingertips_px[1] - middle - 1.02 * tip).norm(), 1e-6);
      EXPECT_NEAR(shifted[i].truth[c].fingertips_px[1].y() - middle.y() - tip.y(), c == 0 ? 1.5 : -1.5, 1e-6);
    }
  }
}

TEST(FaultSite, ThePanOfAnEyeThatTiltsByItselfTurnsItSideways) {
  auto [setup, rig] = test::tilting_eyes();
  using Names = std::vector<std::string>;
  for (const auto& listed :
       {Names{"neck", "l_pan", "l_tilt", "r_tilt", "r_pan"}, Names{"r_pan", "r_tilt", "l_tilt", "l_pan", "neck"}}) {
    setup.head_joints = listed;
    const auto model = std::shared_ptr<const RobotModel>(setup.load());
    const FaultSite site(model, setup, rig);
    ASSERT_TRUE(site.left_pan && site.right_pan);
    EXPECT_EQ(model->joints()[static_cast<std::size_t>(*site.left_pan)].name, "l_pan");
    EXPECT_EQ(model->joints()[static_cast<std::size_t>(*site.right_pan)].name, "r_pan");
    EXPECT_EQ(site.head, std::vector<Eigen::Index>{model->joint_index("neck")});
  }
}

/// The pose of the hand in a camera of a run with a fault, in that camera as it should be.
TEST(Cameras, TurnAndMoveInTheirOwnFramesOrTogetherAboutTheirMiddle) {
  const auto& stage = icub_right();
  auto plan = joints_only();
  plan.frames = 5;
  const auto good = run(stage.simulator(plan));
  const auto with_fault = [&](const std::string& fault) {
    auto other = plan;
    other.faults = {FaultSpec::parse(fault)};
    return run(stage.simulator(other));
  };
  const auto check = [&](const std::string& fault, std::size_t c, const Pose& X_CT) {
    const auto bad = with_fault(fault);
    for (std::size_t i = 0; i < good.size(); ++i) {
      const Pose expected = good[i].truth[c].X_WC * X_CT;
      EXPECT_LT((bad[i].truth[c].X_WC.matrix() - expected.matrix()).norm(), 1e-9) << fault << " camera " << c;
    }
  };
  const Eigen::AngleAxisd yaw(radians(1.5), Eigen::Vector3d::UnitY());
  check("camera_rotation:source=left,axis=y,value=1.5", 0, Pose(yaw));
  check("camera_rotation:source=left,axis=y,value=1.5", 1, Pose::Identity());
  check("camera_rotation:source=difference,axis=y,value=3", 1, Pose(yaw.inverse()));
  check("camera_position:source=right,axis=z,value=4", 1, Pose(Eigen::Translation3d(0, 0, 0.004)));
  check("camera_position:source=right,axis=z,value=4", 0, Pose::Identity());
  // Eyes that look ahead side by side: both are shifted alike, and turned about the middle between them.
  check("camera_position:source=common,axis=x,value=6", 0, Pose(Eigen::Translation3d(0.006, 0, 0)));
  check("camera_position:source=common,axis=x,value=6", 1, Pose(Eigen::Translation3d(0.006, 0, 0)));
  const double half = 0.5 * (good[0].truth[1].X_WC.translation() - good[0].truth[0].X_WC.translation()).norm();
  for (const std::size_t c : {0, 1}) {
    const Eigen::Translation3d to_middle(c == 0 ? half : -half, 0, 0);
    check("camera_rotation:axis=y,value=1.5", c, Pose(to_middle * yaw * to_middle.inverse()));
  }
  // They turn with the head: at other neck angles in the same way.
  auto moving = stage;
  moving.settings.head_moves = true;
  moving.settings.motion.head_motion_deg = 10.0;
  const auto straight = run(moving.simulator(plan));
  plan.faults = {FaultSpec::parse("camera_rotation:axis=z,value=2")};
  const auto turned = run(moving.simulator(plan));
  for (std::size_t i = 0; i < straight.size(); ++i) {
    const Eigen::Translation3d to_middle(half, 0, 0);
    const Eigen::AngleAxisd roll(radians(2.0), Eigen::Vector3d::UnitZ());
    const Pose expected = straight[i].truth[0].X_WC * Pose(to_middle * roll * to_middle.inverse());
    EXPECT_LT((turned[i].truth[0].X_WC.matrix() - expected.matrix()).norm(), 1e-9);
  }
}

TEST(Cameras, LensesOfOneCameraAlone) {
  const auto& stage = icub_right();
  const auto body = [&](const std::string& fault) { return stage.simulator(with(fault)).robot().body(); };
  const auto nominal = stage.rig.cameras[0].intrinsics;
  const auto longer = body("focal_length:source=right,value=2");
  EXPECT_DOUBLE_EQ(longer.cameras[0].intrinsics.fx, nominal.fx);
  EXPECT_DOUBLE_EQ(longer.cameras[1].intrinsics.fy, 1.02 * nominal.fy);
  const auto apart = body("focal_length:source=difference,value=2");
  EXPECT_DOUBLE_EQ(apart.cameras[0].intrinsics.fx, 1.01 * nominal.fx);
  EXPECT_DOUBLE_EQ(apart.cameras[1].intrinsics.fx, 0.99 * nominal.fx);
  const auto bent = body("distortion:source=left,coefficient=p2,value=0.01");
  EXPECT_EQ(bent.cameras[0].distortion, (std::array<double, 5>{0, 0, 0, 0.01, 0}));
  EXPECT_EQ(bent.cameras[1].distortion, (std::array<double, 5>{}));
}

/// How large each cover is, as the robot was built.
TEST(Cameras, ARigWithoutThatCameraSaysSo) {
  auto stage = icub_right();
  stage.rig.cameras.resize(1);
  for (const char* fault : {"focal_length:source=right,value=2", "camera_rotation:source=difference,value=2"}) {
    EXPECT_THROW((void)stage.simulator(with(fault)), ConfigurationError) << fault;
  }
  EXPECT_NO_THROW((void)stage.simulator(with("camera_rotation:source=left,value=2")));
}

TEST(Covers, ScaleAndThicknessBefallOnePartAlone) {
  const auto& stage = icub_right();
  const auto covers = [&](const std::string& fault) { return stage.simulator(with(fault)).robot().body().covers; };
  const auto scaled = [&](const std::string& part) {
    std::set<std::string> links;
    const auto list = covers("mesh_scale:value=3,part=" + part);
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].scale != 1.0) {
        EXPECT_DOUBLE_EQ(list[i].scale, 1.03);
        links.insert(stage.model->meshes()[i].link);
      }
    }
    return links;
  };
  using Links = std::set<std::string>;
  EXPECT_EQ(scaled("palm"), (Links{"r_hand", "r_wrist_2"}));  // rigid with it
  EXPECT_EQ(scaled("fingers").size(), 16u);
  EXPECT_EQ(scaled("fingers").count("r_thumb_4"), 1u);
  EXPECT_EQ(scaled("hand").size(), 18u);
  EXPECT_EQ(scaled("forearm"), (Links{"r_elbow_1", "r_forearm"}));
  EXPECT_EQ(scaled("upper_arm"), (Links{"r_upper_arm"}));
  EXPECT_EQ(scaled("r_forearm+r_wrist_1"), (Links{"r_forearm", "r_wrist_1"}));
  EXPECT_EQ(scaled("all").size(), stage.model->meshes().size());
  const auto thick = covers("cover_dilation:value=2.5,part=r_forearm");
  for (std::size_t i = 0; i < thick.size(); ++i) {
    EXPECT_DOUBLE_EQ(thick[i].dilation_m, stage.model->meshes()[i].link == "r_forearm" ? 0.0025 : 0.0);
  }
  try {
    (void)covers("mesh_scale:value=3,part=r_forarm");
    FAIL() << "a cover that is not there";
  } catch (const ConfigurationError& e) {
    EXPECT_THAT(e.what(), HasSubstr("part is 'r_forarm'"));
    EXPECT_THAT(e.what(), HasSubstr("did you mean 'r_forearm'"));
  }
}

/// In pictures: of a forearm 2 mm thicker, its outline moves by that much, and no other.
TEST(Covers, AThickerForearmMovesItsOwnOutlineOnly) {
  const auto& stage = icub_right();
  auto plan = with("cover_dilation:value=3,part=forearm");
  plan.output = Output::kSilhouettes;
  plan.frames = 8;
  const Pair pair(plan);
  const auto& k = stage.rig.cameras[0].intrinsics;
  double near_tips = 0.0, more = 0.0;
  for (std::size_t i = 0; i < pair.good.size(); ++i) {
    const auto& before = *pair.good[i].cameras[0];
    const auto& after = *pair.bad[i].cameras[0];
    for (int v = 0; v < k.height; ++v) {
      for (int u = 0; u < k.width; ++u) {
        const auto p = static_cast<std::size_t>(v * k.width + u);
        const double change = (after.coverage[p] - before.coverage[p]) / 255.0;
        more += change;
        for (const auto& tip : pair.good[i].truth[0].fingertips_px) {
          if ((tip - Eigen::Vector2d(u, v)).norm() < 6.0) near_tips += std::abs(change);
        }
      }
    }
  }
  EXPECT_GT(more, 50.0);
  EXPECT_EQ(near_tips, 0.0);
}

TEST(StalledEncoder, RepeatsItselfToTheBitAndComesBack) {
  const auto& stage = icub_right();
  auto plan = with("stalled_encoder:joint=r_elbow,at=0.3,value=0.4");
  plan.frames = 40;
  const Pair pair(plan);
  Simulator simulator = stage.simulator(plan);
  const double begin = simulator.robot().site().begin_s;
  const auto j = stage.joint("r_elbow");
  std::set<double> readings;
  int stalled = 0, others = 0;
  for (std::size_t i = 0; i < pair.bad.size(); ++i) {
    for (std::size_t k = 0; k < pair.bad[i].encoders.size(); ++k) {
      const auto& good = pair.good[i].encoders[k];
      const auto& bad = pair.bad[i].encoders[k];
      const double t = seconds(good.utime - simulator.settings().start_utime) - begin;
      // Other joints, and this one at other times, read the same noise as ever.
      for (Eigen::Index other = 0; other < good.q.size(); ++other) {
        if (other == j && t > 0.29 && t < 0.71) continue;
        others += good.q[other] != bad.q[other] ? 1 : 0;
      }
      if (t < 0.301 || t > 0.699) continue;
      readings.insert(bad.q[j]);
      ++stalled;
      if (t > 0.36) {
        EXPECT_EQ(bad.qdot[j], 0.0);
      }
    }
  }
  EXPECT_GE(stalled, 38);
  EXPECT_EQ(readings.size(), 1u);
  EXPECT_EQ(others, 0);
}

TEST(AxisShift, AlongAnyDirectionOfTheLinkAndAlongItsBone) {
  const auto& stage = icub_right();
  const auto move = [&](const std::string& along) {
    const Pair pair(with("axis_shift:joint=r_elbow,value=7,along=" + along));
    ForwardKinematics nominal(stage.model, {"r_upper_arm", stage.rig.cameras[0].link});
    std::vector<Pose> X_W(2);
    nominal.compute(pair.good[4].truth[0].q, X_W);
    const Eigen::Vector3d shift_W = pair.good[4].truth[0].X_WC.linear() * (pair.bad[4].truth[0].X_CP.translation() -
                                                                           pair.good[4].truth[0].X_CP.translation());
    return Eigen::Vector3d(X_W[0].linear().transpose() * shift_W);  // in the link that carries the elbow
  };
  EXPECT_LT((move("x") - Eigen::Vector3d(0.007, 0, 0)).norm(), 1e-9);
  EXPECT_LT((move("y") - Eigen::Vector3d(0, 0.007, 0)).norm(), 1e-9);
  EXPECT_LT((move("z") - Eigen::Vector3d(0, 0, 0.007)).norm(), 1e-9);
  const Eigen::Vector3d bone = move("bone");
  EXPECT_NEAR(bone.norm(), 0.007, 1e-9);
  // Away from the shoulder: the distance between shoulder and elbow grows by all of it.
  ForwardKinematics kinematics(stage.model, {"r_upper_arm", "r_elbow_1"});
  std::vector<Pose> X_W(2);
  kinematics.compute(Eigen::VectorXd::Zero(stage.model->joint_count()), X_W);
  const Eigen::Vector3d shoulder = kinematics.joint_axis(stage.joint("r_shoulder_yaw")).point_W;
  const Eigen::Vector3d elbow = kinematics.joint_axis(stage.joint("r_elbow")).point_W;
  const Eigen::Vector3d longer = elbow + X_W[0].linear() * bone;
  EXPECT_NEAR((longer - shoulder).norm() - (elbow - shoulder).norm(), 0.007, 1e-9);
}

TEST(Slip, SeveralJointsAndTimesAddUp) {
  auto plan = with("slip:joint=r_elbow,value=3,at=0.2");
  plan.faults.push_back(FaultSpec::parse("slip:joint=r_elbow,value=-1,at=0.6"));
  plan.faults.push_back(FaultSpec::parse("slip:joint=r_wrist_yaw,value=4,at=0.4"));
  const Pair pair(plan);
  for (const auto& [t_s, elbow, wrist] :
       {std::tuple{0.1, 0.0, 0.0}, std::tuple{0.3, 3.0, 0.0}, std::tuple{0.5, 3.0, 4.0}, std::tuple{0.8, 2.0, 4.0}}) {
    const auto frame = static_cast<std::size_t>(t_s * 30.0);
    EXPECT_NEAR(pair.dq_deg(frame, "r_elbow"), elbow, 1e-6) << t_s;
    EXPECT_NEAR(pair.dq_deg(frame, "r_wrist_yaw"), wrist, 1e-6) << t_s;
  }
}

TEST(Slip, JumpsOnceAndStays) {
  const Pair pair(with("slip:joint=r_elbow,value=5,at=0.5"));
  for (std::size_t i = 0; i < pair.good.size(); ++i) {
    const double t = static_cast<double>(i) / 30.0;
    if (t < 0.48) {
      EXPECT_NEAR(pair.dq_deg(i, "r_elbow"), 0.0, 1e-3) << t;
    }
    if (t > 0.52) {
      EXPECT_NEAR(pair.dq_deg(i, "r_elbow"), 5.0, 1e-3) << t;
    }
  }
}

TEST(Drift, GrowsEvenlyToItsValue) {
  const Pair pair(with("drift:joint=r_elbow,value=-2"));
  EXPECT_NEAR(pair.dq_deg(0, "r_elbow"), 0.0, 0.02);
  EXPECT_NEAR(pair.dq_deg(15, "r_elbow"), -2.0 * 15.0 / 29.0, 0.02);
  EXPECT_NEAR(pair.dq_deg(29, "r_elbow"), -2.0, 0.02);
}

TEST(VelocityLag, ShowsTheMotorOfOneTimeConstantAgo) {
  auto plan = with("velocity_lag:joint=r_elbow,value=50");
  plan.frames = 100;
  const Pair pair(plan);
  const auto j = icub_right().joint("r_elbow");
  for (std::size_t i = 20; i < 80; ++i) {
    const double speed = degrees(pair.good[i + 1].truth[0].q[j] - pair.good[i - 1].truth[0].q[j]) * 15.0;
    EXPECT_NEAR(pair.dq_deg(i, "r_elbow"), -0.05 * speed, 0.06 * std::abs(0.05 * speed) + 0.05);
  }
}

TEST(DrawFault, DrawsEveryKindAtTheAskedSizeAndNeverAnOffset) {
  const auto& stage = icub_right();
  const auto site = fault_site(stage.model, stage.setup, stage.rig, stage.settings, joints_only());
  std::set<std::string> drawn, in_catalogue, outside, expected_outside;
  for (const auto& kind : fault_kinds()) {
    if (kind.name == "joint_offset" || kind.targets(site).empty()) continue;
    (kind.in_catalogue ? in_catalogue : expected_outside).insert(kind.name);
  }
  std::set<int> signs;
  DrawOptions five_times;
  five_times.multiple_of_detectable = 5.0;
  for (std::uint64_t seed = 0; seed < 500; ++seed) {
    const FaultSpec spec = draw_fault(seed, site, five_times);
    EXPECT_EQ(spec, draw_fault(seed, site, five_times));
    drawn.insert(spec.name);
    const auto& kind = fault_kind(spec.name);
    bool as_asked = false;
    for (const auto& target : kind.targets(site)) {
      as_asked |= std::abs(std::abs(spec.value()) - 5.0 * target.detectable) < 1e-9;
    }
    EXPECT_TRUE(as_asked) << spec.text();
    if (kind.one_sided) {
      EXPECT_GT(spec.value(), 0.0);
    } else {
      signs.insert(spec.value() > 0 ? 1 : -1);
    }
    EXPECT_NO_THROW(make_fault(spec, site)) << spec.text();
  }
  EXPECT_EQ(drawn, in_catalogue);
  EXPECT_EQ(signs.size(), 2u);
  DrawOptions beyond;
  beyond.outside_catalogue = true;
  for (std::uint64_t seed = 0; seed < 100; ++seed) outside.insert(draw_fault(seed, site, beyond).name);
  EXPECT_EQ(outside, expected_outside);
}

TEST(DrawFault, DrawsTheSizeTooUnlessOneIsAskedFor) {
  const auto& stage = icub_right();
  const auto site = fault_site(stage.model, stage.setup, stage.rig, stage.settings, joints_only());
  double least = 1e9, most = 0.0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const FaultSpec spec = draw_fault(seed, site);
    DrawOptions once;
    once.multiple_of_detectable = 1.0;
    const FaultSpec smallest = draw_fault(seed, site, once);
    EXPECT_EQ(spec.name, smallest.name);
    least = std::min(least, spec.value() / smallest.value());
    most = std::max(most, spec.value() / smallest.value());
  }
  EXPECT_GE(least, 3.0);
  EXPECT_LT(least, 3.2);
  EXPECT_GT(most, 5.8);
  EXPECT_LE(most, 6.0);
}

}  // namespace
}  // namespace bodyschema::simulator
