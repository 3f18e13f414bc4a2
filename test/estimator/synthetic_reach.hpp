#pragma once

#include <memory>
#include <random>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/estimator/body_pose_model.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// Observations of a reach without simulator or vision: masks and coverage come from silhouettes
/// drawn at four times the resolution, encoders carry known offsets.
class SyntheticReach {
 public:
  SyntheticReach(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                 const Eigen::VectorXd& offset_rad)
      : robot_(std::move(robot)), setup_(setup), rig_(rig), offset_(offset_rad), body_(robot_, setup_, rig_, {}) {
    SilhouetteModel model;
    model.culling = setup.culling;
    for (const auto& part : robot_->meshes()) model.parts.push_back(part.mesh);
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
    renderer_ = make_silhouette_scorer(model, fine, options);
  }

  /// From now on a camera lies further along its own x axis than the rig says, and observations say so.
  void shift_camera(std::size_t camera, double shift_x_m) {
    known_.resize(rig_.cameras.size(), Corrections(robot_->joint_count()));
    known_[camera].camera.shift_x_m = shift_x_m;
  }

  /// @param q_true  RobotModel order
  Observation observe(const Eigen::VectorXd& q_true, Microseconds utime) {
    Observation observation;
    observation.utime = utime;
    Eigen::VectorXd q_encoder = q_true;
    for (std::size_t k = 0; k < setup_.estimated_joints.size(); ++k) {
      q_encoder(robot_->joint_index(setup_.estimated_joints[k])) += offset_(static_cast<Eigen::Index>(k));
    }
    std::vector<Eigen::Isometry3f> X_CB(body_.part_count());
    for (std::size_t c = 0; c < rig_.cameras.size(); ++c) {
      CameraObservation seen;
      seen.utime = utime;
      seen.joints.utime = utime;
      seen.joints.q = q_encoder;
      seen.joints.qdot = Eigen::VectorXd::Zero(q_encoder.size());
      if (!known_.empty()) seen.corrections = known_[c];
      body_.compute(exposure(q_true, c), Eigen::VectorXd(), c, X_CB);
      const BinaryMask fine = renderer_->render(X_CB, c);
      const int width = rig_.cameras[c].intrinsics.width;
      const int height = rig_.cameras[c].intrinsics.height;
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
      observation.cameras.push_back(std::move(seen));
    }
    return observation;
  }

  [[nodiscard]] Pose true_hand(const Eigen::VectorXd& q_true, std::size_t camera) {
    return body_.hand_pose(exposure(q_true, camera), Eigen::VectorXd(), camera);
  }

 private:
  [[nodiscard]] Exposure exposure(const Eigen::VectorXd& q_true, std::size_t camera) const {
    return {q_true, known_.empty() ? nullptr : &known_[camera]};
  }

  static constexpr int kFine = 4;
  std::shared_ptr<const RobotModel> robot_;
  RobotSetup setup_;
  StereoRig rig_;
  Eigen::VectorXd offset_;
  std::vector<Corrections> known_;  ///< by camera; empty: nothing differs
  BodyPoseModel body_;
  std::unique_ptr<SilhouetteScorer> renderer_;
};

}  // namespace bodyschema
