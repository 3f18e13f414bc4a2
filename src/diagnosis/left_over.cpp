#include "left_over.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <vector>

#include "bodyschema/evidence/distributions.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kSides = 4;
constexpr const char* kNames[kSides] = {"right", "left", "lower", "upper"};
/// Physical, px of a 320x240 picture: masks err alike over a few pixels, a limb's flank is longer than this.
constexpr double kNear_px = 9.0, kFar_px = 15.0;
constexpr double kSameFlank = 0.9;  ///< cosine between normals
constexpr Eigen::Index kFewestBlocks = 3;

std::size_t side_of(const Eigen::Vector2d& normal) {
  const bool flat = std::abs(normal.x()) > std::abs(normal.y());
  return flat ? (normal.x() > 0 ? 0u : 1u) : (normal.y() > 0 ? 2u : 3u);
}

class Gatherer {
 public:
  Gatherer(LogFit& fit, const LogAbout& log)
      : log_(log), pictures_(fit.log()), cameras_(fit.log().rig().cameras.size()),
        segment_of_(fit.measurement().part_count(), 0) {
    const auto& segments = pictures_.roles().segments;
    for (std::size_t s = 0; s < segments.size(); ++s) {
      for (const auto part : segments[s].parts) segment_of_[part] = s;
    }
    const auto groups = static_cast<Eigen::Index>(segments.size() * cameras_ * kSides);
    residual_ = weight_ = Eigen::MatrixXd::Zero(groups, static_cast<Eigen::Index>(log.blocks));
  }

  void add(std::size_t picture, std::span<const OutlinePoint> points) {
    const auto camera = pictures_.pictures()[picture].camera;
    const double unit = unit_of(camera);
    const std::scoped_lock lock(mutex_);
    const auto block = static_cast<Eigen::Index>(log_.block_of[picture]);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto& a = points[i];
      const auto group =
          static_cast<Eigen::Index>((segment_of_[a.part] * cameras_ + camera) * kSides + side_of(a.normal));
      residual_(group, block) += a.weight * a.residual_px;
      weight_(group, block) += a.weight;
      square_ += a.weight * a.residual_px * a.residual_px;
      for (std::size_t j = i + 1; j < points.size(); ++j) {
        const auto& b = points[j];
        if (b.part != a.part || a.normal.dot(b.normal) < kSameFlank) continue;
        const double distance = (a.pixel - b.pixel).norm() / unit;
        if (distance < kNear_px || distance > kFar_px) continue;
        const double w = a.weight * b.weight;
        scatter_ += 0.5 * w * std::pow(a.residual_px - b.residual_px, 2);
        pairs_ += w;
      }
    }
  }

  [[nodiscard]] LeftOver answer(const LeftOverSettings& settings) const {
    LeftOver result;
    const double points = weight_.sum();
    if (points > 0.0) result.rms_px = std::sqrt(square_ / points);
    if (pairs_ > 0.0) result.pixel_noise_px = std::sqrt(scatter_ / pairs_);
    // As many comparisons as groups: Bonferroni.
    const double tail = settings.level / static_cast<double>(std::max<Eigen::Index>(1, weight_.rows()));
    double worst = 0.0;
    for (Eigen::Index group = 0; group < weight_.rows(); ++group) {
      const double weight = weight_.row(group).sum();
      const auto seen = (weight_.row(group).array() > 0.0).count();
      if (seen < kFewestBlocks) continue;
      const double mean = residual_.row(group).sum() / weight, n = static_cast<double>(seen);
      const Eigen::RowVectorXd off = residual_.row(group) - mean * weight_.row(group);
      const double sd = std::sqrt(off.squaredNorm() * n / (n - 1.0)) / weight;
      const auto camera = (static_cast<std::size_t>(group) / kSides) % cameras_;
      if (std::abs(mean) <= worst || std::abs(mean) < least_px(camera, settings) + student_quantile(tail, n - 1.0) * sd)
        continue;
      worst = std::abs(mean);
      result.side = sentence(static_cast<std::size_t>(group), mean);
    }
    return result;
  }

 private:
  [[nodiscard]] double unit_of(std::size_t camera) const {
    return picture_unit(pictures_.rig().cameras[camera].intrinsics);
  }

  /// Beyond what matters, and beyond what a picture places a flank to.
  [[nodiscard]] double least_px(std::size_t camera, const LeftOverSettings& settings) const {
    const double matters = settings.depth_m > 0.0
                               ? settings.matters_m * pictures_.rig().cameras[camera].intrinsics.fx / settings.depth_m
                               : 0.0;
    return std::max(matters, limits::kFlankFloors * limits::kFloor_px * unit_of(camera));
  }

  [[nodiscard]] std::string sentence(std::size_t group, double mean) const {
    return fmt::format("the {} outline of {} lies {:.1f} px {} where the model has it in the pictures of {}",
                       kNames[group % kSides], pictures_.roles().segments[group / kSides / cameras_].name,
                       std::abs(mean), mean > 0.0 ? "outside of" : "inside of",
                       pictures_.rig().cameras[(group / kSides) % cameras_].name);
  }

  const LogAbout& log_;
  const PictureLog& pictures_;
  std::size_t cameras_;
  std::vector<std::size_t> segment_of_;  ///< per part
  Eigen::MatrixXd residual_, weight_;    ///< sums: group (segment, camera, side) x block
  double square_ = 0.0, scatter_ = 0.0, pairs_ = 0.0;
  std::mutex mutex_;
};

}  // namespace

LeftOver left_over(LogFit& fit, const LogAbout& log, const OutlineSearch& search, const LeftOverSettings& settings) {
  Gatherer gatherer(fit, log);
  fit.linearise(log.state.model(), {}, search, {},
                [&](std::size_t picture, std::span<const OutlinePoint> points) { gatherer.add(picture, points); });
  return gatherer.answer(settings);
}

}  // namespace bodyschema::diagnosis
