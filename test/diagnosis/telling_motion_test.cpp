#include "telling_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "bodyschema/geometry/pose.hpp"
#include "simulated_log.hpp"

namespace bodyschema::diagnosis {
namespace {

class TellingMotion : public testing::Test {
 protected:
  TellingMotion() : log_({.seconds = 12.0, .rate_hz = 4.0}) {
    auto& projection = log_.fit().measurement().projection();
    for (const auto& picture : log_.pictures().pictures()) {
      projection.place(picture.joints.q, log_.roles().no_corrections(), picture.camera);
      ResidualSample sample;
      sample.camera = picture.camera;
      sample.depth_m = projection.hand().translation().z();
      report_.samples.push_back(sample);
    }
    DiagnosedCause gain;
    gain.cause = {"encoder_gain", "r_elbow", ""};
    gain.same = {gain.cause};
    report_.causes = {gain};
  }
  test::SimulatedLog log_;
  DiagnosisReport report_;
};

TEST_F(TellingMotion, IsForAnswersOfSeveralCausesOnly) {
  EXPECT_FALSE(telling_motion(log_.fit(), report_));
}

TEST_F(TellingMotion, SweepsTheJointsOfTheClassAloneWithTheHandInSight) {
  report_.causes[0].same.push_back({"eccentricity", "r_elbow", ""});
  const auto motion = telling_motion(log_.fit(), report_);
  ASSERT_TRUE(motion);
  ASSERT_GT(motion->postures.size(), 6u);
  const auto& robot = *log_.pictures().robot();
  const auto elbow = robot.joint_index("r_elbow");
  auto& projection = log_.fit().measurement().projection();
  double alone = 0.0;
  for (std::size_t i = 0; i < motion->postures.size(); ++i) {
    const auto& posture = motion->postures[i];
    if (i > 0) {
      EXPECT_GT(posture.time_s, motion->postures[i - 1].time_s);
    }
    Eigen::VectorXd from_home = posture.q - motion->postures.front().q;
    const double turned = std::abs(from_home[elbow]);
    from_home[elbow] = 0.0;
    if (from_home.cwiseAbs().maxCoeff() < 1e-9) alone = std::max(alone, turned);
    for (std::size_t c = 0; c < log_.pictures().rig().cameras.size(); ++c) {
      projection.place(posture.q, log_.roles().no_corrections(), c);
      const auto& k = log_.pictures().rig().cameras[c].intrinsics;
      const Eigen::Vector3d hand = projection.hand().translation();
      ASSERT_GT(hand.z(), 0.0);
      EXPECT_LT(std::abs(k.fx * hand.x() / hand.z()), 0.5 * k.width) << i;
    }
  }
  EXPECT_GT(alone, radians(10.0));
  // The first posture again at the end.
  EXPECT_LT((motion->postures.back().q - motion->postures.front().q).norm(), 1e-9);
}

}  // namespace
}  // namespace bodyschema::diagnosis
