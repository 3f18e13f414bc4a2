#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <string>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/observation/joint_motion.hpp"
#include "effects/roles.hpp"

namespace bodyschema {
namespace {

using test::instant;
using test::roles;

constexpr Eigen::Index kElbow = 9;

/// The corrections of one effect whose first fitted parameter is `value` in its own unit.
Corrections corrections(Effect& effect, double value, const Instant& at) {
  effect.parameters()[0].value = value * effect.parameters()[0].si_per_unit;
  Corrections c = roles().no_corrections();
  effect.apply(at, c);
  return c;
}

/// The catalogue without what tests of this program have registered.
std::vector<std::string> shipped_effects() {
  auto names = effect_names();
  std::erase_if(names, [](const std::string& name) { return name.starts_with("own_"); });
  return names;
}

double dq_deg(const Corrections& c, Eigen::Index joint) {
  return degrees(c.dq[joint]);
}

/// Sum of the sizes of all numbers.
double size_of(const Corrections& c) {
  double sum = c.dq.lpNorm<1>() + c.base_shift_m.lpNorm<1>();
  for (const auto& a : c.adjustments) {
    for (const double x : {a.along_m, a.tilt_1_rad, a.tilt_2_rad, a.shift_1_m, a.shift_2_m}) sum += std::abs(x);
  }
  for (const auto& s : c.shapes) sum += std::abs(s.scale) + std::abs(s.dilation_px) + std::abs(s.thickness_m);
  const auto& k = c.camera;
  for (const auto& v : {k.rig_shift_m, k.rig_turn_rad, k.shift_m, k.turn_rad}) sum += v.lpNorm<1>();
  for (const double x : {k.focal_scale, k.cx_px, k.cy_px, k.k1, k.readout_s}) sum += std::abs(x);
  return sum;
}

TEST(Catalogue, HoldsEveryCauseAndEachIsNothingWhileItsParametersAreZero) {
  const auto r = roles();
  EXPECT_EQ(shipped_effects().size(), 33u);
  auto at = instant(r);
  at.q.setConstant(0.7);
  at.encoder.setConstant(0.8);
  at.qdot.setConstant(1.0);
  at.gravity_torque.setConstant(2.0);
  at.payload_torque.setConstant(3.0);
  at.utime = 5'000'000;
  at.camera = 1;
  for (const auto& name : shipped_effects()) {
    const auto targets = effect_targets(name, r);
    ASSERT_FALSE(targets.empty()) << name;
    for (const auto& target : targets) {
      auto effect = make_effect(name, target, r);
      effect->observe({0, Eigen::VectorXd::Zero(at.q.size()), Eigen::VectorXd::Zero(at.q.size())});
      Corrections c = r.no_corrections();
      effect->apply(at, c);
      EXPECT_EQ(size_of(c), 0.0) << effect->description();
      EXPECT_GT(effect->parameters()[0].typical, 0.0) << effect->description();
    }
  }
}

/// Whoever applies an effect finds motion and torques only where it asks for them.
TEST(Catalogue, EffectsSayWhatTheyFollow) {
  const auto r = roles();
  auto still = instant(r);
  still.q.setConstant(0.7);
  auto moving = still, hanging = still;
  moving.qdot.setConstant(1.0);
  moving.qddot.setConstant(1.0);
  hanging.gravity_torque.setConstant(2.0);
  hanging.payload_torque.setConstant(3.0);
  moving.camera = hanging.camera = still.camera = 1;
  for (const auto& name : shipped_effects()) {
    const auto effect = make_effect(name, effect_targets(name, r).front(), r);
    const double value = effect->parameters()[0].typical / effect->parameters()[0].si_per_unit;
    const auto apart = [&](const Instant& at) {
      return (corrections(*effect, value, at).dq - corrections(*effect, value, still).dq).norm();
    };
    EXPECT_EQ(effect->follows_motion(), apart(moving) > 0.0) << name;
    EXPECT_EQ(effect->follows_gravity(), apart(hanging) > 0.0) << name;
  }
}

/// Without sign and definition nobody can compare an estimate with another tool's.
TEST(Catalogue, EveryParameterHasItsMeaningInTheHandbook) {
  const auto r = roles();
  for (const auto& name : shipped_effects()) {
    std::ifstream page(std::string(BODYSCHEMA_SOURCE_DIR) + "/docs/diagnosis_reference.md");
    ASSERT_TRUE(page) << "docs/diagnosis_reference.md";
    const auto begin = "| `" + name + "` | ";
    std::string line, row;
    while (std::getline(page, line)) {
      if (line.starts_with(begin)) row = line;
    }
    const auto effect = make_effect(name, effect_targets(name, r).front(), r);
    // "`x`, `y`, `z` mm, `turn_x`, `turn_y`, `turn_z` deg": the unit after the last of those that have it.
    std::string names;
    const EffectParameter* last = nullptr;
    for (const auto& p : std::as_const(*effect).parameters()) {
      if (!p.fitted) continue;
      if (last != nullptr) names += (last->unit != p.unit ? " " + last->unit : "") + ", ";
      names += "`" + p.name + "`";
      last = &p;
    }
    EXPECT_TRUE(row.starts_with(begin + names + " " + last->unit + " | "))
        << "docs/diagnosis_reference.md: expected a row '" << begin << names << " " << last->unit
        << " | meaning |', found '" << row << "'";
  }
}

TEST(Catalogue, NamesTheNearestEffectAndJoint) {
  const auto r = roles();
  EXPECT_THAT(
      [&] {
        make_effect("complience", {"elbow", ""}, r);
      },
      testing::ThrowsMessage<ConfigurationError>(testing::HasSubstr("'compliance'")));
  EXPECT_THAT(
      [&] {
        make_effect("backlash", {"elbw", ""}, r);
      },
      testing::ThrowsMessage<ConfigurationError>(testing::HasSubstr("'elbow'")));
  EXPECT_THROW(make_effect("latency", {"elbow", ""}, r), ConfigurationError);
  EXPECT_THROW(make_effect("slip", {"", ""}, r), ConfigurationError);
  EXPECT_THROW(make_effect("principal_point", {"", "middle"}, r), ConfigurationError);
}

TEST(BaseShift, MovesTheArmAlongTheRootsAxes) {
  const auto r = roles();
  auto effect = make_effect("base_shift", {}, r);
  effect->parameters()[1].value = 2e-3;
  const Corrections c = corrections(*effect, 5.0, instant(r));
  EXPECT_LT((c.base_shift_m - Eigen::Vector3d(5e-3, 2e-3, 0.0)).norm(), 1e-15);
}

TEST(JointOffset, EncoderIsTruePlusOffset) {
  const auto r = roles();
  auto effect = make_effect("joint_offset", {"elbow", ""}, r);
  EXPECT_NEAR(dq_deg(corrections(*effect, 3.0, instant(r)), kElbow), -3.0, 1e-12);
}

TEST(Compliance, JointSagsWithGravity) {
  const auto r = roles();
  auto effect = make_effect("compliance", {"elbow", ""}, r);
  auto at = instant(r);
  at.gravity_torque[kElbow] = -2.0;
  EXPECT_NEAR(dq_deg(corrections(*effect, 0.3, at), kElbow), -0.6, 1e-12);
  at.gravity_torque.resize(0);  // a URDF without masses
  EXPECT_EQ(corrections(*effect, 0.3, at).dq.norm(), 0.0);
}

TEST(Payload, BendsEveryArmJointByItsLever) {
  const auto r = roles();
  auto effect = make_effect("payload", {}, r);
  auto at = instant(r);
  at.payload_torque[kElbow] = -2.0;
  at.payload_torque[6] = 4.0;
  at.payload_torque[0] = 9.0;  // the neck carries nothing
  const auto c = corrections(*effect, 0.5, at);
  EXPECT_NEAR(dq_deg(c, kElbow), -0.3, 1e-12);
  EXPECT_NEAR(dq_deg(c, 6), 0.6, 1e-12);
  EXPECT_EQ(c.dq[0], 0.0);
}

TEST(Backlash, LinkFollowsHalfAWidthBehind) {
  const auto r = roles();
  auto effect = make_effect("backlash", {"elbow", ""}, r);
  effect->parameters()[0].value = radians(1.0);
  auto at = instant(r);
  JointSample sample{0, at.q, at.qdot};
  const auto lag = [&](double encoder_deg) {
    sample.q[kElbow] = at.encoder[kElbow] = radians(encoder_deg);
    sample.utime += 60'000'000;  // at rest
    effect->observe(sample);
    Corrections c = r.no_corrections();
    effect->apply(at, c);
    return dq_deg(c, kElbow);
  };
  lag(0.0);
  EXPECT_NEAR(lag(10.0), -0.5, 5e-3);  // upwards: behind
  EXPECT_NEAR(lag(9.7), -0.2, 5e-3);   // turned, slack not taken up: the link stands at 9.5
  EXPECT_NEAR(lag(9.0), 0.5, 5e-3);    // taken up
  EXPECT_NEAR(lag(-5.0), 0.5, 5e-3);
  EXPECT_NEAR(lag(10.0), -0.5, 5e-3);
  effect->forget();
  EXPECT_NEAR(lag(10.0), 0.0, 1e-9);  // a first sample says nothing about direction
}

TEST(EncoderGain, GrowsWithTheAngle) {
  const auto r = roles();
  auto effect = make_effect("encoder_gain", {"elbow", ""}, r);
  auto at = instant(r);
  at.q[kElbow] = radians(50.0);
  EXPECT_NEAR(dq_deg(corrections(*effect, 2.0, at), kElbow), 1.0, 1e-12);
}

TEST(Eccentricity, IsASineAndACosine) {
  const auto r = roles();
  auto effect = make_effect("eccentricity", {"elbow", ""}, r);
  effect->parameters()[1].value = radians(0.4);
  auto at = instant(r);
  at.q[kElbow] = radians(30.0);
  EXPECT_NEAR(dq_deg(corrections(*effect, 0.6, at), kElbow), 0.3 + 0.4 * std::sqrt(3.0) / 2, 1e-12);
}

TEST(JointCoupling, FollowsTheSource) {
  const auto r = roles();
  auto effect = make_effect("joint_coupling", {"elbow", "s_yaw"}, r);
  auto at = instant(r);
  at.q[8] = radians(20.0);
  EXPECT_NEAR(dq_deg(corrections(*effect, 5.0, at), kElbow), 1.0, 1e-12);
  EXPECT_THROW(make_effect("joint_coupling", {"elbow", "elbow"}, r), ConfigurationError);
}

TEST(Latency, PictureShowsThePast) {
  const auto r = roles();
  auto effect = make_effect("latency", {}, r);
  auto at = instant(r);
  at.qdot[kElbow] = radians(30.0);
  at.qdot[2] = radians(-10.0);
  const auto c = corrections(*effect, 50.0, at);
  EXPECT_NEAR(dq_deg(c, kElbow), -1.5, 1e-12);
  EXPECT_NEAR(dq_deg(c, 2), 0.5, 1e-12);
  at.qddot[kElbow] = radians(80.0);  // so 50 ms ago it was 0.1 deg further on
  EXPECT_NEAR(dq_deg(corrections(*effect, 50.0, at), kElbow), -1.4, 1e-12);
}

/// Velocity and acceleration alone are 0.3 deg off here, so that the delay was said to be some 2 % too short.
TEST(Latency, FollowsThePathOfTheArmWhereItIsKnown) {
  const auto r = roles();
  auto effect = make_effect("latency", {}, r);
  constexpr double kOmega = 3.0, kAmplitude = 0.5;
  const auto angle = [&](double t_s) { return kAmplitude * std::sin(kOmega * t_s); };
  for (const double t_s : {1.0, 1.3, 1.6}) {
    std::vector<JointSample> samples;
    for (int i = 0; i <= 300; ++i) {
      samples.push_back({.utime = microseconds(0.01 * i), .q = instant(r).q, .qdot = {}});
      samples.back().q[kElbow] = angle(0.01 * i);
    }
    auto at = instant(r);
    joint_motion(samples, microseconds(t_s), at.qdot, at.qddot);
    joint_path(samples, microseconds(t_s), at.path);
    for (const double delay_ms : {-134.0, -30.0, 60.0, 134.0}) {
      EXPECT_NEAR(dq_deg(corrections(*effect, delay_ms, at), kElbow),
                  degrees(angle(t_s - 1e-3 * delay_ms) - angle(t_s)), 0.02);
    }
    EXPECT_NEAR(dq_deg(corrections(*effect, 500.0, at), kElbow),
                degrees(-0.5 * at.qdot[kElbow] + 0.125 * at.qddot[kElbow]), 1e-9)
        << "beyond the path";
  }
}

/// Where the arm is 207 ms later is not where it would be 73 and 134 ms later, one after the other from here.
TEST(Latency, AddsUpWithASkewAlongThePathOfTheArm) {
  const auto r = roles();
  const auto early = make_effect("latency", {}, r), skewed = make_effect("camera_skew", {}, r);
  early->parameters()[0].value = -0.073;
  skewed->parameters()[0].value = 0.134;
  const auto angle = [](double t_s) { return 0.5 * std::sin(3.0 * t_s); };
  std::vector<JointSample> samples;
  for (int i = 0; i <= 300; ++i) {
    samples.push_back({.utime = microseconds(0.01 * i), .q = instant(r).q, .qdot = {}});
    samples.back().q[kElbow] = angle(0.01 * i);
  }
  for (const double t_s : {1.0, 1.3, 1.6}) {
    auto at = instant(r);
    at.camera = 1;
    joint_path(samples, microseconds(t_s), at.path);
    for (const bool first : {true, false}) {
      Corrections c = r.no_corrections();
      (first ? early : skewed)->apply(at, c);
      (first ? skewed : early)->apply(at, c);
      EXPECT_NEAR(dq_deg(c, kElbow), degrees(angle(t_s + 0.207) - angle(t_s)), 0.02) << t_s;
      c.clear();
      EXPECT_EQ(c.later_s, 0.0);
    }
  }
}

TEST(CameraSkew, OnlyTheRightPictureIsLater) {
  const auto r = roles();
  auto effect = make_effect("camera_skew", {}, r);
  auto at = instant(r);
  at.qdot[kElbow] = radians(30.0);
  EXPECT_EQ(corrections(*effect, 20.0, at).dq.norm(), 0.0);
  at.camera = 1;
  EXPECT_NEAR(dq_deg(corrections(*effect, 20.0, at), kElbow), 0.6, 1e-12);
}

TEST(RollingShutter, IsOfTheCamerasItNames) {
  const auto r = roles();
  auto at = instant(r);
  EXPECT_NEAR(corrections(*make_effect("rolling_shutter", {}, r), 20.0, at).camera.readout_s, 0.020, 1e-15);
  ASSERT_GT(r.cameras.size(), 1u);
  const auto second = make_effect("rolling_shutter", {"", r.cameras[1]}, r);
  EXPECT_EQ(corrections(*second, 20.0, at).camera.readout_s, 0.0);
  at.camera = 1;
  EXPECT_NEAR(corrections(*second, 20.0, at).camera.readout_s, 0.020, 1e-15);
}

TEST(Geometry, LengthTiltAndHeadGoWhereTheyBelong) {
  const auto r = roles();
  const auto at = instant(r);
  EXPECT_NEAR(corrections(*make_effect("link_length", {"s_yaw", ""}, r), 2.0, at).adjustments[8].along_m, 0.002, 1e-15);
  // A link that does not run along the axis of the joint at its end.
  const auto forearm = corrections(*make_effect("link_length", {"prosup", ""}, r), 2.0, at).adjustments[10];
  EXPECT_NEAR(forearm.along_m, 0.0012, 1e-15);
  EXPECT_NEAR(forearm.shift_1_m, 0.0016, 1e-15);
  EXPECT_NEAR(corrections(*make_effect("axis_tilt", {"elbow", ""}, r), 2.0, at).adjustments[kElbow].tilt_1_rad,
              radians(2.0), 1e-15);
  const auto place = corrections(*make_effect("joint_place", {"elbow", ""}, r), 2.0, at).adjustments[kElbow];
  EXPECT_NEAR(place.along_m, 0.002, 1e-15);
  EXPECT_EQ(place.shift_1_m, 0.0);
  EXPECT_THROW((void)make_effect("joint_place", effect_targets("joint_offset", r).front(), r), ConfigurationError)
      << "the first joint's place is the base's";
  EXPECT_NEAR(dq_deg(corrections(*make_effect("head_offset", {"neck_yaw", ""}, r), 1.0, at), 2), 1.0, 1e-12);
  const auto vergence = corrections(*make_effect("vergence", {}, r), 1.0, at);
  EXPECT_NEAR(dq_deg(vergence, 4) - dq_deg(vergence, 5), 1.0, 1e-12);
  const auto fingers = corrections(*make_effect("finger_posture", {}, r), 5.0, at);
  EXPECT_NEAR(dq_deg(fingers, 13), 5.0, 1e-12);
  EXPECT_NEAR(dq_deg(fingers, 14), 5.0, 1e-12);
  EXPECT_EQ(dq_deg(fingers, 15), 0.0);
  for (const auto joint : r.hand) {
    const auto& name = r.names[static_cast<std::size_t>(joint)];
    const auto one = corrections(*make_effect("finger_offset", {name, ""}, r), 2.0, at);
    EXPECT_NEAR(dq_deg(one, joint), 2.0, 1e-12) << name;
    EXPECT_NEAR(one.dq.cwiseAbs().sum(), radians(2.0), 1e-12) << name;
  }
}

TEST(Cameras, CorrectionsReachTheRightEye) {
  const auto r = roles();
  auto at = instant(r);
  EXPECT_EQ(corrections(*make_effect("baseline", {}, r), 1.0, at).camera.shift_m.norm(), 0.0);
  auto difference = make_effect("principal_point", {"", "difference"}, r);
  EXPECT_NEAR(corrections(*difference, 2.0, at).camera.cx_px, 1.0, 1e-15);
  auto right = make_effect("principal_point", {"", "right"}, r);
  EXPECT_EQ(corrections(*right, 2.0, at).camera.cx_px, 0.0);
  at.camera = 1;
  EXPECT_NEAR(corrections(*difference, 2.0, at).camera.cx_px, -1.0, 1e-15);
  EXPECT_NEAR(corrections(*right, 2.0, at).camera.cx_px, 2.0, 1e-15);
  EXPECT_NEAR(corrections(*make_effect("baseline", {}, r), 1.0, at).camera.shift_m.x(), 1e-3, 1e-15);
  EXPECT_NEAR(corrections(*make_effect("focal_length", {}, r), 1.0, at).camera.focal_scale, 0.01, 1e-15);
  EXPECT_NEAR(corrections(*make_effect("distortion", {}, r), 0.05, at).camera.k1, 0.05, 1e-15);
}

TEST(Cameras, ThePoseIsThatOfTheRigThePairThatOfTheSecondAloneAndTheFirstHasItsOwn) {
  const auto r = roles();
  for (const std::size_t camera : {0u, 1u}) {
    auto at = instant(r);
    at.camera = camera;
    for (const std::string name : {"camera_pose", "camera_pair", "first_camera"}) {
      const auto effect = make_effect(name, {}, r);
      for (std::size_t i = 0; i < 6; ++i) effect->parameters()[i].value = 0.01 * static_cast<double>(i + 1);
      Corrections c = r.no_corrections();
      effect->apply(at, c);
      const Eigen::Vector3d shift(0.01, 0.02, 0.03), turn(0.04, 0.05, 0.06);
      const double rig = name == "camera_pose" ? 1.0 : 0.0;
      const double own = rig == 0.0 && camera == (name == "camera_pair" ? 1u : 0u) ? 1.0 : 0.0;
      EXPECT_LT((c.camera.rig_shift_m - rig * shift).norm() + (c.camera.rig_turn_rad - rig * turn).norm(), 1e-15);
      EXPECT_LT((c.camera.shift_m - own * shift).norm() + (c.camera.turn_rad - own * turn).norm(), 1e-15) << camera;
    }
  }
}

TEST(Cameras, OneCameraHasNoPair) {
  auto r = roles();
  r.cameras = {"only"};
  for (const char* name : {"camera_pair", "first_camera", "baseline"}) {
    EXPECT_TRUE(effect_targets(name, r).empty()) << name;
    EXPECT_THAT([&] { make_effect(name, {}, r); },
                testing::ThrowsMessage<ConfigurationError>(testing::HasSubstr(name)));
  }
  EXPECT_EQ(effect_targets("principal_point", r).size(), 1u);
  EXPECT_EQ(effect_targets("camera_pose", r).size(), 1u);
}

/// The whole body, or one of its segments by name.
TEST(Shapes, AreThoseOfTheBodyOrOfOneSegment) {
  const auto r = roles();
  const auto at = instant(r);
  for (const std::string name : {"mesh_scale", "silhouette_bias"}) {
    ASSERT_EQ(effect_targets(name, r).size(), 3u);
    const auto size = [&](const Corrections& c, std::size_t segment) {
      return name == "mesh_scale" ? c.shapes[segment].scale : 0.01 * c.shapes[segment].dilation_px;
    };
    const auto all = corrections(*make_effect(name, {}, r), 2.0, at);
    const auto hand = corrections(*make_effect(name, {"", "hand"}, r), 2.0, at);
    EXPECT_NEAR(size(all, 0), 0.02, 1e-15) << name;
    EXPECT_NEAR(size(all, 1), 0.02, 1e-15);
    EXPECT_EQ(size(hand, 0), 0.0) << name;
    EXPECT_NEAR(size(hand, 1), 0.02, 1e-15);
  }
  EXPECT_THAT(
      [&] {
        make_effect("mesh_scale", {"", "hnad"}, r);
      },
      testing::ThrowsMessage<ConfigurationError>(testing::HasSubstr("expected forearm or hand")));
}

/// A cover is one part's, in millimetres.
TEST(Shapes, ACoverIsSoManyMillimetresOfOneSegment) {
  auto r = roles();
  ASSERT_EQ(effect_targets("cover_thickness", r).size(), 2u);
  const auto glove = corrections(*make_effect("cover_thickness", {"", "hand"}, r), 8.0, instant(r));
  EXPECT_EQ(glove.shapes[0].thickness_m, 0.0);
  EXPECT_NEAR(glove.shapes[1].thickness_m, 0.008, 1e-15);
  r.segments.resize(1);
  EXPECT_TRUE(effect_targets("cover_thickness", r).empty()) << "of a robot of one part nobody tells it from fat masks";
}

/// A segment with joints within as a whole: parts and places of joints.
TEST(Shapes, OfAnotherSizeMoveTheirJointsToo) {
  const auto r = roles();
  ASSERT_EQ(effect_targets("segment_size", r).size(), 1u) << "the forearm is one part";
  const auto effect = make_effect("segment_size", {"", "hand"}, r);
  const auto hand = corrections(*effect, 2.0, instant(r));
  EXPECT_NEAR(hand.shapes[1].size, 0.02, 1e-15);
  EXPECT_EQ(hand.shapes[1].scale, 0.0);
  EXPECT_EQ(hand.shapes[0].size, 0.0);
  EXPECT_EQ(effect_kind("segment_size").sentence(*effect, r, std::vector<std::string>{"2 %"}),
            "the hand is 2 % larger than in the URDF, the places of its joints with it");
}

TEST(InTime, DriftGrowsAndSlipJumps) {
  const auto r = roles();
  auto at = instant(r);
  auto drift = make_effect("drift", {"elbow", ""}, r);
  drift->parameters()[1].value = 100.0;
  drift->parameters()[2].value = 60.0;
  at.utime = microseconds(130.0);
  EXPECT_NEAR(dq_deg(corrections(*drift, 1.0, at), kElbow), 0.5, 1e-12);
  at.utime = microseconds(300.0);
  EXPECT_NEAR(dq_deg(corrections(*drift, 1.0, at), kElbow), 1.0, 1e-12);
  at.utime = microseconds(130.0);
  auto slip = make_effect("slip", {"elbow", ""}, r);
  slip->parameters()[1].value = 130.5;
  EXPECT_EQ(corrections(*slip, 2.0, at).dq.norm(), 0.0);
  at.utime = microseconds(130.6);
  EXPECT_NEAR(dq_deg(corrections(*slip, 2.0, at), kElbow), 2.0, 1e-12);
}

}  // namespace
}  // namespace bodyschema
