#include "particle_search.hpp"

#include <algorithm>
#include <numeric>
#include <random>
#include <utility>

#include "bodyschema/filter/hammoude.hpp"
#include "limits.hpp"
#include "stage_timer.hpp"

namespace bodyschema {
namespace {

/// Smallest first.
std::vector<Eigen::Index> in_order(const Eigen::VectorXd& values) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(values.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return values(a) < values(b); });
  return order;
}

/// The first `count` of some offsets, nearest first, with all else as in `rest`.
std::vector<Eigen::VectorXd> starts_from(const Eigen::MatrixXd& offsets, const Eigen::VectorXd& distances,
                                         const Eigen::VectorXd& rest, std::size_t count) {
  const auto order = in_order(distances);
  std::vector<Eigen::VectorXd> starts(std::min(count, order.size()), rest);
  for (std::size_t i = 0; i < starts.size(); ++i) starts[i].head(offsets.rows()) = offsets.col(order[i]);
  return starts;
}

}  // namespace

ParticleSearch::ParticleSearch(FrameModel& model, HypothesisScorer& scorer, const EstimatorOptions& options)
    : model_(model), scorer_(scorer), options_(options), joints_(model.state().joints()),
      filter_(joints_, options.filter), first_guesses_(filter_.states()), covariance_(filter_.covariance()) {}

const Eigen::VectorXd& ParticleSearch::score_offsets(const Frame& frame, const Eigen::VectorXd& rest,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& offsets_rad) {
  {
    const StageTimer timer(placing_ms_);
    model_.settle(frame, rest);
    Eigen::VectorXd x = rest;
    for (Eigen::Index i = 0; i < offsets_rad.cols(); ++i) {
      x.head(joints_) = offsets_rad.col(i);
      scorer_.place(x, static_cast<std::size_t>(i));
    }
  }
  return scorer_.score(static_cast<std::size_t>(offsets_rad.cols()));
}

void ParticleSearch::score(const Frame& frame, const Eigen::VectorXd& x) {
  distance_ = score_offsets(frame, x, filter_.states());
}

double ParticleSearch::weigh() {
  Eigen::VectorXd weights;
  if (options_.mode == EstimatorMode::kPaper) {
    weights = distance_.unaryExpr(&hammoude_likelihood);
  } else {
    weights = (-(distance_.array() - distance_.minCoeff()) / options_.temperature).exp();
  }
  if (weights.maxCoeff() <= 0.0) weights.setConstant(1.0);
  filter_.update(weights);
  return filter_.effective_sample_size();
}

ParticleSearch::Best ParticleSearch::take_best() {
  Best best;
  best.offsets_rad = filter_.estimate();
  best.likelihood = hammoude_likelihood(distance_(filter_.estimate_index()));
  covariance_ = filter_.covariance();
  filter_.resample_and_spread();
  best.narrowest = filter_.spread_rad() <= options_.filter.spread_min_rad;
  return best;
}

void ParticleSearch::spread(const Eigen::VectorXd& offsets_rad, const std::optional<Eigen::VectorXd>& sd_rad) {
  slip_of_particle_.clear();
  filter_.resample_and_spread();
  if (!sd_rad && filter_.spread_rad() < limits::kSearchSpread_rad) filter_.set_spread(limits::kSearchSpread_rad);
  const Eigen::VectorXd sd = sd_rad ? Eigen::VectorXd(sd_rad->cwiseMax(options_.filter.spread_min_rad))
                                    : Eigen::VectorXd::Constant(joints_, filter_.spread_rad());
  std::normal_distribution<double> normal(0.0, 1.0);
  Eigen::VectorXd x(joints_);
  for (Eigen::Index i = 0; i < filter_.states().cols() / 2; ++i) {
    for (Eigen::Index k = 0; k < joints_; ++k) x(k) = offsets_rad(k) + sd(k) * normal(filter_.random());
    filter_.set_state(i, x);
  }
}

void ParticleSearch::suspect_slips(const Frame& frame, const Eigen::VectorXd& x) {
  const auto order = in_order(distance_);
  const Eigen::Index slips = filter_.states().cols() / 2;
  const Eigen::Index sizes = std::max<Eigen::Index>(1, slips / (2 * joints_));  // each way
  slip_of_particle_.assign(static_cast<std::size_t>(filter_.states().cols()), -1);
  Eigen::VectorXd slipped(joints_);
  for (Eigen::Index i = 0; i < std::min(slips, 2 * sizes * joints_); ++i) {
    const Eigen::Index step = i / joints_;
    const double size = limits::kLargestSlip_rad * static_cast<double>(step / 2 + 1) / static_cast<double>(sizes);
    slipped = x.head(joints_);
    slipped(i % joints_) += step % 2 == 0 ? size : -size;
    const auto particle = order[order.size() - 1 - static_cast<std::size_t>(i)];
    filter_.set_state(particle, slipped);
    slip_of_particle_[static_cast<std::size_t>(particle)] = i % joints_;
  }
  score(frame, x);
}

std::optional<double> ParticleSearch::slipped_offset_rad(Eigen::Index joint) const {
  if (slip_of_particle_.empty()) return std::nullopt;
  for (const auto particle : in_order(distance_)) {
    if (slip_of_particle_[static_cast<std::size_t>(particle)] == joint) return filter_.states()(joint, particle);
  }
  return std::nullopt;
}

std::vector<Eigen::VectorXd> ParticleSearch::nearest(const Eigen::VectorXd& rest, std::size_t count) const {
  return starts_from(filter_.states(), distance_, rest, count);
}

Eigen::VectorXd ParticleSearch::score_first_guesses(const Frame& frame) {
  return score_offsets(frame, model_.state().prior_mean(), first_guesses_);
}

std::vector<Eigen::VectorXd> ParticleSearch::nearest_guesses(const Eigen::VectorXd& distances,
                                                             std::size_t count) const {
  return starts_from(first_guesses_, distances, model_.state().prior_mean(), count);
}

Eigen::VectorXd ParticleSearch::likelihood(const Frame& frame, const Eigen::MatrixXd& offsets_rad) {
  Eigen::VectorXd result(offsets_rad.cols());
  const auto batch = static_cast<Eigen::Index>(options_.filter.particles);
  for (Eigen::Index begin = 0; begin < offsets_rad.cols(); begin += batch) {
    const Eigen::Index n = std::min(batch, offsets_rad.cols() - begin);
    const auto& distances = score_offsets(frame, model_.state().prior_mean(), offsets_rad.middleCols(begin, n));
    result.segment(begin, n) = distances.head(n).unaryExpr(&hammoude_likelihood);
  }
  return result;
}

void ParticleSearch::restart() {
  filter_.reset(Eigen::VectorXd::Zero(joints_));
}

double ParticleSearch::take_placing_ms() {
  return std::exchange(placing_ms_, 0.0);
}

}  // namespace bodyschema
