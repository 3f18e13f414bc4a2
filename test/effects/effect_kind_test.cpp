#include "bodyschema/effects/effect_kind.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "bodyschema/core/error.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "effects/own_effect.hpp"
#include "effects/roles.hpp"

namespace bodyschema {
namespace {

using test::roles;
using testing::HasSubstr;
using testing::ThrowsMessage;

/// A log in which everything moves, fast and to and fro, seen by two cameras.
LogMotion rich_log(const JointRoles& r) {
  const auto n = static_cast<Eigen::Index>(r.names.size());
  LogMotion motion;
  motion.cameras = 2;
  motion.has_masses = true;
  motion.range_rad = Eigen::VectorXd::Constant(n, radians(90.0));
  motion.torque_range_nm = Eigen::VectorXd::Constant(n, 5.0);
  motion.reversals.assign(r.names.size(), 10);
  motion.arm_speed_rad_s = radians(60.0);
  motion.reading_period_s = 0.01;
  motion.reading_step_rad = radians(0.6);
  motion.neck_range_rad = radians(30.0);
  return motion;
}

/// An arm that stands, seen by one camera.
LogMotion poor_log(const JointRoles& r) {
  const auto n = static_cast<Eigen::Index>(r.names.size());
  LogMotion motion;
  motion.cameras = 1;
  motion.range_rad = motion.torque_range_nm = Eigen::VectorXd::Zero(n);
  motion.reversals.assign(r.names.size(), 0);
  motion.reading_period_s = 0.01;
  return motion;
}

TEST(EffectKinds, SayWhatTheyFoundInASentenceWithTheSizeAndAWordForTheSign) {
  const auto r = roles();
  for (const EffectKind& kind : effect_kinds()) {
    const auto effect = kind.make(kind.targets(r).back(), r);
    std::vector<std::string> amounts;
    for (const auto& p : effect->parameters()) {
      if (p.fitted) amounts.push_back("<" + p.name + ">");
    }
    for (auto& p : effect->parameters()) p.value = p.typical;
    const auto sentence = kind.sentence(*effect, r, amounts);
    for (const auto& amount : amounts) EXPECT_THAT(sentence, HasSubstr(amount)) << kind.name;
    EXPECT_FALSE(sentence.ends_with('.')) << sentence;
    const auto& target = effect->target();
    // A link that is called by its place in the arm needs no joint.
    if (kind.name != "link_length") {
      EXPECT_THAT(sentence, HasSubstr(target.joint)) << kind.name;
    }
    // Of one parameter without bound the sign is a word. Sizes come without it.
    const auto parameters = std::as_const(*effect).parameters();
    const bool signed_size = amounts.size() == 1 && std::isinf(parameters[0].at_least) &&
                             kind.name != "joint_coupling" && kind.name != "compliance";
    if (!signed_size) continue;
    effect->parameters()[0].value *= -1.0;
    EXPECT_NE(kind.sentence(*effect, r, amounts), sentence) << kind.name;
  }
}

TEST(EffectKinds, NameLookalikesThatExistAndTheMotionThatSplitsThem) {
  const auto names = effect_names();
  for (const EffectKind& kind : effect_kinds()) {
    for (const auto& other : kind.lookalikes) {
      EXPECT_NE(other, kind.name);
      EXPECT_NE(std::find(names.begin(), names.end(), other), names.end()) << kind.name << " names " << other;
    }
    EXPECT_EQ(kind.lookalikes.empty(), kind.splitting_motion.empty()) << kind.name;
    // What no file can hold has a remark that says what to do.
    if (kind.name.starts_with("own_")) continue;
    if (kind.home == EffectHome::kNowhere && kind.timing == EffectTiming::kAlways) {
      EXPECT_FALSE(kind.remark.empty()) << kind.name;
    }
  }
}

TEST(EffectKinds, ARichLogTellsAllOfThemAndAPoorOneSaysWhyNot) {
  const auto r = roles();
  const auto rich = rich_log(r), poor = poor_log(r);
  auto stills = poor;  // five photographs, say
  stills.reading_period_s = 9.5;
  stills.reading_step_rad = 0.3;
  std::size_t told_by_any = 0;
  for (const EffectKind& kind : effect_kinds()) {
    if (!kind.not_testable) {
      ++told_by_any;
      continue;
    }
    for (const auto& target : kind.targets(r)) {
      EXPECT_EQ(kind.not_testable(target, r, rich), "") << kind.name;
    }
    const auto last = kind.targets(r).back();
    EXPECT_TRUE(kind.not_testable(last, r, poor) != "" || kind.not_testable(last, r, stills) != "") << kind.name;
  }
  for (const char* change : {"slip", "drift"}) {
    EXPECT_THAT(effect_kind(change).not_testable({"elbow", ""}, r, stills), HasSubstr("17 deg apart")) << change;
  }
  EXPECT_GT(told_by_any, 5u);
  const auto& compliance = effect_kind("compliance");
  auto weightless = rich;
  weightless.has_masses = false;
  EXPECT_NE(compliance.not_testable({"elbow", ""}, r, weightless), "");
  auto one_eye = rich;
  one_eye.cameras = 1;
  EXPECT_THAT(effect_kind("camera_pair").not_testable({}, r, one_eye), HasSubstr("one camera"));
  EXPECT_EQ(effect_kind("principal_point").not_testable({"", "common"}, r, one_eye), "");
  auto sparse = rich;
  sparse.reading_period_s = 0.1;
  EXPECT_THAT(effect_kind("backlash").not_testable({"elbow", ""}, r, sparse), HasSubstr("100 ms"));
}

TEST(EffectKinds, OneThatIsRegisteredIsOneOfTheCatalogue) {
  const auto r = roles();
  test::register_own_effect();
  EXPECT_EQ(effect_names().front(), "joint_offset");
  EXPECT_EQ(effect_names().back(), test::kOwnEffect);
  EXPECT_EQ(effect_targets(test::kOwnEffect, r).size(), r.arm.size());
  // It is made, nearest names are found, files hold it: nothing tells it from those that are shipped.
  ErrorModel model(r);
  model.add(test::kOwnEffect, {"elbow", ""}).parameters()[0].value = radians(2.0);
  const auto again = ErrorModel::parse(model.to_yaml(), r);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_NEAR(again[0].parameters()[0].value, radians(2.0), 1e-12);
  auto at = test::instant(r);
  at.q[9] = kPi / 2.0;
  Corrections c = r.no_corrections();
  again.corrections(at, c);
  EXPECT_NEAR(c.dq[9], radians(2.0), 1e-12);
  EXPECT_THAT([&] { effect_kind("own_ripple_of_the_ger"); },
              ThrowsMessage<ConfigurationError>(HasSubstr(test::kOwnEffect)));
}

TEST(EffectKinds, ASecondOneOfANameIsAnError) {
  test::register_own_effect();
  EXPECT_THAT([] { register_effect(effect_kind("backlash")); },
              ThrowsMessage<ConfigurationError>(HasSubstr("'backlash'")));
  EXPECT_THAT([] { register_effect(effect_kind(test::kOwnEffect)); },
              ThrowsMessage<ConfigurationError>(HasSubstr(test::kOwnEffect)));
}

/// Who holds a kind keeps it, however many are registered later.
TEST(EffectKinds, ReferencesHoldWhileOthersAreRegistered) {
  const auto& first = effect_kind("joint_offset");
  test::register_own_effect();
  EXPECT_EQ(&first, &effect_kind("joint_offset"));
}

}  // namespace
}  // namespace bodyschema
