#include "bodyschema/pipeline/ros_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "bodyschema/camera/camera_info.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class RosFiles : public ::testing::Test {
 protected:
  RosFiles() {
    const auto configuration = Configuration::parse(
        "robot:\n  urdf: " + urdf().string() +
        "\n  rendered_links: [hand]\n  hand_link: hand\n  estimated_joints: [joint1, joint2, joint3]\n"
        "cameras:\n"
        "  left: {link: link1, X_link_optical: {xyz_m: [0.1, 0.2, 0.3], rpy_rad: [0.1, 0.2, 0.3]}, pose: roughly,\n"
        "         pose_sd_deg: 5, pose_sd_mm: 50, width: 320, height: 240, fx: 420, fy: 421, cx: 159.5, cy: 119.5}\n"
        "  right: {beside: left, X_beside_optical: {xyz_m: [0.12, 0, 0], rpy_rad: [0, 0, 0]}, pose: roughly,\n"
        "          pose_sd_deg: 1, pose_sd_mm: 1, width: 320, height: 240, fx: 420, fy: 421, cx: 159.5, cy: 119.5}\n");
    setup_ = RobotSetup::from(configuration.section("robot"));
    setup_.model.rendered_links.clear();
    rig_ = StereoRig::from(configuration.section("cameras"));
    robot_ = load_robot(setup_, rig_);
    roles_ = JointRoles::of(robot_, setup_, rig_);
  }
  static fs::path urdf() { return fs::path(BODYSCHEMA_SOURCE_DIR) / "meshes/arm7/arm7.urdf"; }
  std::string content(const std::string& name) const {
    std::ifstream stream(folder_.path() / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  std::string write(const Correction& correction, const std::vector<RosCamera>& cameras) const {
    write_corrected_urdf(urdf(), correction, folder_.path() / "corrected.urdf");
    return write_ros_files(folder_.path(), urdf(), folder_.path() / "corrected.urdf", correction, cameras);
  }
  TemporaryFolder folder_;
  RobotSetup setup_;
  StereoRig rig_;
  std::shared_ptr<const RobotModel> robot_;
  JointRoles roles_;
};

TEST_F(RosFiles, JointsCarryTheirOffsetsAndTheOriginsOfTheCorrectedUrdf) {
  Correction correction;
  correction.offsets_rad = {{"joint2", 0.03}, {"joint3", -0.01}};
  correction.sd_rad = {{"joint2", 0.001}};
  correction.warnings = {"joint3: known to 1.23 deg only -- look"};
  write(correction, ros_cameras_of(rig_));
  const auto joints = Configuration::load(folder_.path() / "joint_calibration.yaml").section("joints");
  EXPECT_EQ(joints.keys(), (std::vector<std::string>{"joint2", "joint3"}));
  EXPECT_DOUBLE_EQ(joints.section("joint2").number("offset"), 0.03);
  EXPECT_DOUBLE_EQ(joints.section("joint2").number("offset_sd"), 0.001);
  EXPECT_FALSE(joints.section("joint3").has("offset_sd"));
  for (const char* file : {"joint_calibration.yaml", "static_transforms.sh", "ros2_control_transmissions.xml",
                           "camera_info/left.yaml", "camera_info/right.yaml"}) {
    EXPECT_THAT(content(file), HasSubstr("known to 1.23 deg only")) << file;
  }
  EXPECT_THAT(content("ros2_control_transmissions.xml"),
              AllOf(HasSubstr("<joint name=\"joint2\" role=\"joint1\">"), HasSubstr("<offset>-0.03</offset>"),
                    HasSubstr("<offset>0.01</offset>"), Not(HasSubstr("only --"))));
}

TEST_F(RosFiles, AKnownOffsetAndAFoundOneAreAdded) {
  Correction correction;
  correction.offsets_rad = {{"joint2", 0.03}};
  correction.known_offsets_rad = {{"joint2", 0.01}};
  write(correction, {});
  EXPECT_THAT(content("ros2_control_transmissions.xml"), HasSubstr("<offset>-0.04</offset>"));
}

TEST_F(RosFiles, NothingFoundIsAnEmptyListAndStillYaml) {
  write({}, {});
  EXPECT_TRUE(Configuration::load(folder_.path() / "joint_calibration.yaml").section("joints").keys().empty());
}

TEST_F(RosFiles, CamerasOfTheRigGoToCameraInfoAndTransforms) {
  const auto files = write({}, ros_cameras_of(rig_));
  EXPECT_THAT(files, HasSubstr((folder_.path() / "camera_info/left.yaml").string()));
  const CameraInfo info = CameraInfo::read(folder_.path() / "camera_info/right.yaml");
  EXPECT_EQ(info.intrinsics, rig_.cameras[1].intrinsics);
  EXPECT_EQ(info.rectified, info.intrinsics);
  EXPECT_THAT(content("static_transforms.sh"),
              AllOf(HasSubstr("--x 0.1 --y 0.2 --z 0.3 --qx "),
                    HasSubstr("--frame-id 'link1' --child-frame-id 'left_optical_frame' &\n"),
                    HasSubstr("--x 0.12 --y 0 --z 0 --qx 0 --qy 0 --qz 0 --qw 1 --frame-id 'left_optical_frame' "
                              "--child-frame-id 'right_optical_frame' &\n"),
                    HasSubstr("wait\n")));
}

TEST_F(RosFiles, ACameraThatIsALinkIsPlacedByTheUrdf) {
  const auto rig = StereoRig::from(Configuration::parse(
      "left: {link: camera_left_optical, width: 320, height: 240, fx: 420, fy: 420, cx: 159.5, cy: 119.5}\n"));
  (void)write({}, ros_cameras_of(rig));
  EXPECT_THAT(content("static_transforms.sh"),
              AllOf(HasSubstr("# left: its link is in corrected.urdf"), Not(HasSubstr("ros2 run"))));
}

// Such a result once stopped the export: "no joint carries camera link".
TEST_F(RosFiles, FoundPosesOfCamerasThatAreNoLinksMoveTheirMounts) {
  ErrorModel model(roles_);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.05, 0.05);
  for (const char* name : {"camera_pose", "camera_pair"}) {
    for (auto& p : model.add(name, {}).parameters()) p.value = uniform(random);
  }
  Correction correction;
  const auto applied = add_effects(model, robot_, setup_, rig_, correction);
  EXPECT_TRUE(correction.frame_motions.empty());
  for (const auto& effect : applied) EXPECT_EQ(effect.applied, "cameras.yaml") << effect.effect;
  EXPECT_NO_THROW(write(correction, ros_cameras_of(rig_)));

  const StereoRig found = corrected_rig(model, robot_, setup_, rig_);
  const auto moved = load_robot(setup_, found);
  const auto q = setup_.default_joints(*robot_);
  for (std::size_t c = 0; c < 2; ++c) {
    SCOPED_TRACE(c);
    EXPECT_EQ(found.cameras[c].mount.knowledge, PlaceKnowledge::kKnown);
    CorrectedKinematics expected(robot_, {"hand"}, {rig_.cameras[0].link, rig_.cameras[1].link});
    ForwardKinematics actual(moved, {found.cameras[c].link});
    Instant at;
    at.camera = c;
    at.encoder = at.q = at.qdot = at.qddot = Eigen::VectorXd::Zero(robot_->joint_count());
    Corrections corrections = roles_.no_corrections();
    model.corrections(at, corrections);
    std::vector<Pose> X_CH(1), X_WC(1);
    expected.compute(q, corrections, c, X_CH);
    actual.compute(q, X_WC);
    EXPECT_LT((expected.X_WC().translation() - X_WC[0].translation()).norm(), 1e-9);
    EXPECT_LT(rotation_distance(expected.X_WC().linear(), X_WC[0].linear()), 1e-9);
  }
}

TEST_F(RosFiles, NamesOfAnyLettersStayWhole) {
  RosCamera camera{"left", {4, 2, 4, 4, 1.5, 0.5}, {}, "it's <a> \"link\"", Pose::Identity()};
  (void)write({}, {camera});
  EXPECT_THAT(content("static_transforms.sh"), HasSubstr("--frame-id 'it'\\''s <a> \"link\"'"));
}

}  // namespace
}  // namespace bodyschema
