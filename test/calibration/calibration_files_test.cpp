#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/calibration/calibrate.hpp"

namespace bodyschema {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(CalibrationTable, LeavesOutFingersOfWhichNothingIsFound) {
  Calibration calibration;
  calibration.parameters = {{"finger_offset of thumb angle", "deg", 0.4, 1.2, 5.0},
                            {"finger_offset of index angle", "deg", -4.0, 1.2, 5.0},
                            {"silhouette_bias dilation", "px", 0.01, 0.1, 0.3}};
  EXPECT_THAT(to_table(calibration),
              AllOf(Not(HasSubstr("thumb")), HasSubstr("finger_offset of index angle"), HasSubstr("silhouette_bias")));
}

}  // namespace
}  // namespace bodyschema
