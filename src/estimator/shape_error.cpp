#include "shape_error.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "bodyschema/core/order_statistics.hpp"
#include "limits.hpp"

namespace bodyschema {

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
  const double kept = std::exp(-1.0 / limits::kRecentPostures);
  for (auto& [place, known] : parts_) {
    if (place.first != camera) continue;
    for (double* sum : {&known.postures, &known.weight, &known.sum, &known.square}) *sum *= kept;
  }
  std::erase_if(parts_, [](const auto& item) { return item.second.postures < limits::kForgotten; });
  for (const auto& [part, mean] : means) {
    if (mean.points < limits::kFewestOfPart || mean.weight <= 0.0) continue;
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
                     [](const auto& item) { return item.second.seen >= limits::kPosturesOfShape; });
}

void ShapeError::end_posture(double floor_px, double fitted) {
  if (!known()) return;
  postures_ = 1.0 + postures_ * std::exp(-1.0 / limits::kRecentPostures);
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
    // Chance cannot be told from shape in the first few.
    const double of_mean =
        part.seen < limits::kPosturesOfShape ? 0.0 : std::max(0.0, part.square / n - mean * mean) / (n - 1.0);
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
  const double left = parts / std::max(limits::kLeastLeft * parts, parts - fitted);
  return std::max(0.0, left * square - floor_px * floor_px * alike) / weight;
}

}  // namespace bodyschema
