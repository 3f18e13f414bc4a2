#include "bodyschema/evidence/shape_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "bodyschema/core/order_statistics.hpp"

namespace bodyschema {
namespace {

/// Physical. Points of a part in a picture; of fewer the mean is a point's own error.
constexpr double kFewestOfPart = 4.0;
/// Statistical. Postures; of fewer the variance between them is not known.
constexpr int kPosturesOfShape = 3;
/// Numerical. Of one posture: what has faded to less is as if it had not been seen.
constexpr double kForgotten = 1e-3;
/// Physical. Share of what parts get wrong that no fit takes up: parameters turn and shift a limb, which moves its two
/// flanks against each other; to the outside of both at once, as a wrong shape does, few do.
constexpr double kLeastLeft = 0.5;

}  // namespace

ShapeError::ShapeError(double memory_postures)
    : memory_postures_(memory_postures), kept_(memory_postures > 0.0 ? std::exp(-1.0 / memory_postures) : 1.0) {}

void ShapeError::add(std::span<const OutlinePoint> points, std::size_t camera, double unit_px) {
  struct Mean {
    double weight = 0.0, sum = 0.0, points = 0.0;
  };
  std::map<std::size_t, Mean> means;
  for (const auto& point : points) {
    auto& mean = means[point.part];
    mean.weight += point.weight;
    mean.sum += point.weight * point.residual_px / unit_px;
    mean.points += 1.0;
  }
  // What earlier postures left was left by an earlier estimate: of parts, too, that this one does not show.
  for (auto& [place, known] : parts_) {
    if (place.first != camera) continue;
    for (double* sum : {&known.postures, &known.weight, &known.sum, &known.square}) *sum *= kept_;
  }
  std::erase_if(parts_, [](const auto& item) { return item.second.postures < kForgotten; });
  for (const auto& [part, mean] : means) {
    if (mean.points < kFewestOfPart || mean.weight <= 0.0) continue;
    auto& known = parts_[{camera, part}];
    const double residual = mean.sum / mean.weight;
    ++known.seen;
    known.postures += 1.0;
    known.weight += mean.weight;
    known.sum += residual;
    known.square += residual * residual;
  }
}

bool ShapeError::known() const {
  return std::any_of(parts_.begin(), parts_.end(),
                     [](const auto& item) { return item.second.seen >= kPosturesOfShape; });
}

void ShapeError::end_posture(double floor_px, double fitted) {
  if (!known()) return;
  postures_ = 1.0 + postures_ * kept_;
  recent_px2_ += (variance_px2(floor_px, fitted) - recent_px2_) / postures_;
}

double ShapeError::lasting_variance_px2(double floor_px, double fitted) const {
  return std::max(variance_px2(floor_px, fitted), recent_px2_);
}

double ShapeError::variance_px2(double floor_px, double fitted) const {
  if (parts_.empty()) return 0.0;
  std::vector<double> errors;  // of the parts' means, squared
  for (const auto& [place, part] : parts_) {
    const double n = part.postures, mean = part.sum / n;
    // Chance cannot be told from shape in the first few, nor in what is left of a part that is not seen any more.
    const double of_mean =
        part.seen < kPosturesOfShape || n < 2.0 ? 0.0 : std::max(0.0, part.square / n - mean * mean) / (n - 1.0);
    errors.push_back(mean * mean - of_mean);
  }
  const double middle = median(errors);
  double square = 0.0, weight = 0.0, alike = 0.0, weight_square = 0.0;
  auto error = errors.begin();
  for (const auto& [place, part] : parts_) {
    const double own = part.weight * part.weight / part.postures;
    square += own * std::max(middle, *error++);
    alike += own;
    weight += part.weight;
    weight_square += part.weight * part.weight;
  }
  // Parts that have a say: as many as equally large ones would be.
  const double parts = weight * weight / weight_square;
  const double left = parts / std::max(kLeastLeft * parts, parts - fitted);
  return std::max(0.0, left * square - floor_px * floor_px * alike) / weight;
}

Eigen::MatrixXd shape_covariance(const PostureMemory& memory, double variance_share) {
  const Eigen::Index n = memory.layout().estimated();
  if (memory.empty() || variance_share <= 0.0) return Eigen::MatrixXd::Zero(n, n);
  const Eigen::VectorXd prior = memory.layout().prior_sd.cwiseProduct(memory.widening()).array().square().inverse();
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(n, n);
  Eigen::MatrixXd precision = memory.estimate().own.ldlt().solve(identity);
  precision.diagonal() -= prior;
  precision /= variance_share * static_cast<double>(memory.postures());
  precision.diagonal() += prior;
  return precision.ldlt().solve(identity);
}

}  // namespace bodyschema
