#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>
#include <vector>

namespace bodyschema::diagnosis {

/// Normal equations of one block of the log over the parameters of the base, about the base's fit; divided by the
/// variance of a residual, so that they are what a log likelihood is.
struct BaseBlock {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double square = 0.0;
};

/// Further columns: what a candidate would add, block by block.
struct AddedColumns {
  std::vector<Eigen::MatrixXd> B;  ///< base x added
  std::vector<Eigen::MatrixXd> C;  ///< added x added
  std::vector<Eigen::VectorXd> d;  ///< their gradients
  AddedColumns() = default;
  AddedColumns(std::size_t blocks, Eigen::Index base, Eigen::Index added);
  [[nodiscard]] Eigen::Index size() const { return d.empty() ? 0 : d.front().size(); }
  /// Some of them.
  [[nodiscard]] AddedColumns only(const std::vector<Eigen::Index>& columns) const;
};

/// What is left of added columns once the base has taken what it can explain; each column by itself.
struct Scores {
  Eigen::MatrixXd u;        ///< added x blocks: each block's say, with the column at zero
  Eigen::MatrixXd beliefs;  ///< added x base: what the beliefs about the base would add, per standard deviation
  Eigen::MatrixXd S;        ///< information left, added x added
  Eigen::MatrixXd Y;        ///< base x added: how the base makes up for them, with opposite sign
  Eigen::VectorXd total;    ///< sum of everything
  Eigen::VectorXd sd;       ///< of the total, from how blocks differ about the best value, and from the beliefs
  Eigen::VectorXd dof;      ///< blocks that carry the information, less one (Satterthwaite's count)
  /// Total over standard deviation, and blocks that carry it, where blocks weigh by how far they can be believed: each
  /// errs by its pictures' noise and by what the model gets wrong in its posture (random effects: DerSimonian and Laird
  /// 1986), so that no single one decides because it knows the column best. Of columns that hardly stand out: as above.
  Eigen::VectorXd even_t, even_dof;
  /// Share of each column that the base cannot make up for.
  Eigen::VectorXd independent;
  /// The total over its standard deviation.
  [[nodiscard]] Eigen::VectorXd t() const { return total.cwiseQuotient(sd.cwiseMax(1e-300)); }
  /// The largest |even_t|, as the normal variable that is as unlikely (Wallace's approximation, 1959).
  [[nodiscard]] double z() const;
  [[nodiscard]] Eigen::VectorXd estimate() const;
};

/// A fit's loss on blocks that it has not seen.
struct Heldout {
  Eigen::VectorXd loss;      ///< per block
  double beliefs = 0.0;      ///< what the whole fit departs from the beliefs, chi-square
  Eigen::MatrixXd replicas;  ///< (base + added) x blocks: estimates without each block
  Eigen::VectorXd estimate;
  [[nodiscard]] double total() const { return loss.sum() + beliefs; }
};

/// The base with its beliefs: everything that is decided follows from these sums. Leaving a block out is how honest any
/// of it is, whatever the noise within a block.
class BlockRegression {
 public:
  /// @param precision  of the beliefs about each parameter; 0: none
  /// @param away  of the fit from where the beliefs have their centre
  BlockRegression(std::vector<BaseBlock> blocks, Eigen::VectorXd precision, Eigen::VectorXd away);

  [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }
  [[nodiscard]] Eigen::Index size() const { return precision_.size(); }
  [[nodiscard]] const std::vector<BaseBlock>& parts() const { return blocks_; }
  [[nodiscard]] const Eigen::VectorXd& precision() const { return precision_; }
  [[nodiscard]] const Eigen::VectorXd& away() const { return away_; }
  /// From the linearisation to the optimum.
  [[nodiscard]] const Eigen::VectorXd& step() const { return step_; }
  [[nodiscard]] Scores score(const AddedColumns& added) const;
  /// Of several, each beside the base alone.
  /// @param evenly  false: `even_t` and `even_dof` stay as t() and `dof`, which is much quicker
  [[nodiscard]] std::vector<Scores> score(std::span<const AddedColumns> list, bool evenly = true) const;
  [[nodiscard]] std::vector<Scores> score(std::span<const AddedColumns* const> list, bool evenly = true) const;
  [[nodiscard]] Heldout heldout(const AddedColumns& added = {}) const;
  /// Covariance of the base's parameters from how blocks differ, never below that of white noise.
  [[nodiscard]] Eigen::MatrixXd covariance() const;
  /// Of added columns, given the base.
  [[nodiscard]] Eigen::MatrixXd covariance(const Scores& scores) const;

 private:
  /// The base without one block.
  struct Rest {
    Eigen::LDLT<Eigen::MatrixXd> H;
    Eigen::VectorXd x;  ///< its estimate
  };
  /// Found when first asked for, and kept: added columns are eliminated against them.
  [[nodiscard]] const std::vector<Rest>& rests() const;
  [[nodiscard]] Scores score(const AddedColumns& added, const Eigen::MatrixXd& Y, const Eigen::MatrixXd& quadratic,
                             bool evenly) const;
  /// One added column beside the base, fitted with weights of the blocks.
  struct Weighed {
    Eigen::RowVectorXd u, share;  ///< per block as in Scores, before they are weighed
    double t = 0.0, dof = 0.0;
  };
  [[nodiscard]] Weighed weigh(const AddedColumns& added, Eigen::Index column, const Eigen::RowVectorXd& weight) const;

  std::vector<BaseBlock> blocks_;
  Eigen::VectorXd precision_, away_, pull_;
  Eigen::MatrixXd H_;
  Eigen::LDLT<Eigen::MatrixXd> total_;
  Eigen::VectorXd step_;
  std::vector<Eigen::VectorXd> left_;  ///< per block: what its gradient is at the optimum
  mutable std::vector<Rest> rests_;    ///< per block
};

/// The |z| that the largest of all candidates exceeds by chance in a share `level` of logs: every block's say times a
/// random number, the same one for all candidates (wild bootstrap: Wu 1986; largest of all: Westfall and Young 1993).
/// Levels that so few draws do not tell follow from how many comparisons of their own the draws behave like.
double chance_threshold(const std::vector<Scores>& scores, double level, std::uint64_t seed);

/// How alike neighbouring blocks err: mean lag-one autocorrelation of the candidates' scores about their means.
double neighbours_alike(const std::vector<Scores>& scores);

/// Mean over standard error of the paired differences per block, a minus b; large: a is worse. Student's t.
double paired_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

}  // namespace bodyschema::diagnosis
