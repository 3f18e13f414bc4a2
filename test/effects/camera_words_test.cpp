#include <gtest/gtest.h>

#include "bodyschema/effects/effect_kind.hpp"
#include "roles.hpp"

namespace bodyschema {
namespace {

/// Directions are those of someone who looks through the camera.
TEST(CameraWords, SayWhichWayACameraSits) {
  const auto roles = test::roles();
  const auto effect = make_effect("camera_pair", {}, roles);
  const std::vector<std::string> amounts = {"0.1 mm (at most 0.3)", "2 mm (1 to 3)",       "0.1 mm (at most 0.3)",
                                            "0.7 deg (0.6 to 0.8)", "0 deg (at most 0.1)", "1 deg (0.9 to 1.1)"};
  const auto set = [&](std::size_t i, double value) { effect->parameters()[i].value = value; };
  set(1, 0.002);
  set(3, -0.012);
  set(5, 0.017);
  const auto& sentence = effect_kind("camera_pair").sentence;
  EXPECT_EQ(
      sentence(*effect, roles, amounts),
      "camera 'right' sits otherwise against 'left' than configured: 2 mm (1 to 3) lower, looking 0.7 deg (0.6 to 0.8) "
      "further down, rolled by 1 deg (0.9 to 1.1) clockwise");
  // A positive turn about x, to the right, lifts the view: the picture's centre moves to what was above it.
  Corrections c = roles.no_corrections();
  auto at = test::instant(roles);
  at.camera = 1;
  set(3, 0.1);
  effect->apply(at, c);
  const Eigen::Vector3d looks =
      Eigen::AngleAxisd(c.camera.turn_rad.x(), Eigen::Vector3d::UnitX()) * Eigen::Vector3d::UnitZ();
  EXPECT_LT(looks.y(), 0.0) << "y points down";
}

TEST(CameraWords, OfTheFirstAloneSayThatTheOtherDoesNot) {
  const auto roles = test::roles();
  const auto effect = make_effect("first_camera", {}, roles);
  std::vector<std::string> amounts(6, "0 mm (at most 1)");
  amounts[4] = "0.7 deg (0.6 to 0.8)";
  EXPECT_EQ(effect_kind("first_camera").sentence(*effect, roles, amounts),
            "camera 'left' sits otherwise than configured, and 'right' does not: looking 0.7 deg (0.6 to 0.8) further "
            "right");
}

TEST(CameraWords, WhereNothingIsToldAllIsSaid) {
  const auto roles = test::roles();
  const auto effect = make_effect("camera_pose", {}, roles);
  const std::vector<std::string> amounts(6, "0 mm (at most 1)");
  const auto text = effect_kind("camera_pose").sentence(*effect, roles, amounts);
  EXPECT_NE(text.find("further forward"), std::string::npos);
  EXPECT_NE(text.find("rolled by"), std::string::npos);
}

}  // namespace
}  // namespace bodyschema
