#include <gtest/gtest.h>

#include "bodyschema/effects/effect_kind.hpp"
#include "bodyschema/effects/across_axis.hpp"
#include "roles.hpp"
#include "words.hpp"

namespace bodyschema {
namespace {

std::string said(const std::string& name, const EffectTarget& target, const std::vector<double>& values,
                 const std::vector<std::string>& amounts) {
  const auto roles = test::roles();
  const auto effect = make_effect(name, target, roles);
  for (std::size_t i = 0; i < values.size(); ++i) effect->parameters()[i].value = values[i];
  return effect_kind(name).sentence(*effect, roles, amounts);
}

TEST(Words, OfALengthArePlain) {
  EXPECT_EQ(said("link_length", {"s_yaw", ""}, {0.006}, {"6.2 mm (5.9 to 6.5)"}),
            "the upper arm is 6.2 mm (5.9 to 6.5) longer than in the URDF");
  auto roles = test::roles();
  roles.links.back().takes_cover = true;
  const auto forearm = make_effect("link_length", {"prosup", ""}, roles);
  forearm->parameters()[0].value = -0.004;
  EXPECT_EQ(effect_kind("link_length").sentence(*forearm, roles, std::vector<std::string>{"4 mm"}),
            "the forearm is 4 mm shorter than in the URDF, its cover further in");
}

TEST(Words, OfPartsAreThoseOfAnArm) {
  EXPECT_EQ(effects::part_in_words("r_upper_arm"), "the upper arm");
  EXPECT_EQ(effects::part_in_words("left_forearm_link"), "the forearm");
  EXPECT_EQ(effects::part_in_words("r_hand_dh_frame"), "the hand");
  EXPECT_EQ(effects::part_in_words("panda_link5"), "the link panda_link5");
  EXPECT_EQ(said("mesh_scale", {"", "hand"}, {-0.03}, {"3 % (2.9 to 3.1)"}),
            "the hand is 3 % (2.9 to 3.1) smaller than in the meshes");
}

TEST(Words, LeaveOutWhatMayBeNothingBesideWhatIsSomething) {
  EXPECT_EQ(
      said("axis_shift", {"elbow", ""}, {}, {"3 mm (2 to 4) along -x", "1 mm (0.5 to 1.5) along +y"}),
      "the axis of elbow lies beside where the URDF has it, by 3 mm (2 to 4) along -x and 1 mm (0.5 to 1.5) along "
      "+y");
  EXPECT_EQ(said("axis_tilt", {"elbow", ""}, {}, {"0.6 deg (0.5 to 0.7) about +x", "0.1 deg (at most 0.2) about -y"}),
            "the axis of elbow is tilted against the URDF's, by 0.6 deg (0.5 to 0.7) about +x");
}

/// Amounts come without a sign: one that is applied the wrong way round doubles the error.
TEST(Words, OfTwoSignedNumbersSayWhichWay) {
  EXPECT_EQ(
      said("eccentricity", {"elbow", ""}, {-0.01, 0.02}, {"0.6 deg", "1.1 deg"}),
      "the encoder disc of elbow runs off centre: its error swings with the angle, by 0.6 deg times minus the sine "
      "and 1.1 deg times the cosine");
  EXPECT_EQ(
      said("principal_point", {"", "common"}, {-2.0, 1.0}, {"2 px", "1 px"}),
      "the principal point of the cameras lies elsewhere than configured, 2 px to the left and 1 px further down");
}

/// Directions across an axis are made up; the URDF's axes are not.
TEST(Words, OfDirectionsAreTheAxesOfTheUrdf) {
  EXPECT_EQ(effects::direction_in_words({0.0, 1.0, 0.0}), "+y");
  EXPECT_EQ(effects::direction_in_words(Eigen::Vector3d(1.0, 0.0, -1.0).normalized()), "(0.71, 0, -0.71)");
  const AcrossAxis across{"elbow", "r_upper_arm", {Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitZ()}};
  EXPECT_EQ(across.direction(1, true), "-z of the link r_upper_arm");
  EXPECT_EQ(across.direction(1, false), "+z of the link r_upper_arm");
}

}  // namespace
}  // namespace bodyschema
