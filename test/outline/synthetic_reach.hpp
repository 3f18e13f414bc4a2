#pragma once

#include <memory>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/encoder_track.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/outline/robot_projection.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// Observations of a reach without simulator or vision: masks and coverage come from silhouettes
/// drawn at four times the resolution, encoders carry known offsets.
class SyntheticReach {
 public:
  /// @param offset_rad  of the estimated joints
  SyntheticReach(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                 const Eigen::VectorXd& offset_rad)
      : robot_(std::move(robot)), setup_(setup), rig_(rig), roles_(JointRoles::of(robot_, setup_, rig_)),
        offset_(offset_rad), others_(roles_), track_(robot_, setup_), projection_(robot_, setup_, rig_, roles_) {
    std::vector<PinholeIntrinsics> fine = rig.intrinsics();
    for (auto& k : fine) {
      k.width *= kFine;
      k.height *= kFine;
      k.fx *= kFine;
      k.fy *= kFine;
      k.cx = (k.cx + 0.5) * kFine - 0.5;
      k.cy = (k.cy + 0.5) * kFine - 0.5;
    }
    SilhouetteOptions options;
    options.engine = "contour";
    renderer_ = make_silhouette_scorer(silhouette_model(*robot_, setup_), fine, options);
  }

  [[nodiscard]] const JointRoles& roles() const { return roles_; }

  /// What else this robot is from now on, beside its offsets: effects without memory. Focal lengths, principal points,
  /// sizes and places are drawn; dilation and distortion are not.
  void befall(const ErrorModel& others) { others_ = others; }

  /// @param q_true  joints less what other effects do to them, RobotModel order
  Observation observe(const Eigen::VectorXd& q_true, Microseconds utime) {
    Observation observation;
    observation.utime = utime;
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      CameraObservation seen = draw(q_true, corrections(q_true, c), c);
      seen.utime = seen.joints.utime = utime;
      seen.joints.q = encoders(q_true);
      observation.cameras.push_back(std::move(seen));
    }
    observation.encoders = {observation.cameras[0]->joints};
    return observation;
  }

  /// What a camera sees of a robot that departs so from the model; dilation and distortion are not drawn.
  CameraObservation draw(const Eigen::VectorXd& q, const Corrections& departs, std::size_t camera) {
    CameraObservation seen;
    seen.joints = {0, q, Eigen::VectorXd::Zero(q.size())};
    std::vector<Eigen::Isometry3f> X_CB(projection_.part_count());
    projection_.place(q, departs, camera);
    projection_.parts(X_CB);
    cover(renderer_->render(X_CB, camera), seen);
    return seen;
  }

  [[nodiscard]] Pose true_hand(const Eigen::VectorXd& q_true, std::size_t camera) {
    projection_.place(q_true, corrections(q_true, camera), camera);
    return projection_.hand();
  }

 private:
  [[nodiscard]] Eigen::VectorXd encoders(const Eigen::VectorXd& q_true) const {
    Eigen::VectorXd q = q_true;
    for (std::size_t k = 0; k < setup_.estimated_joints.size(); ++k) {
      q(robot_->joint_index(setup_.estimated_joints[k])) += offset_(static_cast<Eigen::Index>(k));
    }
    return q;
  }

  /// Of the effects beside the offsets.
  [[nodiscard]] Corrections corrections(const Eigen::VectorXd& q_true, std::size_t camera) {
    Instant at;
    const Eigen::VectorXd q = encoders(q_true);
    track_.instant({0, q, Eigen::VectorXd::Zero(q.size())}, camera, q - q_true, at);
    Corrections result = roles_.no_corrections();
    others_.corrections(at, result);
    return result;
  }

  void cover(const BinaryMask& fine, CameraObservation& seen) const {
    const int width = fine.width() / kFine, height = fine.height() / kFine;
    seen.mask = BinaryMask(width, height);
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        int inside = 0;
        for (int dv = 0; dv < kFine; ++dv) {
          for (int du = 0; du < kFine; ++du) {
            inside += fine.at(u * kFine + du, v * kFine + dv) ? 1 : 0;
          }
        }
        const int coverage = inside * 255 / (kFine * kFine);
        seen.coverage.push_back(static_cast<std::uint8_t>(coverage));
        if (coverage >= 128) seen.mask.set(u, v);
      }
    }
  }

  static constexpr int kFine = 4;
  std::shared_ptr<const RobotModel> robot_;
  RobotSetup setup_;
  StereoRig rig_;
  JointRoles roles_;
  Eigen::VectorXd offset_;
  ErrorModel others_;
  EncoderTrack track_;
  RobotProjection projection_;
  std::unique_ptr<SilhouetteScorer> renderer_;
};

}  // namespace bodyschema
