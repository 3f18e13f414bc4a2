#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/simulator/lens.hpp"

namespace bodyschema::simulator {

/// Where the robot stands in its room. Frame K: origin midway between the cameras as the head usually stands,
/// x where they look but level, y to the left, z up. Metres.
struct RoomPlan {
  Pose X_WK = Pose::Identity();
  double floor_z = -1.15;  ///< in K
  double front_x = 2.3;    ///< the wall before the robot
  bool table = true;
  double table_z = -0.45;  ///< its top
  double table_near_x = 0.15, table_far_x = 0.95, table_half_width = 0.75;
};

/// A room with cupboards, tiles, a window, shelves and a table's top, all with patterns, as a box of painted walls:
/// it moves in the picture as a room does when the head turns, near and far things by different amounts. Colours
/// are drawn by seed, a share of them close to the robot's. Immutable.
class Kitchen {
 public:
  /// @param near_colours  levels 0-255
  Kitchen(const RoomPlan& plan, const std::vector<Eigen::Vector3f>& near_colours, std::uint64_t seed);
  ~Kitchen();

  /// Fills rows [v0, v1) of `picture` (three floats a pixel, levels) with walls, floor and ceiling; of the table only
  /// its place is known here.
  /// @param X_WC  camera in the root frame, metres
  void paint(const Lens& lens, const Pose& X_WC, int v0, int v1, std::vector<float>& picture) const;
  /// Share of light that the table's top gives back at a point of the root frame, RGB.
  /// @param footprint_m  what a pixel covers there
  [[nodiscard]] Eigen::Vector3f table_albedo(const Eigen::Vector3f& p_W, float footprint_m) const;
  [[nodiscard]] const RoomPlan& plan() const { return plan_; }

 private:
  struct Walls;
  RoomPlan plan_;
  Eigen::Matrix3f R_KW_;
  Eigen::Vector3f p_KW_;
  std::unique_ptr<const Walls> walls_;
};

}  // namespace bodyschema::simulator
