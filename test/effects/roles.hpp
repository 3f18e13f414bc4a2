#pragma once

#include "bodyschema/effects/instant.hpp"
#include "bodyschema/effects/joint_roles.hpp"

namespace bodyschema::test {

/// A made-up robot: six head joints, seven arm joints, two fingers and what spreads one, two cameras; three rendered
/// parts in two segments.
inline JointRoles roles() {
  JointRoles r;
  r.names = {"neck_pitch", "neck_roll", "neck_yaw", "eyes_tilt", "l_eye_pan", "r_eye_pan", "s_pitch", "s_roll",
             "s_yaw",      "elbow",     "prosup",   "w_pitch",   "w_yaw",     "index",     "thumb",   "spread"};
  r.head = {0, 1, 2, 3, 4, 5};
  r.neck = {0, 1, 2, 3};
  r.left_pan = 4;
  r.right_pan = 5;
  r.arm = {6, 7, 8, 9, 10, 11, 12};
  r.fingers = {13, 14};
  r.hand = {13, 14, 15};
  r.cameras = {"left", "right"};
  r.segments = {{"forearm", {0}}, {"hand", {1, 2}, {2}, 1}};
  r.links = {{"upper_arm", 8, 0.15, {.along_m = 1.0}}, {"forearm", 10, 0.14, {.along_m = 0.6, .shift_1_m = 0.8}}};
  r.mounts = {{"hand", 12, {1.0, 0.0, 0.0}}};
  return r;
}

inline Instant instant(const JointRoles& r) {
  const auto n = static_cast<Eigen::Index>(r.names.size());
  Instant at;
  at.encoder.setZero(n);
  at.q.setZero(n);
  at.qdot.setZero(n);
  at.qddot.setZero(n);
  at.gravity_torque.setZero(n);
  at.payload_torque.setZero(n);
  return at;
}

}  // namespace bodyschema::test
