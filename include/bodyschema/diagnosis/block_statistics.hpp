#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>
#include <vector>

namespace bodyschema {

/// A column of the regression: a column of the normal equations, or that column switched on from
/// a block on, or from a cell within that block on (a joint offset that starts there is a slip).
struct Column {
  Eigen::Index index = 0;
  std::size_t from_block = 0;
  std::size_t from_cell = 0;
  friend bool operator==(const Column&, const Column&) = default;
};
using Columns = std::vector<Column>;

/// A least-squares fit with its leave-one-block-out replicas.
struct BlockFit {
  Eigen::VectorXd estimate;
  Eigen::MatrixXd replicas;        ///< one column per block: the estimate without that block
  Eigen::MatrixXd covariance;      ///< jackknife over blocks: honest under any noise within a block
  Eigen::VectorXd model_variance;  ///< diagonal of the inverse information (white noise)
  Eigen::VectorXd heldout_loss;    ///< per block: r'Wr of that block under the fit without it
  double loss = 0.0;               ///< in the sample
  /// Of NestedFits: share of the added columns that the others cannot make up for, at the least.
  double independent = 1.0;
  bool usable = false;  ///< false: the columns are not independent
  [[nodiscard]] double heldout() const { return heldout_loss.sum(); }
};

/// Normal equations of all columns, block by block. Everything that the diagnosis decides (fits,
/// errors, held-out losses) follows from these alone, in microseconds.
class BlockStatistics {
 public:
  /// A block from its second, third.. cell to its end, for columns that begin there: the first few
  /// columns alone can be switched.
  struct Tail {
    Eigen::MatrixXd information;  ///< switchable columns x columns
    Eigen::VectorXd vector;       ///< of the switchable columns
  };
  struct Block {
    Eigen::MatrixXd information;  ///< columns x columns
    Eigen::VectorXd vector;
    double square = 0.0;
    double weight = 0.0;
    std::vector<Tail> tails{};
  };
  explicit BlockStatistics(std::vector<Block> blocks) : blocks_(std::move(blocks)) {}
  [[nodiscard]] std::size_t block_count() const { return blocks_.size(); }
  [[nodiscard]] std::span<const Block> blocks() const { return blocks_; }
  /// Blocks, or groups of so many, in which anything was seen: the replicas of a fit, on which every standard
  /// error rests.
  [[nodiscard]] std::size_t seen_blocks(std::size_t group = 1) const;

  /// @param group  blocks left out at a time: with more, what is held out lies further in time from
  ///        what the fit has seen
  [[nodiscard]] BlockFit fit(const Columns& columns, std::size_t group = 1) const;
  /// Held-out loss per block of a fit whose columns are drawn to zero: adds precision x^2 for each.
  /// With precisions above zero columns need not be independent.
  [[nodiscard]] Eigen::VectorXd heldout_with_prior(const Columns& columns, const Eigen::VectorXd& precision) const;

 private:
  std::vector<Block> blocks_;
};

/// A fit to which further columns are added, one set after another, at a small part of the cost of
/// fitting anew: the base is factorised once (block elimination, Schur complement).
class NestedFits {
 public:
  /// @param statistics  outlives this; other arguments as BlockStatistics::fit
  NestedFits(const BlockStatistics& statistics, const Columns& base, std::size_t group = 1);
  [[nodiscard]] const BlockFit& base() const { return base_fit_; }
  /// What statistics.fit(base + more, group) gives.
  [[nodiscard]] BlockFit with(const Columns& more) const;

 private:
  /// All blocks, or all but one group.
  struct Part {
    Eigen::LLT<Eigen::MatrixXd> factor;  ///< of the scaled information
    Eigen::VectorXd scale, estimate;
    std::size_t first = 0, last = 0;  ///< the blocks left out
  };
  [[nodiscard]] Part factorise(const Eigen::MatrixXd& information, const Eigen::VectorXd& vector, std::size_t first,
                               std::size_t last) const;

  const BlockStatistics& statistics_;
  Columns base_;
  std::size_t group_;
  BlockFit base_fit_;
  Part total_;
  std::vector<Part> parts_;                   ///< one per group that holds anything
  std::vector<Eigen::MatrixXd> information_;  ///< of the base, per block
  std::vector<Eigen::VectorXd> vector_;
};

/// Mean over standard error of the paired differences per block; large: a is worse than b.
double paired_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// The z at which a chi-square of `dof` degrees is as unlikely as `wald`, up to the far tail.
double equivalent_z(double wald, Eigen::Index dof);

/// What `z`, whose standard error comes from `blocks` blocks, is worth in a log of `usual` ones: there as
/// unlikely (Student's t; Wallace's approximation, 1959). Unchanged where there are as many or more.
double z_of_few(double z, std::size_t blocks, std::size_t usual);

}  // namespace bodyschema
