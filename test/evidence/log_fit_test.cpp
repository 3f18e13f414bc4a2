#include "bodyschema/evidence/log_fit.hpp"

#include <random>

#include "evidence/drawn_log.hpp"
#include "random_seed.hpp"

namespace bodyschema {
namespace {

/// Eight postures of a robot with the paper's offsets and a forearm that is 6 mm longer than in the URDF.
class LogFitOfOwnRobot : public DrawnLog {
 protected:
  static constexpr int kPostures = 8;
  LogFitOfOwnRobot() {
    if (!seen_.empty()) return;
    ErrorModel others(roles_);
    others.add("link_length", {"r_wrist_pitch", ""}).parameters()[0].value = 0.006;
    seen_ = observe(kPostures, paper_offsets_rad(), &others);
  }
  static void TearDownTestSuite() { seen_.clear(); }
  [[nodiscard]] State truth(const State& like) const {
    State state = like;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(state.size());
    x.head(7) = paper_offsets_rad();
    if (const auto k = state.find("link_length", {"r_wrist_pitch", ""}, 0); k >= 0) x[k] = 0.006;
    state.set(x);
    return state;
  }
  [[nodiscard]] State state() const { return {roles_, beliefs({{"link_length", {"r_wrist_pitch", ""}, {0.01}}})}; }
  /// Each posture with readings that err by `sd_deg` of its own.
  [[nodiscard]] std::vector<Observation> with_postures_apart(double sd_deg, std::uint64_t more = 0) const {
    auto seen = seen_;
    std::mt19937_64 random(test::seed() + more);
    std::normal_distribution<double> normal(0.0, radians(sd_deg));
    for (auto& observation : seen) {
      for (const char* joint : {"r_shoulder_yaw", "r_elbow", "r_wrist_prosup"}) {
        const double noise = normal(random);
        for (auto& camera : observation.cameras) camera->joints.q[robot_->joint_index(joint)] += noise;
      }
    }
    return seen;
  }
  static inline std::vector<Observation> seen_;
};

TEST_F(LogFitOfOwnRobot, FromAfarItFindsWhatEachPostureAloneCannotTell) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  State found = state();
  const double cost = fit.fit(found, {.from_px = 30.0, .variance_px2 = 0.1});
  EXPECT_LT(cost, 0.05) << "px^2 of an outline point";
  EXPECT_LT((found.x() - truth(found).x()).head(7).cwiseAbs().maxCoeff(), radians(0.3));
  EXPECT_NEAR(found.x()[7], 0.006, 5e-4);
}

TEST_F(LogFitOfOwnRobot, ResultsDoNotDependOnTheNumberOfThreads) {
  const auto log = log_of(seen_);
  std::vector<Eigen::VectorXd> found;
  for (const int threads : {1, 3}) {
    LogFit fit(*log, threads);
    State own = state();
    fit.fit(own, {.iterations = 3, .from_px = 12.0});
    found.push_back(own.x());
  }
  EXPECT_EQ(found[0], found[1]);
}

TEST_F(LogFitOfOwnRobot, TheTruthExplainsThePicturesAndNothingElseDoesAsWell) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  const State right = truth(state());
  State wrong = right;
  Eigen::VectorXd x = right.x();
  x[7] = 0.0;
  wrong.set(x);
  const OutlineSearch search{.search_px = 6.0};
  const auto at = fit.linearise(right.model(), {}, search), elsewhere = fit.linearise(wrong.model(), {}, search);
  EXPECT_LT(at.rms_px(), 0.2);
  EXPECT_GT(at.matched_share(), 0.95);
  EXPECT_GT(elsewhere.rms_px(), 0.5);
  EXPECT_LT(fit.misfit(at, at.sampled()), 0.2 * fit.misfit(elsewhere, at.sampled()));
  // A prediction that drops much of the outline out of the pictures is no better fit.
  EXPECT_GT(fit.misfit(at, 2.0 * at.sampled()), fit.misfit(at, at.sampled()));
}

/// Where an arm is predicted in no picture nothing lies off: a search that strayed there stayed.
TEST_F(LogFitOfOwnRobot, AnArmThatIsPredictedInNoPictureFitsWorst) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  const State right = truth(state());
  State away = right;
  Eigen::VectorXd x = right.x();
  x[0] += radians(170.0);
  away.set(x);
  const auto at = fit.linearise(right.model(), {}, {}), elsewhere = fit.linearise(away.model(), {}, {});
  ASSERT_EQ(elsewhere.sampled(), 0.0);
  EXPECT_GT(fit.misfit(elsewhere, 0.0), fit.misfit(at, at.sampled()));
}

/// Evidence over parameters is that over coordinates: a step along it leads to the truth.
TEST_F(LogFitOfOwnRobot, EvidenceAboutParametersPointsToTheTruth) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  State near = truth(state());
  Eigen::VectorXd x = near.x();
  x[3] += radians(0.4);
  x[7] -= 0.001;
  near.set(x);
  std::vector<ParameterRef> refs;
  for (const auto& p : near.parameters()) refs.push_back(p.ref);
  const auto coordinates = fit.moved_by(near.model(), refs);
  const auto at = fit.linearise(near.model(), coordinates, {});
  StateEvidence all;
  for (const auto& picture : fit.project(at, near.model(), refs)) all.add(picture);
  const Eigen::VectorXd step = all.A.ldlt().solve(all.b);
  EXPECT_NEAR(step[3], -radians(0.4), radians(0.1));
  EXPECT_NEAR(step[7], 0.001, 3e-4);
}

/// Outlines that pictures place exactly pull back as A says. Where each posture has the arm a little elsewhere, many
/// lie as far off as the robust scale reaches, and pull less the further they are.
TEST_F(LogFitOfOwnRobot, TheSlopeIsLessWhereOutlinesLieFarOff) {
  const auto slope = [&](const std::vector<Observation>& seen) {
    const auto log = log_of(seen);
    LogFit fit(*log, 2);
    State found = truth(state());
    fit.fit(found, {.variance_px2 = 0.1});
    return fit.slope(found, {.search_px = 8.0, .robust_px = 3.0}, 0.1, {}, test::seed());
  };
  const double exact = slope(seen_), rough = slope(with_postures_apart(1.0));
  EXPECT_GT(exact, 0.9);
  EXPECT_LT(rough, exact - 0.05);
  EXPECT_GT(rough, 0.25);
}

/// There the cost goes up and down by some ten thousandths from step to step; a fit once went on until a step happened
/// to change it by a tenth of that.
TEST_F(LogFitOfOwnRobot, AFitEndsWhereStepsNoLongerLowerItsCost) {
  constexpr int kLogs = 30, kSteps = 40;
  int steps = 0;
  for (std::uint64_t k = 0; k < kLogs; ++k) {
    const auto log = log_of(with_postures_apart(1.0, k));
    LogFit fit(*log, 2);
    State found = truth(state());
    fit.fit(found, {.iterations = 12, .variance_px2 = 0.1});
    fit.fit(found, {.iterations = kSteps, .variance_px2 = 0.1, .progress = [&](double) { ++steps; }});
  }
  EXPECT_LT(steps, 3 * kLogs) << "a few logs have a way to go";
}

TEST_F(LogFitOfOwnRobot, OnlyWhatIsAskedForIsLookedAt) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 2);
  const std::vector<std::size_t> some = {3, 5};
  const auto at = fit.linearise(truth(state()).model(), {}, {}, some);
  for (std::size_t p = 0; p < at.evidence.size(); ++p) EXPECT_EQ(at.evidence[p].sampled > 0.0, p == 3 || p == 5) << p;
}

TEST_F(LogFitOfOwnRobot, KnowsWhichCoordinatesAParameterMovesInAnyPicture) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  ErrorModel model(roles_);
  model.add("joint_offset", {"r_elbow", ""});
  model.add("baseline", {});
  const auto moved = fit.moved_by(model, fitted_parameters(model));
  const auto position = [&](Coordinate::Kind kind, Eigen::Index index) {
    return static_cast<std::uint32_t>(fit.coordinates().find({kind, index}));
  };
  EXPECT_EQ(moved, (std::vector{position(Coordinate::Kind::kJoint, roles_.index("r_elbow")),
                                position(Coordinate::Kind::kCameraShift, 0)}));
}

/// Somebody else's arm in one picture: it costs, and pulls at nothing.
TEST_F(LogFitOfOwnRobot, APictureOfSomethingElseSaysNothing) {
  auto seen = seen_;
  auto& mask = seen[2].cameras[0]->mask;
  const BinaryMask arm = mask;
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) mask.set(u, v, u < 80);
  }
  seen[2].cameras[0]->coverage.clear();
  const auto log = log_of(seen);
  LogFit fit(*log, 1);
  const State right = truth(state());
  std::vector<ParameterRef> refs;
  for (const auto& p : right.parameters()) refs.push_back(p.ref);
  const auto at = fit.linearise(right.model(), fit.moved_by(right.model(), refs), {});
  const std::size_t strange = 4;
  EXPECT_EQ(at.evidence[strange].weight, 0.0);
  EXPECT_EQ(at.evidence[strange].A.norm(), 0.0);
  EXPECT_GT(at.evidence[strange].misfit, 10.0 * at.evidence[strange + 1].misfit);
  State found = state();
  fit.fit(found, {.from_px = 30.0, .variance_px2 = 0.1});
  EXPECT_NEAR(found.x()[7], 0.006, 1e-3);
}

/// What pictures hardly tell stays where it is believed to be.
TEST_F(LogFitOfOwnRobot, BeliefsHoldWhatNoPictureTells) {
  const auto log = log_of({seen_[0]});
  LogFit fit(*log, 1);
  State found(roles_, beliefs({{"base_shift", {}, {0.002, 0.002, 0.002}}}));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(10);
  x.head(7) = paper_offsets_rad().array() + radians(0.7);
  found.set(x);  // one posture alone leads astray from afar
  fit.fit(found, {.from_px = 10.0, .variance_px2 = 0.1});
  for (Eigen::Index k = 7; k < 10; ++k) EXPECT_LT(std::abs(found.x()[k]), 3.0 * 0.002) << k;
}

/// A soft joint stands where its drive and gravity's torque there agree, not where the torque of a stiff arm, or of one
/// that has sagged once, would have it.
TEST_F(LogFitOfOwnRobot, ASoftJointStandsWhereItsTorqueHasIt) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  ErrorModel model(roles_);
  const double softness = radians(3.0);  // rad/Nm: it gives way by up to 15 deg
  model.add("compliance", {"r_shoulder_pitch", ""}).parameters()[0].value = softness;
  const auto joint = roles_.index("r_shoulder_pitch");
  const auto predicted = fit.predict(model, {});
  double most = 0.0;
  for (std::size_t p = 0; p < predicted.corrections.size(); ++p) {
    const auto& dq = predicted.corrections[p].dq;
    Instant there;
    log->instant(p, -dq, there);
    EXPECT_NEAR(dq[joint], softness * there.gravity_torque[joint], 2e-5);
    most = std::max(most, std::abs(dq[joint]));
  }
  EXPECT_GT(most, radians(5.0));
}

}  // namespace
}  // namespace bodyschema
