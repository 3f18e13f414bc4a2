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
  /// The end of what a picture shows of the arm: of the mask's pixels that of the highest row.
  static Eigen::Vector2d tip(const CameraObservation& seen) {
    for (int v = 0; v < seen.mask.height(); ++v) {
      for (int u = 0; u < seen.mask.width(); ++u) {
        if (seen.mask.at(u, v)) return {u, v};
      }
    }
    return {0, 0};
  }
  static void paint(CameraObservation& seen, const Eigen::Vector2d& at, int half_px, bool robot) {
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

TEST_F(BeyondTheModel, AThingAtTheArmsEndIsFoundAndLeftOut) {
  auto observations = healthy();
  const Eigen::Vector2d at = tip(*observations[0].cameras[0]);
  for (auto& observation : observations) {
    for (auto& seen : observation.cameras) paint(*seen, tip(*seen), 20, true);
  }
  auto log = log_of(observations);
  const auto beyond = look_at(*log);
  EXPECT_EQ(beyond.pictures, log->pictures().size());
  const std::size_t pictures = log->pictures().size();
  leave_out(*log, beyond);
  ASSERT_EQ(log->pictures().size(), pictures);
  // At the thing's rim, and nowhere far from it.
  std::size_t unknown = 0;
  const auto& valid = log->pictures()[0].valid;
  for (int v = 0; v < valid.height(); ++v) {
    for (int u = 0; u < valid.width(); ++u) {
      if (valid.at(u, v)) continue;
      ++unknown;
      EXPECT_LT((Eigen::Vector2d(u, v) - at).cwiseAbs().maxCoeff(), 30.0);
    }
  }
  EXPECT_GT(unknown, 500u);
}

TEST_F(BeyondTheModel, SomebodysArmInOnePictureIsLeftOutAndNotTakenForAThing) {
  auto observations = healthy();
  auto& seen = *observations[2].cameras[0];
  paint(seen, tip(seen), 20, true);
  auto log = log_of(observations);
  const auto beyond = look_at(*log);
  EXPECT_EQ(beyond.pictures, 1u);
  EXPECT_TRUE(beyond.on_link.empty()) << beyond.on_link;
}

TEST(LinkThatHolds, IsNotOneThatWasSeenOnce) {
  EXPECT_EQ(link_that_holds(std::vector{9.0, 1.0}, std::vector{10.0, 1.0}, 10), 0u);
  EXPECT_EQ(link_that_holds(std::vector{6.0, 6.0}, std::vector{10.0, 7.0}, 10), 1u);
  EXPECT_EQ(link_that_holds(std::vector{5.0, 1.0}, std::vector{10.0, 1.0}, 10), std::nullopt);
}

}  // namespace
}  // namespace bodyschema
