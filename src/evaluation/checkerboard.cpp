#include "checkerboard.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>

#include "bodyschema/core/error.hpp"
#include "bodyschema/imports/csv_table.hpp"
#include "bodyschema/simulator/lens.hpp"

namespace bodyschema {
namespace {

using Corner = Eigen::Vector2d;

struct Lens {
  const PinholeIntrinsics& k;
  const std::array<double, 5>& d;
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& p_C) const {
    const Eigen::Vector2d x = simulator::bend(d, p_C.x() / p_C.z(), p_C.y() / p_C.z());
    return {k.fx * x.x() + k.cx, k.fy * x.y() + k.cy};
  }
  /// Ray of a pixel, z = 1: the distortion is small, so that what it did is taken back by repetition.
  [[nodiscard]] Eigen::Vector2d ray(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d seen((pixel.x() - k.cx) / k.fx, (pixel.y() - k.cy) / k.fy);
    Eigen::Vector2d x = seen;
    constexpr int kRounds = 20;
    for (int i = 0; i < kRounds; ++i) x += seen - simulator::bend(d, x.x(), x.y());
    return x;
  }
};

Pose moved(const Pose& X, const Eigen::Matrix<double, 6, 1>& step) {
  Pose result = X;
  result.translation() += step.head<3>();
  const Eigen::Vector3d w = step.tail<3>();
  if (w.norm() > 0.0) result.linear() = Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix() * X.linear();
  return result;
}

/// Gauss-Newton with numeric derivatives: few unknowns, smooth residuals.
/// @return the sum of squares at the end
double minimise(Eigen::VectorXd& x, const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals) {
  constexpr int kRounds = 60;
  constexpr double kStep = 1e-6;
  Eigen::VectorXd r = residuals(x);
  double damping = 1e-6;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd J(r.size(), x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Eigen::VectorXd there = x;
      there[i] += kStep;
      J.col(i) = (residuals(there) - r) / kStep;
    }
    Eigen::MatrixXd H = J.transpose() * J;
    H.diagonal() *= 1.0 + damping;
    const Eigen::VectorXd trial = x - H.ldlt().solve(J.transpose() * r);
    const Eigen::VectorXd left = residuals(trial);
    if (!(left.squaredNorm() < r.squaredNorm())) {
      damping = std::max(1e-4, 10.0 * damping);
      if (damping > 1e6) break;
      continue;
    }
    const double gained = r.squaredNorm() - left.squaredNorm();
    x = trial;
    r = left;
    damping *= 0.1;
    if (gained < 1e-10 * r.squaredNorm()) break;
  }
  return r.squaredNorm();
}

/// Where a board of this side stands, from the homography of its corners (Zhang 2000, section 3.1), not yet refined.
Pose by_homography(const BoardCorners& corners, const Lens& lens, double side_m) {
  const auto n = static_cast<Eigen::Index>(corners.board.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2 * n, 9);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector2d b = side_m * corners.board[static_cast<std::size_t>(i)];
    const Eigen::Vector2d x = lens.ray(corners.pixel[static_cast<std::size_t>(i)]);
    const Eigen::RowVector3d p(b.x(), b.y(), 1.0);
    A.block<1, 3>(2 * i, 0) = p;
    A.block<1, 3>(2 * i, 6) = -x.x() * p;
    A.block<1, 3>(2 * i + 1, 3) = p;
    A.block<1, 3>(2 * i + 1, 6) = -x.y() * p;
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeFullV);
  const Eigen::VectorXd h = svd.matrixV().col(8);
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  H /= 0.5 * (H.col(0).norm() + H.col(1).norm());
  if (H(2, 2) < 0.0) H = -H;
  Eigen::Matrix3d R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> nearest(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Pose X = Pose::Identity();
  X.linear() = nearest.matrixU() * nearest.matrixV().transpose();
  X.translation() = H.col(2);
  return X;
}

Eigen::Vector3d on_board(const Corner& corner, double side_m) {
  return {side_m * corner.x(), side_m * corner.y(), 0.0};
}

/// Residuals of one view's corners for a board at X_CB, appended.
void add_residuals(const BoardCorners& corners, const Lens& lens, const Pose& X_CB, double side_m,
                   Eigen::VectorXd& residuals, Eigen::Index& at) {
  for (std::size_t i = 0; i < corners.board.size(); ++i) {
    residuals.segment<2>(at) = lens.project(X_CB * on_board(corners.board[i], side_m)) - corners.pixel[i];
    at += 2;
  }
}

/// Rms distance from the mean of places, and rms angle from the mean of rotations.
std::pair<double, double> scatter(const std::vector<Pose>& poses, const Eigen::Vector3d& middle) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const auto& X : poses) {
    mean += X * middle / static_cast<double>(poses.size());
    sum += X.linear();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d R = svd.matrixU() * svd.matrixV().transpose();
  double square = 0.0, turn = 0.0;
  for (const auto& X : poses) {
    square += (X * middle - mean).squaredNorm();
    turn += std::pow(rotation_distance(R, X.linear()), 2);
  }
  const double n = static_cast<double>(poses.size());
  return {std::sqrt(square / n), std::sqrt(turn / n)};
}

}  // namespace

std::map<std::int64_t, BoardCorners> read_checkerboard(const std::filesystem::path& csv) {
  const CsvTable table = CsvTable::read(csv);
  if (table.bad.count > 0) throw FileError(table.bad.first);
  std::map<std::int64_t, BoardCorners> boards;
  for (const auto& row : table.rows) {
    const auto& value = row.values;
    const bool numbers = std::none_of(value.begin(), value.end(), [](double v) { return std::isnan(v); });
    if (value.size() != 5 || !numbers) throw FileError(table.where(row) + ": expected posture,column,row,u_px,v_px");
    auto& board = boards[static_cast<std::int64_t>(value[0])];
    board.board.emplace_back(value[1], value[2]);
    board.pixel.emplace_back(value[3], value[4]);
  }
  return boards;
}

BoardWitness board_witness(const std::vector<BoardView>& views, const PinholeIntrinsics& k,
                           const std::array<double, 5>& distortion) {
  constexpr double kGuess_m = 0.0115;  // of a square, where the search begins
  const Lens lens{k, distortion};
  Eigen::Index rows = 0;
  for (const auto& view : views) rows += 2 * static_cast<Eigen::Index>(view.corners->board.size());
  const Pose X_HB =
      views.front().X_camera_hand.inverse(Eigen::Isometry) * by_homography(*views.front().corners, lens, kGuess_m);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(7);
  x[6] = kGuess_m;
  const double square = minimise(x, [&](const Eigen::VectorXd& at) {
    Eigen::VectorXd residuals(rows);
    Eigen::Index row = 0;
    const Pose X = moved(X_HB, at.head<6>());
    for (const auto& view : views) add_residuals(*view.corners, lens, view.X_camera_hand * X, at[6], residuals, row);
    return residuals;
  });
  BoardWitness witness;
  witness.pictures = views.size();
  witness.rms_px = std::sqrt(square / (0.5 * static_cast<double>(rows)));
  witness.square_mm = 1e3 * x[6];

  std::vector<Pose> alone;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& corner : views.front().corners->board) {
    middle += on_board(corner, x[6]) / static_cast<double>(views.front().corners->board.size());
  }
  for (const auto& view : views) {
    const Pose start = by_homography(*view.corners, lens, x[6]);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(6);
    minimise(step, [&](const Eigen::VectorXd& at) {
      Eigen::VectorXd residuals(2 * static_cast<Eigen::Index>(view.corners->board.size()));
      Eigen::Index row = 0;
      add_residuals(*view.corners, lens, moved(start, at), x[6], residuals, row);
      return residuals;
    });
    alone.push_back(view.X_camera_hand.inverse(Eigen::Isometry) * moved(start, step));
  }
  const auto [mm, deg] = scatter(alone, middle);
  witness.scatter_mm = 1e3 * mm;
  witness.scatter_deg = deg * 180.0 / kPi;
  return witness;
}

}  // namespace bodyschema
