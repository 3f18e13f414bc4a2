#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/observation/corrections.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

/// Forward kinematics of links and cameras with the corrections of an ErrorModel applied.
/// A constant transform T at joint j turns X_WB of every link beyond it into C X_WB with
/// C = X_WJ T X_WJ^-1, so plain kinematics and one product per adjusted joint are all it takes.
/// One per thread; `compute` neither throws nor allocates.
class CorrectedKinematics {
 public:
  /// Throws ConfigurationError naming an unknown link.
  CorrectedKinematics(std::shared_ptr<const RobotModel> model, std::vector<std::string> links,
                      std::vector<std::string> camera_links);

  /// Poses of the links in one camera.
  /// @param q  encoder readings (plus a particle's own correction, where there is one), radians
  /// @param corrections  `dq` is added to q, joint adjustments and the camera's shift are applied
  /// @param X_CB  out, one per link
  void compute(const Eigen::Ref<const Eigen::VectorXd>& q, const Corrections& corrections, std::size_t camera,
               std::span<Pose> X_CB);

  /// Pose of the camera in the root frame at the last `compute`, with its own corrections and the base's shift.
  [[nodiscard]] const Pose& X_WC() const { return X_WC_; }
  /// Directions about which JointAdjustment::tilt_1_rad and tilt_2_rad turn and along which shift_1_m
  /// and shift_2_m move: unit, perpendicular to the joint's axis, fixed in its parent link; root frame,
  /// at the last `compute`. Zero for a joint that moves none of the links and cameras.
  [[nodiscard]] Eigen::Vector3d tilt_axis(Eigen::Index joint, int which) const;
  /// Directions along which JointAdjustment::along_m (0), shift_1_m (1) and shift_2_m (2) move; as tilt_axis.
  [[nodiscard]] Eigen::Vector3d shift_axis(Eigen::Index joint, int which) const;

 private:
  [[nodiscard]] bool moves(Eigen::Index joint, std::size_t link) const;
  /// Moves what the joint's link carries.
  void mount(Eigen::Index joint, std::size_t camera, const JointAdjustment& adjustment, std::span<Pose> X_WB);

  struct Frames {
    bool moves_something = false;  ///< a listed link or a camera
    std::size_t parent = 0;        ///< position of the parent link in the FK's list
    std::array<Eigen::Vector3d, 2> tilt_P{};
    double outwards = 1.0;  ///< sign of the axis that leads on to the next joint
    std::size_t child = 0;  ///< position of the link that it turns in the FK's list
  };
  std::shared_ptr<const RobotModel> model_;
  std::size_t link_count_;
  std::size_t camera_count_;
  std::vector<Frames> joints_;
  std::unique_ptr<ForwardKinematics> fk_;
  Eigen::VectorXd q_;
  std::vector<Pose> X_W_;
  std::vector<bool> moves_;    ///< [joint][link], links then cameras then parents and children
  std::vector<bool> carries_;  ///< the same of what a joint moves but for its own link
  Pose X_WC_ = Pose::Identity();
  Pose mount_C_ = Pose::Identity();  ///< scratch: what the last mount does, root frame
};

}  // namespace bodyschema
