#include "nearer_model.hpp"

#include <gtest/gtest.h>

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

TEST(NearerModel, FindsNothingWhereOffsetsExplainIt) {
  EXPECT_FALSE(look({}).model.has_value());
}

}  // namespace
}  // namespace bodyschema::diagnosis
