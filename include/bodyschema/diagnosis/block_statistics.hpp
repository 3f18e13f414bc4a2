#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace bodyschema {

/// A column of the regression: a column of the normal equations, or that column switched on from
/// a block on (a joint offset that starts there is a slip).
struct Column {
  Eigen::Index index = 0;
  std::size_t from_block = 0;
  friend bool operator==(const Column&, const Column&) = default;
};
using Columns = std::vector<Column>;

/// A least-squares fit with its leave-one-block-out replicas.
struct BlockFit {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd replicas;      ///< one column per block: the estimate without that block
  Eigen::MatrixXd covariance;    ///< jackknife over blocks: honest under any noise within a block
  Eigen::VectorXd model_variance;///< diagonal of the inverse information (white noise)
  Eigen::VectorXd heldout_loss;  ///< per block: r'Wr of that block under the fit without it
  double loss = 0.0;             ///< in the sample
  bool usable = false;           ///< false: the columns are not independent
  [[nodiscard]] double heldout() const { return heldout_loss.sum(); }
};

/// Normal equations of all columns, block by block. Everything that the diagnosis decides (fits,
/// errors, held-out losses) follows from these alone, in microseconds.
class BlockStatistics {
 public:
  struct Block {
    Eigen::MatrixXd information;  ///< columns x columns
    Eigen::VectorXd vector;
    double square = 0.0;
    double weight = 0.0;
  };
  explicit BlockStatistics(std::vector<Block> blocks) : blocks_(std::move(blocks)) {}
  [[nodiscard]] std::size_t block_count() const { return blocks_.size(); }
  [[nodiscard]] std::span<const Block> blocks() const { return blocks_; }

  /// @param group  blocks left out at a time: with more, what is held out lies further in time from
  ///        what the fit has seen
  [[nodiscard]] BlockFit fit(const Columns& columns, std::size_t group = 1) const;
  /// r'Wr per block with given values of the columns.
  [[nodiscard]] Eigen::VectorXd loss(const Columns& columns,
                                     const Eigen::Ref<const Eigen::VectorXd>& values) const;

 private:
  std::vector<Block> blocks_;
};

/// Mean over standard error of the paired differences per block; large: a is worse than b.
double paired_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// The z at which a chi-square of `dof` degrees is as unlikely as `wald`, up to the far tail.
double equivalent_z(double wald, Eigen::Index dof);

}  // namespace bodyschema
