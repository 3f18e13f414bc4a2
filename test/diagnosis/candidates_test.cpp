#include "candidates.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "findings.hpp"
#include "model_search.hpp"
#include "simulated_log.hpp"

namespace bodyschema::diagnosis {
namespace {

/// A short log about the truth: its offsets are known and nothing else is wrong, but for what a test adds.
class Candidates : public testing::Test {
 protected:
  static test::Simulated what() {
    test::Simulated w;
    w.seconds = 14.0;
    w.rate_hz = 4.0;
    return w;
  }
  explicit Candidates(const test::Simulated& w = what())
      : log_(w), search_(log_.fit(), log_.beliefs().state, log_.beliefs().tolerances, options_) {
    search_.start();
  }
  [[nodiscard]] const Candidate* find(const std::vector<Candidate>& list, const CauseName& cause) const {
    const auto at = std::find_if(list.begin(), list.end(), [&](const auto& c) { return c.cause == cause; });
    return at == list.end() ? nullptr : &*at;
  }

  test::SimulatedLog log_;
  DiagnosisOptions options_;
  ModelSearch search_;
};

TEST_F(Candidates, AreTheWholeCatalogueButForWhatIsFoundOrCannotBeTested) {
  auto about = search_.about(1.0);
  about.found = {{"latency", "", ""}};
  const auto list = catalogue_candidates(log_.fit(), about, {{{"backlash", "r_elbow", ""}, "for a test"}});
  std::map<std::string, std::size_t> count;
  for (const auto& c : list) {
    ++count[c.cause.name];
    EXPECT_FALSE(c.generic());
    EXPECT_EQ(c.columns.d.size(), about.blocks);
    EXPECT_EQ(c.columns.size(), static_cast<Eigen::Index>(c.parameters.size())) << c.cause.text();
  }
  for (const auto& kind : effect_kinds()) {
    const auto& name = kind.get().name;
    std::size_t expected = kind.get().targets(log_.roles()).size();
    if (name == "joint_offset" || name == "slip" || name == "latency" || kind.get().where_believed) expected = 0;
    if (name == "backlash") expected -= 1;
    EXPECT_EQ(count[name], expected) << name;
  }
  EXPECT_EQ(find(list, {"backlash", "r_elbow", ""}), nullptr);
  EXPECT_EQ(find(list, {"axis_tilt", "r_elbow", ""})->columns.size(), 2);
}

/// What a candidate's column says a cause would move is what it does move.
TEST_F(Candidates, ColumnsAreWhatTheEffectMoves) {
  const auto about = search_.about(1.0);
  const auto elbow = log_.roles().index("r_elbow");
  const Candidate gain{.cause = {"encoder_gain", "r_elbow", ""}, .variable = {}, .parameters = {0}};
  const auto directions = directions_of(log_.fit(), about, gain);
  const auto joint = log_.fit().coordinates().find({Coordinate::Kind::kJoint, elbow});
  for (const std::size_t p : {std::size_t{0}, directions.size() / 2, directions.size() - 1}) {
    double moved = 0.0;
    for (const auto& step : directions[p][0]) {
      EXPECT_EQ(static_cast<Eigen::Index>(step.coordinate), joint);
      moved += step.amount;
    }
    EXPECT_NEAR(moved, about.at.instants[p].q[elbow], 1e-6);  // dq = gain * q
  }
  // Sums over blocks are those over pictures.
  const auto columns = added_columns(about, directions);
  double d = 0.0, C = 0.0;
  for (std::size_t p = 0; p < directions.size(); ++p) {
    d += about.precision[p] * gradient(about.at.evidence[p], directions[p][0]);
    C += about.precision[p] * product(about.at.evidence[p], directions[p][0], directions[p][0]);
  }
  double d_blocks = 0.0, C_blocks = 0.0;
  for (std::size_t b = 0; b < about.blocks; ++b) {
    d_blocks += columns.d[b][0];
    C_blocks += columns.C[b](0, 0);
  }
  EXPECT_NEAR(d_blocks, d, 1e-9 * std::abs(C));
  EXPECT_NEAR(C_blocks, C, 1e-9 * C);
}

TEST_F(Candidates, FreeCurvesAreOfEveryArmJointOverWhatItDoes) {
  const auto about = search_.about(1.0);
  const auto curves = free_curves(log_.fit(), about);
  std::map<std::string, std::set<std::string>> variables;
  for (const auto& c : curves) {
    EXPECT_TRUE(c.generic());
    EXPECT_EQ(c.cause.name, "unexplained");
    variables[c.cause.joint].insert(c.variable);
    ASSERT_EQ(c.amounts.size(), static_cast<std::size_t>(c.columns.size()));
    for (const auto& column : c.amounts) {
      ASSERT_EQ(column.size(), log_.pictures().pictures().size());
      double mean = 0.0, square = 0.0;
      for (const double x : column) {
        mean += x / static_cast<double>(column.size());
        square += x * x / static_cast<double>(column.size());
      }
      EXPECT_NEAR(mean, 0.0, 1e-9) << "a constant is the joint's offset";
      EXPECT_NEAR(square, 1.0, 1e-6) << c.cause.joint << " " << c.variable;
    }
  }
  EXPECT_EQ(variables.size(), log_.roles().arm.size());
  EXPECT_THAT(variables.at("r_elbow"),
              testing::UnorderedElementsAre("time", "velocity", "acceleration", "angle", "torque"));
}

TEST_F(Candidates, SlipsAreOffsetsFromATimeOn) {
  const auto about = search_.about(1.0);
  const auto base = search_.regression(about);
  const auto all = slips(about, base, {{{"slip", "r_elbow", ""}, "for a test"}});
  EXPECT_EQ(all.best.size(), log_.roles().arm.size() - 1);
  EXPECT_EQ(find(all.best, {"slip", "r_elbow", ""}), nullptr);
  // Two pictures a frame; nearly every pair of frames is a time at which one may have happened.
  EXPECT_GT(all.all.size(), (log_.roles().arm.size() - 1) * (log_.pictures().pictures().size() / 2));
  const auto* pitch = find(all.best, {"slip", "r_shoulder_pitch", ""});
  ASSERT_NE(pitch, nullptr);
  EXPECT_DOUBLE_EQ(pitch->z(), base.score(pitch->columns).z());
  // The column of the effect itself.
  const auto columns = added_columns(about, directions_of(log_.fit(), about, *pitch));
  for (std::size_t b = 0; b < about.blocks; ++b) {
    EXPECT_NEAR(columns.C[b](0, 0), pitch->columns.C[b](0, 0), 1e-6 * (1.0 + columns.C[b](0, 0)));
    EXPECT_NEAR(columns.d[b][0], pitch->columns.d[b][0], 1e-6 * (1.0 + columns.C[b](0, 0)));
  }
}

/// Slipped in the middle of the log: found there, of that joint.
class SlippedElbow : public Candidates {
 protected:
  static test::Simulated slipped() {
    auto w = what();
    w.faults = {"slip:joint=r_elbow,value=2,at=7"};
    return w;
  }
  SlippedElbow() : Candidates(slipped()) {}
};

TEST_F(SlippedElbow, StandsOutMostWhereItHappened) {
  const auto about = search_.about(1.0);
  const auto best = slips(about, search_.regression(about), {}).best;
  const auto strongest =
      std::max_element(best.begin(), best.end(), [](const auto& a, const auto& b) { return a.z() < b.z(); });
  ASSERT_NE(strongest, best.end());
  EXPECT_EQ(strongest->cause.joint, "r_elbow");
  EXPECT_NEAR(seconds(strongest->from - log_.pictures().pictures().front().joints.utime), 7.0, 1.0);
}

TEST_F(Candidates, ASmallerOneIsToldByMoreOfTheLog) {
  const auto about = search_.about(1.0);
  const auto base = search_.regression(about);
  Candidate gain{.cause = {"encoder_gain", "r_elbow", ""}, .variable = {}, .parameters = {0}};
  gain.columns = added_columns(about, directions_of(log_.fit(), about, gain));
  gain.scores = base.score(gain.columns);
  EXPECT_TRUE(is_told(about, gain, 4.2));
  // Of two blocks no threshold of 4.2 normal deviations is reached before the gain is that of no robot.
  gain.scores.dof[0] = 0.5;
  EXPECT_FALSE(is_told(about, gain, 4.2));
}

TEST_F(Candidates, BlocksEndWhereTheArmHasMoved) {
  const auto about = search_.about(1.0);
  ASSERT_EQ(about.block_of.size(), log_.pictures().pictures().size());
  EXPECT_GE(about.blocks, 8u);
  EXPECT_TRUE(std::is_sorted(about.block_of.begin(), about.block_of.end()));
  // Longer ones are fewer, however far the arm went from picture to picture: that ended every block, and a diagnosis
  // whose neighbouring blocks erred alike never came to an end.
  EXPECT_LE(search_.about(4.0).blocks, 4u);
  const auto [first, last] = seen_span(log_.fit(), about.at);
  EXPECT_NEAR(last - first, 13.5, 1.0);
}

}  // namespace
}  // namespace bodyschema::diagnosis
