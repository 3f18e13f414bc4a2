#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/block_statistics.hpp"

namespace bodyschema::test {

/// Rows of an ordinary regression y = X b, gathered into blocks of equal length.
inline BlockStatistics statistics_of(const Eigen::MatrixXd& X, const Eigen::VectorXd& y, Eigen::Index blocks) {
  std::vector<BlockStatistics::Block> list;
  const Eigen::Index n = X.rows() / blocks;
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const Eigen::MatrixXd x = X.middleRows(b * n, n);
    const Eigen::VectorXd r = y.segment(b * n, n);
    list.push_back({x.transpose() * x, x.transpose() * r, r.squaredNorm(), static_cast<double>(n)});
  }
  return BlockStatistics(std::move(list));
}

/// A block in which nothing was seen.
inline BlockStatistics::Block unseen_block(Eigen::Index columns) {
  return {Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns), 0.0, 0.0};
}

}  // namespace bodyschema::test
