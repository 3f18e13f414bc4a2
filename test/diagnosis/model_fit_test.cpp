#include "model_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr double kDeg = 3.14159265358979323846 / 180.0;

ErrorModel offsets_of(const MeasurementSource& log, double each_deg) {
  ErrorModel model(log.roles());
  for (const auto& target : effect_targets("joint_offset", log.roles())) {
    model.add("joint_offset", target).parameters()[0].value = each_deg * kDeg;
  }
  return model;
}

TEST(ModelFitter, EndsAtTheSamePlaceWhereverItBegins) {
  const auto log = make_synthetic_log(test::robot(), {}, test::log_seed());
  const CoordinateLayout layout(log->roles());
  ModelFitter fitter(*log, layout, 2.0);
  auto near = offsets_of(*log, 0.0), far = offsets_of(*log, 12.0);
  const auto a = fitter.fit(near, {}, {8, {}}), b = fitter.fit(far, {}, {12, {}});
  EXPECT_NEAR(misfit(a.at, outline_points(a.at)), misfit(b.at, outline_points(a.at)), 1e-3);
  EXPECT_LT((near.offsets() - far.offsets()).cwiseAbs().maxCoeff(), 0.02 * kDeg);
}

/// A log, as it is.
class Forwarded : public MeasurementSource {
 public:
  explicit Forwarded(MeasurementSource& log) : log_(log) {}
  const JointRoles& roles() const override { return log_.roles(); }
  std::span<const ViewInput> views() const override { return log_.views(); }
  std::span<const JointSample> stream() const override { return log_.stream(); }
  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    log_.instant(view, offsets, out);
  }
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    log_.compress(corrections, out);
  }
  Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& c) override { return log_.hand_jacobian(view, c); }

 private:
  MeasurementSource& log_;
};

/// A log whose regression points the wrong way, as it does where every counterpart belongs to
/// another part of the outline.
class Misleading final : public Forwarded {
 public:
  using Forwarded::Forwarded;
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    Forwarded::compress(corrections, out);
    for (auto& view : out) view.vector *= -3.0;
  }
};

TEST(ModelFitter, TakesNoStepThatMakesTheOutlinesWorse) {
  const auto log = make_synthetic_log(test::robot(), {}, test::log_seed());
  Misleading misleading(*log);
  const CoordinateLayout layout(log->roles());
  ModelFitter fitter(misleading, layout, 2.0);
  auto model = offsets_of(*log, 1.0);
  const auto begin = fitter.about(model, {});
  const auto end = fitter.fit(model, {}, {6, {}});
  const double points = outline_points(begin.at);
  EXPECT_LE(misfit(end.at, points), 1.01 * misfit(begin.at, points));
}

/// Counts how often a log is looked at.
class Counted final : public Forwarded {
 public:
  using Forwarded::Forwarded;
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override {
    ++looks;
    Forwarded::compress(corrections, out);
  }
  int looks = 0;
};

/// A free curve stays beside the model, so its step never shrinks.
TEST(ModelFitter, StopsWhereTheParametersDoWhateverExtraColumnsAskFor) {
  TrialOptions options;
  options.faults = {{{"wobble", "r_elbow", ""}, 2.0, 8.0, 0.0}};
  const auto log = make_synthetic_log(test::robot(), options, test::log_seed());
  const CoordinateLayout layout(log->roles());
  std::vector<double> curve;
  const double begin = seconds(log->views().front().joints.utime);
  for (const auto& view : log->views()) {
    curve.push_back(kDeg * std::sin(2.0 * 3.14159265358979323846 / 8.0 * (seconds(view.joints.utime) - begin)));
  }
  const auto column = joint_column(layout, log->roles().index("r_elbow"), curve);
  constexpr int kIterations = 20;
  Counted counted(*log);
  ModelFitter fitter(counted, layout, 2.0);
  auto model = offsets_of(*log, 0.0);
  fitter.fit(model, {&column}, {.iterations = kIterations, .from_afar = false});
  EXPECT_LT(counted.looks, kIterations);  // 16; every iteration takes two
}

TEST(Misfit, CountsPointsThatLeftThePictures) {
  Linearisation all, few;
  all.views.push_back({{}, {}, 0.0, 0.0, 200.0, 100.0});
  few.views.push_back({{}, {}, 0.0, 0.0, 20.0, 10.0});
  EXPECT_DOUBLE_EQ(misfit(all, 100.0), 2.0);
  EXPECT_GT(misfit(few, 100.0), 10.0);  // no better for showing a tenth of the outline
  EXPECT_DOUBLE_EQ(misfit(few, 10.0), 2.0);
}

TEST(Misfit, StandsForADistance) {
  EXPECT_DOUBLE_EQ(typical_distance_px(0.25), 0.5);  // quadratic within a pixel
  EXPECT_DOUBLE_EQ(typical_distance_px(9.0), 5.0);   // 2 |r| - 1 beyond
}

}  // namespace
}  // namespace bodyschema::diagnosis
