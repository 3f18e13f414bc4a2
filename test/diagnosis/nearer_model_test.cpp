#include "nearer_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bodyschema/effects/catalogue.hpp"
#include "diagnosis_trials/trial_robot.hpp"

namespace bodyschema::diagnosis {
namespace {

/// What nearer_model makes of a log: the offsets alone, and what came of them.
struct Looked {
  double offsets_alone = 0.0, nearer = 0.0;  ///< misfit
  std::optional<ErrorModel> model;
};

Looked look(const std::vector<TrialFault>& faults) {
  TrialOptions options;
  options.duration_s = 30.0;
  options.faults = faults;
  const auto log = make_synthetic_log(test::robot(), options, test::log_seed());
  const CoordinateLayout layout(log->roles());
  ModelFitter fitter(*log, layout, 2.0);
  ErrorModel offsets(log->roles());
  for (const auto& target : effect_targets("joint_offset", log->roles())) offsets.add("joint_offset", target);
  const auto before = fitter.fit(offsets, {}, {8, {}});
  std::vector<CauseName> causes;
  for (const char* name : {"link_length", "base_shift", "axis_shift", "encoder_gain", "vergence"}) {
    for (const auto& target : effect_targets(name, log->roles())) causes.push_back({name, target.joint, target.source});
  }
  Looked looked;
  const double points = outline_points(before.at);
  looked.offsets_alone = misfit(before.at, points);
  looked.model = nearer_model(*log, layout, fitter, offsets, causes);
  if (looked.model) looked.nearer = misfit(linearise(*log, *looked.model), points);
  return looked;
}

TEST(NearerModel, FindsSeveralLengthsThatAreFarOff) {
  const auto looked = look({{{"link_length", "r_wrist_prosup", ""}, 25.0}, {{"base_shift", "", ""}, 15.0, -20.0}});
  ASSERT_TRUE(looked.model.has_value());
  EXPECT_LT(looked.nearer, 0.3 * looked.offsets_alone);
  auto model = *looked.model;
  const Effect* forearm = model.find("link_length", {"r_wrist_prosup", ""});
  const Effect* shift = model.find("base_shift", {});
  ASSERT_NE(forearm, nullptr);
  ASSERT_NE(shift, nullptr);
  EXPECT_NEAR(forearm->parameters()[0].in_unit(), 25.0, 2.0);
  EXPECT_NEAR(shift->parameters()[0].in_unit(), 15.0, 2.0);
  EXPECT_NEAR(shift->parameters()[1].in_unit(), -20.0, 2.0);
}

TEST(NearerModel, NoRobotIsBuiltSoWrongThatItsElbowTiltsByThirtyDegrees) {
  const auto tilted = [](double deg) {
    ErrorModel model(JointRoles::of(test::robot().model, test::robot().setup, test::robot().rig));
    model.add("axis_tilt", {"r_elbow", ""}).parameters()[0].value = radians(deg);
    model.add("joint_offset", {"r_elbow", ""}).parameters()[0].value = radians(40.0);  // which may well be
    return plausible(model);
  };
  EXPECT_TRUE(tilted(5.0));
  EXPECT_FALSE(tilted(-30.0));
}

/// A log in which the elbow slips by 6 deg, a model that knows it, and when it happened.
struct Slipped {
  std::unique_ptr<SyntheticMeasurement> log;
  ErrorModel model{JointRoles{}};
  double time_s = 0.0;
};
Slipped slipped() {
  TrialOptions options;
  options.duration_s = 30.0;
  options.faults = {{{"slip", "r_elbow", ""}, 6.0, 0.7}};
  Slipped s{make_synthetic_log(test::robot(), options, test::log_seed())};
  const auto& corrections = s.log->true_corrections();
  const auto& roles = s.log->roles();
  const auto elbow = std::find(roles.arm.begin(), roles.arm.end(), roles.index("r_elbow")) - roles.arm.begin();
  for (Eigen::Index v = 1; v < corrections.rows(); ++v) {
    if (std::abs(corrections(v, elbow) - corrections(v - 1, elbow)) < radians(3.0)) continue;
    s.time_s = seconds(s.log->views()[static_cast<std::size_t>(v)].joints.utime) - 1e-3;
  }
  s.model = ErrorModel(roles);
  for (const auto& target : effect_targets("joint_offset", roles)) s.model.add("joint_offset", target);
  auto& slip = s.model.add("slip", {"r_elbow", ""});
  slip.parameters()[1].value = s.time_s;
  const CoordinateLayout layout(roles);
  ModelFitter(*s.log, layout, 2.0).fit(s.model, {}, {8, {}});
  return s;
}

TEST(NearerModel, ASlipThatTheModelLacksIsATurning) {
  auto s = slipped();
  const auto found = turning(*s.log, linearise(*s.log, s.model));
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(found->unlike, 3.0) << "with the slip in the model";
  s.model.find("slip", {"r_elbow", ""})->parameters()[0].value = 0.0;
  const auto lacking = turning(*s.log, linearise(*s.log, s.model));
  ASSERT_TRUE(lacking.has_value());
  EXPECT_GT(lacking->unlike, 8.0);
  EXPECT_NEAR(lacking->time_s, s.time_s, 0.5);
  EXPECT_TRUE(lacking->later_is_worse);
  EXPECT_GT(lacking->worse_share, 0.05);
  EXPECT_LT(lacking->worse_share, 0.5);
}

TEST(NearerModel, ASlipMovesToWhenTheOutlinesAskForIt) {
  auto s = slipped();
  EXPECT_FALSE(retime_slips(*s.log, s.model)) << "where it is right already";
  for (const double off_s : {-5.0, 3.0}) {
    s.model.find("slip", {"r_elbow", ""})->parameters()[1].value = s.time_s + off_s;
    EXPECT_TRUE(retime_slips(*s.log, s.model));
    EXPECT_NEAR(s.model.find("slip", {"r_elbow", ""})->parameters()[1].value, s.time_s, 0.3);
  }
}

TEST(NearerModel, FindsNothingWhereOffsetsExplainIt) {
  EXPECT_FALSE(look({}).model.has_value());
}

}  // namespace
}  // namespace bodyschema::diagnosis
