#include "hypothesis_scorer.hpp"

#include <chrono>
#include <utility>

#include "bodyschema/filter/hammoude.hpp"

namespace bodyschema {

HypothesisScorer::HypothesisScorer(FrameModel& model, const SilhouetteModel& silhouettes,
                                   std::vector<PinholeIntrinsics> cameras, const SilhouetteOptions& options,
                                   std::size_t slots)
    : model_(model), cameras_(std::move(cameras)),
      scorer_(make_silhouette_scorer(silhouettes, cameras_, options, &engine_reason_)), observed_(cameras_.size()),
      slots_(slots), X_CB_((slots + 1) * cameras_.size() * model.part_count()), counts_(slots * cameras_.size()),
      distances_(static_cast<Eigen::Index>(slots)), one_distance_(1) {}

bool HypothesisScorer::observe(const Observation& observation, const Frame& frame, double min_share) {
  frame_ = &frame;
  camera_mask_ = 0;
  double seen_px = 0.0, pixels = 0.0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const bool present =
        c < observation.cameras.size() && observation.cameras[c] && !observation.cameras[c]->mask.empty();
    if (present) {
      observed_[c].mask = observation.cameras[c]->mask;
      observed_[c].valid = observation.cameras[c]->valid;
      seen_px += static_cast<double>(observed_[c].mask.count());
      pixels += static_cast<double>(cameras_[c].width) * static_cast<double>(cameras_[c].height);
      camera_mask_ |= 1u << c;
    } else {
      observed_[c].mask = BinaryMask(cameras_[c].width, cameras_[c].height);
      observed_[c].valid = BinaryMask();
    }
  }
  if (camera_mask_ == 0 || seen_px < min_share * pixels) return false;
  scorer_->set_observation(observed_);
  return true;
}

void HypothesisScorer::place(const Eigen::VectorXd& x, std::size_t slot) {
  const std::size_t parts = model_.part_count();
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if ((camera_mask_ & (1u << c)) == 0) continue;
    model_.place(x, c, {X_CB_.data() + (slot * cameras_.size() + c) * parts, parts});
  }
}

void HypothesisScorer::score_slots(std::size_t begin, std::size_t n, Eigen::VectorXd& distances) {
  const auto start = std::chrono::steady_clock::now();
  const std::size_t cameras = cameras_.size(), per_slot = cameras * model_.part_count();
  scorer_->score({X_CB_.data() + begin * per_slot, n * per_slot}, {counts_.data(), n * cameras}, camera_mask_);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t in_union = 0, in_both = 0;
    for (std::size_t c = 0; c < cameras; ++c) {
      in_union += counts_[i * cameras + c].union_count();
      in_both += counts_[i * cameras + c].intersection;
    }
    distances(static_cast<Eigen::Index>(i)) = hammoude_distance(in_union, in_both);
  }
  scoring_ms_ += std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

const Eigen::VectorXd& HypothesisScorer::score(std::size_t n) {
  score_slots(0, n, distances_);
  return distances_;
}

double HypothesisScorer::distance(const Eigen::VectorXd& x) {
  model_.settle(*frame_, x);
  place(x, slots_);
  score_slots(slots_, 1, one_distance_);
  return one_distance_(0);
}

bool HypothesisScorer::can_be_exchanged() const {
  return cameras_.size() == 2 && camera_mask_ == 3u && cameras_[0].width == cameras_[1].width &&
         cameras_[0].height == cameras_[1].height;
}

std::string HypothesisScorer::description() const {
  return scorer_->description() + (engine_reason_.empty() ? "" : ": " + engine_reason_);
}

double HypothesisScorer::take_scoring_ms() {
  return std::exchange(scoring_ms_, 0.0);
}

}  // namespace bodyschema
