#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// Corners of one picture of a checkerboard.
struct BoardCorners {
  std::vector<Eigen::Vector2d> board;  ///< squares, along the printed X and Y
  std::vector<Eigen::Vector2d> pixel;  ///< px
};

/// Reads `posture,column,row,u_px,v_px`. Throws FileError naming file and line.
std::map<std::int64_t, BoardCorners> read_checkerboard(const std::filesystem::path& csv);

/// What a board that is rigid with the hand says of a robot's calibration that has not seen it.
struct BoardWitness {
  std::size_t pictures = 0;
  double rms_px = 0.0;      ///< of all corners, one board for all pictures
  double scatter_mm = 0.0;  ///< of the board's middle in the hand's frame, each picture by itself: rms from the mean
  double scatter_deg = 0.0;
  double square_mm = 0.0;  ///< side of a square, as the robot's motion makes it
};

/// One view of the board: where the calibrated robot has its hand, and the corners.
struct BoardView {
  Pose X_camera_hand = Pose::Identity();
  const BoardCorners* corners = nullptr;
};

/// Fits one board in the hand's frame, its pose and the side of a square, to the corners of all views; then each view
/// by itself with that side.
/// @param distortion  k1 k2 p1 p2 k3 as OpenCV
BoardWitness board_witness(const std::vector<BoardView>& views, const PinholeIntrinsics& k,
                           const std::array<double, 5>& distortion);

}  // namespace bodyschema
