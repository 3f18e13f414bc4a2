#include "bodyschema/evidence/picture_log.hpp"

#include <algorithm>

#include "bodyschema/observation/joint_motion.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

PictureLog::PictureLog(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig)
    : robot_(std::move(robot)), setup_(setup), rig_(rig), roles_(JointRoles::of(robot_, setup_, rig_)),
      instants_(std::make_unique<InstantBuilder>(robot_, setup_.hand_link, setup_.gravity_W)) {}

bool PictureLog::repeats_the_last(const std::vector<Picture>& pictures) const {
  return std::all_of(pictures.begin(), pictures.end(), [&](const Picture& picture) {
    const auto last = std::find_if(pictures_.rbegin(), pictures_.rend(),
                                   [&](const Picture& p) { return p.camera == picture.camera; });
    return last != pictures_.rend() && last->joints.q == picture.joints.q && last->mask == picture.mask &&
           last->coverage == picture.coverage && last->valid == picture.valid;
  });
}

void PictureLog::add(const Observation& observation) {
  if (observation.encoders_begin_anew) {
    // The clock stepped back: what was stamped before and lies after the new beginning would stand among what follows.
    auto begin = observation.utime;
    if (!observation.encoders.empty()) begin = std::min(begin, observation.encoders.front().utime);
    std::erase_if(pictures_, [&](const Picture& picture) { return picture.joints.utime >= begin; });
    std::erase_if(encoders_, [&](const JointSample& sample) { return sample.utime >= begin; });
  }
  for (const auto& sample : observation.encoders) {
    if (!encoders_.empty() && sample.utime <= encoders_.back().utime) {
      if (sample.utime == encoders_.back().utime) encoders_.back() = sample;
      continue;
    }
    encoders_.push_back(sample);
  }
  std::vector<Picture> pictures;
  for (std::size_t c = 0; c < observation.cameras.size() && c < rig_.cameras.size(); ++c) {
    const auto& seen = observation.cameras[c];
    if (!seen || seen->mask.empty()) continue;
    Picture picture{seen->joints, {}, {}, c, seen->mask, seen->valid, seen->coverage};
    picture.joints.utime = seen->utime;
    pictures.push_back(std::move(picture));
  }
  if (repeats_the_last(pictures)) return;
  for (auto& picture : pictures) {
    // Left and right of one observation may carry stamps in either order.
    const auto at =
        std::upper_bound(pictures_.begin(), pictures_.end(), picture.joints.utime,
                         [](Microseconds utime, const Picture& other) { return utime < other.joints.utime; });
    pictures_.insert(at, std::move(picture));
  }
}

std::optional<std::size_t> PictureLog::find(std::size_t camera, Microseconds utime) const {
  const auto found = std::find_if(pictures_.begin(), pictures_.end(),
                                  [&](const Picture& p) { return p.camera == camera && p.joints.utime == utime; });
  if (found == pictures_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - pictures_.begin());
}

void PictureLog::forget_before(Microseconds utime) {
  std::erase_if(pictures_, [&](const Picture& picture) { return picture.joints.utime < utime; });
  // What has a memory, and the motion about the first picture, need those shortly before.
  constexpr Microseconds kBefore = 1'000'000;
  const auto first = std::find_if(encoders_.begin(), encoders_.end(),
                                  [&](const JointSample& sample) { return sample.utime >= utime - kBefore; });
  encoders_.erase(encoders_.begin(), first);
}

void PictureLog::drop_outlines(std::size_t bytes) {
  for (auto picture = pictures_.rbegin(); picture != pictures_.rend(); ++picture) {
    const std::size_t own = picture->mask.bytes() + picture->valid.bytes() + picture->coverage.size();
    if (own <= bytes) {
      bytes -= own;
      continue;
    }
    bytes = 0;
    picture->mask = picture->valid = BinaryMask();
    picture->coverage = {};
  }
}

void PictureLog::replace_rig(std::shared_ptr<const RobotModel> robot, const StereoRig& rig) {
  robot_ = std::move(robot);
  rig_ = rig;
  roles_ = JointRoles::of(robot_, setup_, rig_);
  instants_ = std::make_unique<InstantBuilder>(robot_, setup_.hand_link, setup_.gravity_W);
}

std::vector<bool> PictureLog::parts_shown() const {
  // Physical: the width of a thin limb. What moves less uncovers no background, or only a rim of it.
  constexpr double kOutOfTheWay_m = 0.03, kReach_m = 0.1;
  const auto& links = setup_.model.rendered_links;
  std::vector<bool> shown(links.size(), !learned_background_);
  if (!learned_background_) return shown;
  std::vector<std::string> frames = links;
  for (const auto& link : rig_.links()) frames.push_back(link);
  ForwardKinematics kinematics(robot_, frames);
  std::vector<Pose> X_WF(frames.size());
  std::vector<std::vector<Pose>> first(rig_.cameras.size());
  for (const auto& picture : pictures_) {
    kinematics.compute(picture.joints.q, X_WF);
    const Pose X_CW = X_WF[links.size() + picture.camera].inverse(Eigen::Isometry);
    auto& reference = first[picture.camera];
    for (std::size_t l = 0; l < links.size(); ++l) {
      const Pose X_CL = X_CW * X_WF[l];
      if (reference.size() <= l) reference.push_back(X_CL);
      const double moved = (X_CL.translation() - reference[l].translation()).norm() +
                           kReach_m * rotation_distance(X_CL.linear(), reference[l].linear());
      if (moved > kOutOfTheWay_m) shown[l] = true;
    }
  }
  return shown;
}

void PictureLog::finish() {
  for (auto& picture : pictures_) {
    // Of a picture whose path is known to its end nothing comes to light later.
    if (picture.path.cols() > 0 && !picture.path.col(picture.path.cols() - 1).array().isNaN().all()) continue;
    joint_motion(encoders_, picture.joints.utime, picture.joints.qdot, picture.qddot);
    picture.joints.qdot.conservativeResize(picture.joints.q.size());
    picture.qddot.conservativeResize(picture.joints.q.size());
    joint_path(encoders_, picture.joints.utime, picture.path);
  }
}

ObservedEdges PictureLog::edges(std::size_t picture) const {
  const auto& p = pictures_[picture];
  const auto& k = rig_.cameras[p.camera].intrinsics;
  return {p.coverage, p.mask, p.valid, k.width, k.height};
}

void PictureLog::instant(std::size_t picture, const Eigen::Ref<const Eigen::VectorXd>& offsets, Instant& out) {
  instants_->build(pictures_[picture].joints, pictures_[picture].camera, offsets, out);
  out.qddot = pictures_[picture].qddot;
  out.path = pictures_[picture].path;
}

}  // namespace bodyschema
