#include "model_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "random_seed.hpp"
#include "simulated_log.hpp"

namespace bodyschema::diagnosis {
namespace {

/// How much less pictures of one posture weigh than if each were a witness of its own.
double weight_of_one_posture(double rate_hz, double& span_s, double& pictures_per_camera) {
  test::Simulated what;
  what.seconds = 10.0;
  what.rate_hz = rate_hz;
  test::SimulatedLog log(what);
  DiagnosisOptions options;
  options.block_s = 0.5;
  options.same_posture_rad = 10.0;  // all of the log
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto sum = [&](double block_s) {
    const auto about = search.about(block_s);
    EXPECT_EQ(about.blocks, 1u);
    return std::accumulate(about.precision.begin(), about.precision.end(), 0.0);
  };
  const auto pictures = log.pictures().pictures();
  span_s = seconds(pictures.back().joints.utime - pictures.front().joints.utime);
  pictures_per_camera = 0.5 * static_cast<double>(pictures.size());
  return sum(1.0) / sum(20.0);
}

/// An arm that stands shows the same posture in all its pictures, which err alike: they weigh as much as those of one
/// block of the shortest length, however long it stands. Photographs that are further apart weigh as one.
TEST(ModelSearch, PicturesOfOnePostureCountAsOneBlock) {
  double span_s = 0.0, pictures = 0.0;
  const double many = weight_of_one_posture(5.0, span_s, pictures);
  ASSERT_GT(span_s, 9.0);
  EXPECT_NEAR(many, 1.0 / span_s, 1e-6);
  const double few = weight_of_one_posture(0.5, span_s, pictures);
  ASSERT_LT(pictures, span_s);
  EXPECT_NEAR(few, 1.0 / pictures, 1e-6);
}

/// What moves is told as before.
TEST(ModelSearch, PicturesOfAnArmThatMovesCountInFull) {
  test::Simulated what;
  what.seconds = 14.0;
  test::SimulatedLog log(what);
  const DiagnosisOptions options;
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto about = search.about(1.0);
  ASSERT_GT(about.blocks, 8u);
  const double most = *std::max_element(about.precision.begin(), about.precision.end());
  const auto full =
      std::count_if(about.precision.begin(), about.precision.end(), [&](double p) { return p > 0.7 * most; });
  EXPECT_GT(full, 0.6 * static_cast<double>(about.precision.size()));
}

/// What is considered besides, as where pictures place a whole flank, has a share in where all pictures together have
/// the robot: the state goes there, although the state alone explains them a little worse then. It stayed behind, up to
/// four standard deviations, and intervals were those of where it had not gone.
TEST(ModelSearch, ThePolishedStateIsWhereThePicturesPullNoFurther) {
  test::Simulated what;
  what.seed = test::seed();
  what.seconds = 14.0;
  what.faults = {"cover_dilation:part=forearm,value=0.5"};
  test::SimulatedLog log(what);
  const DiagnosisOptions options;
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  const auto pull = [&] {
    const auto base = search.regression(search.about(options.block_s));
    const auto n = search.state().size();
    const Eigen::VectorXd sd = base.covariance().diagonal().head(n).cwiseSqrt();
    return base.step().head(n).cwiseQuotient(sd).cwiseAbs().maxCoeff();
  };
  const double before = pull();
  search.polish(options.block_s);
  RecordProperty("before", std::to_string(before));
  EXPECT_GT(before, 0.5) << "nothing to do";
  EXPECT_LT(pull(), 0.1);
}

/// From a place beside it, one step leads back to where the pictures have the robot. By what A says alone it falls
/// short of that by some hundredths, and intervals are too narrow by as much.
TEST(ModelSearch, AStepGoesAllTheWay) {
  test::Simulated what;
  what.seed = test::seed();
  test::SimulatedLog log(what);
  const DiagnosisOptions options;
  ModelSearch search(log.fit(), log.beliefs().state, log.beliefs().tolerances, options);
  search.start();
  search.polish(options.block_s);
  const auto there = search.now();
  const auto n = there.state.size();
  const auto regression = [&] { return search.regression(search.about(options.block_s)); };
  const auto here = regression();
  Eigen::MatrixXd all = here.precision().asDiagonal();
  for (const auto& block : here.parts()) all += block.H;
  // Of the state, with what is considered besides left free.
  const Eigen::MatrixXd H = all.inverse().topLeftCorner(n, n).inverse();
  const Eigen::LLT<Eigen::MatrixXd> root(H);
  std::mt19937_64 random(test::seed());
  std::normal_distribution<double> normal;
  double left = 0.0, whole = 0.0;
  for (int way = 0; way < 8; ++way) {
    const Eigen::VectorXd away =
        root.matrixU().solve(Eigen::VectorXd::NullaryExpr(n, [&] { return normal(random); })).eval();
    auto beside = there;
    beside.state.set(there.state.x() + away);
    search.go_back_to(std::move(beside));
    const Eigen::VectorXd back = regression().step().head(n) - here.step().head(n);
    left += away.dot(H * (away + back));
    whole += away.dot(H * away);
  }
  RecordProperty("left", std::to_string(left / whole));
  EXPECT_LT(std::abs(left), 0.05 * whole);
}

}  // namespace
}  // namespace bodyschema::diagnosis
