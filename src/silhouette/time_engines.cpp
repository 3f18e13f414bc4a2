#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {
namespace {

/// Every silhouette's parts before the camera, each turned another way: the n-th of a spiral of directions.
std::vector<Eigen::Isometry3f> poses_before(std::span<const PinholeIntrinsics> cameras, const SilhouetteModel& model,
                                            std::size_t silhouettes) {
  std::vector<Eigen::Vector3f> centres;
  float radius = 1e-3f;
  for (const auto& part : model.parts) {
    Eigen::AlignedBox3f box;
    for (const auto& v : part.vertices) box.extend(v);
    centres.emplace_back(Eigen::Vector3f::Zero());
    if (box.isEmpty()) continue;
    centres.back() = box.center();
    radius = std::max(radius, 0.5f * box.diagonal().norm());
  }
  const float depth = 6.0f * radius * static_cast<float>(cameras[0].fy) / static_cast<float>(cameras[0].height);
  std::vector<Eigen::Isometry3f> X_CB;
  for (std::size_t i = 0; i < silhouettes * centres.size(); ++i) {
    const float turn = 2.39996323f * static_cast<float>(i % 1024);
    auto& X = X_CB.emplace_back(Eigen::AngleAxisf(turn, Eigen::Vector3f(0.48f, 0.64f, 0.6f)));
    const Eigen::Vector3f place(0.3f * std::sin(3.0f * turn) * radius, 0.3f * std::cos(5.0f * turn) * radius, depth);
    X.translation() = place - X.linear() * centres[i % centres.size()];
  }
  return X_CB;
}

// Engines round outlines differently, by far less than this.
constexpr double kOtherwiseShare = 0.01, kOtherwise_px = 8.0;

}  // namespace

std::string disagreement(std::span<const SilhouetteCounts> counts, std::span<const SilhouetteCounts> expected) {
  const auto apart = [](std::uint32_t a, std::uint32_t b) {
    return std::abs(static_cast<double>(a) - b) > std::max(kOtherwise_px, kOtherwiseShare * std::max(a, b));
  };
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const auto &a = counts[i], &b = expected[i];
    wrong += apart(a.predicted, b.predicted) || apart(a.intersection, b.intersection) ? 1 : 0;
  }
  if (wrong == 0) return "";
  return "counts " + std::to_string(wrong) + " of " + std::to_string(expected.size()) + " silhouettes wrongly";
}

std::vector<EngineTiming> time_engines(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                                       const SilhouetteOptions& options, std::size_t silhouettes, double seconds) {
  using Clock = std::chrono::steady_clock;
  silhouettes = std::max<std::size_t>(1, silhouettes / cameras.size()) * cameras.size();
  const auto X_CB = poses_before(cameras, model, silhouettes);
  std::vector<SilhouetteCounts> counts(silhouettes), expected;
  std::vector<EngineTiming> timings{
      {"contour", "", 0.0, "", ""}, {"atlas", "raster", 0.0, "", ""}, {"atlas", "compute", 0.0, "", ""}};
  for (auto& timing : timings) {
    SilhouetteOptions own = options;
    own.engine = timing.engine;
    own.gl_pass = timing.gl_pass.empty() ? "auto" : timing.gl_pass;
    try {
      const auto begin = Clock::now();
      const auto since = [](Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); };
      const auto scorer = make_silhouette_scorer(model, cameras, own);
      std::vector<ObservedSilhouette> observed;
      for (std::size_t c = 0; c < cameras.size(); ++c) {
        observed.push_back(
            {scorer->render(std::span(X_CB).subspan(c * model.parts.size(), model.parts.size()), c), {}});
      }
      timing.ms = std::numeric_limits<double>::infinity();
      for (int round = 0; round < 2 || since(begin) < seconds / static_cast<double>(timings.size()); ++round) {
        const auto start = Clock::now();
        scorer->set_observation(observed);
        scorer->score(X_CB, counts);
        timing.ms = std::min(timing.ms, 1e3 * since(start));
        if (since(begin) > seconds / static_cast<double>(timings.size())) break;
      }
      timing.description = scorer->description();
      if (expected.empty()) expected = counts;  // contour, the first, needs no driver
      timing.error = disagreement(counts, expected);
    } catch (const std::runtime_error& error) {  // no GL, or too little of it
      if (timing.engine == "contour") throw;
      timing.error = error.what();
    }
  }
  return timings;
}

}  // namespace bodyschema
