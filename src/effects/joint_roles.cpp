#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/nearest_name.hpp"
#include "bodyschema/effects/corrected_kinematics.hpp"
#include "bodyschema/effects/joint_roles.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {
namespace {

/// What each joint does to the rendered links beyond the hand's frame. Those of the arm do as much where there are two.
class FingerJoints {
 public:
  FingerJoints(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup,
               const std::vector<Eigen::Index>& arm)
      : links_(with_hand(setup)), kinematics_(model, links_), q_(setup.default_joints(*model)), X_WB_(links_.size()),
        turned_(links_.size()) {
    kinematics_.compute(q_, X_WB_);
    for (Eigen::Index j = 0; j < model->joint_count(); ++j) {
      const bool arms = std::find(arm.begin(), arm.end(), j) != arm.end();
      if (!arms && !kinematics_.moves(j, links_.size() - 1)) add(j);
    }
  }

  [[nodiscard]] std::vector<Eigen::Index> all() const {
    std::vector<Eigen::Index> all;
    for (const auto& joint : joints_) all.push_back(joint.index);
    return all;
  }

  [[nodiscard]] std::vector<Eigen::Index> curling() const {
    constexpr double kParallel = 0.7;
    std::vector<Eigen::Index> curling;
    for (const auto& joint : joints_) {
      const Joint& last = last_of(joint);
      if (std::abs(joint.axis_W.dot(last.axis_W)) > kParallel) curling.push_back(joint.index);
    }
    return curling;
  }

 private:
  struct Joint {
    Eigen::Index index;
    std::vector<std::size_t> links;  ///< those it moves
    Eigen::Vector3d axis_W;
  };

  static std::vector<std::string> with_hand(const RobotSetup& setup) {
    auto links = setup.model.rendered_links;
    links.push_back(setup.hand_link);
    return links;
  }

  void add(Eigen::Index j) {
    Joint joint{j, {}, Eigen::Vector3d::Zero()};
    for (std::size_t l = 0; l + 1 < links_.size(); ++l) {
      if (kinematics_.moves(j, l)) joint.links.push_back(l);
    }
    if (joint.links.empty()) return;
    constexpr double kStep = 0.01;
    Eigen::VectorXd q = q_;
    q[j] += kStep;
    kinematics_.compute(q, turned_);
    const auto l = joint.links.front();
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(turned_[l].linear() * X_WB_[l].linear().transpose()));
    if (turn.angle() < 0.1 * kStep) return;  // it slides
    joint.axis_W = turn.axis();
    joints_.push_back(std::move(joint));
  }

  /// The joint furthest out of those that move a part of what `joint` moves; joints come in order from
  /// the root.
  [[nodiscard]] const Joint& last_of(const Joint& joint) const {
    const Joint* last = &joint;
    for (const auto& other : joints_) {
      if (other.index > last->index &&
          std::includes(last->links.begin(), last->links.end(), other.links.begin(), other.links.end())) {
        last = &other;
      }
    }
    return *last;
  }

  std::vector<std::string> links_;
  ForwardKinematics kinematics_;
  Eigen::VectorXd q_;
  std::vector<Pose> X_WB_, turned_;
  std::vector<Joint> joints_;
};

/// The bodies that the arm's joints move, and the links between these joints.
class ArmAnatomy {
 public:
  ArmAnatomy(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup,
             const std::vector<std::string>& cameras, const std::vector<Eigen::Index>& arm)
      : model_(*model), arm_(arm), rendered_(setup.model.rendered_links), links_(links_of(setup)),
        kinematics_(model, links_), corrected_(model, links_, cameras), X_WB_(links_.size()) {
    const auto q = setup.default_joints(*model);
    kinematics_.compute(q, X_WB_);
    std::vector<Pose> X_CB(links_.size());
    corrected_.compute(q, Corrections(q.size()), 0, X_CB);
  }

  /// Parts that the same joint of the arm moves last, those of the hand under the name of its frame.
  [[nodiscard]] std::vector<BodySegment> segments() const {
    std::vector<BodySegment> segments;
    std::vector<Eigen::Index> last;
    for (std::size_t part = 0; part < rendered_.size(); ++part) {
      const auto joint = last_that_moves(part);
      const auto at = std::find(last.begin(), last.end(), joint);
      if (at == last.end()) {
        last.push_back(joint);
        const bool hand = joint == last_that_moves(rendered_.size());
        segments.push_back({hand ? links_[rendered_.size()] : rendered_[part], {part}});
      } else {
        segments[static_cast<std::size_t>(at - last.begin())].parts.push_back(part);
      }
    }
    // Further in, what hangs on inner joints may carry the arm: a body whose legs move.
    for (std::size_t s = 0; s < segments.size(); ++s) {
      const bool arm_goes_on = std::any_of(segments.begin(), segments.end(), [&](const BodySegment& other) {
        return &other != &segments[s] && (last[s] < 0 || kinematics_.moves(last[s], other.parts.front()));
      });
      if (!arm_goes_on) find_inner_parts(segments[s]);
    }
    return segments;
  }

  /// What moves against the others of its segment, and which of these it hangs on: the one whose frame is nearest.
  void find_inner_parts(BodySegment& segment) const {
    const auto moved_by = [&](std::size_t part) {
      std::vector<Eigen::Index> list;
      for (Eigen::Index j = 0; j < model_.joint_count(); ++j) {
        if (kinematics_.moves(j, part)) list.push_back(j);
      }
      return list;
    };
    const auto first = moved_by(segment.parts.front());
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto part : segment.parts) {
      if (moved_by(part) == first) continue;
      segment.inner.push_back(part);
      middle += X_WB_[part].translation();
    }
    if (segment.inner.empty()) return;
    middle /= static_cast<double>(segment.inner.size());
    const auto away = [&](std::size_t part) { return (X_WB_[part].translation() - middle).norm(); };
    segment.core = segment.parts.front();
    for (const auto part : segment.parts) {
      if (moved_by(part) == first && away(part) < away(segment.core)) segment.core = part;
    }
  }

  /// Where on its axis a joint sits that turns a link about its own length, a URDF chooses freely, often at the near
  /// end: so it may lie further out although no length in the URDF says so. Where one does, that is its link_length.
  [[nodiscard]] std::vector<ArmLink> links() const {
    constexpr double kApart_m = 0.02, kAbout = 0.9;
    std::vector<ArmLink> list;
    for (const auto joint : arm_) {
      const auto before = joint_before(joint);
      if (before < 0) continue;
      const Eigen::Vector3d along = origin(joint) - origin(before);
      const double length = along.norm();
      if (length < kApart_m) continue;
      const Eigen::Vector3d direction = along / length;
      const auto& name = info(joint).parent_link;
      // A short step aside to the joint that turns a link is no length of that link: what lies aside is its axis.
      const bool listed = std::any_of(list.begin(), list.end(), [&](const ArmLink& l) {
        return l.joint == before && l.per_metre.along_m > kAbout;
      });
      if (!listed && joint_before(before) >= 0 && direction.dot(corrected_.shift_axis(before, 0)) > kAbout) {
        std::erase_if(list, [&](const ArmLink& l) { return l.joint == before; });
        list.push_back({name, before, length, {.along_m = 1.0}, true});
      }
      JointAdjustment step;
      step.along_m = direction.dot(corrected_.shift_axis(joint, 0));
      step.shift_1_m = direction.dot(corrected_.shift_axis(joint, 1));
      step.shift_2_m = direction.dot(corrected_.shift_axis(joint, 2));
      list.push_back({name, joint, length, step});
    }
    return list;
  }

  /// Rendered links, or the hand's frame, that are fixed to the link which the arm's last joint turns. Fingers are not.
  [[nodiscard]] std::vector<Mount> mounts() const {
    std::vector<Mount> list;
    for (std::size_t part = 0; part <= rendered_.size(); ++part) {
      const auto joint = last_that_moves(part);
      if (joint < 0 || info(joint).child_link == links_[part] || !is_last(joint)) continue;
      bool jointed = false;
      for (Eigen::Index j = joint + 1; j < model_.joint_count(); ++j) jointed |= kinematics_.moves(j, part);
      const bool listed = std::any_of(list.begin(), list.end(), [&](const Mount& m) { return m.joint == joint; });
      if (!jointed && !listed) list.push_back({links_[part], joint, mount_axis(part, joint)});
    }
    return list;
  }

 private:
  [[nodiscard]] Eigen::Vector3d mount_axis(std::size_t part, Eigen::Index joint) const {
    constexpr double kApart_m = 1e-3;
    const Pose& X_WL = X_WB_[rendered_.size() + 1 + arm_.size() + position(joint)];
    const Eigen::Vector3d on = X_WB_[part].translation() - X_WL.translation();
    const Eigen::Vector3d axis_W = on.norm() > kApart_m ? Eigen::Vector3d(on.normalized())
                                                        : Eigen::Vector3d(kinematics_.joint_axis(joint).direction_W);
    return X_WL.linear().transpose() * axis_W;
  }
  /// Whether no other joint of the arm is further out.
  [[nodiscard]] bool is_last(Eigen::Index joint) const {
    return std::none_of(arm_.begin(), arm_.end(), [&](Eigen::Index other) {
      return other != joint && kinematics_.moves(joint, rendered_.size() + 1 + position(other));
    });
  }
  std::vector<std::string> links_of(const RobotSetup& setup) const {
    auto links = setup.model.rendered_links;
    links.push_back(setup.hand_link);
    for (const auto joint : arm_) links.push_back(info(joint).parent_link);
    for (const auto joint : arm_) links.push_back(info(joint).child_link);
    return links;
  }
  [[nodiscard]] const JointInfo& info(Eigen::Index joint) const {
    return model_.joints()[static_cast<std::size_t>(joint)];
  }
  [[nodiscard]] std::size_t position(Eigen::Index joint) const {
    return static_cast<std::size_t>(std::find(arm_.begin(), arm_.end(), joint) - arm_.begin());
  }
  [[nodiscard]] Eigen::Index last_that_moves(std::size_t link) const {
    Eigen::Index last = -1;
    for (const auto joint : arm_) {
      if (kinematics_.moves(joint, link)) last = std::max(last, joint);
    }
    return last;
  }
  /// The arm's joint before it on the way from the root; -1: none.
  [[nodiscard]] Eigen::Index joint_before(Eigen::Index joint) const {
    return last_that_moves(rendered_.size() + 1 + position(joint));
  }
  /// Of the joint's frame, which its own rotation leaves where it is; root frame, m.
  [[nodiscard]] Eigen::Vector3d origin(Eigen::Index joint) const {
    return X_WB_[rendered_.size() + 1 + arm_.size() + position(joint)].translation();
  }

  const RobotModel& model_;
  const std::vector<Eigen::Index>& arm_;
  std::vector<std::string> rendered_;
  std::vector<std::string> links_;  ///< rendered, the hand, parents of the arm's joints, their children
  ForwardKinematics kinematics_;
  CorrectedKinematics corrected_;
  std::vector<Pose> X_WB_;
};

}  // namespace

JointRoles JointRoles::of(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig) {
  JointRoles roles;
  for (const auto& joint : model->joints()) roles.names.push_back(joint.name);
  for (const auto& name : setup.estimated_joints) roles.arm.push_back(roles.index(name));
  for (const auto& name : setup.head_joints) roles.head.push_back(roles.index(name));
  std::sort(roles.arm.begin(), roles.arm.end());
  std::sort(roles.head.begin(), roles.head.end());

  std::vector<std::string> cameras;
  for (const auto& camera : rig.cameras) {
    roles.cameras.push_back(camera.name);
    cameras.push_back(camera.link);
  }
  ForwardKinematics eyes(model, cameras);
  std::vector<Pose> X_WC(cameras.size());
  eyes.compute(setup.default_joints(*model), X_WC);
  // An eye may also tilt by itself: the joint that pans it turns most nearly about the vertical of its picture.
  const auto upright = [&](Eigen::Index joint, std::size_t camera) {
    return joint < 0 ? -1.0 : std::abs(eyes.joint_axis(joint).direction_W.dot(X_WC[camera].linear().col(1)));
  };
  for (const auto joint : roles.head) {
    const bool left = eyes.moves(joint, 0);
    const bool right = cameras.size() < 2 ? left : eyes.moves(joint, 1);
    if (left && right) {
      roles.neck.push_back(joint);
    } else if (left && upright(joint, 0) > upright(roles.left_pan, 0)) {
      roles.left_pan = joint;
    } else if (right && upright(joint, 1) > upright(roles.right_pan, 1)) {
      roles.right_pan = joint;
    }
  }
  const FingerJoints fingers(model, setup, roles.arm);
  roles.fingers = fingers.curling();
  roles.hand = fingers.all();
  const ArmAnatomy anatomy(model, setup, cameras, roles.arm);
  roles.segments = anatomy.segments();
  roles.links = anatomy.links();
  roles.mounts = anatomy.mounts();
  return roles;
}

Eigen::Index JointRoles::index(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) {
    throw ConfigurationError("unknown joint '" + name + "'; did you mean '" + nearest_name(name, names) + "'?");
  }
  return at - names.begin();
}

}  // namespace bodyschema
