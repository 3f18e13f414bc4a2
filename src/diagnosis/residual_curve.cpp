#include "residual_curve.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kFewestPerBin = 4;
constexpr double kLeastDof = 0.1;
constexpr double kFewestIndependent = 4.0;
constexpr double kMedian = 1.253;      ///< standard error of a median of normal values over that of their mean
constexpr double kMiddleHalf = 1.349;  ///< width of the middle half of a normal distribution, in standard deviations

double quantile_of_sorted(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const double part = at - static_cast<double>(low);
  return low + 1 < sorted.size() ? (1.0 - part) * sorted[low] + part * sorted[low + 1] : sorted[low];
}

std::vector<double> sorted_y(std::vector<ResidualPoint>::const_iterator first,
                             std::vector<ResidualPoint>::const_iterator last) {
  std::vector<double> values;
  for (; first != last; ++first) values.push_back(first->y);
  std::sort(values.begin(), values.end());
  return values;
}

void leave_out_unknown(std::vector<ResidualPoint>& points) {
  std::erase_if(points, [](const ResidualPoint& p) { return !std::isfinite(p.x) || !std::isfinite(p.y); });
}

/// The signs of each camera's points about the median, with their times.
struct Signs {
  std::vector<double> time_s, sign;
};
using SignsOfCameras = std::array<Signs, 2>;

/// Mean product of a camera's signs `lag` pictures apart, not counting those with a gap between them.
double correlation(const SignsOfCameras& cameras, std::size_t lag, double step_s) {
  const double usual_s = static_cast<double>(lag) * step_s;
  double sum = 0.0, count = 0.0;
  for (const auto& [time_s, sign] : cameras) {
    for (std::size_t i = lag; i < sign.size(); ++i) {
      if (std::abs(time_s[i] - time_s[i - lag] - usual_s) > 0.5 * usual_s) continue;
      sum += sign[i] * sign[i - lag];
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

/// Median time from one picture of a camera to its next, not counting those shown twice; 0 without any.
double usual_step_s(const SignsOfCameras& cameras) {
  std::vector<double> steps;
  for (const auto& camera : cameras) {
    for (std::size_t i = 1; i < camera.time_s.size(); ++i) {
      const double step = camera.time_s[i] - camera.time_s[i - 1];
      if (step > 0.0) steps.push_back(step);
    }
  }
  std::sort(steps.begin(), steps.end());
  return steps.empty() ? 0.0 : quantile_of_sorted(steps, 0.5);
}

/// Mean product of signs of the two cameras within half a step of each other.
double shared_by(const Signs& left, const Signs& right, double step_s) {
  double sum = 0.0, count = 0.0;
  std::size_t r = 0;
  for (std::size_t l = 0; l < left.sign.size(); ++l) {
    while (r < right.sign.size() && right.time_s[r] < left.time_s[l] - 0.5 * step_s) ++r;
    if (r == right.sign.size()) break;
    if (right.time_s[r] > left.time_s[l] + 0.5 * step_s) continue;
    sum += left.sign[l] * right.sign[r];
    count += 1.0;
  }
  return count > 0.0 ? std::clamp(sum / count, 0.0, 1.0) : 0.0;
}

/// How many points that err independently these are worth: n^2 over the sum of the correlations of all pairs.
/// These fade evenly, so that one sum a camera stands for all points before.
double independent(std::vector<ResidualPoint> points, const ErrorMemory& memory) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.time_s < b.time_s; });
  std::array<double, 2> before{};
  // Within half a step of each other is the same time: the cameras' stamps need not be equal.
  const double first_s = points.front().time_s;
  double pairs = 0.0, last_step = 0.0;
  for (const auto& p : points) {
    const double step = std::round((p.time_s - first_s) / memory.step_s);
    const double kept = std::pow(memory.kept, step - last_step);
    const std::size_t own = p.camera == 0 ? 0 : 1;
    for (auto& sum : before) sum *= kept;
    pairs += before[own] + memory.shared * before[1 - own];
    before[own] += 1.0;
    last_step = step;
  }
  const double n = static_cast<double>(points.size());
  return n * n / (n + 2.0 * pairs);
}

}  // namespace

ErrorMemory error_memory(const std::vector<ResidualPoint>& all) {
  constexpr std::size_t kFewest = 16;
  auto points = all;
  leave_out_unknown(points);
  if (points.size() < kFewest) return {};
  const auto sorted = sorted_y(points.begin(), points.end());
  const double middle = quantile_of_sorted(sorted, 0.5);
  SignsOfCameras cameras;
  for (const auto& p : points) {
    auto& camera = cameras[p.camera == 0 ? 0 : 1];
    camera.time_s.push_back(p.time_s);
    camera.sign.push_back(p.y > middle ? 1.0 : p.y < middle ? -1.0 : 0.0);
  }
  ErrorMemory memory;
  memory.step_s = usual_step_s(cameras);
  if (memory.step_s == 0.0) return {};
  // What all later pictures have in common with one, until they have nothing.
  double sum = 0.0;
  for (std::size_t lag = 1; lag < points.size(); ++lag) {
    const double common = correlation(cameras, lag, memory.step_s);
    if (common <= 0.0) break;
    sum += common;
  }
  // A memory that fades evenly has kept / (1 - kept).
  memory.kept = sum / (1.0 + sum);
  memory.shared = shared_by(cameras[0], cameras[1], memory.step_s);
  memory.spread = (quantile_of_sorted(sorted, 0.75) - quantile_of_sorted(sorted, 0.25)) / kMiddleHalf;
  return memory;
}

double ResidualCurve::structure() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) sum += std::pow(y[i] / std::max(1e-12, sd[i]), 2);
  return y.empty() ? 0.0 : sum / static_cast<double>(y.size());
}

double ResidualCurve::size() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < y.size(); ++i) sum += y[i] * y[i] - sd[i] * sd[i];
  return y.empty() ? 0.0 : std::sqrt(std::max(0.0, sum / static_cast<double>(y.size())));
}

ResidualCurve residual_curve(std::vector<ResidualPoint> points, const ErrorMemory& memory, bool centred,
                             std::size_t most_bins) {
  leave_out_unknown(points);
  ResidualCurve curve;
  if (points.size() < 2 * kFewestPerBin) return curve;
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  const double centre = centred ? quantile_of_sorted(sorted_y(points.begin(), points.end()), 0.5) : 0.0;
  const std::size_t bins = std::clamp<std::size_t>(points.size() / 12, 2, std::max<std::size_t>(2, most_bins));
  for (std::size_t b = 0; b < bins; ++b) {
    const auto from = points.begin() + static_cast<std::ptrdiff_t>(b * points.size() / bins);
    const auto to = points.begin() + static_cast<std::ptrdiff_t>((b + 1) * points.size() / bins);
    if (static_cast<std::size_t>(to - from) < kFewestPerBin) continue;
    double x = 0.0;
    for (auto p = from; p != to; ++p) x += p->x / static_cast<double>(to - from);
    const auto values = sorted_y(from, to);
    const double median = quantile_of_sorted(values, 0.5) - centre;
    // Standard error of a median from the middle half of the values; values that err alike lie closer as well.
    const double own = (quantile_of_sorted(values, 0.75) - quantile_of_sorted(values, 0.25)) / kMiddleHalf;
    const double worth = independent({from, to}, memory);
    const bool pooled = worth < kFewestIndependent && memory.spread > 0.0;
    const double dof = std::max(kLeastDof, worth - 1.0);
    const double sd = kMedian * (pooled ? memory.spread / std::sqrt(worth) : own / std::sqrt(dof));
    const double half = student_quantile(0.05, std::max(1.0, pooled ? static_cast<double>(points.size()) : dof)) * sd;
    curve.x.push_back(x);
    curve.y.push_back(median);
    curve.low.push_back(median - half);
    curve.high.push_back(median + half);
    curve.sd.push_back(sd);
  }
  return curve;
}

}  // namespace bodyschema::diagnosis
