#include <gtest/gtest.h>

#include <algorithm>

#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/effects/joint_roles.hpp"
#include "robot/tilting_eyes.hpp"
#include "test_data.hpp"

namespace bodyschema {
namespace {

using Names = std::vector<std::string>;

struct Robot {
  JointRoles roles;
  [[nodiscard]] Names names(const std::vector<Eigen::Index>& joints) const {
    Names list;
    for (const auto joint : joints) list.push_back(roles.names[static_cast<std::size_t>(joint)]);
    std::sort(list.begin(), list.end());
    return list;
  }
};

Robot robot(const std::string& file, const std::vector<std::string>& overrides = {}) {
  const auto configuration = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/" + file, overrides);
  const auto setup = RobotSetup::from(configuration.section("robot"));
  const auto rig = StereoRig::from(configuration.section("cameras"));
  return {JointRoles::of(load_robot(setup, rig), setup, rig)};
}

std::string name_of(const Robot& robot, Eigen::Index joint) {
  return joint < 0 ? "none" : robot.roles.names[static_cast<std::size_t>(joint)];
}

const Names kCurl = {"r_index_distal", "r_index_proximal", "r_middle_distal", "r_middle_proximal",
                     "r_pinky",        "r_thumb_distal",   "r_thumb_proximal"};

TEST(JointRoles, OfOurOwnRobot) {
  const auto r = robot("icub_right/robot.yaml");
  EXPECT_EQ(r.names(r.roles.fingers), kCurl);  // the thumb's opposition turns it sideways
  auto hand = kCurl;
  hand.insert(hand.begin() + 6, "r_thumb_oppose");
  EXPECT_EQ(r.names(r.roles.hand), hand);
  EXPECT_EQ(r.names(r.roles.neck), (Names{"eyes_tilt", "neck_pitch", "neck_roll", "neck_yaw"}));
  EXPECT_EQ(name_of(r, r.roles.left_pan), "l_eye_pan");
  EXPECT_EQ(name_of(r, r.roles.right_pan), "r_eye_pan");
}

TEST(JointRoles, DoNotDependOnTheOrderInWhichTheHeadIsListed) {
  const auto r = robot("icub_right/robot.yaml",
                       {"robot.head_joints=[r_eye_pan, l_eye_pan, eyes_tilt, neck_yaw, neck_roll, neck_pitch]"});
  EXPECT_EQ(r.names(r.roles.neck), (Names{"eyes_tilt", "neck_pitch", "neck_roll", "neck_yaw"}));
  EXPECT_EQ(name_of(r, r.roles.left_pan), "l_eye_pan");
  EXPECT_EQ(name_of(r, r.roles.right_pan), "r_eye_pan");
}

TEST(JointRoles, ComeFromTheRootOutwardsHoweverTheyAreListed) {
  const auto r = robot("icub_right/robot.yaml");
  const auto backwards = robot("icub_right/robot.yaml",
                               {"robot.head_joints=[r_eye_pan, l_eye_pan, eyes_tilt, neck_yaw, neck_roll, neck_pitch]",
                                "robot.estimated_joints=[r_wrist_yaw, r_wrist_pitch, r_wrist_prosup, r_elbow, "
                                "r_shoulder_yaw, r_shoulder_roll, r_shoulder_pitch]"});
  EXPECT_EQ(backwards.roles.neck, r.roles.neck);
  EXPECT_EQ(backwards.roles.head, r.roles.head);
  EXPECT_EQ(backwards.roles.arm, r.roles.arm);
  EXPECT_EQ(name_of(r, r.roles.neck.front()), "neck_pitch");
  EXPECT_EQ(name_of(r, r.roles.neck.back()), "eyes_tilt");
  EXPECT_EQ(name_of(r, r.roles.arm.front()), "r_shoulder_pitch");
}

TEST(JointRoles, OfAnEyeThatTiltsByItselfThePanTurnsAboutTheVertical) {
  auto [setup, rig] = test::tilting_eyes();
  for (const auto& listed :
       {Names{"neck", "l_pan", "l_tilt", "r_tilt", "r_pan"}, Names{"r_pan", "r_tilt", "l_tilt", "l_pan", "neck"}}) {
    setup.head_joints = listed;
    const Robot r{JointRoles::of(setup.load(), setup, rig)};
    EXPECT_EQ(r.names(r.roles.neck), Names{"neck"});
    EXPECT_EQ(name_of(r, r.roles.left_pan), "l_pan");
    EXPECT_EQ(name_of(r, r.roles.right_pan), "r_pan");
  }
}

Names joints_of(const JointRoles& roles, const std::vector<ArmLink>& links) {
  Names names;
  for (const auto& link : links) names.push_back(roles.names[static_cast<std::size_t>(link.joint)]);
  return names;
}

/// Bodies between the arm's joints, fingers counted to the hand, and the links between joints that lie apart.
TEST(JointRoles, SegmentsHoldEveryPartOnceAndLinksAreAsLongAsTheRobotsAre) {
  const auto configuration = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
  const auto setup = RobotSetup::from(configuration.section("robot"));
  const auto model = setup.load();
  const auto roles = JointRoles::of(model, setup, StereoRig::from(configuration.section("cameras")));
  std::vector<std::size_t> parts;
  for (const auto& segment : roles.segments) parts.insert(parts.end(), segment.parts.begin(), segment.parts.end());
  std::sort(parts.begin(), parts.end());
  std::vector<std::size_t> all(setup.model.rendered_links.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = i;
  EXPECT_EQ(parts, all);
  Names names;
  for (const auto& segment : roles.segments) names.push_back(segment.name);
  EXPECT_EQ(names, (Names{"r_upper_arm", "r_elbow_1", "r_forearm", "r_wrist_1", "r_hand"}));
  EXPECT_EQ(roles.segments.back().parts.size(), 18u);  // what carries the palm, the palm and five fingers

  // Lengths by walking from joint to joint, and what a longer link does to the hand.
  Names links;
  for (const auto& link : roles.links) links.push_back(link.name);
  EXPECT_EQ(links, (Names{"r_shoulder_1", "r_upper_arm", "r_upper_arm", "r_forearm", "r_forearm"}));
  EXPECT_EQ(joints_of(roles, roles.links),
            (Names{"r_shoulder_roll", "r_shoulder_yaw", "r_elbow", "r_wrist_prosup", "r_wrist_pitch"}));
  CorrectedKinematics kinematics(model, {setup.hand_link, "r_forearm", "r_upper_arm"}, {"root_link"});
  const auto q = setup.default_joints(*model);
  for (const auto& link : roles.links) {
    EXPECT_GT(link.length_m, 0.1);
    std::vector<Pose> before(3), after(3);
    auto c = roles.no_corrections();
    kinematics.compute(q, c, 0, before);
    auto& adjustment = c.adjustments[static_cast<std::size_t>(link.joint)];
    adjustment.along_m = 0.01 * link.per_metre.along_m;
    adjustment.shift_1_m = 0.01 * link.per_metre.shift_1_m;
    adjustment.shift_2_m = 0.01 * link.per_metre.shift_2_m;
    kinematics.compute(q, c, 0, after);
    EXPECT_NEAR((after[0].translation() - before[0].translation()).norm(), 0.01, 1e-6) << link.name;
    // A link that turns about its own length goes with the joint that turns it, not with the one at its end.
    const std::size_t own = link.name == "r_forearm" ? 1 : 2;
    const double cover_m = (after[own].translation() - before[own].translation()).norm();
    if (link.name != "r_shoulder_1") {
      EXPECT_NEAR(cover_m, link.takes_cover ? 0.01 : 0.0, 1e-6) << link.name;
    }
  }
}

/// Of the body between arm and ground, too, some parts move against others; but the arm stands on them.
TEST(JointRoles, OnlyTheLastSegmentOfAnArmHasJointsWithin) {
  const auto configuration = Configuration::load(std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/robot.yaml");
  auto setup = RobotSetup::from(configuration.section("robot"));
  auto& links = setup.model.rendered_links;
  links.insert(links.begin(), {"torso_1", "torso_2"});
  const auto roles = JointRoles::of(setup.load(), setup, StereoRig::from(configuration.section("cameras")));
  EXPECT_EQ(roles.segments.front().parts.size(), 2u);
  for (const auto& segment : roles.segments) EXPECT_EQ(segment.inner.size(), segment.name == "r_hand" ? 16u : 0u);
  EXPECT_EQ(links[roles.segments.back().core], "r_hand");
}

TEST(JointRoles, OfARobotWithoutHeadOrFingers) {
  const auto r = robot("arm7/robot.yaml");
  EXPECT_TRUE(r.roles.fingers.empty()) << r.names(r.roles.fingers).front();
  EXPECT_FALSE(r.roles.has_pans());
}

/// The official iCub names its joints otherwise: ..._0_joint opposes the thumb and spreads the fingers.
TEST(JointRoles, OfTheOfficialIcub) {
  SKIP_WITHOUT("icub-models");
  const auto r = robot("icub_v2_5/robot.yaml");
  const auto fingers = r.names(r.roles.fingers);
  EXPECT_GE(fingers.size(), 11u);
  for (const auto& name : fingers) EXPECT_EQ(name.find("_0_joint"), std::string::npos) << name;
  EXPECT_EQ(r.roles.hand.size(), fingers.size() + 5);
  EXPECT_EQ(r.roles.neck.size(), 4u);
  EXPECT_TRUE(r.roles.has_pans());
  // The joint that turns the forearm sits aside of the elbow, 37 deg off its own axis: a shorter forearm lies along
  // that axis with its cover, and where nothing was called so it was taken for a shifted elbow.
  std::vector<ArmLink> turned;
  for (const auto& link : r.roles.links) {
    if (name_of(r, link.joint) == "r_wrist_prosup") turned.push_back(link);
  }
  ASSERT_EQ(turned.size(), 1u);
  EXPECT_EQ(turned.front().name, "r_forearm");
  EXPECT_TRUE(turned.front().takes_cover);
}

/// The other arm's joints move what is drawn, and not the hand that is named; they are no fingers for that.
TEST(JointRoles, OfARobotWithTwoArms) {
  SKIP_WITHOUT("real/robots/g1");
  const auto r = robot("g1/robot.yaml");
  EXPECT_EQ(r.roles.arm.size(), 14u);
  EXPECT_EQ(r.names(r.roles.fingers), Names{});
  // A joint has one length, although several links of the tree may follow it: a second one would be the same number.
  auto joints = joints_of(r.roles, r.roles.links);
  std::sort(joints.begin(), joints.end());
  EXPECT_EQ(std::adjacent_find(joints.begin(), joints.end()), joints.end());
  ASSERT_EQ(r.roles.mounts.size(), 2u);
  EXPECT_EQ(r.roles.mounts[1].link, "R_hand_base_link");
  EXPECT_EQ(name_of(r, r.roles.mounts[1].joint), "right_wrist_yaw_joint");
  EXPECT_LT((r.roles.mounts[1].axis - Eigen::Vector3d::UnitX()).norm(), 1e-9);
}

/// Fingers and their tips are no mounts; nor is a last link that carries nothing.
TEST(JointRoles, AMountIsWhatIsFixedToTheLastLinkOfAnArm) {
  const auto own = robot("icub_right/robot.yaml");
  ASSERT_EQ(own.roles.mounts.size(), 1u);
  EXPECT_EQ(own.roles.mounts.front().link, "r_hand");
  EXPECT_EQ(name_of(own, own.roles.mounts.front().joint), "r_wrist_yaw");
  EXPECT_LT((own.roles.mounts.front().axis - Eigen::Vector3d(0.0625, 0.0, 0.016).normalized()).norm(), 1e-9);
}

}  // namespace
}  // namespace bodyschema
