#include "left_over.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <vector>

#include "bodyschema/evidence/distributions.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kSides = 4;
constexpr const char* kNames[kSides] = {"right", "left", "lower", "upper"};
/// Physical: a patch of a robot's surface, about a finger's width.
constexpr double kPatch_m = 0.015;
constexpr int kFewestBlocks = 3;  ///< of fewer no variance is known

std::size_t side_of(const Eigen::Vector2d& normal) {
  const bool flat = std::abs(normal.x()) > std::abs(normal.y());
  return flat ? (normal.x() > 0 ? 0u : 1u) : (normal.y() > 0 ? 2u : 3u);
}

/// Weighted residuals of something, block by block; blocks come in order.
class BlockMean {
 public:
  void add(std::size_t block, double weight, double residual_px) {
    if (blocks_ == 0 || block != block_) close(block);
    own_weight_ += weight;
    own_ += weight * residual_px;
  }
  struct Result {
    double mean = 0.0, variance = 0.0;  ///< of the mean
    double weight = 0.0;
    int blocks = 0;
  };
  [[nodiscard]] Result result() const {
    BlockMean whole = *this;
    whole.close(block_);
    Result r{.weight = whole.weight_, .blocks = whole.blocks_ - 1};
    if (whole.weight_ <= 0.0) return r;
    r.mean = whole.sum_ / whole.weight_;
    if (r.blocks < 2) return r;
    // Sum over blocks of (sum - mean weight)^2.
    const double scatter = whole.square_ - 2.0 * r.mean * whole.product_ + r.mean * r.mean * whole.weight_square_;
    const double n = r.blocks;
    r.variance = std::max(0.0, scatter) * n / (n - 1.0) / (whole.weight_ * whole.weight_);
    return r;
  }

 private:
  void close(std::size_t next) {
    sum_ += own_;
    weight_ += own_weight_;
    square_ += own_ * own_;
    product_ += own_ * own_weight_;
    weight_square_ += own_weight_ * own_weight_;
    own_ = own_weight_ = 0.0;
    block_ = next;
    ++blocks_;
  }
  std::size_t block_ = 0;
  int blocks_ = 0;
  double own_ = 0.0, own_weight_ = 0.0;
  double sum_ = 0.0, weight_ = 0.0, square_ = 0.0, product_ = 0.0, weight_square_ = 0.0;
};

class Gatherer {
 public:
  Gatherer(LogFit& fit, const LogAbout& log)
      : fit_(fit), log_(log), pictures_(fit.log()), cameras_(fit.log().rig().cameras.size()),
        sides_(pictures_.roles().segments.size() * cameras_ * kSides) {}

  void add(std::size_t picture, const std::vector<OutlinePoint>& points) {
    const auto camera = pictures_.pictures()[picture].camera;
    auto& projection = fit_.measurement().projection();
    projection.place(pictures_.pictures()[picture].joints.q, log_.at.corrections[picture], camera);
    for (const auto& point : points) {
      const auto side = (projection.segment_of(point.part) * cameras_ + camera) * kSides + side_of(point.normal);
      sides_[side].add(log_.block_of[picture], point.weight, point.residual_px);
      patches_[patch_of(point, projection.links()[point.part])].add(log_.block_of[picture], point.weight,
                                                                    point.residual_px);
      square_ += point.weight * point.residual_px * point.residual_px;
      weight_ += point.weight;
    }
  }

  [[nodiscard]] LeftOver answer(const LeftOverSettings& settings) const {
    LeftOver result;
    if (weight_ <= 0.0) return result;
    double alike = 0.0;
    for (const auto& [patch, mean] : patches_) {
      const auto r = mean.result();
      if (r.blocks >= kFewestBlocks) alike += r.weight * (r.mean * r.mean - r.variance);
    }
    result.rms_px = std::sqrt(square_ / weight_);
    result.noise_px = std::sqrt(std::max(0.0, square_ - std::max(0.0, alike)) / weight_);
    // As many comparisons as sides: Bonferroni.
    const double tail = settings.level / static_cast<double>(sides_.size());
    double worst = 0.0;
    for (std::size_t side = 0; side < sides_.size(); ++side) {
      const auto r = sides_[side].result();
      if (r.blocks < kFewestBlocks || std::abs(r.mean) <= worst) continue;
      const double chance = student_quantile(tail, r.blocks - 1.0) * std::sqrt(r.variance);
      if (std::abs(r.mean) < least_px((side / kSides) % cameras_, settings) + chance) continue;
      worst = std::abs(r.mean);
      result.side = sentence(side, r.mean);
    }
    return result;
  }

 private:
  using Patch = std::tuple<std::size_t, long, long, long, int>;

  /// Where on the part's own surface a point lies, and which way that looks.
  static Patch patch_of(const OutlinePoint& point, const Pose& X_CB) {
    const Eigen::Vector3d at = X_CB.inverse(Eigen::Isometry) * point.p_C / kPatch_m;
    const Eigen::Vector3d outwards =
        X_CB.linear().transpose() * Eigen::Vector3d(point.normal.x(), point.normal.y(), 0.0);
    Eigen::Index axis = 0;
    outwards.cwiseAbs().maxCoeff(&axis);
    const int way = static_cast<int>(2 * axis) + (outwards[axis] > 0.0);
    return {point.part, std::lround(at.x()), std::lround(at.y()), std::lround(at.z()), way};
  }

  /// Beyond what matters, and beyond what a picture places a flank to.
  [[nodiscard]] double least_px(std::size_t camera, const LeftOverSettings& settings) const {
    const auto& k = pictures_.rig().cameras[camera].intrinsics;
    const double matters = settings.depth_m > 0.0 ? settings.matters_m * k.fx / settings.depth_m : 0.0;
    return std::max(matters, limits::kFlankFloors * limits::kFloor_px * picture_unit(k));
  }

  [[nodiscard]] std::string sentence(std::size_t side, double mean) const {
    return fmt::format("the {} outline of {} lies {:.1f} px {} where the model has it in the pictures of {}",
                       kNames[side % kSides], pictures_.roles().segments[side / kSides / cameras_].name, std::abs(mean),
                       mean > 0.0 ? "outside of" : "inside of",
                       pictures_.rig().cameras[(side / kSides) % cameras_].name);
  }

  LogFit& fit_;
  const LogAbout& log_;
  const PictureLog& pictures_;
  std::size_t cameras_;
  std::vector<BlockMean> sides_;  ///< segment x camera x side
  std::map<Patch, BlockMean> patches_;
  double square_ = 0.0, weight_ = 0.0;
};

}  // namespace

LeftOver left_over(LogFit& fit, const LogAbout& log, const OutlineSearch& search, const LeftOverSettings& settings) {
  std::vector<std::vector<OutlinePoint>> points(log.at.evidence.size());
  fit.linearise(log.state.model(), {}, search, {}, [&](std::size_t picture, std::span<const OutlinePoint> seen) {
    points[picture].assign(seen.begin(), seen.end());
  });
  Gatherer gatherer(fit, log);
  for (std::size_t picture = 0; picture < points.size(); ++picture) gatherer.add(picture, points[picture]);
  return gatherer.answer(settings);
}

}  // namespace bodyschema::diagnosis
