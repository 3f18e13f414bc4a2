#include "agreed_motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema::diagnosis {
namespace {

/// Pairs of one kind, summed up.
struct Pairs {
  double agreed = 0.0, variance = 0.0;  ///< px^2 times weight, and its variance by chance
  double square = 0.0;                  ///< all misfit of the pairs
  int count = 0;
  void add(double both, double squares) {
    agreed += both;
    variance += both * both;
    square += squares;
    ++count;
  }
  /// @param tail  chance that noise alone is above it
  [[nodiscard]] double share(double tail) const {
    constexpr int kFewest = 3;
    if (count < kFewest || square <= 0.0) return 0.0;
    // Each pair's sum has no mean if there is nothing but noise: its own square is its variance.
    const double chance = student_quantile(2.0 * tail, count) * std::sqrt(variance);
    return agreed > chance ? std::min(1.0, agreed / square) : 0.0;
  }
};

}  // namespace

double agreed_share(const std::vector<MotionEvidence>& pictures, const AgreedMotionSettings& settings) {
  const Eigen::VectorXd belief = settings.sd.array().square().inverse();
  std::vector<Eigen::VectorXd> motion;
  for (const auto& picture : pictures) {
    Eigen::MatrixXd A = picture.precision * picture.A;
    A.diagonal() += belief;
    motion.emplace_back(A.ldlt().solve(picture.precision * picture.b));
  }
  const auto pair = [&](Pairs& pairs, std::size_t a, std::size_t b) {
    pairs.add(motion[a].dot(pictures[b].b) + motion[b].dot(pictures[a].b), pictures[a].square + pictures[b].square);
  };
  Pairs at_once, in_turn;
  std::vector<std::optional<std::size_t>> last;  // picture of each camera
  std::vector<bool> taken(pictures.size(), false);
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    const auto& own = pictures[p];
    const auto apart = [&](std::size_t other) { return own.utime - pictures[other].utime; };
    if (own.camera >= last.size()) last.resize(own.camera + 1);
    // The other camera's picture that came last, if it was not compared yet.
    std::optional<std::size_t> beside;
    for (std::size_t camera = 0; camera < last.size(); ++camera) {
      if (camera == own.camera || !last[camera] || taken[*last[camera]]) continue;
      if (!beside || *last[camera] > *beside) beside = last[camera];
    }
    if (beside && apart(*beside) <= settings.longest_us) {
      pair(at_once, *beside, p);
      taken[*beside] = taken[p] = true;
    }
    if (auto& before = last[own.camera]; before && apart(*before) <= settings.longest_us) pair(in_turn, *before, p);
    last[own.camera] = p;
  }
  // Two kinds of pairs are asked.
  return std::max(at_once.share(settings.level / 2.0), in_turn.share(settings.level / 2.0));
}

}  // namespace bodyschema::diagnosis
