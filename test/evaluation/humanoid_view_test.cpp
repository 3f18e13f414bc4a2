#include "humanoid_view.hpp"

#include <gtest/gtest.h>

#include "bodyschema/core/installation.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

/// Whatever a calibration found: joints beside their places were left out once, and answers seemed to put the arm 10 px
/// off that lay 4 px off.
TEST(HumanoidView, HasTheHandWhereAllThatWasFoundPutsIt) {
  SKIP_WITHOUT("real");
  const auto configuration = Configuration::load(find_data_file("config/g1/estimator.yaml"));
  const HumanoidView view(configuration);
  const Pipeline pipeline(configuration);
  const EffectTarget wrist{"right_wrist_roll_joint", ""};
  Calibration calibration;
  calibration.cameras.resize(1);
  calibration.cameras.front().X_link_optical = view.nominal().X_link_optical;
  calibration.cameras.front().intrinsics = view.nominal().intrinsics;
  calibration.model.emplace(JointRoles::of(pipeline.shared_robot(), pipeline.setup(), pipeline.rig()));
  calibration.model->add("joint_place", wrist).parameters()[0].value = 0.01;
  calibration.model->add("camera_pose", {}).parameters()[0].value = 0.02;  // X_link_optical has it

  HumanoidModel model = view.nominal();
  model.take(calibration);
  const Pose before = view.hand(view.nominal(), {}), beside = view.hand(model, {});
  EXPECT_NEAR((beside.translation() - before.translation()).norm(), 0.01, 1e-9);
  EXPECT_TRUE(beside.linear().isApprox(before.linear(), 1e-9));

  calibration.model->add("joint_offset", wrist).parameters()[0].value = 0.3;
  model.take(calibration);
  const Pose turned = view.hand(model, {});
  EXPECT_NEAR(Eigen::AngleAxisd(turned.linear().transpose() * beside.linear()).angle(), 0.3, 1e-9);
}

}  // namespace
}  // namespace bodyschema
