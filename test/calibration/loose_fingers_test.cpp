#include "loose_fingers.hpp"

#include <gtest/gtest.h>

#include "believed_outline.hpp"
#include "evidence/drawn_log.hpp"

namespace bodyschema {
namespace {

class LooseFingers : public DrawnLog {
 protected:
  [[nodiscard]] Beliefs believing(double finger_sd_deg) const {
    Beliefs beliefs;
    beliefs.state.push_back({"finger_posture", EffectTarget(), {radians(finger_sd_deg)}});
    return beliefs;
  }
  std::vector<Observation> seen_ = observe(4, Eigen::VectorXd::Zero(7));
};

TEST_F(LooseFingers, AllFingersAndNothingElseWhereTheirAnglesAreHardlyKnown) {
  const auto log = log_of(seen_);
  EXPECT_TRUE(loose_fingers(*log, believing(1.5)).empty()) << "known well enough";
  EXPECT_TRUE(loose_fingers(*log, {}).empty());
  const auto loose = loose_fingers(*log, believing(10.0));
  const auto& links = setup_.model.rendered_links;
  ASSERT_EQ(loose.size(), links.size());
  int fingers = 0;
  for (std::size_t l = 0; l < links.size(); ++l) {
    fingers += loose[l];
    for (const char* other : {"r_forearm", "r_hand", "r_upper_arm", "r_wrist_1"}) {
      if (links[l] == other) {
        EXPECT_FALSE(loose[l]) << links[l];
      }
    }
  }
  EXPECT_GE(fingers, 5);
}

TEST_F(LooseFingers, WhatIsLeftOutHasNoSayAndStillHides) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  const auto parts_seen = [&] {
    std::vector<std::size_t> points(setup_.model.rendered_links.size(), 0);
    fit.linearise(ErrorModel(roles_), {}, {.search_px = 6.0, .spacing_px = 3.0, .robust_px = 3.0}, {},
                  [&](std::size_t, std::span<const OutlinePoint> matched) {
                    for (const auto& point : matched) ++points[point.part];
                  });
    return points;
  };
  const auto all = parts_seen();
  const auto loose = loose_fingers(*log, believing(10.0));
  fit.leave_out(loose);
  const auto arm = parts_seen();
  fit.refresh();
  EXPECT_EQ(parts_seen(), arm) << "after a refresh, too";
  for (std::size_t l = 0; l < all.size(); ++l) {
    EXPECT_EQ(arm[l], loose[l] ? 0u : all[l]) << setup_.model.rendered_links[l];
  }
}

TEST_F(LooseFingers, OutlinesAreBelievedToBeOffByWhatTheOffsetsMoveThem) {
  const auto log = log_of(seen_);
  LogFit fit(*log, 1);
  const auto believed_px = [&](double sd_deg) {
    std::vector<Belief> list;
    for (const auto& target : effect_targets("joint_offset", roles_)) {
      list.push_back({"joint_offset", target, {radians(sd_deg)}});
    }
    return believed_outline_sd_px(fit, State(roles_, list));
  };
  const double one = believed_px(1.0);
  // A degree of a shoulder moves a hand 0.4 m away by 7 mm: 4 px of a picture with a focal length of 260 px at 0.35 m.
  EXPECT_GT(one, 1.0);
  EXPECT_LT(one, 12.0);
  EXPECT_NEAR(believed_px(4.0), 4.0 * one, 1e-6 * one);
}

}  // namespace
}  // namespace bodyschema
