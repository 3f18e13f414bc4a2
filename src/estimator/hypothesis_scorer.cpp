#include "hypothesis_scorer.hpp"

#include <fmt/core.h>

#include <utility>

#include "bodyschema/filter/hammoude.hpp"
#include "bodyschema/search/fastest_engine.hpp"
#include "bodyschema/search/search_level.hpp"
#include "stage_timer.hpp"

namespace bodyschema {

HypothesisScorer::HypothesisScorer(FrameModel& model, const SilhouetteModel& silhouettes,
                                   const SilhouetteModel* outlines, std::vector<PinholeIntrinsics> cameras,
                                   const SilhouetteOptions& options, std::size_t slots)
    : model_(model), cameras_(std::move(cameras)), observed_(cameras_.size()), coarse_(cameras_.size()), slots_(slots),
      X_CB_((slots + 1) * cameras_.size() * model.part_count()), counts_(slots * cameras_.size()),
      distances_(static_cast<Eigen::Index>(slots)), one_distance_(1) {
  const std::size_t at_once = slots * cameras_.size();
  if (outlines == nullptr) {
    full_ = make_silhouette_scorer(silhouettes, cameras_,
                                   fastest_engine(silhouettes, cameras_, options, at_once, engine_reason_));
    scorer_ = full_.get();
    return;
  }
  const SearchLevel level = search_level(silhouettes, cameras_);
  step_ = level.step;
  search_ = make_silhouette_scorer(level.model, level.cameras,
                                   fastest_engine(level.model, level.cameras, options, at_once, engine_reason_));
  // For pictures to look at and specks: the processor is quick enough.
  SilhouetteOptions full = options;
  full.engine = "contour";
  full_ = make_silhouette_scorer(*outlines, cameras_, full);
  scorer_ = search_.get();
  std::size_t triangles = 0, drawn = 0;
  for (const auto& part : silhouettes.parts) triangles += part.triangles.size();
  for (const auto& part : level.model.parts) drawn += part.triangles.size();
  level_text_ = fmt::format(", 1/{} of the pictures' rows and columns, {} of {} triangles", step_, drawn, triangles);
}

bool HypothesisScorer::observe(const Frame& frame, double min_share, bool every_pixel) {
  frame_ = &frame;
  camera_mask_ = 0;
  double seen_px = 0.0, pixels = 0.0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraObservation* seen = frame.seen[c];
    if (seen != nullptr && !seen->mask.empty()) {
      observed_[c].mask = seen->mask;
      observed_[c].valid = seen->valid;
      if (c < frame.covered.size()) leave_out(frame.covered[c], observed_[c].valid);
      seen_px += static_cast<double>(observed_[c].mask.count());
      pixels += static_cast<double>(cameras_[c].width) * static_cast<double>(cameras_[c].height);
      camera_mask_ |= 1u << c;
    } else {
      observed_[c].mask = BinaryMask(cameras_[c].width, cameras_[c].height);
      observed_[c].valid = BinaryMask();
    }
  }
  if (camera_mask_ == 0 || seen_px < min_share * pixels) return false;
  // The counts of so few pixels would hold more chance than silhouette.
  constexpr double kFewest_px = 800.0;
  const bool coarse = search_ && !every_pixel && seen_px >= kFewest_px * step_ * step_;
  scorer_ = coarse ? search_.get() : full_.get();
  for (std::size_t c = 0; coarse && c < cameras_.size(); ++c) {
    coarse_[c].mask = every_nth_pixel(observed_[c].mask, step_);
    coarse_[c].valid = every_nth_pixel(observed_[c].valid, step_);
  }
  scorer_->set_observation(coarse ? coarse_ : observed_);
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
  const StageTimer timer(scoring_ms_);
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
  return (search_ ? search_ : full_)->description() + level_text_ +
         (engine_reason_.empty() ? "" : ": " + engine_reason_);
}

double HypothesisScorer::take_scoring_ms() {
  return std::exchange(scoring_ms_, 0.0);
}

}  // namespace bodyschema
