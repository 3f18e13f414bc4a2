#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {

/// What the hand holds: a thing that no mesh shows, learned from where masks go beyond the robot.
///
/// A map of small cubes around the hand, in its frame. A cube that pictures show as mask beside the robot is foreign;
/// what is foreign in the same place of the hand's frame in several views, while the hand turns, is carried by it. A
/// person who passes, the other arm, a cupboard whose colour is the robot's are foreign once here and once there, and
/// each picture that shows background where a cube is carves it away. No shape, no size is assumed.
///
/// Pictures of a hand that stands where it stood say nothing new and are not counted twice. One thread.
class HeldThing {
 public:
  /// One picture of a hand whose place is known.
  struct View {
    const PinholeIntrinsics* camera = nullptr;
    Pose X_CP = Pose::Identity();       ///< hand in the camera, m
    const BinaryMask* mask = nullptr;   ///< what is robot or thing
    const BinaryMask* valid = nullptr;  ///< pixels that count; empty: all
    const BinaryMask* robot = nullptr;  ///< where the robot is predicted, and beside it as far as it may be off
  };

  /// Whether the hand, at this place in the first camera that sees it, shows another side than before.
  [[nodiscard]] bool is_new(const Pose& X_CP) const;
  /// Looks at one frame's pictures.
  void learn(std::span<const View> views);
  /// Whether something is held.
  [[nodiscard]] bool known() const { return !held_.empty(); }
  /// The pixels that it may cover in a picture.
  /// @param margin_px  how far off the hand may be
  BinaryMask mark(const PinholeIntrinsics& camera, const Pose& X_CP, double margin_px);
  void forget();

 private:
  void look(const View& view);
  [[nodiscard]] Eigen::Vector3d centre(std::size_t cube) const;

  std::vector<std::int8_t> evidence_;  ///< per cube; empty: nothing foreign was ever seen
  std::vector<std::uint32_t> held_;    ///< cubes
  std::vector<Pose> views_;            ///< of the hand in the first camera that saw it, the last few
  MaskMorphology morphology_;
};

}  // namespace bodyschema
