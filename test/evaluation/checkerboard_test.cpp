#include "../../src/evaluation/checkerboard.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "bodyschema/core/error.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

constexpr double kSide_m = 0.012;
const PinholeIntrinsics kCamera{320, 240, 150.0, 150.0, 160.0, 120.0};
const std::array<double, 5> kLens = {-0.05, 0.0, 0.0, 0.0, 0.0};

Pose pose(const Eigen::Vector3d& place, const Eigen::Vector3d& turn) {
  Pose X = Pose::Identity();
  X.translation() = place;
  if (turn.norm() > 0.0) X.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  return X;
}

/// A board that is rigid with the hand in six views, and what the robot says of its hand there.
class Board : public ::testing::Test {
 protected:
  Board() {
    const Pose X_HB = pose({0.02, -0.05, 0.03}, {0.1, 0.2, -0.3});
    for (int i = 0; i < 6; ++i) {
      const Pose X_CH = pose({-0.1 + 0.04 * i, 0.02 * i, 0.4 + 0.02 * i}, {0.1 * i, -0.3 + 0.1 * i, 0.05 * i});
      BoardCorners corners;
      for (int row = 0; row < 6; ++row) {
        for (int column = 0; column < 9; ++column) {
          const Eigen::Vector3d p_C = X_CH * (X_HB * Eigen::Vector3d(kSide_m * column, kSide_m * row, 0.0));
          const Eigen::Vector2d x = p_C.head<2>() / p_C.z();
          corners.board.emplace_back(column, row);
          corners.pixel.push_back(Eigen::Vector2d(160.0, 120.0) + 150.0 * (1.0 + kLens[0] * x.squaredNorm()) * x);
        }
      }
      hands_.push_back(X_CH);
      corners_.push_back(std::move(corners));
    }
  }
  [[nodiscard]] BoardWitness witness(const std::array<double, 5>& lens = kLens) const {
    std::vector<BoardView> views;
    for (std::size_t i = 0; i < hands_.size(); ++i) views.push_back({hands_[i], &corners_[i]});
    return board_witness(views, kCamera, lens);
  }
  std::vector<Pose> hands_;
  std::vector<BoardCorners> corners_;
};

TEST_F(Board, FitsARobotThatIsRight) {
  const auto found = witness();
  EXPECT_EQ(found.pictures, 6u);
  EXPECT_LT(found.rms_px, 1e-3);
  EXPECT_LT(found.scatter_mm, 0.01);
  EXPECT_LT(found.scatter_deg, 0.01);
  EXPECT_NEAR(found.square_mm, 1e3 * kSide_m, 1e-3);
}

TEST_F(Board, ScattersWhereTheHandIsElsewhere) {
  // Two millimetres to and fro from view to view, more than a common error of board or side can make up for.
  for (std::size_t i = 0; i < hands_.size(); ++i) hands_[i].translation().x() += i % 2 == 0 ? 0.002 : -0.002;
  const auto found = witness();
  EXPECT_GT(found.rms_px, 0.3);
  EXPECT_NEAR(found.scatter_mm, 2.0, 0.3);
}

TEST_F(Board, RefutesAnotherLens) {
  EXPECT_GT(witness({0.2, 0.0, 0.0, 0.0, 0.0}).rms_px, 0.1);
}

TEST(Checkerboard, NamesTheLineThatIsWrong) {
  const fs::path file = fs::temp_directory_path() / ("checkerboard_" + std::to_string(getpid()) + ".csv");
  std::ofstream(file) << "posture,column,row,u_px,v_px\n3,0,1,10.5,20\n3,1,1,eleven,20\n";
  EXPECT_THAT([&] { (void)read_checkerboard(file); }, ::testing::ThrowsMessage<FileError>(::testing::HasSubstr(":3:")));
  std::ofstream(file) << "posture,column,row,u_px,v_px\n3,0,1,10.5,20\n";
  const auto boards = read_checkerboard(file);
  ASSERT_EQ(boards.count(3), 1u);
  EXPECT_EQ(boards.at(3).pixel.front(), Eigen::Vector2d(10.5, 20.0));
  EXPECT_EQ(boards.at(3).board.front(), Eigen::Vector2d(0.0, 1.0));
  fs::remove(file);
}

}  // namespace
}  // namespace bodyschema
