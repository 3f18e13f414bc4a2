#include "bodyschema/effects/online_error_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {
namespace {

/// This project's own robot without its meshes.
class OnlineErrorModelTest : public testing::Test {
 protected:
  OnlineErrorModelTest() {
    const Configuration configuration =
        Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
    setup = RobotSetup::from(configuration.section("robot"));
    setup.model.rendered_links.clear();
    robot = setup.load();
    roles = JointRoles::of(robot, setup, StereoRig::from(configuration.section("cameras")));
    elbow = roles.index("r_elbow");
  }
  /// The elbow swings; everything else stands.
  JointSample sample(Microseconds utime) const {
    JointSample s;
    s.utime = utime;
    s.q = setup.default_joints(*robot);
    s.qdot.setZero(s.q.size());
    const double phase = 2.0 * kPi * seconds(utime) / 2.0;
    s.q[elbow] = radians(60.0 + 10.0 * std::sin(phase));
    s.qdot[elbow] = radians(10.0) * kPi * std::cos(phase);
    return s;
  }
  Corrections at(OnlineErrorModel& online, const JointSample& exposure, std::size_t camera = 0) const {
    Corrections out(robot->joint_count());
    online.corrections(exposure, camera, out);
    return out;
  }

  RobotSetup setup;
  std::shared_ptr<const RobotModel> robot;
  JointRoles roles;
  Eigen::Index elbow = 0;
};

TEST_F(OnlineErrorModelTest, MemoryEndsAtTheExposureThoughLaterSamplesCame) {
  ErrorModel model(roles);
  model.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
  OnlineErrorModel online(robot, setup, model);
  bool positive = false, negative = false;
  Microseconds seen = 0;
  for (Microseconds now = 0; now < 4'000'000; now += 500'000) {
    for (; seen <= now + 300'000; seen += 10'000) online.observe(sample(seen));  // 0.3 s ahead
    ErrorModel offline(roles);
    offline.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
    for (Microseconds t = 0; t <= now; t += 10'000) offline.observe(sample(t));
    Instant instant;
    InstantBuilder(robot, setup.hand_link, setup.gravity_W)
        .build(sample(now), 0, Eigen::VectorXd::Zero(robot->joint_count()), instant);
    Corrections expected(robot->joint_count());
    offline.corrections(instant, expected);
    const double dq = at(online, sample(now)).dq[elbow];
    EXPECT_NEAR(dq, expected.dq[elbow], 1e-12) << now;
    positive = positive || dq > radians(0.5);
    negative = negative || dq < radians(-0.5);
  }
  EXPECT_TRUE(positive && negative) << "the motion never crossed the play";
}

TEST_F(OnlineErrorModelTest, AfterAStepOfTheClockNothingIsRemembered) {
  ErrorModel model(roles);
  model.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
  OnlineErrorModel online(robot, setup, model);
  for (Microseconds t = 0; t <= 500'000; t += 10'000) online.observe(sample(t));
  ASSERT_GT(std::abs(at(online, sample(500'000)).dq[elbow]), radians(0.5));
  online.forget();
  EXPECT_EQ(at(online, sample(500'000)).dq[elbow], 0.0);
}

TEST_F(OnlineErrorModelTest, MoreWaitingSamplesThanFitAreSeenEarly) {
  ErrorModel model(roles);
  model.add("backlash", {"r_elbow", ""}).parameters()[0].value = radians(2.0);
  OnlineErrorModel online(robot, setup, model), plain(robot, setup, model);
  const auto last = static_cast<Microseconds>(3 * OnlineErrorModel::kMostWaiting) * 10'000;
  for (Microseconds t = 0; t <= last; t += 10'000) {
    online.observe(sample(t));
    plain.observe(sample(t));
    (void)at(plain, sample(t));
  }
  EXPECT_NEAR(at(online, sample(last)).dq[elbow], at(plain, sample(last)).dq[elbow], 1e-12);
}

TEST_F(OnlineErrorModelTest, OffsetsAndIntrinsicsAreLeftToOthers) {
  ErrorModel model(roles);
  model.add("joint_offset", {"r_elbow", ""}).parameters()[0].value = 0.1;
  model.add("focal_length", {}).parameters()[0].value = 0.02;
  model.add("distortion", {}).parameters()[0].value = 0.02;
  model.add("latency", {}).parameters()[0].value = 0.04;
  model.add("link_length", {"r_shoulder_yaw", ""}).parameters()[0].value = 0.003;
  OnlineErrorModel online(robot, setup, model);
  EXPECT_EQ(at(online, sample(0)).dq[elbow], 0.0) << "no motion was seen yet";
  for (Microseconds t = -200'000; t <= 200'000; t += 10'000) online.observe(sample(t));
  const Corrections c = at(online, sample(0));
  EXPECT_NEAR(c.dq[elbow], -0.04 * sample(0).qdot[elbow], 1e-3 * std::abs(sample(0).qdot[elbow]));
  EXPECT_EQ(c.camera.focal_scale, 0.0);
  EXPECT_EQ(c.camera.k1, 0.0);
  const auto yaw = static_cast<std::size_t>(roles.index("r_shoulder_yaw"));
  EXPECT_EQ(c.adjustments[yaw].along_m, 0.003);
}

/// The picture shows the past by as much as the arm swings on meanwhile, whatever velocity is published
/// and however large the delay; little follows the newest exposure beside a running robot.
TEST_F(OnlineErrorModelTest, ALatePictureShowsWhereTheArmWas) {
  for (const double delay_ms : {-60.0, -30.0, 30.0, 60.0, 100.0}) {
    ErrorModel model(roles);
    model.add("latency", {}).parameters()[0].value = 1e-3 * delay_ms;
    OnlineErrorModel online(robot, setup, model);
    double worst = 0.0;
    Microseconds seen = 0;
    for (Microseconds now = 500'000; now < 4'000'000; now += 33'000) {
      for (; seen <= now + 10'000; seen += 10'000) {
        JointSample published = sample(seen);
        published.qdot.setZero();
        online.observe(published);
      }
      const auto delay_us = static_cast<Microseconds>(1e3 * delay_ms);
      const double expected = sample(now - delay_us).q[elbow] - sample(now).q[elbow];
      worst = std::max(worst, std::abs(at(online, sample(now)).dq[elbow] - expected));
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

TEST_F(OnlineErrorModelTest, AnEffectNeedsNoNameToFindMotionAndGravity) {
  const auto with = [&](bool lags, bool sags) {
    ErrorModel model(roles);
    model.add(std::make_unique<LagAndSag>(elbow, lags, sags));
    return model;
  };
  OnlineErrorModel lags(robot, setup, with(true, false));
  for (Microseconds t = -200'000; t <= 200'000; t += 10'000) {
    JointSample published = sample(t);
    published.qdot.setZero();
    lags.observe(published);
  }
  JointSample exposure = sample(0);
  exposure.qdot.setZero();
  const double speed = sample(0).qdot[elbow];
  EXPECT_NEAR(at(lags, exposure).dq[elbow], -0.05 * speed, 0.01 * std::abs(speed));
  // Where the first look at gravity puts the arm, the torque is another.
  OnlineErrorModel sags(robot, setup, with(false, true));
  GravityTorques torques(robot);
  Eigen::VectorXd q = sample(0).q;
  const double first = 0.05 * torques.compute(q, setup.gravity_W)[elbow];
  q[elbow] += first;
  const double second = 0.05 * torques.compute(q, setup.gravity_W)[elbow];
  EXPECT_NEAR(at(sags, sample(0)).dq[elbow], second, 1e-12);
  EXPECT_GT(std::abs(second - first), 1e-4);
}

TEST_F(OnlineErrorModelTest, GravityActsOnTheArmWhereItHangs) {
  ASSERT_TRUE(robot->has_masses());
  const auto roll = roles.index("r_shoulder_roll");
  const double compliance = radians(3.0);  // rad/Nm, far too soft, so that the second look matters
  ErrorModel model(roles);
  model.add("joint_offset", {"r_elbow", ""}).parameters()[0].value = radians(5.0);
  model.add("compliance", {"r_shoulder_roll", ""}).parameters()[0].value = compliance;
  OnlineErrorModel online(robot, setup, model);
  const double dq = at(online, sample(0)).dq[roll];
  // Written out: torque with the offset, then once more where that torque puts the arm.
  GravityTorques torques(robot);
  Eigen::VectorXd q = sample(0).q;
  q[elbow] -= radians(5.0);
  const double first = compliance * torques.compute(q, setup.gravity_W)[roll];
  q[roll] += first;
  const double second = compliance * torques.compute(q, setup.gravity_W)[roll];
  EXPECT_NEAR(dq, second, 1e-12);
  EXPECT_GT(std::abs(second - first), 1e-4);
}

}  // namespace
}  // namespace bodyschema
