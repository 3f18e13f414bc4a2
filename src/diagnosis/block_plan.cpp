#include "block_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace bodyschema::diagnosis {
namespace {

constexpr double kStill = 0.25 * kPi / 180.0;  ///< within this a joint stands
constexpr double kShortestHold_s = 3.0;
constexpr double kCell_s = 0.5;

using Hold = std::pair<std::size_t, std::size_t>;  ///< views [first, last)

/// Rests of arm and head. Encoders of fingers and of what else is published may shake meanwhile.
std::vector<Hold> find_holds(std::span<const ViewInput> views, const JointRoles& roles) {
  auto joints = roles.arm;
  joints.insert(joints.end(), roles.head.begin(), roles.head.end());
  const auto moved = [&](const ViewInput& a, const ViewInput& b) {
    return (a.joints.q(joints) - b.joints.q(joints)).cwiseAbs().maxCoeff();
  };
  std::vector<Hold> holds;
  for (std::size_t v = 0; v < views.size();) {
    std::size_t end = v;
    while (end < views.size() && moved(views[end], views[v]) < kStill) ++end;
    const bool hold = seconds(views[end - 1].joints.utime - views[v].joints.utime) >= kShortestHold_s;
    if (hold) holds.emplace_back(v, end);
    v = hold ? end : v + 1;
  }
  return holds;
}

/// The scores b = G'Wr of the arm's joints, by camera: the noise as the fit sees it. In a hold the
/// true residual is constant, so what varies is noise.
std::vector<StillStretch> still_stretches(std::span<const ViewInput> views,
                                          const std::vector<CompressedView>& compressed,
                                          const std::vector<Hold>& holds) {
  constexpr std::size_t kFewest = 16;
  constexpr Eigen::Index kArmJoints = 7;
  std::vector<StillStretch> stretches;
  for (const auto& [first, last] : holds) {
    for (std::size_t camera = 0; camera < 2; ++camera) {
      std::vector<std::size_t> members;
      for (auto v = first; v < last; ++v) {
        const bool repeated = !members.empty() && views[v].joints.utime == views[members.back()].joints.utime;
        if (views[v].camera == camera && compressed[v].weight > 0.0 && !repeated) members.push_back(v);
      }
      if (members.size() < kFewest) continue;
      const auto n = static_cast<Eigen::Index>(members.size());
      StillStretch stretch;
      stretch.step_s = seconds(views[members.back()].joints.utime - views[members.front()].joints.utime) /
                       static_cast<double>(n - 1);
      stretch.samples.resize(std::min(kArmJoints, compressed[first].vector.size()), n);
      for (Eigen::Index i = 0; i < n; ++i) {
        stretch.samples.col(i) = compressed[members[static_cast<std::size_t>(i)]].vector.head(stretch.samples.rows());
      }
      stretches.push_back(std::move(stretch));
    }
  }
  return stretches;
}

/// Orthonormal columns: a mean and a linear trend over n samples. A trend in a rest is a drift.
Eigen::MatrixXd trend_basis(Eigen::Index n) {
  Eigen::MatrixXd basis(n, 2);
  basis.col(0).setConstant(1.0);
  basis.col(1) = Eigen::VectorXd::LinSpaced(n, -1.0, 1.0);
  basis.colwise().normalize();
  return basis;
}

/// Autocovariance of a stretch without its trend, mean over rows of variance one.
Eigen::VectorXd autocovariance(const Eigen::MatrixXd& samples, Eigen::Index lags) {
  const Eigen::MatrixXd basis = trend_basis(samples.cols());
  Eigen::VectorXd result = Eigen::VectorXd::Zero(lags);
  double rows = 0.0;
  for (Eigen::Index i = 0; i < samples.rows(); ++i) {
    Eigen::VectorXd x = samples.row(i).transpose();
    x -= basis * (basis.transpose() * x);
    const double square = x.squaredNorm();
    if (square <= 0.0) continue;
    rows += 1.0;
    for (Eigen::Index k = 0; k < lags; ++k) {
      result[k] += x.head(x.size() - k).dot(x.tail(x.size() - k)) / square;
    }
  }
  return rows > 0.0 ? Eigen::VectorXd(result / rows) : result;
}

/// What autocovariance() is on average for noise of variance one whose correlation falls by `decay`
/// a step (0: white).
Eigen::VectorXd expected_autocovariance(double decay, Eigen::Index n, Eigen::Index lags) {
  Eigen::MatrixXd covariance(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      covariance(i, j) = i == j ? 1.0 : std::pow(decay, static_cast<double>(std::abs(i - j)));
    }
  }
  const Eigen::MatrixXd basis = trend_basis(n);
  const Eigen::MatrixXd seen = covariance * basis;
  covariance +=
      basis * (basis.transpose() * seen) * basis.transpose() - seen * basis.transpose() - basis * seen.transpose();
  Eigen::VectorXd result(lags);
  for (Eigen::Index k = 0; k < lags; ++k) {
    result[k] = covariance.diagonal(k).sum() / static_cast<double>(n);
  }
  return result;
}

/// Slow noise plus white noise that explains an autocovariance best; both shares at least zero.
struct NoiseFit {
  double slow = 0.0, white = 0.0, misfit = std::numeric_limits<double>::infinity();
};
NoiseFit fit_noise(const Eigen::VectorXd& observed, const Eigen::VectorXd& slow, const Eigen::VectorXd& white) {
  const double ss = slow.squaredNorm(), ww = white.squaredNorm(), sw = slow.dot(white);
  const double so = slow.dot(observed), wo = white.dot(observed);
  const double determinant = ss * ww - sw * sw;
  NoiseFit fit;
  if (determinant > 1e-12 * ss * ww) {
    fit.slow = (ww * so - sw * wo) / determinant;
    fit.white = (ss * wo - sw * so) / determinant;
  }
  if (fit.white < 0.0) fit = {std::max(0.0, so / ss), 0.0, 0.0};
  if (fit.slow < 0.0) fit = {0.0, std::max(0.0, wo / ww), 0.0};
  fit.misfit = (observed - fit.slow * slow - fit.white * white).squaredNorm();
  return fit;
}

/// What follows takes time and memory with the square of a stretch's length; a long rest is several.
std::vector<StillStretch> in_pieces(const std::vector<StillStretch>& stretches) {
  constexpr Eigen::Index kMostSamples = 600;
  std::vector<StillStretch> pieces;
  for (const auto& stretch : stretches) {
    const Eigen::Index n = stretch.samples.cols(), count = (n + kMostSamples - 1) / kMostSamples;
    for (Eigen::Index i = 0; i < count; ++i) {
      pieces.push_back({stretch.samples.middleCols(i * (n / count), n / count), stretch.step_s});
    }
  }
  return pieces;
}

}  // namespace

double noise_correlation_s(const std::vector<StillStretch>& whole) {
  constexpr double kSlowest_s = 12.0, kRatio = 1.3;
  const auto stretches = in_pieces(whole);
  double result = 0.0;
  // Stretches of one length share what is expected of them.
  std::vector<bool> used(stretches.size(), false);
  for (std::size_t first = 0; first < stretches.size(); ++first) {
    if (used[first]) continue;
    const Eigen::Index n = stretches[first].samples.cols(), lags = std::max<Eigen::Index>(2, n / 2);
    const double step = stretches[first].step_s;
    Eigen::VectorXd observed = Eigen::VectorXd::Zero(lags);
    double count = 0.0;
    for (std::size_t s = first; s < stretches.size(); ++s) {
      if (used[s] || stretches[s].samples.cols() != n) continue;
      used[s] = true;
      observed += autocovariance(stretches[s].samples, lags);
      count += 1.0;
    }
    observed /= count;
    const Eigen::VectorXd white = expected_autocovariance(0.0, n, lags);
    NoiseFit best;
    double best_s = 0.0;
    for (double time = 0.3 * step; time < kSlowest_s; time *= kRatio) {
      const auto fit = fit_noise(observed, expected_autocovariance(std::exp(-step / time), n, lags), white);
      if (fit.misfit < best.misfit) {
        best = fit;
        best_s = time;
      }
    }
    const double share = best.slow / std::max(1e-12, best.slow + best.white);
    result = std::max(result, 0.5 * step + share * best_s);
  }
  return result;
}

BlockPlan plan_blocks(const MeasurementSource& source, const std::vector<CompressedView>& compressed,
                      double shortest_s) {
  const auto views = source.views();
  BlockPlan plan;
  plan.block_of_view.assign(views.size(), 0);
  plan.cell_of_view.assign(views.size(), 0);
  plan.weight_of_view.assign(views.size(), 1.0);
  if (views.empty()) return plan;

  const auto holds = find_holds(views, source.roles());
  std::vector<bool> still(views.size(), false);
  for (const auto& [first, last] : holds) {
    std::fill(still.begin() + static_cast<std::ptrdiff_t>(first), still.begin() + static_cast<std::ptrdiff_t>(last),
              true);
  }
  plan.still_share =
      static_cast<double>(std::count(still.begin(), still.end(), true)) / static_cast<double>(views.size());
  plan.correlation_s = noise_correlation_s(still_stretches(views, compressed, holds));
  const double span = seconds(views.back().joints.utime - views.front().joints.utime);
  // At least ten blocks, else there is nothing to hold out.
  plan.length_s = std::min(std::max(shortest_s, 5.0 * plan.correlation_s), std::max(shortest_s, span / 10.0));

  const auto time = [&](std::size_t v) { return seconds(views[v].joints.utime); };
  std::size_t block = 0;
  double start = time(0);
  std::vector<int> members = {0};
  for (std::size_t v = 0; v < views.size(); ++v) {
    const bool same_instant = v > 0 && views[v].joints.utime - views[v - 1].joints.utime < 1000;
    const bool cut = v > 0 && (still[v] != still[v - 1] || (!still[v] && time(v) - start >= plan.length_s));
    if (cut && !same_instant) {
      ++block;
      start = time(v);
      members.push_back(0);
    }
    plan.block_of_view[v] = block;
    ++members[block];
  }
  // A remainder shorter than half a block joins the one before.
  const double typical = static_cast<double>(views.size()) * plan.length_s / std::max(span, 1e-9);
  std::vector<std::size_t> renamed(block + 1, 0);
  std::size_t kept = 0;
  for (std::size_t b = 0; b <= block; ++b) {
    if (b > 0 && members[b] > 0.5 * typical) ++kept;
    renamed[b] = kept;
  }
  for (auto& b : plan.block_of_view) b = renamed[b];
  plan.cell_start_s.resize(kept + 1);
  for (std::size_t v = 0; v < views.size(); ++v) {
    auto& cells = plan.cell_start_s[plan.block_of_view[v]];
    const bool same_instant = v > 0 && views[v].joints.utime - views[v - 1].joints.utime < 5000;
    if (cells.empty() || (!same_instant && time(v) - cells.back() >= kCell_s)) cells.push_back(time(v));
    plan.cell_of_view[v] = cells.size() - 1;
  }
  // A hold weighs as much as one block of motion.
  for (const auto& [first, last] : holds) {
    const double share = typical / static_cast<double>(last - first);
    for (auto v = first; v < last; ++v) plan.weight_of_view[v] = std::min(1.0, share);
  }
  return plan;
}

}  // namespace bodyschema::diagnosis
