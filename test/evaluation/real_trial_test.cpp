#include "real_trial.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "temporary_folder.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Photographs of a physical arm with offsets of 4 deg standard deviation hidden in its encoders.
RealTrialOptions arm_before(const char* set, std::uint64_t seed) {
  RealTrialOptions options;
  options.set = data_folder() / "real" / set;
  options.urdf = data_folder() / "real/robots/lbr_med7/lbr_med7.urdf";
  options.hidden.offsets_deg = draw_offsets(options.set, seed, 4.0);
  return options;
}

// No start of the search got beyond 24 px^2 with masks of what moved, where others get to 14, and a second place was
// only 1.1 times as bad: "another place of the camera explains the pictures nearly as well". The finer masks that
// followed brought the first one to the right answer all the same.
TEST(RealTrial, APlaceThatOnlyRoughMasksAllowIsNoRival) {
  SKIP_WITHOUT("real");
  const TemporaryFolder folder;
  RealTrialOptions options = arm_before("lbr_zed10", 2077);
  options.masks = false;
  const RealTrial trial = run_real_trial(options, folder.path() / "trial");
  EXPECT_EQ(trial.calibration.state, CalibrationState::kGood) << trial.calibration.sentence;
  for (const auto& joint : trial.calibration.joints) {
    if (!joint.told) continue;
    EXPECT_NEAR(degrees(joint.offset_rad), options.hidden.offsets_deg.at(joint.name), 0.5) << joint.name;
  }
}

// Where a tool begins that no URDF shows, masks put the wrist elsewhere, alike in all postures: none contradicted the
// others, and a joint was told 1.47 deg off at a standard deviation of 0.49 deg. The pictures have the wrist where it
// is.
TEST(RealTrial, WhatGivenMasksGetWrongInAllPosturesIsSaid) {
  SKIP_WITHOUT("real");
  const TemporaryFolder folder;
  const RealTrialOptions options = arm_before("lbr_zed5", 1795683057);
  const RealTrial trial = run_real_trial(options, folder.path() / "trial");
  EXPECT_EQ(trial.calibration.state, CalibrationState::kGood) << trial.calibration.sentence;
  EXPECT_THAT(trial.calibration.remarks, Contains(HasSubstr("own edges disagree about lbr_A6")));
  for (const auto& joint : trial.calibration.joints) {
    if (!joint.told) continue;
    EXPECT_NEAR(degrees(joint.offset_rad), options.hidden.offsets_deg.at(joint.name),
                2.5 * std::hypot(degrees(joint.sd_rad), 0.1))
        << joint.name;
  }
}

}  // namespace
}  // namespace bodyschema
