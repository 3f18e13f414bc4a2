#include "regression.hpp"

#include <gtest/gtest.h>

#include <random>

#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema::diagnosis {
namespace {

/// Twelve pictures with three coordinates in two blocks of three cells, two pictures a cell.
struct Toy {
  std::vector<CompressedView> views;
  std::vector<SparseColumn> columns;
  BlockPlan plan;
  std::vector<Eigen::Matrix3d> A;
  std::vector<Eigen::Vector3d> b;

  explicit Toy(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    columns.resize(2);
    for (int v = 0; v < 12; ++v) {
      Eigen::Matrix3d root;
      for (int i = 0; i < 9; ++i) root(i) = normal(random);
      A.push_back(root.transpose() * root);
      b.push_back(Eigen::Vector3d(normal(random), normal(random), normal(random)));
      views.push_back({A.back(), b.back(), 10.0, 5.0, 0.0, 0.0});
      columns[0].views.push_back({{0, static_cast<float>(normal(random))}});
      columns[1].views.push_back({{1, static_cast<float>(normal(random))}, {2, 0.5f}});
      plan.block_of_view.push_back(static_cast<std::size_t>(v / 6));
      plan.cell_of_view.push_back(static_cast<std::size_t>(v % 6 / 2));
      plan.weight_of_view.push_back(v < 6 ? 1.0 : 0.5);
    }
    plan.cell_start_s = {{0.0, 1.0, 2.0}, {3.0, 4.0, 5.0}};
  }

  /// The columns of one picture as a dense map from parameters to coordinates.
  [[nodiscard]] Eigen::Matrix<double, 3, 2> map(std::size_t v) const {
    Eigen::Matrix<double, 3, 2> m = Eigen::Matrix<double, 3, 2>::Zero();
    for (int c = 0; c < 2; ++c) {
      for (const auto& e : columns[static_cast<std::size_t>(c)].views[v])
        m(e.coordinate, c) = static_cast<double>(e.value);
    }
    return m;
  }
};

TEST(Accumulate, IsTheSumOfTheBlocksPictures) {
  const Toy toy(test::seed());
  const auto statistics = accumulate(toy.views, toy.plan, {&toy.columns[0], &toy.columns[1]});
  ASSERT_EQ(statistics.block_count(), 2u);
  for (std::size_t block = 0; block < 2; ++block) {
    Eigen::Matrix2d H = Eigen::Matrix2d::Zero();
    Eigen::Vector2d g = Eigen::Vector2d::Zero();
    for (std::size_t v = 6 * block; v < 6 * block + 6; ++v) {
      H += toy.plan.weight_of_view[v] * toy.map(v).transpose() * toy.A[v] * toy.map(v);
      g += toy.plan.weight_of_view[v] * toy.map(v).transpose() * toy.b[v];
    }
    EXPECT_LT((statistics.blocks()[block].information - H).norm(), 1e-9);
    EXPECT_LT((statistics.blocks()[block].vector - g).norm(), 1e-9);
  }
  EXPECT_DOUBLE_EQ(statistics.blocks()[1].square, 30.0);
}

TEST(Accumulate, ATailBeginsWithItsCell) {
  const Toy toy(test::seed());
  const auto statistics = accumulate(toy.views, toy.plan, {&toy.columns[0], &toy.columns[1]}, 1);
  const auto& tails = statistics.blocks()[0].tails;
  ASSERT_EQ(tails.size(), 2u);
  for (std::size_t cell = 1; cell < 3; ++cell) {
    Eigen::RowVector2d H = Eigen::RowVector2d::Zero();
    double g = 0.0;
    for (std::size_t v = 2 * cell; v < 6; ++v) {
      H += toy.map(v).col(0).transpose() * toy.A[v] * toy.map(v);
      g += toy.map(v).col(0).dot(toy.b[v]);
    }
    EXPECT_LT((tails[cell - 1].information - H).norm(), 1e-9);
    EXPECT_NEAR(tails[cell - 1].vector[0], g, 1e-9);
  }
}

TEST(EffectColumns, AreTheChangePerTypicalSize) {
  const auto log = make_synthetic_log(test::robot(), {}, 1);
  const auto& roles = log->roles();
  const CoordinateLayout layout(roles);
  const auto elbow = roles.index("r_elbow");
  const auto at = linearise(*log, ErrorModel(roles));
  for (const double value : {0.0, 0.03}) {  // a secant from zero, a derivative elsewhere
    std::vector<std::unique_ptr<Effect>> effects;
    effects.push_back(make_effect("encoder_gain", {"r_elbow", ""}, roles));
    effects[0]->parameters()[0].value = value;
    const auto columns = effect_columns(*log, at, effects, layout);
    ASSERT_EQ(columns.size(), 1u);
    const double typical = effects[0]->parameters()[0].typical;
    for (const std::size_t v : {std::size_t{0}, std::size_t{77}, std::size_t{301}}) {
      Corrections one(at.corrections[v].dq.size()), two = one;
      effects[0]->apply(at.instants[v], one);
      auto more = effects[0]->clone();
      more->parameters()[0].value += typical;
      more->apply(at.instants[v], two);
      double column = 0.0;
      for (const auto& e : columns[0].views[v]) {
        EXPECT_EQ(static_cast<Eigen::Index>(e.coordinate), layout.joint(elbow));
        column += static_cast<double>(e.value);
      }
      EXPECT_NEAR(column, two.dq[elbow] - one.dq[elbow], 1e-6);  // a gain is linear in its size
    }
  }
}

}  // namespace
}  // namespace bodyschema::diagnosis
