#include "bodyschema/diagnosis/image_measurement.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <thread>

namespace bodyschema {
namespace {

constexpr float kSpacing_px = 3.0f;
constexpr double kStep_px = 0.5;
constexpr double kHalf = 127.5;
constexpr double kHuber_px = 1.0;
/// A counterpart this far away says no more than none.
constexpr double kFar_px = 10.0;
constexpr std::size_t kFewestPoints = 20;
/// A picture in which less of the outline is found than this shows something else.
constexpr double kLeastShare = 0.3;

/// Coverage at a place between pixels; nothing outside the picture or where a pixel does not count.
class Coverage {
 public:
  Coverage(std::span<const std::uint8_t> coverage, const BinaryMask& valid, int width, int height)
      : coverage_(coverage), valid_(valid), width_(width), height_(height) {}

  /// Negative where nothing is known.
  [[nodiscard]] double at(double u, double v) const {
    const double fu = std::floor(u), fv = std::floor(v);
    const int u0 = static_cast<int>(fu), v0 = static_cast<int>(fv);
    if (u0 < 0 || v0 < 0 || u0 + 1 >= width_ || v0 + 1 >= height_) return -1.0;
    if (!valid_.empty() &&
        !(valid_.at(u0, v0) && valid_.at(u0 + 1, v0) && valid_.at(u0, v0 + 1) && valid_.at(u0 + 1, v0 + 1))) {
      return -1.0;
    }
    const double a = u - fu, b = v - fv;
    const auto* row = coverage_.data() + static_cast<std::size_t>(v0) * static_cast<std::size_t>(width_) +
                      static_cast<std::size_t>(u0);
    const auto* below = row + width_;
    return (1 - b) * ((1 - a) * row[0] + a * row[1]) + b * ((1 - a) * below[0] + a * below[1]);
  }

  /// Distance along the normal to the nearest place where the robot ends. Looks outwards, so that a
  /// good prediction costs few pixels.
  [[nodiscard]] std::optional<double> edge(const Eigen::Vector2d& pixel, const Eigen::Vector2d& normal,
                                           double search_px) const {
    const int steps = static_cast<int>(std::ceil(search_px / kStep_px));
    const auto value_at = [&](int step) {
      return at(pixel.x() + step * kStep_px * normal.x(), pixel.y() + step * kStep_px * normal.y());
    };
    // Between a step and the next one outwards along the normal.
    const auto crossing = [](int step, double inner, double outer) -> std::optional<double> {
      if (inner < kHalf || outer < 0.0 || outer >= kHalf) return std::nullopt;
      return kStep_px * (step + (inner - kHalf) / (inner - outer));
    };
    double last_out = value_at(0), last_in = last_out;
    for (int i = 1; i <= steps; ++i) {
      const double out = value_at(i), in = value_at(-i);
      const auto outside = crossing(i - 1, last_out, out), inside = crossing(-i, in, last_in);
      if (outside && inside) return *outside < -*inside ? outside : inside;
      if (outside || inside) return outside ? outside : inside;
      last_out = out;
      last_in = in;
    }
    return std::nullopt;
  }

 private:
  std::span<const std::uint8_t> coverage_;
  const BinaryMask& valid_;
  int width_, height_;
};

std::vector<std::string> links_of(const RobotSetup& setup) {
  auto links = setup.model.rendered_links;
  links.push_back(setup.hand_link);
  return links;
}

std::vector<std::string> cameras_of(const StereoRig& rig) {
  std::vector<std::string> links;
  for (const auto& camera : rig.cameras) links.push_back(camera.link);
  return links;
}

SilhouetteModel silhouettes_of(const RobotModel& model, FaceCulling culling) {
  SilhouetteModel silhouettes;
  for (const auto& mesh : model.meshes()) silhouettes.parts.push_back(mesh.mesh);
  silhouettes.culling = culling;
  return silhouettes;
}

}  // namespace

/// What one thread needs.
struct ImageMeasurement::Worker {
  Worker(const std::shared_ptr<const RobotModel>& model, const JointRoles& roles, const RobotSetup& setup,
         const StereoRig& rig)
      : compressor(model, roles, links_of(setup), cameras_of(rig)),
        extractor(silhouettes_of(*model, setup.culling), rig.intrinsics()), X_CB(setup.model.rendered_links.size()) {}

  void compress(const ViewInput& view, const Seen& seen, const Corrections& c, const CameraModel& camera,
                double search_px, CompressedView& out) {
    const auto poses = compressor.set_view(view.joints.q, c, view.camera);
    const auto& k = camera.intrinsics;
    PinholeIntrinsics corrected = k;
    corrected.fx *= 1.0 + c.camera.focal_scale;
    corrected.fy *= 1.0 + c.camera.focal_scale;
    corrected.cx += c.camera.cx_px;
    corrected.cy += c.camera.cy_px;
    // The extractor keeps its intrinsics: a longer focal length or another principal point is a
    // linear change of the scene before it, undone on the points it returns.
    Eigen::Matrix3d warp = Eigen::Matrix3d::Identity();
    warp(0, 0) = warp(1, 1) = 1.0 + c.camera.focal_scale;
    warp(0, 2) = c.camera.cx_px / k.fx;
    warp(1, 2) = c.camera.cy_px / k.fy;
    const Eigen::Matrix3d unwarp = warp.inverse();
    for (std::size_t part = 0; part < X_CB.size(); ++part) {
      X_CB[part].linear() = (warp * poses[part].linear() * (1.0 + c.mesh_scale)).cast<float>();
      X_CB[part].translation() = (warp * poses[part].translation()).cast<float>();
    }
    const auto outline = extractor.extract(X_CB, view.camera, kSpacing_px);
    const Coverage coverage(seen.coverage, seen.valid, k.width, k.height);
    points.clear();
    double misfit = 0.0;
    for (const auto& point : outline) {
      const Eigen::Vector3d p_C = unwarp * point.p_C.cast<double>();
      const Eigen::Vector2d normal = point.normal.cast<double>();
      const Eigen::Vector2d x = p_C.head<2>() / p_C.z();
      const Eigen::Vector2d bent(corrected.fx * x.x(), corrected.fy * x.y());
      const Eigen::Vector2d pixel =
          point.pixel.cast<double>() + c.camera.k1 * x.squaredNorm() * bent + c.dilation_px * normal;
      const auto distance = coverage.edge(pixel, normal, std::max(search_px, kFar_px));
      const double far = distance ? std::min(kFar_px, std::abs(*distance)) : kFar_px;
      misfit += far <= kHuber_px ? far * far : kHuber_px * (2.0 * far - kHuber_px);
      if (!distance || std::abs(*distance) > search_px) continue;
      points.push_back({point.part, p_C, normal, *distance, far <= kHuber_px ? 1.0 : kHuber_px / far});
    }
    if (points.size() < kFewestPoints ||
        static_cast<double>(points.size()) < kLeastShare * static_cast<double>(outline.size())) {
      leave_out(out);
    } else {
      compressor.compress(points, corrected, out);
      out.matched = static_cast<double>(points.size());
    }
    out.misfit = misfit;
    out.outline = static_cast<double>(outline.size());
  }

  void leave_out(CompressedView& out) const {
    const auto n = compressor.layout().size();
    out.information.setZero(n, n);
    out.vector.setZero(n);
    out.square = out.weight = out.misfit = out.outline = out.matched = 0.0;
  }

  ViewCompressor compressor;
  ContourExtractor extractor;
  std::vector<Eigen::Isometry3f> X_CB;
  std::vector<OutlinePoint> points;
};

ImageMeasurement::ImageMeasurement(std::shared_ptr<const RobotModel> model, const RobotSetup& setup,
                                   const StereoRig& rig, int threads)
    : setup_(setup), rig_(rig), roles_(JointRoles::of(model, setup, rig)),
      instants_(model, setup.hand_link, setup.gravity_W) {
  for (int t = 0; t < std::max(1, threads); ++t) {
    workers_.push_back(std::make_unique<Worker>(model, roles_, setup, rig));
  }
}

ImageMeasurement::~ImageMeasurement() = default;

ImageMeasurement::Seen ImageMeasurement::seen_of(const CameraObservation& camera, const PinholeIntrinsics& k) {
  const auto pixels = static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
  Seen seen{camera.coverage, camera.valid};
  if (seen.coverage.size() == pixels) return seen;
  seen.coverage.resize(pixels);
  for (int v = 0; v < k.height; ++v) {
    for (int u = 0; u < k.width; ++u) {
      seen.coverage[static_cast<std::size_t>(v) * static_cast<std::size_t>(k.width) + static_cast<std::size_t>(u)] =
          camera.mask.at(u, v) ? 255 : 0;
    }
  }
  return seen;
}

bool ImageMeasurement::repeats_the_last(const std::vector<std::pair<ViewInput, Seen>>& pictures) const {
  return std::all_of(pictures.begin(), pictures.end(), [&](const auto& picture) {
    const auto& [view, seen] = picture;
    for (auto v = views_.size(); v-- > 0;) {
      if (views_[v].camera == view.camera) return views_[v].joints.q == view.joints.q && seen_[v] == seen;
    }
    return false;
  });
}

void ImageMeasurement::add(const Observation& observation) {
  std::vector<std::pair<ViewInput, Seen>> pictures;
  for (std::size_t c = 0; c < observation.cameras.size() && c < rig_.cameras.size(); ++c) {
    const auto& camera = observation.cameras[c];
    if (!camera || camera->mask.empty()) continue;
    ViewInput view{camera->joints, c, {}};
    view.joints.utime = camera->utime;
    pictures.emplace_back(std::move(view), seen_of(*camera, rig_.cameras[c].intrinsics));
  }
  if (repeats_the_last(pictures)) return;
  for (auto& [view, seen] : pictures) {
    // Left and right of one observation may carry stamps in either order.
    auto at = views_.size();
    while (at > 0 && views_[at - 1].joints.utime > view.joints.utime) --at;
    views_.insert(views_.begin() + static_cast<std::ptrdiff_t>(at), std::move(view));
    seen_.insert(seen_.begin() + static_cast<std::ptrdiff_t>(at), std::move(seen));
  }
}

void ImageMeasurement::set_stream(std::vector<JointSample> stream) {
  stream_ = std::move(stream);
  set_motion(views_, stream_);
}

void ImageMeasurement::instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) {
  instants_.build(views_[view].joints, views_[view].camera, offsets, out);
  out.qddot = views_[view].qddot;
}

void ImageMeasurement::compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) {
  out.resize(views_.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&](Worker& worker) {
    for (std::size_t v; (v = next++) < views_.size();) {
      if (v / rig_.cameras.size() % every_ != 0) {
        worker.leave_out(out[v]);
        continue;
      }
      worker.compress(views_[v], seen_[v], corrections[v], rig_.cameras[views_[v].camera], search_px_, out[v]);
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t t = 1; t < workers_.size(); ++t) {
    threads.emplace_back([&, t] { work(*workers_[t]); });
  }
  work(*workers_.front());
  for (auto& thread : threads) thread.join();
}

Eigen::MatrixXd ImageMeasurement::hand_jacobian(std::size_t view, const Corrections& corrections) {
  auto& compressor = workers_.front()->compressor;
  compressor.set_view(views_[view].joints.q, corrections, views_[view].camera);
  return compressor.link_jacobian(setup_.model.rendered_links.size());
}

}  // namespace bodyschema
