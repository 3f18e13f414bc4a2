#include "fallback_scorer.hpp"

#include <cstdlib>
#include <optional>

#include "bodyschema/gl/context.hpp"
#include "contour_scorer.hpp"

namespace bodyschema {
namespace {

class FallbackScorer final : public SilhouetteScorer {
 public:
  FallbackScorer(std::unique_ptr<SilhouetteScorer> first, const SilhouetteModel& model,
                 std::span<const PinholeIntrinsics> cameras, int threads)
      : scorer_(std::move(first)), model_(model), cameras_(cameras.begin(), cameras.end()), threads_(threads) {
    if (const char* text = std::getenv("BODYSCHEMA_LOSE_GL_AFTER")) lose_after_ = std::atol(text);
  }

  void set_observation(std::span<const ObservedSilhouette> observed) override {
    if (model_) observed_.assign(observed.begin(), observed.end());
    with_fallback([&] { scorer_->set_observation(observed); });
  }

  void score(std::span<const Eigen::Isometry3f> X_CB, std::span<SilhouetteCounts> counts,
             std::uint32_t camera_mask) override {
    with_fallback([&] {
      if (model_ && lose_after_ > 0 && --lose_after_ == 0) throw gl::ContextError("lost for a test");
      scorer_->score(X_CB, counts, camera_mask);
    });
  }

  BinaryMask render(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) override {
    BinaryMask mask;
    with_fallback([&] { mask = scorer_->render(X_CB, camera); });
    return mask;
  }

  [[nodiscard]] std::string description() const override { return scorer_->description() + note_; }

 private:
  template <class Call>
  void with_fallback(const Call& call) {
    if (!model_) return call();
    try {
      call();
    } catch (const gl::ContextError& error) {
      note_ = ", since " + scorer_->description() + " was lost (" + error.what() + ")";
      scorer_ = make_contour_scorer(*model_, cameras_, threads_);
      model_.reset();
      if (!observed_.empty()) scorer_->set_observation(observed_);
      observed_.clear();
      call();
    }
  }

  std::unique_ptr<SilhouetteScorer> scorer_;
  std::optional<SilhouetteModel> model_;  ///< until it is needed
  std::vector<PinholeIntrinsics> cameras_;
  int threads_;
  std::vector<ObservedSilhouette> observed_;
  std::string note_;
  long lose_after_ = 0;
};

}  // namespace

std::unique_ptr<SilhouetteScorer> with_contour_to_fall_back_on(std::unique_ptr<SilhouetteScorer> first,
                                                               const SilhouetteModel& model,
                                                               std::span<const PinholeIntrinsics> cameras,
                                                               int threads) {
  return std::make_unique<FallbackScorer>(std::move(first), model, cameras, threads);
}

}  // namespace bodyschema
