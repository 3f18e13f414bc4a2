#include "bodyschema/camera/stereo_rig.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/camera/require_places.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

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

TEST(StereoRig, ACameraThatCouldBeAnywhereIsNoCameraToWorkWith) {
  EXPECT_NO_THROW(require_places(parse(kLeft + "}\n"), "a replay"));
  EXPECT_NO_THROW(require_places(parse(kLeft + ", pose: roughly, pose_sd_deg: 1, pose_sd_mm: 10}\n"), "a replay"));
  EXPECT_THAT([] { require_places(parse(kLeft + ", pose: unknown}\n"), "a replay"); },
              ::testing::ThrowsMessage<ConfigurationError>(::testing::AllOf(
                  HasSubstr("cameras.left.link"), HasSubstr("a replay needs it"), HasSubstr("calibrate"))));
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

const std::string kLens = "width: 64, height: 48, fx: 50, fy: 50, cx: 31.5, cy: 23.5";

TEST(StereoRig, TakesCamerasOfAnyNameInTheOrderOfTheirNumbers) {
  const StereoRig one = parse("cameras:\n  cam_high: {link: l, " + kLens + "}\n");
  ASSERT_EQ(one.cameras.size(), 1u);
  EXPECT_EQ(one.cameras[0].name, "cam_high");
  EXPECT_EQ(one.cameras[0].number(), 0);

  const StereoRig two = parse("cameras:\n  wrist: {link: w, " + kLens + "}\n  head-2: {link: h, " + kLens + "}\n");
  EXPECT_EQ(two.cameras[0].name, "wrist");
  EXPECT_EQ(two.cameras[1].number(), 1);

  const StereoRig mixed = parse("cameras:\n  right: {link: r, " + kLens + "}\n  top: {link: t, " + kLens + "}\n");
  EXPECT_EQ(mixed.cameras[0].name, "top");
  EXPECT_EQ(mixed.cameras[1].number(), 1);

  const StereoRig given =
      parse("cameras:\n  a: {image_type: 7, link: a, " + kLens + "}\n  b: {image_type: 3, link: b, " + kLens + "}\n");
  EXPECT_EQ(given.cameras[0].name, "b");
  EXPECT_EQ(given.cameras[1].number(), 7);

  EXPECT_EQ(parse("cameras:\n  right: {link: r, " + kLens + "}\n").cameras[0].number(), 1);
  EXPECT_EQ(parse("cameras:\n  left: null\n  top: {link: r, " + kLens + "}\n").cameras.size(), 1u);
  EXPECT_THAT(message("cameras:\n  a: {image_type: 1, link: a, " + kLens + "}\n  right: {link: b, " + kLens + "}\n"),
              HasSubstr("cameras.right.image_type"));
  EXPECT_THAT(message("cameras:\n  a/b: {link: a, " + kLens + "}\n"), HasSubstr("letters, digits"));
  EXPECT_THAT(message("cameras:\n  a: {link: a, " + kLens + "}\n  b: {link: a, " + kLens + "}\n  c: {link: a, " +
                      kLens + "}\n"),
              HasSubstr("one camera or two"));
}

TEST(StereoRig, ReadsWhereACameraIsFixedAndHowWellThatIsKnown) {
  const CameraModel exact = parse(
                                "cameras:\n  a: {link: base, X_link_optical: {xyz_m: [1, 2, 3], rpy_rad: "
                                "[-1.5707963267948966, 0, -1.5707963267948966]}, " +
                                kLens + "}\n")
                                .cameras[0];
  EXPECT_EQ(exact.mount.parent, "base");
  EXPECT_EQ(exact.link, "camera:a");
  EXPECT_EQ(exact.mount.knowledge, PlaceKnowledge::kExact);
  // As a URDF has it: the optical frame of a camera that looks along x.
  EXPECT_TRUE((exact.mount.X_PC * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(2, 2, 3), 1e-12));
  EXPECT_TRUE((exact.mount.X_PC * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(1, 1, 3), 1e-12));

  const CameraModel known = parse("cameras:\n  a: {link: base, pose: known, " + kLens + "}\n").cameras[0];
  EXPECT_EQ(known.mount.knowledge, PlaceKnowledge::kKnown);
  EXPECT_TRUE(known.mount.sd_rad.isConstant(radians(0.1)));
  EXPECT_TRUE(known.mount.sd_m.isConstant(0.001));

  const CameraModel roughly = parse(
                                  "cameras:\n  a: {link: base, X_link_optical: [[0, 0, 1, 1], [-1, 0, 0, 2], [0, "
                                  "-1, 0, 3], [0, 0, 0, 1]], pose: roughly, pose_sd_deg: 5, pose_sd_mm: 50, " +
                                  kLens + "}\n")
                                  .cameras[0];
  EXPECT_EQ(roughly.mount.knowledge, PlaceKnowledge::kRoughly);
  EXPECT_TRUE(roughly.mount.X_PC.isApprox(exact.mount.X_PC, 1e-12));
  EXPECT_TRUE(roughly.mount.sd_rad.isConstant(radians(5.0)));
  EXPECT_TRUE(roughly.mount.sd_m.isConstant(0.05));

  const CameraModel by_axis =
      parse("cameras:\n  a: {link: base, pose: roughly, pose_sd_deg: [1, 2, 3], pose_sd_mm: [5, 6, 40], " + kLens +
            "}\n")
          .cameras[0];
  EXPECT_TRUE(by_axis.mount.sd_rad.isApprox(radians(1.0) * Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(by_axis.mount.sd_m.isApprox(Eigen::Vector3d(0.005, 0.006, 0.04)));

  const CameraModel unknown = parse("cameras:\n  a: {link: base, pose: unknown, " + kLens + "}\n").cameras[0];
  EXPECT_EQ(unknown.mount.knowledge, PlaceKnowledge::kUnknown);
  EXPECT_EQ(unknown.link, "camera:a") << "a frame of its own, whose place can be given once it is found";
  EXPECT_TRUE(unknown.mount.X_PC.isApprox(Pose::Identity()));

  const StereoRig pair = parse("cameras:\n  a: {link: base, pose: unknown, " + kLens +
                               "}\n  b: {beside: a, X_beside_optical: {xyz_m: [0.12, 0, 0]}, pose: roughly, "
                               "pose_sd_deg: 0.1, pose_sd_mm: 1, " +
                               kLens + "}\n");
  EXPECT_TRUE(pair.cameras[1].mount.relative);
  EXPECT_EQ(pair.cameras[1].mount.parent, pair.cameras[0].link);
}

TEST(StereoRig, SaysWhatIsWrongWithACamerasPlace) {
  const auto with = [](const std::string& keys) { return message("cameras:\n  a: {" + keys + ", " + kLens + "}\n"); };
  EXPECT_THAT(with("link: l, pose: perhaps"), HasSubstr("known, roughly or unknown"));
  EXPECT_THAT(with("link: l, pose: roughly"), HasSubstr("cameras.a.pose_sd_deg"));
  EXPECT_THAT(with("link: l, pose_sd_mm: 4"), HasSubstr("only with 'pose: roughly'"));
  EXPECT_THAT(with("link: l, pose: roughly, pose_sd_deg: [1, 2], pose_sd_mm: 1"), HasSubstr("three numbers"));
  EXPECT_THAT(with("link: l, pose: roughly, pose_sd_deg: [1, 2, -3], pose_sd_mm: 1"),
              HasSubstr("or three, for the camera's x, y and z"));
  EXPECT_THAT(with("link: l, X_link_optical: [1, 2]"), HasSubstr("lists of numbers"));
  EXPECT_THAT(with("link: l, X_link_optical: [[1, 2]]"), HasSubstr("four rows of four numbers"));
  EXPECT_THAT(with("link: l, X_link_optical: [[1,0,0,0],[0,1,0,0],[0,0,-1,0],[0,0,0,1]]"), HasSubstr("a rotation"));
  EXPECT_THAT(with("link: l, X_link_optical: [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]"), HasSubstr("a rotation"));
  EXPECT_THAT(with("link: l, X_link_optical: {rpy_rad: [0, 0, 0]}"), HasSubstr("xyz_m"));
  EXPECT_THAT(with("link: l, X_link_optical: {xyz_m: [0, 0]}"), HasSubstr("three numbers"));
  EXPECT_THAT(with("beside: a, X_beside_optical: {xyz_m: [0, 0, 0]}"), HasSubstr("the name of the other camera"));
  EXPECT_THAT(with("beside: b"), HasSubstr("X_beside_optical"));
  EXPECT_THAT(with("link: l, beside: b, pose: unknown"), HasSubstr("either 'link' or 'beside'"));
}

TEST(LoadRobot, GivesEveryCameraItsFrame) {
  const std::filesystem::path source = BODYSCHEMA_SOURCE_DIR;
  RobotSetup setup;
  setup.model.urdf = source / "meshes/arm7/arm7.urdf";
  setup.hand_link = "hand";
  const StereoRig rig = parse("cameras:\n  a: {link: link3, X_link_optical: {xyz_m: [0, 0, 0.5]}, " + kLens +
                              "}\n  b: {beside: a, X_beside_optical: {xyz_m: [0.1, 0, 0]}, " + kLens + "}\n");
  const auto robot = load_robot(setup, rig);
  ForwardKinematics kinematics(robot, {"link3", rig.cameras[0].link, rig.cameras[1].link});
  std::vector<Pose> X_WL(3);
  kinematics.compute(Eigen::VectorXd::Constant(robot->joint_count(), 0.3), X_WL);
  EXPECT_TRUE((X_WL[0].inverse() * X_WL[1]).translation().isApprox(Eigen::Vector3d(0, 0, 0.5), 1e-9));
  EXPECT_TRUE((X_WL[0].inverse() * X_WL[2]).translation().isApprox(Eigen::Vector3d(0.1, 0, 0.5), 1e-9));
  EXPECT_TRUE(kinematics.moves(robot->joint_index("joint2"), 2));
  EXPECT_FALSE(kinematics.moves(robot->joint_index("joint5"), 2));

  StereoRig astray = parse("cameras:\n  a: {link: lnk3, pose: unknown, " + kLens + "}\n");
  try {
    (void)load_robot(setup, astray);
    ADD_FAILURE() << "nothing was thrown";
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("cameras.a.link' is 'lnk3'; expected a link of robot 'arm7'"));
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'link3'?"));
  }
}

}  // namespace
}  // namespace bodyschema
