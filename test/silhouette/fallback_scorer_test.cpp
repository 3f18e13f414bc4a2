// A GL context that is lost in the middle of the work.

#include "fallback_scorer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/gl/context.hpp"
#include "contour_scorer.hpp"
#include "silhouette/synthetic_hand.hpp"

namespace bodyschema {
namespace {

/// Counts wrongly for a few calls, then loses its context in the chosen function.
class Dying final : public SilhouetteScorer {
 public:
  enum class In { kSetObservation, kScore, kRender };
  explicit Dying(In where, int after = 0) : where_(where), after_(after) {}
  void set_observation(std::span<const ObservedSilhouette>) override { die(In::kSetObservation); }
  void score(std::span<const Eigen::Isometry3f>, std::span<SilhouetteCounts> counts, std::uint32_t) override {
    std::fill(counts.begin(), counts.end(), SilhouetteCounts{1, 2, 3});
    die(In::kScore);
  }
  BinaryMask render(std::span<const Eigen::Isometry3f>, std::size_t) override {
    die(In::kRender);
    return {};
  }
  [[nodiscard]] std::string description() const override { return "atlas on a GPU"; }

 private:
  void die(In where) {
    if (where == where_ && after_-- == 0) throw gl::ContextError("the driver was reset");
  }
  In where_;
  int after_;
};

class FallbackScorer : public testing::TestWithParam<Dying::In> {};

TEST_P(FallbackScorer, ContourTakesOverWithinTheCallThatFailed) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240)};
  const auto X_CB = synthetic::stereo_particles(8, 1, 3);
  const std::size_t parts = model.parts.size();
  const auto contour = make_contour_scorer(model, cameras, 1);
  const std::vector<ObservedSilhouette> observed{{contour->render({X_CB.data(), parts}, 0), {}}};
  std::vector<SilhouetteCounts> expected(8), counts(8);
  contour->set_observation(observed);
  contour->score(X_CB, expected, ~0u);

  const auto scorer = with_contour_to_fall_back_on(std::make_unique<Dying>(GetParam()), model, cameras, 1);
  EXPECT_EQ(scorer->description(), "atlas on a GPU");
  scorer->set_observation(observed);
  const BinaryMask drawn = scorer->render({X_CB.data(), parts}, 0);
  scorer->score(X_CB, counts, ~0u);
  EXPECT_THAT(scorer->description(), testing::HasSubstr("since atlas on a GPU was lost (the driver was reset)"));
  if (GetParam() != Dying::In::kScore) {
    scorer->score(X_CB, counts, ~0u);
  }
  EXPECT_EQ(counts, expected);
  if (GetParam() != Dying::In::kScore) {
    EXPECT_EQ(drawn.count(), observed[0].mask.count());
  }
}

INSTANTIATE_TEST_SUITE_P(, FallbackScorer,
                         testing::Values(Dying::In::kSetObservation, Dying::In::kScore, Dying::In::kRender));

TEST(FallbackScorerAlone, WorksOnWithTheFirstWhileItLives) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(64, 48)};
  const auto X_CB = synthetic::stereo_particles(4, 1, 5);
  const auto scorer = with_contour_to_fall_back_on(std::make_unique<Dying>(Dying::In::kScore, 2), model, cameras, 1);
  std::vector<SilhouetteCounts> counts(4);
  for (int i = 0; i < 2; ++i) {
    scorer->score(X_CB, counts, ~0u);
    EXPECT_EQ(counts[0], (SilhouetteCounts{1, 2, 3}));
  }
  scorer->score(X_CB, counts, ~0u);
  EXPECT_NE(counts[0], (SilhouetteCounts{1, 2, 3}));
}

}  // namespace
}  // namespace bodyschema
