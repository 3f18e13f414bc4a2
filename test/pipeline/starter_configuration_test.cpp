#include "bodyschema/pipeline/starter_configuration.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <unistd.h>

#include "bodyschema/core/error.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/imports/joint_mapping.hpp"
#include "imports/stills_folder.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const fs::path kSource = BODYSCHEMA_SOURCE_DIR;

class StarterConfiguration : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("bodyschema_starter_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  StarterOptions options() const {
    StarterOptions o;
    o.urdf = kSource / "meshes/arm7/arm7.urdf";
    o.hand_link = "hand";
    o.camera_links = {"camera_left_optical", "camera_right_optical"};
    o.out = folder_ / "mine";
    return o;
  }
  fs::path folder_;
};

TEST_F(StarterConfiguration, FindsTheArmBetweenRootAndHand) {
  auto o = options();
  o.width = 320;
  o.height = 240;
  o.focal_px = 420.0;
  const std::string told = write_starter_configuration(o).text;
  EXPECT_THAT(told, HasSubstr("arm: joint1, joint2, joint3, joint4, joint5, joint6, joint7\n"));
  EXPECT_THAT(told, HasSubstr("robot and meshes load"));
  Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  EXPECT_THAT(pipeline.setup().estimated_joints,
              ElementsAre("joint1", "joint2", "joint3", "joint4", "joint5", "joint6", "joint7"));
  EXPECT_THAT(pipeline.setup().model.rendered_links,
              ElementsAre("base", "link1", "link2", "link3", "link4", "link5", "link6", "link7", "hand", "left_finger",
                          "right_finger"))
      << "the base stands in the view of cameras that stand too";
  EXPECT_TRUE(pipeline.setup().head_joints.empty());
  ASSERT_EQ(pipeline.rig().cameras.size(), 2u);
  EXPECT_EQ(pipeline.rig().cameras[1].intrinsics, (PinholeIntrinsics{320, 240, 420.0, 420.0, 159.5, 119.5}));
  EXPECT_EQ(pipeline.bus().channels().cameras, "ROBOT_CAMERAS");
  // Played by bodyschema-sim on the same channels; docs/calibrate_my_robot.md does so.
  const Configuration stand_in = Configuration::load(o.out / "simulator.yaml");
  EXPECT_EQ(BusOptions::from(stand_in.section("bus")).channels().cameras, "ROBOT_CAMERAS");
}

/// As in a ROS workspace: package://NAME/ stands for a folder above the URDF.
// What config/estimator.yaml says of pairs of cameras once stopped every robot with one.
TEST_F(StarterConfiguration, OneCameraIsEnough) {
  auto o = options();
  o.camera_links = {"camera_left_optical"};
  o.width = 320;
  o.height = 240;
  o.focal_px = 420.0;
  write_starter_configuration(o);
  const Configuration configuration = Configuration::load(o.out / "estimator.yaml");
  Pipeline pipeline(configuration);
  const auto roles = JointRoles::of(pipeline.shared_robot(), pipeline.setup(), pipeline.rig());
  const auto beliefs = Beliefs::from(configuration, roles, pipeline.rig(), EstimatorOptions::from(configuration));
  const auto has = [&](const char* effect) {
    return std::any_of(beliefs.state.begin(), beliefs.state.end(), [&](const Belief& b) { return b.effect == effect; });
  };
  EXPECT_TRUE(has("focal_length"));
  EXPECT_FALSE(has("principal_point"));
}

/// The links of a body's axes that the cameras sit on: the files load, and no picture fits.
TEST_F(StarterConfiguration, DoubtsAxesByWhichNoCameraSeesTheHand) {
  auto o = options();
  EXPECT_THAT(write_starter_configuration(o).text, Not(HasSubstr("axes")));
  o.camera_links = {"camera_left", "camera_right"};
  o.out = folder_ / "body";
  const auto told = write_starter_configuration(o);
  EXPECT_TRUE(told.usable);
  EXPECT_THAT(told.text, HasSubstr("the axes of camera_left look like a body's (x forward, z up)"));
  EXPECT_THAT(told.text, HasSubstr("the axes of camera_right look like"));
  // The line that it prints is the remedy.
  const std::string key = "X_link_optical: ";
  const auto at = told.text.find(key) + key.size();
  const std::string place = told.text.substr(at, told.text.find('\n', at) - at);
  const Configuration mended = Configuration::load(o.out / "estimator.yaml", {"cameras.left.X_link_optical=" + place});
  const Pose& X_PC = Pipeline(mended).rig().cameras[0].mount.X_PC;
  EXPECT_LT((X_PC.linear().col(2) - Eigen::Vector3d::UnitX()).norm(), 1e-6) << "into the picture is forward";
  EXPECT_LT((X_PC.linear().col(1) + Eigen::Vector3d::UnitZ()).norm(), 1e-6) << "down in the picture is down";
}

TEST_F(StarterConfiguration, FindsTheFolderOfThePackageThatHoldsTheMeshes) {
  const fs::path package = folder_ / "src/lab/pointer_description";
  fs::create_directories(package / "urdf");
  fs::create_directories(package / "meshes");
  std::ofstream(package / "meshes/wedge.stl")
      << "solid wedge\n"
         "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 100 0 0\nvertex 0 100 0\nendloop\nendfacet\n"
         "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 100 0\nvertex 0 0 100\nendloop\nendfacet\n"
         "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 100\nvertex 100 0 0\nendloop\nendfacet\n"
         "facet normal 0 0 1\nouter loop\nvertex 100 0 0\nvertex 0 0 100\nvertex 0 100 0\nendloop\nendfacet\n"
         "endsolid wedge\n";
  std::ofstream(package / "urdf/pointer.urdf") << R"(<robot name="pointer">
  <link name="base"/><link name="eye"/>
  <link name="tip"><visual><geometry>
    <mesh filename="package://pointer_description/meshes/wedge.stl" scale="0.001 0.001 0.001"/>
  </geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="mount" type="fixed"><parent link="base"/><child link="eye"/></joint>
</robot>)";
  StarterOptions o;
  o.urdf = package / "urdf/pointer.urdf";
  o.hand_link = "tip";
  o.camera_links = {"eye"};
  o.out = folder_ / "mine";
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("robot and meshes load"));

  fs::rename(package, folder_ / "elsewhere");
  o.urdf = folder_ / "elsewhere/urdf/pointer.urdf";
  o.out = folder_ / "astray";
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("the folder that holds 'pointer_description/'"));
}

TEST_F(StarterConfiguration, AHumanoidsTorsoIsSharedAndItsHeadIsNoArm) {
  auto o = options();
  o.urdf = kSource / "meshes/icub_right/icub_right.urdf";
  o.hand_link = "r_hand";
  o.camera_links = {"l_eye_optical", "r_eye_optical"};
  const std::string told = write_starter_configuration(o).text;
  EXPECT_THAT(told, HasSubstr("focal length: a guess, 55"));
  Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  const Configuration ours = Configuration::load(kSource / "config/icub_right/robot.yaml");
  EXPECT_EQ(pipeline.setup().estimated_joints, RobotSetup::from(ours.section("robot")).estimated_joints);
  EXPECT_THAT(pipeline.setup().head_joints, testing::UnorderedElementsAre("neck_pitch", "neck_roll", "neck_yaw",
                                                                          "eyes_tilt", "l_eye_pan", "r_eye_pan"));
  EXPECT_TRUE(pipeline.setup().fixed_joints_rad.contains("torso_pitch"));
  EXPECT_TRUE(pipeline.setup().fixed_joints_rad.contains("r_thumb_proximal"));
}

TEST_F(StarterConfiguration, JointsThatSlideAreGivenInMetresAndNotEstimated) {
  auto o = options();
  std::stringstream text;
  text << std::ifstream(o.urdf).rdbuf();
  std::string urdf = text.str();
  for (const std::string joint : {"left_finger_joint", "joint1"}) {
    const auto at = urdf.find("<joint name=\"" + joint + "\"");
    ASSERT_NE(at, std::string::npos);
    const auto end = urdf.find('>', at);
    urdf.replace(at, end - at, "<joint name=\"" + joint + "\" type=\"prismatic\"");
    if (urdf.find("<limit", at) > urdf.find("</joint>", at)) {
      urdf.insert(urdf.find("</joint>", at), "<limit lower=\"0\" upper=\"0.04\" effort=\"9\" velocity=\"1\"/>");
    }
  }
  fs::copy(o.urdf.parent_path(), folder_ / "sliding", fs::copy_options::recursive);
  o.urdf = folder_ / "sliding/arm7.urdf";
  std::ofstream(o.urdf) << urdf;
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("robot and meshes load"));
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  EXPECT_THAT(pipeline.setup().fixed_joints_m, testing::Contains(testing::Key("left_finger_joint")));
  EXPECT_THAT(pipeline.setup().estimated_joints, testing::Not(testing::Contains("joint1")));
}

TEST_F(StarterConfiguration, AHeadThatSlidesIsLeftOutOfItsJoints) {
  auto o = options();
  std::stringstream text;
  text << std::ifstream(kSource / "meshes/icub_right/icub_right.urdf").rdbuf();
  std::string urdf = text.str();
  const std::string turns = "<joint name=\"neck_yaw\" type=\"revolute\">";
  const auto at = urdf.find(turns);
  ASSERT_NE(at, std::string::npos);
  urdf.replace(at, turns.size(), "<joint name=\"neck_yaw\" type=\"prismatic\">");
  fs::copy(kSource / "meshes/icub_right", folder_ / "sliding", fs::copy_options::recursive);
  o.urdf = folder_ / "sliding/icub_right.urdf";
  std::ofstream(o.urdf) << urdf;
  o.hand_link = "r_hand";
  o.camera_links = {"l_eye_optical", "r_eye_optical"};
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("robot and meshes load"));
  const auto setup = RobotSetup::from(Configuration::load(o.out / "robot.yaml").section("robot"));
  EXPECT_THAT(setup.head_joints,
              testing::UnorderedElementsAre("neck_pitch", "neck_roll", "eyes_tilt", "l_eye_pan", "r_eye_pan"));
}

TEST_F(StarterConfiguration, NamesOfAnyLettersComeBackAsTheyAre) {
  const std::vector<std::string> names = {"lift's joint", "say \"a\": [b] # c", "back\\slash", "two\nlines", "arm.5"};
  const std::string finger = "finger.1";
  auto o = options();
  std::ifstream in(o.urdf);
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto written = [](std::string name) {
    const std::vector<std::pair<std::string, std::string>> escapes = {
        {"'", "&apos;"}, {"\"", "&quot;"}, {"\n", "&#10;"}};
    for (const auto& [from, to] : escapes) {
      for (std::size_t at = 0; (at = name.find(from, at)) != std::string::npos; at += to.size()) {
        name.replace(at, from.size(), to);
      }
    }
    return name;
  };
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string from = "\"joint" + std::to_string(i + 1) + "\"";
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos;) {
      text.replace(at, from.size(), "\"" + written(names[i]) + "\"");
    }
  }
  const std::string fixed = "<joint name=\"left_finger_joint\" type=\"fixed\">";
  const auto at = text.find(fixed);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, fixed.size(),
               "<joint name=\"" + finger +
                   "\" type=\"revolute\"><limit lower=\"0\" upper=\"1\" effort=\"9\" "
                   "velocity=\"1\"/>");
  fs::copy(o.urdf.parent_path(), folder_ / "arm", fs::copy_options::recursive);
  o.urdf = folder_ / "arm/it's.urdf";
  std::ofstream(o.urdf) << text;
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("robot and meshes load"));
  const auto setup = RobotSetup::from(Configuration::load(o.out / "robot.yaml").section("robot"));
  ASSERT_EQ(setup.estimated_joints.size(), 7u);
  for (std::size_t i = 0; i < names.size(); ++i) EXPECT_EQ(setup.estimated_joints[i], names[i]);
  EXPECT_THAT(setup.fixed_joints_rad, testing::Contains(testing::Key(finger)));
}

constexpr const char* kWedge =
    "solid wedge\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 100 0 0\nvertex 0 100 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 100 0\nvertex 0 0 100\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 0 100\nvertex 100 0 0\nendloop\nendfacet\n"
    "facet normal 0 0 1\nouter loop\nvertex 100 0 0\nvertex 0 0 100\nvertex 0 100 0\nendloop\nendfacet\n"
    "endsolid wedge\n";

/// One joint, one link with a mesh of this name.
std::string pointer(const std::string& mesh) {
  return R"(<robot name="pointer"><link name="base"/>
  <link name="tip"><visual><geometry><mesh filename=")" +
         mesh + R"(" scale="0.001 0.001 0.001"/></geometry></visual></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>)";
}

void put(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

/// As `colcon build --symlink-install` leaves it: the installed package is made of links to the sources.
TEST_F(StarterConfiguration, FollowsTheLinksOfAWorkspaceThatWasInstalledBySymlinks) {
  const fs::path source = folder_ / "src/pointer_description";
  const fs::path installed = folder_ / "install/pointer_description/share/pointer_description";
  put(source / "package.xml", "<package/>");
  put(source / "meshes/visual/wedge.stl", kWedge);
  put(source / "urdf/pointer.urdf", pointer("package://pointer_description/meshes/visual/wedge.stl"));
  put(source / "urdf/beside.urdf", pointer("../meshes/visual/wedge.stl"));
  for (const char* file : {"meshes/visual/wedge.stl", "urdf/pointer.urdf", "urdf/beside.urdf"}) {
    fs::create_directories((installed / file).parent_path());
    fs::create_symlink(source / file, installed / file);
  }
  // Some tools link whole packages.
  fs::create_directories(folder_ / "linked/share");
  fs::create_directory_symlink(source, folder_ / "linked/share/pointer_description");
  for (const fs::path& package : {installed, folder_ / "linked/share/pointer_description"}) {
    for (const char* urdf : {"urdf/pointer.urdf", "urdf/beside.urdf"}) {
      StarterOptions o;
      o.urdf = package / urdf;
      o.out = folder_ / "mine";
      const StarterReport report = write_starter_configuration(o);
      EXPECT_THAT(report.text, HasSubstr("robot and meshes load")) << o.urdf;
      EXPECT_TRUE(report.usable) << o.urdf;
      fs::remove_all(o.out);
    }
  }
}

TEST_F(StarterConfiguration, FindsMeshesBesideTheFolderOfTheUrdf) {
  put(folder_ / "robot/meshes/wedge.stl", kWedge);
  put(folder_ / "robot/urdf/pointer.urdf", pointer("../meshes/wedge.stl"));
  put(folder_ / "bringup/urdf/pointer.urdf", pointer("../../robot/meshes/wedge.stl"));
  for (const char* urdf : {"robot/urdf/pointer.urdf", "bringup/urdf/pointer.urdf"}) {
    StarterOptions o;
    o.urdf = folder_ / urdf;
    o.out = folder_ / "mine" / urdf;
    EXPECT_TRUE(write_starter_configuration(o).usable) << urdf;
  }
  // A configuration that does not name the place says which key would.
  try {
    (void)RobotModel::load({folder_ / "robot/urdf/pointer.urdf", {}, {"tip"}});
    ADD_FAILURE();
  } catch (const FileError& e) {
    EXPECT_THAT(e.what(), HasSubstr("allow its place with robot.mesh_search_roots: [" +
                                    fs::canonical(folder_ / "robot/meshes").string() + "]"));
  }
}

TEST_F(StarterConfiguration, FindsPackagesWhereRosLooksForThem) {
  put(folder_ / "opt/share/pointer_description/meshes/wedge.stl", kWedge);
  put(folder_ / "elsewhere/pointer.urdf", pointer("package://pointer_description/meshes/wedge.stl"));
  StarterOptions o;
  o.urdf = folder_ / "elsewhere/pointer.urdf";
  o.out = folder_ / "without";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_FALSE(report.usable) << "the command's exit status says so";
  EXPECT_THAT(report.text, HasSubstr("to be put right: "));
  setenv("AMENT_PREFIX_PATH", (folder_ / "opt").c_str(), 1);
  o.out = folder_ / "with";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  unsetenv("AMENT_PREFIX_PATH");
}

TEST_F(StarterConfiguration, WithoutCamerasTheirPosesAreToBeFound) {
  auto o = options();
  o.hand_link.clear();
  o.camera_links.clear();
  const StarterReport report = write_starter_configuration(o);
  EXPECT_TRUE(report.usable);
  EXPECT_THAT(report.text, HasSubstr("hand: a guess, hand\n"));
  EXPECT_THAT(report.text, HasSubstr("camera camera: its pose is to be found"));
  EXPECT_THAT(report.text, HasSubstr("focal length: a guess"));
  EXPECT_THAT(report.text, HasSubstr("principal point: a guess, the picture's middle"));
  EXPECT_FALSE(fs::exists(o.out / "simulator.yaml")) << "which camera should it play?";
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  ASSERT_EQ(pipeline.rig().cameras.size(), 1u);
  EXPECT_EQ(pipeline.rig().cameras[0].mount.knowledge, PlaceKnowledge::kUnknown);
  EXPECT_EQ(pipeline.rig().cameras[0].mount.parent, "base");
  EXPECT_THAT(pipeline.setup().model.rendered_links, testing::Contains("base"));
}

/// Taken to stand, a camera in a head that moves is never found.
TEST_F(StarterConfiguration, WithoutCamerasItNamesLinksThatAreNamedLikeCameras) {
  auto o = options();
  o.urdf = kSource / "meshes/icub_right/icub_right.urdf";
  o.hand_link = "r_hand";
  o.camera_links.clear();
  EXPECT_THAT(write_starter_configuration(o).text,
              HasSubstr("named like cameras: l_eye_optical (moved by torso_pitch, torso_roll, torso_yaw, neck_pitch, "
                        "neck_roll, neck_yaw, eyes_tilt, l_eye_pan); r_eye_optical (moved by"));
  o = options();
  o.camera_links = {"camera_left_optical"};
  o.out = folder_ / "given";
  EXPECT_THAT(write_starter_configuration(o).text, testing::Not(HasSubstr("named like cameras")));
}

/// How far something is believed possible by what is written, SI.
double believed(const StarterOptions& o, const std::string& effect, const std::string& source) {
  (void)write_starter_configuration(o);
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  for (const auto& belief : pipeline.beliefs().state) {
    if (belief.effect == effect && belief.target.source == source) return belief.sd.at(0);
  }
  return 0.0;
}

// A guess that was taken for known to 0.2 %: calibrations were "good" and 2 deg off where the focal length was 35 %
// less.
TEST_F(StarterConfiguration, AFocalLengthThatIsAGuessIsToBeFound) {
  auto o = options();
  o.focal_px = 0.0;
  EXPECT_NEAR(believed(o, "focal_length", ""), 0.25, 1e-9);
  o.out = folder_ / "centre";
  EXPECT_NEAR(believed(o, "principal_point", "common"), 0.02 * o.width, 0.1);
  o.out = folder_ / "given";
  o.focal_px = 500.0;
  EXPECT_LT(believed(o, "focal_length", ""), 0.01);
}

// As `bodyschema import ros-bag BAG --camera-info FOLDER` writes them.
TEST_F(StarterConfiguration, TwoCalibrationsAreTwoCameras) {
  auto o = options();
  o.camera_links.clear();
  o.rectified = true;
  for (const std::string camera : {"a", "b"}) {
    put(folder_ / (camera + ".yaml"),
        "# /rig/" + camera +
            "\n{\"width\": 8, \"height\": 6, \"distortion_model\": \"plumb_bob\", \"d\": [0, 0, 0, 0, 0],"
            " \"k\": [8, 0, 3.6, 0, 8.1, 2.4, 0, 0, 1], \"r\": [1, 0, 0, 0, 1, 0, 0, 0, 1], \"p\": [8, 0, 3.6, " +
            std::string(camera == "b" ? "-0.96" : "0") + ", 0, 8.1, 2.4, 0, 0, 0, 1, 0]}\n");
    o.camera_infos.push_back(folder_ / (camera + ".yaml"));
  }
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  const auto& cameras = pipeline.rig().cameras;
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].name, "left");
  EXPECT_EQ(cameras[0].mount.knowledge, PlaceKnowledge::kUnknown);
  EXPECT_TRUE(cameras[1].mount.X_PC.translation().isApprox(Eigen::Vector3d(0.12, 0, 0), 1e-6));
}

/// Networks' masks lie outside or inside all around by a share of what they resolve; those of one's own by a share of a
/// pixel.
TEST_F(StarterConfiguration, GivenMasksOfLargerPicturesMayHaveLargerBiases) {
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.out = folder_ / "mine";
  put(folder_ / "large.yaml",
      "{\"width\": 1280, \"height\": 960, \"distortion_model\": \"plumb_bob\", \"d\": [0, 0, 0, 0, 0],"
      " \"k\": [900, 0, 640, 0, 900, 480, 0, 0, 1], \"r\": [1, 0, 0, 0, 1, 0, 0, 0, 1],"
      " \"p\": [900, 0, 640, 0, 0, 900, 480, 0, 0, 0, 1, 0]}\n");
  o.camera_infos = {folder_ / "large.yaml"};
  o.masks = true;
  EXPECT_NEAR(believed(o, "silhouette_bias", ""), 4.0 * 0.15, 0.005);
  o.out = folder_ / "own";
  o.masks = false;
  EXPECT_NEAR(believed(o, "silhouette_bias", ""), 0.15, 1e-9);
}

TEST_F(StarterConfiguration, FromStillsNothingElseIsAsked) {
  const SmallStills stills;
  for (const std::string camera : {"left", "right"}) {
    stills.mask(camera + "/00.png", 255);
    stills.write("camera_info/" + camera + ".yaml",
                 "width: 8\nheight: 6\nd: []\nk: [8, 0, 3.6, 0, 8.1, 2.4, 0, 0, 1]\nr: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
                 "p: [8, 0, 3.6, " +
                     std::string(camera == "right" ? "-0.96" : "0") + ", 0, 8.1, 2.4, 0, 0, 0, 1, 0]\n");
  }
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_TRUE(report.usable) << report.text;
  EXPECT_THAT(report.text, testing::Not(HasSubstr("focal length")));
  EXPECT_THAT(report.text, HasSubstr("camera left: left.yaml has no distortion: how its lens bends pictures is to be "
                                     "found; --rectified says that they come straightened"));
  EXPECT_THAT(report.text, testing::Not(HasSubstr("mask of no picture")));
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  const auto& cameras = pipeline.rig().cameras;
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].name, "left");
  EXPECT_EQ(cameras[0].intrinsics, (PinholeIntrinsics{8, 6, 8, 8.1, 3.6, 2.4}));
  EXPECT_EQ(cameras[0].mount.knowledge, PlaceKnowledge::kUnknown);
  EXPECT_TRUE(cameras[1].mount.relative) << "the pair's calibration says where the right one is";
  EXPECT_TRUE(cameras[1].mount.X_PC.translation().isApprox(Eigen::Vector3d(0.12, 0, 0), 1e-6));
  EXPECT_TRUE(pipeline.make_stream().expects_masks()) << "the folder has masks";
  EXPECT_TRUE(pipeline.setup().fixed_joints_rad.empty()) << "all that moves is recorded";

  o.rectified = true;
  o.out = folder_ / "straight";
  EXPECT_THAT(write_starter_configuration(o).text, testing::Not(HasSubstr("--rectified")));

  o.masks = false;
  o.out = folder_ / "bare";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  EXPECT_FALSE(Pipeline(Configuration::load(o.out / "estimator.yaml")).make_stream().expects_masks());
}

/// Before a camera that stands still, the moving arm uncovers its background; its base never does.
TEST_F(StarterConfiguration, AMovingRecordingWithoutMasksLearnsItsBackground) {
  const SmallStills stills;
  fs::remove_all(stills.path() / "images/right");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "still";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const auto still = Configuration::load(o.out / "estimator.yaml");
  EXPECT_EQ(still.section("vision").text("method"), "auto");
  EXPECT_FALSE(still.section("estimator").section("state").has("latency"));

  stills.write("joints.csv", "posture,time_s,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n0,10,0,0,0,0,0,0,0\n");
  o.out = folder_ / "moving";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const auto moving = Configuration::load(o.out / "estimator.yaml");
  EXPECT_EQ(moving.section("vision").text("method"), "learned_background");
  EXPECT_TRUE(moving.section("estimator").section("state").has("latency"));
  // Times beside stills do not make a camera's centre better known: they halved what was claimed.
  for (const auto* recording : {&still, &moving}) {
    EXPECT_TRUE(recording->section("estimator").section("state").has("principal_point common"));
  }
  const auto links = Pipeline(moving).setup().model.rendered_links;
  EXPECT_EQ(std::count(links.begin(), links.end(), "base"), 0) << "what never moves is learned as background";
}

TEST_F(StarterConfiguration, StillsOfACameraOfAnyNameOnALinkOfTheRobot) {
  const SmallStills stills;
  fs::rename(stills.path() / "images/left", stills.path() / "images/cam_high");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.camera_links = {"cam_high=camera_left_optical"};
  o.out = folder_ / "mine";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  ASSERT_EQ(pipeline.rig().cameras.size(), 1u);
  EXPECT_EQ(pipeline.rig().cameras[0].name, "cam_high");
  EXPECT_EQ(pipeline.rig().cameras[0].link, "camera_left_optical");
  EXPECT_EQ(pipeline.rig().cameras[0].intrinsics.width, 8) << "as the picture says";
  o.camera_links = {"cam_low=camera_left_optical"};
  o.out = folder_ / "wrong";
  EXPECT_THROW((void)write_starter_configuration(o), ConfigurationError);
}

/// The one jaw of a gripper (SO-101) that nobody recorded was guessed for the hand, and its joint missed. What is not
/// recorded is said once, of whichever arm it is.
TEST_F(StarterConfiguration, AHandIsNotGuessedBehindAJointThatWasNotRecorded) {
  const SmallStills stills;
  stills.write("joints.csv", "posture,joint1,joint2,joint3,joint4,joint5,joint6\n0,1,2,3,4,5,6\n");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_TRUE(report.usable) << report.text;
  EXPECT_THAT(report.text, HasSubstr("hand: a guess, link6\n"));
  EXPECT_THAT(report.text, HasSubstr("taken as fixed at 0 unless you take them out: joint7"));

  // A first joint that is missed is missed behind every hand: the guess is what it would have been, and that is said.
  stills.write("joints.csv", "posture,joint2,joint3,joint4,joint5,joint6,joint7\n0,2,3,4,5,6,7\n");
  o.out = folder_ / "without";
  const StarterReport without = write_starter_configuration(o);
  EXPECT_FALSE(without.usable);
  EXPECT_THAT(without.text, HasSubstr("hand: a guess, hand\n"));
  EXPECT_THAT(without.text, HasSubstr("to be put right: joints.csv has no column of joint1;"));
  EXPECT_THAT(without.text, testing::Not(HasSubstr("taken for a part of the hand")));
}

/// A motor's temperature is no angle of 31 degrees, and a wrist that turns for ever was turned once round.
TEST_F(StarterConfiguration, TheUnitIsThatOfJointsAlone) {
  const SmallStills stills;
  stills.write("joints.csv",
               "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7,motor_temp_c\n"
               "0,0.1,0.2,0.3,0.4,0.5,0.6,7.7,31.5\n1,-0.1,0,0,0,0,0,7.5,31.6\n");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_THAT(report.text, HasSubstr("columns of joints.csv that are no joints: motor_temp_c"));
  EXPECT_THAT(report.text, Not(HasSubstr("is taken for deg")));
}

TEST_F(StarterConfiguration, XacroIsConvertedFirst) {
  StarterOptions o;
  o.urdf = folder_ / "arm.urdf";
  std::ofstream(o.urdf) << "<robot name='arm' xmlns:xacro='http://www.ros.org/wiki/xacro'><link name='base'/>"
                           "<xacro:include filename='gripper.xacro'/></robot>";
  o.out = folder_ / "mine";
  EXPECT_THAT([&] { (void)write_starter_configuration(o); },
              testing::ThrowsMessage<FileError>(HasSubstr("xacro arm.urdf.xacro > ")));
}

TEST_F(StarterConfiguration, StillsWhoseColumnsAreNoJointsAreToBePutRight) {
  const SmallStills stills;
  stills.write("joints.csv", "posture,j1,joint2,joint3,joint4,joint5,joint6,joint7\n0,90,2,3,4,5,6,7\n");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_FALSE(report.usable);
  EXPECT_THAT(report.text, HasSubstr("to be put right: joints.csv has no column of joint1; say which of j1 is which"));
  EXPECT_THAT(report.text, HasSubstr("is taken for deg"));
  const auto configuration = Configuration::load(o.out / "estimator.yaml");
  EXPECT_TRUE(JointMapping::from(configuration.section("import")).in_degrees);
  EXPECT_TRUE(JointMapping::from(configuration.section("import")).joints.contains("j1"));
}

TEST_F(StarterConfiguration, ColumnsThatHoldNotesAreLeftOutAndSaid) {
  const SmallStills stills;
  stills.write(
      "joints.csv",
      "Posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7,note,\n0,1,2,3,4,5,6,7,ok,\n1,1,2,3,4,5,6,7,,\n");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_TRUE(report.usable) << report.text;
  EXPECT_THAT(report.text, HasSubstr("column 'note' of joints.csv is no joint and holds text; it is not read"));
  EXPECT_TRUE(JointMapping::from(Configuration::load(o.out / "estimator.yaml").section("import")).joints.empty());
  stills.write("joints.csv", "posture,joint1,joint2,joint3,joint4,joint5,joint6,joint7\n0,1,2,3,4,5,6 deg,7\n");
  o.out = folder_ / "other";
  EXPECT_THAT([&] { write_starter_configuration(o); },
              testing::ThrowsMessage<FileError>(HasSubstr("joints.csv:2: '6 deg' in column 'joint6' is not a finite")));
}

TEST_F(StarterConfiguration, MasksThatBelongToNoPictureAreToBePutRight) {
  const SmallStills stills;
  stills.mask("left/00_mask.png", 255);
  stills.mask("left/01_mask.png", 255);
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const std::string expected =
      "masks/left/00_mask.png: its name ends in no number, or in that of another mask; expected "
      "the name of its picture, as 00.png (the first of 2 masks without a picture)";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_FALSE(report.usable);
  EXPECT_THAT(report.text, HasSubstr(expected));
  stills.mask("right/00.png", 255);
  o.out = folder_ / "some";
  const StarterReport some = write_starter_configuration(o);
  EXPECT_TRUE(some.usable);
  EXPECT_THAT(some.text, HasSubstr(expected));
  o.masks = false;
  o.out = folder_ / "none";
  EXPECT_THAT(write_starter_configuration(o).text, testing::Not(HasSubstr("00_mask.png")));
}

TEST_F(StarterConfiguration, OfThreeCamerasItSaysWhichAreUsed) {
  const SmallStills stills;
  stills.picture("images/wrist/00.png", cv::Mat(6, 8, CV_8UC3, cv::Scalar(1, 2, 3)));
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  EXPECT_THAT([&] { write_starter_configuration(o); },
              testing::ThrowsMessage<ConfigurationError>(
                  HasSubstr("/images: 3 cameras (left, right, wrist), one or two can be used; move the others' folders "
                            "out of images/, or name those that are links of the robot (--camera NAME=LINK)")));
  o.camera_links = {"wrist=camera_left_optical"};
  EXPECT_THAT(write_starter_configuration(o).text, HasSubstr("cameras: wrist; not used: images/left, images/right"));
}

TEST_F(StarterConfiguration, PicturesOfAnotherSizeThanTheirCalibrationAreToBePutRight) {
  const SmallStills stills;
  stills.write("camera_info/left.yaml", "width: 16\nheight: 12\nd: []\nk: [16, 0, 7, 0, 16, 5, 0, 0, 1]\n");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "mine";
  const StarterReport report = write_starter_configuration(o);
  EXPECT_FALSE(report.usable);
  EXPECT_THAT(report.text, HasSubstr("left.yaml is of pictures of 16x12 px, those of camera left are 8x6"));
}

TEST_F(StarterConfiguration, ACameraPoseIsReadWhereItIsNamedAndOnlyThere) {
  const SmallStills stills;
  const auto pose = [](double x) {
    return "[[0, 0, 1, " + std::to_string(x) + "], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]";
  };
  const auto file =
      stills.write("camera_pose.json", R"({"base_link": "base", "X_base_optical": {"a": {"left": )" + pose(1) +
                                           R"(, "right": )" + pose(2) + R"(}, "b": {"left": )" + pose(3) + "}}}");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.stills = stills.path();
  o.out = folder_ / "unknown";
  (void)write_starter_configuration(o);
  EXPECT_EQ(Pipeline(Configuration::load(o.out / "estimator.yaml")).rig().cameras[0].mount.knowledge,
            PlaceKnowledge::kUnknown);
  o.camera_pose = file.string() + ":a";
  o.out = folder_ / "known";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const Pipeline pipeline(Configuration::load(o.out / "estimator.yaml"));
  EXPECT_EQ(pipeline.rig().cameras[1].mount.knowledge, PlaceKnowledge::kRoughly) << "a file may be wrong";
  EXPECT_EQ(pipeline.rig().cameras[1].mount.X_PC.translation().x(), 2.0);
  o.out = folder_ / "none";
  for (const char* method : {"", ":b", ":c"}) {
    o.camera_pose = file.string() + method;
    EXPECT_THROW((void)write_starter_configuration(o), FileError) << method;
  }
}

/// A camera of a live robot has no folder of pictures that names it.
TEST_F(StarterConfiguration, CamerasAreCalledWhatTheirPosesCallThem) {
  const SmallStills stills;
  const std::string pose = "[[0, 0, 1, 1], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]]";
  const auto one =
      stills.write("one.json", R"({"base_link": "base", "X_base_optical": {"a": {"head": )" + pose + "}}}");
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.out = folder_ / "one";
  o.camera_pose = one.string();
  o.camera_infos = {stills.write("camera_info/left.yaml",
                                 "width: 8\nheight: 6\nd: []\nk: [8, 0, 3.6, 0, 8.1, 2.4, 0, 0, 1]\n"
                                 "r: [1, 0, 0, 0, 1, 0, 0, 0, 1]\np: [8, 0, 3.6, 0, 0, 8.1, 2.4, 0, 0, 0, 1, 0]\n")};
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const auto rig = Pipeline(Configuration::load(o.out / "estimator.yaml")).rig();
  ASSERT_EQ(rig.cameras.size(), 1u);
  EXPECT_EQ(rig.cameras[0].name, "head");
  EXPECT_EQ(rig.cameras[0].mount.knowledge, PlaceKnowledge::kRoughly);

  // By their files, where these are called as the poses are.
  const auto two = stills.write("two.json", R"({"base_link": "base", "X_base_optical": {"a": {"chest": )" + pose +
                                                R"(, "left": )" + pose + "}}}");
  o.out = folder_ / "two";
  o.camera_pose = two.string();
  EXPECT_TRUE(write_starter_configuration(o).usable);
  EXPECT_EQ(Pipeline(Configuration::load(o.out / "estimator.yaml")).rig().cameras.at(0).name, "left");

  o.out = folder_ / "none";
  o.camera_infos.clear();
  EXPECT_THAT([&] { (void)write_starter_configuration(o); },
              testing::ThrowsMessage<FileError>(testing::AllOf(
                  HasSubstr("no pose of camera 'camera'; it has chest, left"), HasSubstr("--camera NAME=LINK"))));
}

/// What a live robot's arm and cameras are wrong by as a rule stands in its configuration, late pictures among it.
TEST_F(StarterConfiguration, ALiveRobotsPicturesMayBeLate) {
  StarterOptions o;
  o.urdf = kSource / "meshes/arm7/arm7.urdf";
  o.out = folder_ / "live";
  EXPECT_TRUE(write_starter_configuration(o).usable);
  const auto state = Configuration::load(o.out / "estimator.yaml").section("estimator").section("state");
  EXPECT_TRUE(state.has("latency"));
  EXPECT_TRUE(state.has("joint_place"));
}

/// Robots of others: an arm without a hand, a gripper whose fingers slide, and two arms with fingers that turn.
TEST_F(StarterConfiguration, GuessesTheHandOfOtherPeoplesRobots) {
  SKIP_WITHOUT("real");
  const auto told = [&](const std::string& urdf) {
    StarterOptions o;
    o.urdf = data_folder() / "real/robots" / urdf;
    o.out = folder_ / fs::path(urdf).stem();
    return write_starter_configuration(o).text;
  };
  EXPECT_THAT(told("lbr_med7/lbr_med7.urdf"), HasSubstr("hand: a guess, lbr_link_7\n"));
  EXPECT_THAT(told("panda/panda.urdf"), HasSubstr("hand: a guess, panda_hand\n"));
  EXPECT_THAT(told("g1/g1_29dof_rev_1_0_with_inspire_hand_DFQ.urdf"),
              HasSubstr("hand: a guess, L_hand_base_link; it could be R_hand_base_link as well (--hand)\n"));
}

TEST_F(StarterConfiguration, ReplacesNothing) {
  (void)write_starter_configuration(options());
  EXPECT_THROW((void)write_starter_configuration(options()), FileError);
}

TEST_F(StarterConfiguration, WrongInputIsNamed) {
  const auto error_of = [](const StarterOptions& o) {
    try {
      (void)write_starter_configuration(o);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  auto o = options();
  o.hand_link = "hannd";
  EXPECT_THAT(error_of(o), HasSubstr("--hand 'hannd': no such link in"));
  EXPECT_THAT(error_of(o), HasSubstr("did you mean 'hand'?"));
  o = options();
  o.camera_links = {"left_fingertip"};
  EXPECT_THAT(error_of(o), HasSubstr("no joint moves it against the cameras"));
  o = options();
  o.urdf = kSource / "README.md";
  EXPECT_THAT(error_of(o), HasSubstr("README.md: not a URDF"));
  o.urdf = "/nonexistent.urdf";
  EXPECT_THAT(error_of(o), HasSubstr("/nonexistent.urdf: URDF not found"));
  o.urdf = folder_ / "bad.urdf";
  std::ofstream(o.urdf) << "<robot name='r'/>";
  fs::resize_file(o.urdf, (16u << 20) + 1);
  EXPECT_THAT(error_of(o), HasSubstr("at most 16777216"));
  std::ofstream(o.urdf) << "<robot name='r'><link name='hand'/><joint name='j' type='fixed'><parent link='hand'/>"
                           "<child link='hand'/></joint></robot>";
  EXPECT_THAT(error_of(o), HasSubstr("is its own ancestor"));
  EXPECT_FALSE(fs::exists(o.out)) << "nothing is written for wrong input";
}

}  // namespace
}  // namespace bodyschema
