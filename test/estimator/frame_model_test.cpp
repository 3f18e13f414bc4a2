#include "frame_model.hpp"

#include <cmath>

#include "bodyschema/robot/gravity_torques.hpp"
#include "outline/own_robot.hpp"
#include "outline/synthetic_reach.hpp"

namespace bodyschema {
namespace {

constexpr Microseconds kMs = 1000;

/// The elbow swings; everything else stands.
class FrameModelOfOwnRobot : public OwnRobot {
 protected:
  [[nodiscard]] JointSample sample(Microseconds utime) const {
    JointSample s{utime, pose(0.5), Eigen::VectorXd::Zero(robot_->joint_count())};
    s.q[elbow_] = radians(75.0 + 10.0 * std::sin(kPi * seconds(utime)));
    return s;
  }
  [[nodiscard]] static double speed(Microseconds utime) { return radians(10.0) * kPi * std::cos(kPi * seconds(utime)); }
  /// Exposures of both eyes, with the samples of 100 Hz since `from` and some ahead.
  [[nodiscard]] Observation observe(Microseconds left, Microseconds right, Microseconds from,
                                    Microseconds ahead) const {
    Observation observation;
    observation.utime = left;
    for (const auto utime : {left, right}) {
      CameraObservation seen;
      seen.utime = utime;
      seen.joints = sample(utime);
      observation.cameras.push_back(std::move(seen));
    }
    for (Microseconds t = from; t <= std::max(left, right) + ahead; t += 10 * kMs)
      observation.encoders.push_back(sample(t));
    return observation;
  }
  /// @param known  what the robot's model has already
  [[nodiscard]] FrameModel model(const ErrorModel& known, const std::vector<Belief>& beliefs = {},
                                 const std::vector<Belief>& beside = {}) const {
    ErrorModel other(roles_);
    for (const auto& belief : beside) other.add(belief.effect, belief.target);
    return {robot_, setup_, rig_, roles_, State(known, beliefs), other};
  }
  [[nodiscard]] Corrections corrections(FrameModel& model, const Exposure& exposure) const {
    Corrections c = roles_.no_corrections();
    model.corrections(exposure, model.state().x(), c);
    return c;
  }

  /// What a joint gives way by under gravity, written out: in the posture given, and where posture and torque agree.
  [[nodiscard]] std::pair<double, double> sagged(Eigen::VectorXd q, Eigen::Index joint, double compliance) const {
    GravityTorques torques(robot_);
    const double stiff = q[joint], first = compliance * torques.compute(q, setup_.gravity_W)[joint];
    double last = first;
    for (int i = 0; i < 100; ++i) {
      q[joint] = stiff + last;
      last = compliance * torques.compute(q, setup_.gravity_W)[joint];
    }
    return {first, last};
  }

  static constexpr double kSettled_rad = 1e-5;
  JointRoles roles_ = JointRoles::of(robot_, setup_, rig_);
  Eigen::Index elbow_ = roles_.index("r_elbow");
  const Eigen::VectorXd nothing_;
};

/// Backlash as it is at the exposure, though later samples came, and as it was there when others came since.
TEST_F(FrameModelOfOwnRobot, MemoryEndsAtTheExposureThoughLaterSamplesCame) {
  ErrorModel known(roles_);
  known.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
  FrameModel frames = model(known);
  bool positive = false, negative = false;
  Microseconds given = 0;
  for (Microseconds now = 0; now < 4'000 * kMs; now += 500 * kMs) {
    const Observation seen = observe(now, now + 4 * kMs, given, 300 * kMs);
    given = seen.encoders.back().utime + 10 * kMs;
    const Frame frame = frames.take(seen, nothing_);
    ErrorModel offline = known;
    offline.forget();
    for (Microseconds t = 0; t <= now; t += 10 * kMs) offline.observe(sample(t));
    Corrections expected = roles_.no_corrections();
    offline.corrections(frame.exposures[0].at, expected);
    const double dq = corrections(frames, frame.exposures[0]).dq[elbow_];
    EXPECT_NEAR(dq, expected.dq[elbow_], 1e-12) << now;
    positive = positive || dq > radians(0.5);
    negative = negative || dq < radians(-0.5);
  }
  EXPECT_TRUE(positive && negative) << "the motion never crossed the play";
}

TEST_F(FrameModelOfOwnRobot, HeadThatTurnsLeavesNoPartStill) {
  FrameModel frames = model(ErrorModel(roles_));
  for (const bool still : frames.still_parts()) EXPECT_FALSE(still);
}

TEST(FrameModel, BaseIsStillBeforeCamerasThatStandStill) {
  const auto configuration =
      Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/arm7/robot.yaml",
                          {"robot.rendered_links=[base, link2, hand]"});
  const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  const auto robot = setup.load();
  const StereoRig rig = StereoRig::from(configuration.section("cameras"));
  const auto roles = JointRoles::of(robot, setup, rig);
  const FrameModel frames(robot, setup, rig, roles, State(ErrorModel(roles), {}), ErrorModel(roles));
  EXPECT_EQ(frames.still_parts(), (std::vector<bool>{true, false, false}));
}

/// What was learned is kept by frames' times: for it time goes on where the stamps' clock steps back, once or again.
TEST_F(FrameModelOfOwnRobot, TimeGoesOnWhereTheClockStepsBack) {
  FrameModel frames = model(ErrorModel(roles_));
  double last_s = 0.0;
  for (const int start_ms : {3'600'000, 10'000, 5'000}) {
    for (int i = 0; i < 3; ++i) {
      Observation seen = observe((start_ms + 100 * i) * kMs, (start_ms + 100 * i) * kMs, (start_ms + 100 * i) * kMs, 0);
      seen.encoders_begin_anew = i == 0;
      const double time_s = frames.take(seen, nothing_).time_s;
      EXPECT_GE(time_s, last_s);
      if (i > 0) {
        EXPECT_NEAR(time_s - last_s, 0.1, 1e-6);
      }
      last_s = time_s;
    }
  }
}

TEST_F(FrameModelOfOwnRobot, OtherEncodersBeginWithoutAMemory) {
  ErrorModel known(roles_);
  known.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
  FrameModel frames = model(known);
  Observation seen = observe(500 * kMs, 500 * kMs, 0, 0);
  ASSERT_GT(std::abs(corrections(frames, frames.take(seen, nothing_).exposures[0]).dq[elbow_]), radians(0.5));
  seen.encoders_begin_anew = true;
  seen.encoders = {sample(500 * kMs)};
  EXPECT_NEAR(corrections(frames, frames.take(seen, nothing_).exposures[0]).dq[elbow_], 0.0, 1e-9);
}

/// The picture shows the past by as much as the arm swings on meanwhile, whatever velocity is published
/// and however large the delay; little follows the newest exposure beside a running robot.
TEST_F(FrameModelOfOwnRobot, ALatePictureShowsWhereTheArmWas) {
  for (const double delay_ms : {-60.0, -30.0, 30.0, 60.0, 100.0}) {
    ErrorModel known(roles_);
    known.add("latency", {}).parameters()[0].value = 1e-3 * delay_ms;
    FrameModel frames = model(known);
    double worst = 0.0;
    Microseconds given = 0;
    for (Microseconds now = 500 * kMs; now < 4'000 * kMs; now += 33 * kMs) {
      const Observation seen = observe(now, now, given, 10 * kMs);
      given = seen.encoders.back().utime + 10 * kMs;
      const Frame frame = frames.take(seen, nothing_);
      const auto delay = static_cast<Microseconds>(1e3 * delay_ms);
      const double expected = sample(now - delay).q[elbow_] - sample(now).q[elbow_];
      worst = std::max(worst, std::abs(corrections(frames, frame.exposures[0]).dq[elbow_] - expected));
    }
    EXPECT_LT(degrees(worst), 0.08) << delay_ms << " ms";  // it swings by up to 31 deg/s
  }
}

/// An effect that the catalogue does not know: a joint that lags by its speed and gives way to gravity.
class LagAndSag final : public Effect {
 public:
  LagAndSag(Eigen::Index joint, bool lags, bool sags)
      : Effect("lag_and_sag", {}, {}), joint_(joint), lags_(lags), sags_(sags) {}
  [[nodiscard]] std::unique_ptr<Effect> clone() const override { return std::make_unique<LagAndSag>(*this); }
  [[nodiscard]] bool follows_motion() const override { return lags_; }
  [[nodiscard]] bool follows_gravity() const override { return sags_; }
  void apply(const Instant& at, Corrections& add_to) const override {
    if (lags_) add_to.dq[joint_] -= 0.05 * at.qdot[joint_];
    if (sags_) add_to.dq[joint_] += 0.05 * at.gravity_torque[joint_];
  }

 private:
  Eigen::Index joint_;
  bool lags_, sags_;
};

TEST_F(FrameModelOfOwnRobot, AnEffectNeedsNoNameToFindMotionAndGravity) {
  const auto dq = [&](bool lags, bool sags) {
    ErrorModel known(roles_);
    known.add(std::make_unique<LagAndSag>(elbow_, lags, sags));
    FrameModel frames = model(known);
    const Observation seen = observe(200 * kMs, 200 * kMs, 0, 200 * kMs);
    return corrections(frames, frames.take(seen, nothing_).exposures[0]).dq[elbow_];
  };
  EXPECT_NEAR(dq(true, false), -0.05 * speed(200 * kMs), 0.001);
  const auto [first, last] = sagged(sample(200 * kMs).q, elbow_, 0.05);
  EXPECT_NEAR(dq(false, true), last, kSettled_rad);
  EXPECT_GT(std::abs(last - first), 1e-4);
}

TEST_F(FrameModelOfOwnRobot, GravityActsOnTheArmWhereItHangsUnderTheOffsetsBelieved) {
  ASSERT_TRUE(robot_->has_masses());
  const auto roll = roles_.index("r_shoulder_roll");
  const double compliance = radians(3.0);  // rad/Nm, far too soft, so that where it sags to matters
  ErrorModel known(roles_);
  known.add("compliance", {"r_shoulder_roll", ""}).parameters()[0].value = compliance;
  FrameModel frames = model(known, {{"joint_offset", {"r_elbow", ""}, {0.1}}});
  const Observation seen = observe(0, 0, 0, 0);
  const Eigen::VectorXd x = Eigen::VectorXd::Constant(1, radians(5.0));
  const Frame frame = frames.take(seen, x);
  Corrections c = roles_.no_corrections();
  frames.corrections(frame.exposures[0], x, c);
  Eigen::VectorXd q = sample(0).q;
  q[elbow_] -= radians(5.0);
  const auto [first, last] = sagged(q, roll, compliance);
  EXPECT_NEAR(c.dq[roll], last, kSettled_rad);
  EXPECT_GT(std::abs(last - first), 1e-4);
}

TEST_F(FrameModelOfOwnRobot, ACameraThatSawNothingBorrowsTheOthersEncodersNotItsPlace) {
  ErrorModel known(roles_);
  known.add("baseline", {}).parameters()[0].value = 3e-3;
  FrameModel frames = model(known);
  Observation seen = observe(100 * kMs, 100 * kMs, 0, 0);
  seen.cameras[1].reset();
  const Frame frame = frames.take(seen, nothing_);
  EXPECT_TRUE(frame.exposed());
  EXPECT_EQ(frame.seen[1], nullptr);
  EXPECT_EQ(frame.exposures[1].at.encoder, frame.exposures[0].at.encoder);
  EXPECT_EQ(frame.exposures[1].at.camera, 1u);
  EXPECT_NEAR(corrections(frames, frame.exposures[1]).camera.shift_m.x(), 3e-3, 1e-15);
  EXPECT_EQ(corrections(frames, frame.exposures[0]).camera.shift_m.x(), 0.0);
}

/// Many hypotheses about offsets are placed with the rest settled once.
TEST_F(FrameModelOfOwnRobot, PlacesHypothesesAsTheWholeStateWouldBe) {
  std::vector<Belief> beliefs;
  for (const auto& target : effect_targets("joint_offset", roles_)) beliefs.push_back({"joint_offset", target, {0.1}});
  beliefs.push_back({"focal_length", {}, {0.01}});
  FrameModel frames = model(ErrorModel(roles_), beliefs);
  const Observation seen = observe(0, 0, 0, 0);
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(8, -0.05, 0.05);
  const Frame frame = frames.take(seen, x);
  std::vector<Eigen::Isometry3f> fast(frames.part_count()), whole(frames.part_count());
  Eigen::VectorXd rest = x;
  rest.head(7).setConstant(0.3);
  frames.settle(frame, rest);
  frames.place(x, 1, fast);
  frames.project(frame.exposures[1], x).parts(whole);
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_TRUE(fast[i].isApprox(whole[i], 1e-5f)) << i;
}

/// What lies beside the state is asked for, and its value stays zero.
TEST_F(FrameModelOfOwnRobot, EvidenceIsAboutTheStateAndWhatLiesBeside) {
  std::vector<Belief> offsets;
  for (const auto& target : effect_targets("joint_offset", roles_)) offsets.push_back({"joint_offset", target, {0.1}});
  FrameModel narrow = model(ErrorModel(roles_), offsets, {{"mesh_scale", {}, {0.01}}});
  auto more = offsets;
  more.push_back({"mesh_scale", {}, {0.01}});
  FrameModel wide = model(ErrorModel(roles_), more);
  EXPECT_EQ(narrow.beside_count(), 1);
  SyntheticReach reach(robot_, setup_, rig_, Eigen::VectorXd::Zero(7));
  const Observation seen = reach.observe(pose(0.5), 0);
  const Eigen::VectorXd x = Eigen::VectorXd::Constant(7, 0.004);
  Eigen::VectorXd x_wide = Eigen::VectorXd::Zero(8);
  x_wide.head(7) = x;
  const std::vector<OutlineSearch> search(2);
  FrameEvidence a, b, without;
  const Frame frame = narrow.take(seen, x), other = wide.take(seen, x_wide);
  narrow.linearise(frame, x, search, true, a);
  narrow.linearise(frame, x, search, false, without);
  wide.linearise(other, x_wide, search, false, b);
  ASSERT_EQ(a.cameras[0].A.rows(), 8);
  for (const std::size_t c : {0u, 1u}) {
    EXPECT_LT((a.cameras[c].A - b.cameras[c].A).norm(), 1e-6 * b.cameras[c].A.norm());
    EXPECT_LT((a.cameras[c].b - b.cameras[c].b).norm(), 1e-6 * b.cameras[c].b.norm());
    EXPECT_EQ(without.cameras[c].A(7, 7), 0.0);
    EXPECT_LT((without.cameras[c].b.head(7) - a.cameras[c].b.head(7)).norm(), 1e-9 * a.cameras[c].b.norm());
  }
}

TEST_F(FrameModelOfOwnRobot, TheHandsJacobianIsThatOfItsPlaceUnderTheState) {
  std::vector<Belief> beliefs;
  for (const auto& target : effect_targets("joint_offset", roles_)) beliefs.push_back({"joint_offset", target, {0.1}});
  beliefs.push_back({"camera_pose", {}, std::vector<double>(6, 0.01)});
  beliefs.push_back({"encoder_gain", {"r_elbow", ""}, {0.02}});
  FrameModel frames = model(ErrorModel(roles_), beliefs, {{"base_shift", {}, {}}});
  const Observation seen = observe(0, 0, 0, 0);
  Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(14, -0.01, 0.012);
  const Frame frame = frames.take(seen, x);
  for (const std::size_t camera : {0u, 1u}) {
    const Eigen::MatrixXd J = frames.hand_jacobian(frame.exposures[camera], x);
    ASSERT_EQ(J.cols(), 17);
    for (Eigen::Index k = 0; k < x.size(); ++k) {
      constexpr double kStep = 1e-5;
      Eigen::VectorXd plus = x, minus = x;
      plus[k] += kStep;
      minus[k] -= kStep;
      const Eigen::Vector3d expected = (frames.hand_pose(frame.exposures[camera], plus).translation() -
                                        frames.hand_pose(frame.exposures[camera], minus).translation()) /
                                       (2.0 * kStep);
      EXPECT_LT((J.col(k) - expected).norm(), 1e-3) << camera << ", " << k;
    }
    EXPECT_NEAR(J.col(14).norm(), 1.0, 1e-3) << "the base moves the hand by as much";
  }
}

}  // namespace
}  // namespace bodyschema
