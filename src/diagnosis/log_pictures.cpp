#include "log_pictures.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>

#include "bodyschema/effects/online_error_model.hpp"
#include "bodyschema/estimator/body_pose_model.hpp"
#include "bodyschema/pipeline/overlay.hpp"

namespace bodyschema::diagnosis {
namespace {

constexpr std::size_t kShown = 3;
constexpr int kHalfPart_px = 75;
constexpr int kEnlargement = 3;

/// A silhouette of a pinhole camera as a lens with radial distortion k1 shows it.
BinaryMask bent(const BinaryMask& straight, const PinholeIntrinsics& k, double k1) {
  BinaryMask result(straight.width(), straight.height());
  for (int v = 0; v < straight.height(); ++v) {
    for (int u = 0; u < straight.width(); ++u) {
      const Eigen::Vector2d seen((u - k.cx) / k.fx, (v - k.cy) / k.fy);
      Eigen::Vector2d x = seen;
      for (int i = 0; i < 5; ++i) x = seen / (1.0 + k1 * x.squaredNorm());
      const auto su = static_cast<int>(std::lround(k.fx * x.x() + k.cx));
      const auto sv = static_cast<int>(std::lround(k.fy * x.y() + k.cy));
      const bool inside = su >= 0 && sv >= 0 && su < straight.width() && sv < straight.height();
      if (inside && straight.at(su, sv)) result.set(u, v);
    }
  }
  return result;
}

/// Predicted silhouettes of one error model, asked for in order of time.
class ModelSilhouettes {
 public:
  ModelSilhouettes(const Pipeline& pipeline, const ErrorModel& model, std::span<const JointSample> stream)
      : online_(pipeline.shared_robot(), pipeline.setup(), model), offsets_(model.offsets()), stream_(stream),
        corrections_(offsets_.size()), body_(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), {}),
        rig_(model.corrected(pipeline.rig())) {
    SilhouetteModel silhouettes;
    silhouettes.culling = pipeline.setup().culling;
    for (const auto& part : pipeline.robot().meshes()) silhouettes.parts.push_back(part.mesh);
    SilhouetteOptions options;
    options.engine = "contour";
    options.threads = 1;
    scorer_ = make_silhouette_scorer(silhouettes, rig_.intrinsics(), options);
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      // Of the configured distortion the pictures are free.
      k1_.push_back(rig_.cameras[c].distortion[0] - pipeline.rig().cameras[c].distortion[0]);
    }
  }

  BinaryMask at(const JointSample& joints, std::size_t camera) {
    for (; next_ < stream_.size() && stream_[next_].utime <= joints.utime + kAhead; ++next_) {
      online_.observe(stream_[next_]);
    }
    online_.corrections(joints, camera, corrections_);
    const Eigen::VectorXd q = joints.q - offsets_;
    std::vector<Eigen::Isometry3f> X_CB(body_.part_count());
    body_.compute({q, &corrections_}, Eigen::VectorXd(), camera, X_CB);
    BinaryMask silhouette = scorer_->render(X_CB, camera);
    return k1_[camera] == 0.0 ? silhouette : bent(silhouette, rig_.cameras[camera].intrinsics, k1_[camera]);
  }

 private:
  static constexpr Microseconds kAhead = 100'000;  ///< for the motion about an exposure

  OnlineErrorModel online_;
  Eigen::VectorXd offsets_;
  std::span<const JointSample> stream_;
  std::size_t next_ = 0;
  Corrections corrections_;
  BodyPoseModel body_;
  StereoRig rig_;
  std::vector<double> k1_;  ///< what the model adds to each camera's
  std::unique_ptr<SilhouetteScorer> scorer_;
};

Eigen::Vector2d pixel_of(const Eigen::Vector3d& p_C, const PinholeIntrinsics& k) {
  return {k.fx * p_C.x() / p_C.z() + k.cx, k.fy * p_C.y() / p_C.z() + k.cy};
}

}  // namespace

void LogPictures::offer(const Observation& observation) {
  if (offered_++ % every_ != 0) return;
  kept_.push_back(observation);
  if (kept_.size() <= kMost) return;
  for (std::size_t i = 1; 2 * i < kept_.size(); ++i) kept_[i] = std::move(kept_[2 * i]);
  kept_.resize((kept_.size() + 1) / 2);
  every_ *= 2;
}

void LogPictures::place_hand(const Pipeline& pipeline, std::span<const ViewInput> views, DiagnosisReport& report) {
  const Eigen::VectorXd offsets = report.extended_model->offsets();
  BodyPoseModel body(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), {});
  for (std::size_t v = 0; v < views.size() && v < report.samples.size(); ++v) {
    report.samples[v].utime = views[v].joints.utime;
    const auto& k = pipeline.rig().cameras[views[v].camera].intrinsics;
    const Eigen::VectorXd q = views[v].joints.q - offsets;
    const Eigen::Vector3d p_C = body.hand_pose(q, Eigen::VectorXd(), views[v].camera).translation();
    if (p_C.z() <= 0.0) continue;
    report.samples[v].depth_m = p_C.z();
    report.samples[v].image_radius_px = (pixel_of(p_C, k) - Eigen::Vector2d(k.cx, k.cy)).norm();
  }
}

std::vector<std::pair<Image, std::string>> LogPictures::draw(const Pipeline& pipeline,
                                                             std::span<const JointSample> stream,
                                                             const DiagnosisReport& report) const {
  const bool found = !report.causes.empty();
  // How much the extension helps in each kept observation.
  std::vector<std::pair<double, std::size_t>> gain;
  for (std::size_t i = 0; i < kept_.size(); ++i) {
    double sum = 0.0;
    std::size_t n = 0;
    for (const auto& sample : report.samples) {
      if (sample.before.rms_px <= 0.0 || sample.after.rms_px <= 0.0) continue;
      for (const auto& seen : kept_[i].cameras) {
        if (!seen || seen->utime != sample.utime) continue;
        sum += sample.before.rms_px - sample.after.rms_px;
        ++n;
      }
    }
    if (n > 0) gain.emplace_back(found ? sum / static_cast<double>(n) : 0.0, i);
  }
  std::stable_sort(gain.begin(), gain.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(kShown, gain.size()); ++i) {
    // Without causes, spread over the log.
    shown.push_back(gain[found ? i : (2 * i + 1) * gain.size() / (2 * kShown)].second);
  }
  std::sort(shown.begin(), shown.end());

  const ErrorModel plain(report.extended_model->roles());
  ModelSilhouettes before(pipeline, found ? *report.baseline_model : plain, stream);
  ModelSilhouettes after(pipeline, *report.extended_model, stream);
  BodyPoseModel body(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), {});
  const Eigen::VectorXd offsets = report.extended_model->offsets();
  const OverlayNames names = {found ? "offsets and nuisances" : "encoders as they are", "extended model"};
  std::vector<std::pair<Image, std::string>> pictures;
  for (const std::size_t i : shown) {
    std::vector<OverlayView> views;
    for (std::size_t c = 0; c < kept_[i].cameras.size(); ++c) {
      const auto& seen = kept_[i].cameras[c];
      if (!seen || seen->image.empty()) continue;
      OverlayView view{&seen->image, before.at(seen->joints, c), after.at(seen->joints, c), {}};
      // The part about the hand, moved into the picture.
      const auto& k = pipeline.rig().cameras[c].intrinsics;
      const Eigen::VectorXd q = seen->joints.q - offsets;
      const Eigen::Vector2d hand = pixel_of(body.hand_pose(q, Eigen::VectorXd(), c).translation(), k);
      const int size = std::min({2 * kHalfPart_px, k.width, k.height});
      if (hand.allFinite()) {
        view.part = {std::clamp(static_cast<int>(hand.x()) - size / 2, 0, k.width - size),
                     std::clamp(static_cast<int>(hand.y()) - size / 2, 0, k.height - size), size, size};
      }
      views.push_back(std::move(view));
    }
    if (views.empty()) continue;
    const double time_s = seconds(kept_[i].utime - report.begin_utime);
    pictures.emplace_back(draw_overlay(views, fmt::format("{:.1f} s", time_s), kEnlargement, names),
                          fmt::format("{:.1f} s into the log, both eyes: outlines of {} (red) and of the extended "
                                      "model (green)",
                                      time_s, found ? "the fit of offsets and nuisances" : "the encoders as they are"));
  }
  return pictures;
}

}  // namespace bodyschema::diagnosis
