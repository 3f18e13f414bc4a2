#include "beyond_model.hpp"

#include <gtest/gtest.h>

#include "evidence/drawn_log.hpp"

namespace bodyschema {
namespace {

class BeyondTheModel : public DrawnLog {
 protected:
  static constexpr int kPostures = 6;

  [[nodiscard]] std::vector<Observation> healthy() const {
    return observe(kPostures, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(roles_.arm.size())));
  }
  [[nodiscard]] BeyondModel look_at(PictureLog& log) const {
    const std::vector<Corrections> corrections(log.pictures().size(), roles_.no_corrections());
    return beyond_model(log, corrections);
  }
  /// Where the hand is in a picture.
  [[nodiscard]] Eigen::Vector2d hand(const PictureLog& log, std::size_t picture) const {
    RobotProjection projection(robot_, setup_, rig_, roles_);
    const auto& p = log.pictures()[picture];
    projection.place(p.joints.q, roles_.no_corrections(), p.camera);
    return rig_.cameras[p.camera].intrinsics.project(projection.hand().translation());
  }
  static void paint(CameraObservation& seen, const Eigen::Vector2d& at, int half_px, bool robot) {
    std::printf("at %.1f %.1f mask %dx%d coverage %zu\n", at.x(), at.y(), seen.mask.width(), seen.mask.height(), seen.coverage.size());
    for (int v = static_cast<int>(at.y()) - half_px; v <= static_cast<int>(at.y()) + half_px; ++v) {
      for (int u = static_cast<int>(at.x()) - half_px; u <= static_cast<int>(at.x()) + half_px; ++u) {
        if (u < 0 || v < 0 || u >= seen.mask.width() || v >= seen.mask.height()) continue;
        seen.mask.set(u, v, robot);
        if (!seen.coverage.empty()) {
          seen.coverage[static_cast<std::size_t>(v) * static_cast<std::size_t>(seen.mask.width()) +
                        static_cast<std::size_t>(u)] = robot ? 255 : 0;
        }
      }
    }
  }
};

TEST_F(BeyondTheModel, MasksOfTheModelHaveNothing) {
  const auto log = log_of(healthy());
  const auto beyond = look_at(*log);
  EXPECT_EQ(beyond.pictures, 0u);
  EXPECT_TRUE(beyond.on_link.empty()) << beyond.on_link;
}

TEST_F(BeyondTheModel, AThingInTheHandIsFoundNamedAndLeftOut) {
  auto observations = healthy();
  const auto bare = log_of(observations);
  std::size_t p = 0;
  for (auto& observation : observations) {
    for (auto& seen : observation.cameras) paint(*seen, hand(*bare, p++), 40, true);
  }
  auto log = log_of(observations);
  const auto beyond = look_at(*log);
  EXPECT_EQ(beyond.pictures, log->pictures().size());
  EXPECT_FALSE(beyond.on_link.empty());
  const Eigen::Vector2d at = hand(*bare, 0);
  leave_out(*log, beyond);
  ASSERT_EQ(log->pictures().size(), bare->pictures().size());
  // At the thing's rim, and nowhere far from it.
  std::size_t unknown = 0;
  const auto& valid = log->pictures()[0].valid;
  for (int v = 0; v < valid.height(); ++v) {
    for (int u = 0; u < valid.width(); ++u) {
      if (valid.at(u, v)) continue;
      ++unknown;
      EXPECT_LT((Eigen::Vector2d(u, v) - at).cwiseAbs().maxCoeff(), 50.0);
    }
  }
  EXPECT_GT(unknown, 500u);
}

TEST_F(BeyondTheModel, SomebodysArmInOnePictureIsLeftOutAndNotTakenForAThing) {
  auto observations = healthy();
  const auto bare = log_of(observations);
  paint(*observations[2].cameras[0], hand(*bare, 4), 35, true);
  auto log = log_of(observations);
  const auto beyond = look_at(*log);
  EXPECT_EQ(beyond.pictures, 1u);
  EXPECT_TRUE(beyond.on_link.empty()) << beyond.on_link;
}

}  // namespace
}  // namespace bodyschema
