#include "bodyschema/camera/stereo_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

using testing::HasSubstr;

const std::string kLeft =
    "cameras:\n  left: {link: l_eye, width: 320, height: 240, fx: 257, fy: 258, cx: 159.5, cy: 119.5";

StereoRig parse(const std::string& yaml) {
  return StereoRig::from(Configuration::parse(yaml).section("cameras"));
}

std::string message(const std::string& yaml) {
  try {
    parse(yaml);
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(StereoRig, ReadsOneCamera) {
  const StereoRig rig = parse(kLeft + "}\n");
  ASSERT_EQ(rig.cameras.size(), 1u);
  const CameraModel& camera = rig.cameras[0];
  EXPECT_EQ(camera.name, "left");
  EXPECT_EQ(camera.link, "l_eye");
  EXPECT_EQ(camera.intrinsics, (PinholeIntrinsics{320, 240, 257, 258, 159.5, 119.5}));
  EXPECT_FALSE(camera.has_distortion());
}

TEST(StereoRig, LeftComesFirst) {
  const StereoRig rig = parse(
      "cameras:\n"
      "  right: {link: r, width: 64, height: 48, fx: 50, fy: 50, cx: 31.5, cy: 23.5,"
      " distortion: [0.1, 0, 0, 0, 0]}\n"
      "  left: {link: l, width: 32, height: 24, fx: 25, fy: 25, cx: 15.5, cy: 11.5}\n");
  ASSERT_EQ(rig.cameras.size(), 2u);
  EXPECT_EQ(rig.cameras[0].link, "l");
  EXPECT_EQ(rig.cameras[1].link, "r");
  EXPECT_TRUE(rig.cameras[1].has_distortion());
  ASSERT_EQ(rig.intrinsics().size(), 2u);
  EXPECT_EQ(rig.intrinsics()[1].width, 64);
}

TEST(StereoRig, ReadsTheConfigurationsOfThisProject) {
  for (const char* robot : {"icub_right", "icub_unity", "icub_v2_5"}) {
    SCOPED_TRACE(robot);
    const auto file = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config" / robot / "robot.yaml";
    const StereoRig rig = StereoRig::from(Configuration::load(file).section("cameras"));
    ASSERT_EQ(rig.cameras.size(), 2u);
    for (const auto& camera : rig.cameras) {
      EXPECT_NEAR(camera.intrinsics.fx, 257.34, 0.01);
      EXPECT_EQ(camera.intrinsics.cx, 159.5);
      EXPECT_EQ(camera.intrinsics.cy, 119.5);
    }
  }
}

TEST(StereoRig, SaysWhatIsWrong) {
  EXPECT_THAT(message("cameras: {}\n"), HasSubstr("left"));
  EXPECT_THAT(message("robot: {}\n"), HasSubstr("left"));
  EXPECT_THAT(message("cameras:\n  left: {link: l}\n"), HasSubstr("cameras.left.width"));
  EXPECT_THAT(message(kLeft + ", distortion: [1, 2]}\n"), HasSubstr("k1, k2, p1, p2, k3"));
  EXPECT_THAT(message("cameras:\n  left: {link: l, width: 0, height: 240, fx: 257, fy: 258, cx: 1, cy: 1}\n"),
              HasSubstr("cameras.left.width"));
  EXPECT_THAT(message("cameras:\n  left: {link: l, width: 320, height: 240, fx: -5, fy: 258, cx: 1, cy: 1}\n"),
              HasSubstr("cameras.left.fx"));
  EXPECT_THAT(message("cameras:\n  left: {link: l, width: 320, height: 240, fx: .nan, fy: 258, cx: 1, cy: 1}\n"),
              HasSubstr("cameras.left.fx"));
}

}  // namespace
}  // namespace bodyschema
