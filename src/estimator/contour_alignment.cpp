#include "bodyschema/estimator/contour_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace bodyschema {
namespace {

constexpr double kSampleStep_px = 0.5;
constexpr double kHalf = 127.5;

/// Coverage 0..255 at a sub-pixel position, bilinear; nothing outside the picture or where a pixel
/// does not count.
class CoverageSampler {
 public:
  CoverageSampler(const CameraObservation& seen, int width, int height)
      : seen_(seen), width_(width), height_(height),
        from_mask_(seen.coverage.size() != static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

  [[nodiscard]] std::optional<double> at(double u, double v) const {
    const double fu = std::floor(u);
    const double fv = std::floor(v);
    const int u0 = static_cast<int>(fu);
    const int v0 = static_cast<int>(fv);
    if (u0 < 0 || v0 < 0 || u0 + 1 >= width_ || v0 + 1 >= height_) return std::nullopt;
    if (!seen_.valid.empty() && !(seen_.valid.at(u0, v0) && seen_.valid.at(u0 + 1, v0) && seen_.valid.at(u0, v0 + 1) &&
                                  seen_.valid.at(u0 + 1, v0 + 1))) {
      return std::nullopt;
    }
    const double a = u - fu;
    const double b = v - fv;
    return (1 - b) * ((1 - a) * pixel(u0, v0) + a * pixel(u0 + 1, v0)) +
           b * ((1 - a) * pixel(u0, v0 + 1) + a * pixel(u0 + 1, v0 + 1));
  }

 private:
  [[nodiscard]] double pixel(int u, int v) const {
    if (from_mask_) return seen_.mask.at(u, v) ? 255.0 : 0.0;
    return seen_.coverage[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)];
  }
  const CameraObservation& seen_;
  int width_;
  int height_;
  bool from_mask_;
};

/// Signed distance in px along `normal` from `pixel` to the nearest place where coverage falls
/// through one half going outwards.
std::optional<double> nearest_edge(const CoverageSampler& coverage, const Eigen::Vector2d& pixel,
                                   const Eigen::Vector2d& normal, double search_px) {
  const int steps = static_cast<int>(std::ceil(search_px / kSampleStep_px));
  std::optional<double> best;
  std::optional<double> previous;
  for (int i = -steps; i <= steps; ++i) {
    const double t = i * kSampleStep_px;
    const auto value = coverage.at(pixel.x() + t * normal.x(), pixel.y() + t * normal.y());
    if (value && previous && *previous >= kHalf && *value < kHalf) {
      const double crossing = t - kSampleStep_px * (kHalf - *value) / (*previous - *value);
      if (!best || std::abs(crossing) < std::abs(*best)) best = crossing;
      if (t > 0) break;  // later crossings are further away
    }
    previous = value;
  }
  if (best && std::abs(*best) > search_px) return std::nullopt;
  return best;
}

double step_for(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::kPrincipalDifferenceX:
    case ParameterKind::kPrincipalDifferenceY: return 0.5;
    default: return 2e-3;
  }
}

}  // namespace

double ContourEvidence::rms_px() const {
  return matched > 0 ? std::sqrt(cost / static_cast<double>(matched)) : 0.0;
}

double ContourEvidence::matched_share() const {
  return sampled > 0 ? static_cast<double>(matched) / static_cast<double>(sampled) : 0.0;
}

ContourAlignment::ContourAlignment(BodyPoseModel& body, const SilhouetteModel& silhouettes,
                                   std::span<const PinholeIntrinsics> cameras, const ContourAlignmentOptions& options)
    : body_(body), extractor_(silhouettes, cameras), cameras_(cameras.begin(), cameras.end()), options_(options),
      X_CB_(body.part_count()), X_plus_(body.part_count()), X_minus_(body.part_count()),
      dX_dB_(body.part_count() * body.parameters().size()),
      jacobian_row_(static_cast<Eigen::Index>(body.parameters().size())) {}

void ContourAlignment::linearise(const Observation& observation, const Eigen::VectorXd& x, double search_px,
                                 ContourEvidence& evidence) {
  const auto n = static_cast<Eigen::Index>(body_.parameters().size());
  evidence.A.setZero(n, n);
  evidence.b.setZero(n);
  evidence.cost = 0.0;
  evidence.matched = evidence.sampled = 0;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (c < observation.cameras.size() && observation.cameras[c] && !observation.cameras[c]->mask.empty()) {
      add_camera(*observation.cameras[c], x, c, search_px, evidence);
    }
  }
  evidence.A = evidence.A.selfadjointView<Eigen::Lower>();
}

void ContourAlignment::add_camera(const CameraObservation& seen, const Eigen::VectorXd& x, std::size_t camera,
                                  double search_px, ContourEvidence& evidence) {
  const auto parameters = body_.parameters();
  const std::size_t parts = body_.part_count();
  body_.compute(seen, x, camera, X_CB_);
  const auto outline = extractor_.extract(X_CB_, camera, options_.spacing_px);

  // How each parameter moves each part: the derivative of X_CB acting on camera coordinates.
  const double known_px = seen.corrections ? seen.corrections->dilation_px : 0.0;
  double dilation_px = known_px;
  x_work_ = x;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto index = static_cast<Eigen::Index>(k);
    if (parameters[k].kind == ParameterKind::kDilation) {
      dilation_px = known_px + x(index);
      continue;
    }
    const double step = step_for(parameters[k].kind);
    x_work_(index) = x(index) + step;
    body_.compute(seen, x_work_, camera, X_plus_);
    x_work_(index) = x(index) - step;
    body_.compute(seen, x_work_, camera, X_minus_);
    x_work_(index) = x(index);
    for (std::size_t part = 0; part < parts; ++part) {
      const Eigen::Matrix3d inverse = X_CB_[part].linear().cast<double>().inverse();
      const Eigen::Matrix3d dR = (X_plus_[part].linear() - X_minus_[part].linear()).cast<double>() / (2.0 * step);
      const Eigen::Vector3d dt =
          (X_plus_[part].translation() - X_minus_[part].translation()).cast<double>() / (2.0 * step);
      auto& derivative = dX_dB_[k * parts + part];
      derivative.leftCols<3>() = dR * inverse;
      derivative.col(3) = dt - dR * inverse * X_CB_[part].translation().cast<double>();
    }
  }

  const PinholeIntrinsics& intrinsics = cameras_[camera];
  const CoverageSampler coverage(seen, intrinsics.width, intrinsics.height);
  for (const ContourPoint& point : outline) {
    ++evidence.sampled;
    const Eigen::Vector2d normal = point.normal.cast<double>();
    const Eigen::Vector2d pixel = point.pixel.cast<double>() + dilation_px * normal;
    const auto distance = nearest_edge(coverage, pixel, normal, search_px);
    if (!distance) continue;
    ++evidence.matched;
    const Eigen::Vector3d p_C = point.p_C.cast<double>();
    const double z_inverse = 1.0 / p_C.z();
    // d(normal . pixel) / d p_C
    const Eigen::RowVector3d gradient(
        normal.x() * intrinsics.fx * z_inverse, normal.y() * intrinsics.fy * z_inverse,
        -(normal.x() * intrinsics.fx * p_C.x() + normal.y() * intrinsics.fy * p_C.y()) * z_inverse * z_inverse);
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      const auto index = static_cast<Eigen::Index>(k);
      if (parameters[k].kind == ParameterKind::kDilation) {
        jacobian_row_(index) = 1.0;
        continue;
      }
      const auto& derivative = dX_dB_[k * parts + point.part];
      jacobian_row_(index) = gradient.dot(derivative.leftCols<3>() * p_C + derivative.col(3));
    }
    const double magnitude = std::abs(*distance);
    const double weight = magnitude <= options_.huber_px ? 1.0 : options_.huber_px / magnitude;
    evidence.A.selfadjointView<Eigen::Lower>().rankUpdate(jacobian_row_, weight);
    evidence.b += weight * *distance * jacobian_row_;
    evidence.cost += weight * *distance * *distance;
  }
}

}  // namespace bodyschema
