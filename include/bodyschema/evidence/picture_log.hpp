#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/effects/instant.hpp"
#include "bodyschema/effects/joint_roles.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/outline/observed_edges.hpp"

namespace bodyschema {

/// One picture of a log: where the encoders were at its exposure, and the robot's outline in it.
struct Picture {
  JointSample joints;  ///< at the exposure; velocities from the encoder log once that is complete
  Eigen::VectorXd qddot;
  Eigen::MatrixXd path;  ///< joint_path() about the exposure
  std::size_t camera = 0;
  BinaryMask mask, valid;
  std::vector<std::uint8_t> coverage;
};

/// What a log shows: its pictures' outlines and its encoders. In order of time. Keeps coverage (one byte a pixel), not
/// the pictures themselves.
class PictureLog {
 public:
  PictureLog(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig);

  /// Adds the pictures of an observation whose masks have been filled in, and its encoder samples. One that repeats
  /// the last, with the same outlines at the same encoder readings, says nothing new and is left out: a simulator at
  /// rest, a driver that publishes twice.
  void add(const Observation& observation);
  /// Encoder samples from elsewhere instead, in order of time.
  void set_encoders(std::vector<JointSample> encoders) { encoders_ = std::move(encoders); }
  /// Forgets pictures before a time, and the encoder samples before the first one left.
  void forget_before(Microseconds utime);
  /// Lets go of the oldest pictures' outlines, whose evidence somebody keeps, so that the newest take at most so many
  /// bytes; the rest stays.
  void drop_outlines(std::size_t bytes);
  /// Of the same pictures, a robot whose cameras sit elsewhere.
  void replace_rig(std::shared_ptr<const RobotModel> robot, const StereoRig& rig);
  /// The masks come of a background that was learned from these pictures: what never left its place is part of it.
  void learned_background() { learned_background_ = true; }
  /// Of each rendered link, whether it moved out of the way in the course of the pictures; all, unless the background
  /// was learned from them. Of others no mask shows anything.
  [[nodiscard]] std::vector<bool> parts_shown() const;
  /// Finds the arm's motion at every exposure, once all observations are in.
  void finish();

  [[nodiscard]] std::span<const Picture> pictures() const { return pictures_; }
  /// Position of a camera's picture of that time.
  [[nodiscard]] std::optional<std::size_t> find(std::size_t camera, Microseconds utime) const;
  /// picture_unit of the camera that took a picture.
  [[nodiscard]] double unit_px(std::size_t picture) const {
    return picture_unit(rig_.cameras[pictures_[picture].camera].intrinsics);
  }
  /// These pixels of a picture do not count any more.
  void leave_out(std::size_t picture, const BinaryMask& pixels) {
    bodyschema::leave_out(pixels, pictures_[picture].valid);
  }
  [[nodiscard]] std::span<const JointSample> encoders() const { return encoders_; }
  [[nodiscard]] ObservedEdges edges(std::size_t picture) const;
  /// What effects may look at in a picture; `offsets` as InstantBuilder::build.
  void instant(std::size_t picture, const Eigen::Ref<const Eigen::VectorXd>& offsets, Instant& out);

  [[nodiscard]] const std::shared_ptr<const RobotModel>& robot() const { return robot_; }
  [[nodiscard]] const RobotSetup& setup() const { return setup_; }
  [[nodiscard]] const StereoRig& rig() const { return rig_; }
  [[nodiscard]] const JointRoles& roles() const { return roles_; }

 private:
  [[nodiscard]] bool repeats_the_last(const std::vector<Picture>& pictures) const;

  std::shared_ptr<const RobotModel> robot_;
  RobotSetup setup_;
  StereoRig rig_;
  JointRoles roles_;
  std::unique_ptr<InstantBuilder> instants_;
  std::vector<Picture> pictures_;
  std::vector<JointSample> encoders_;
  bool learned_background_ = false;
};

}  // namespace bodyschema
