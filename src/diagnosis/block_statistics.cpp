#include "bodyschema/diagnosis/block_statistics.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// A column whose part outside the span of the others is below this share of itself carries no
/// information of its own.
constexpr double kDependent = 1e-7;

struct Normal {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  double s = 0.0;
};

void gather(const BlockStatistics::Block& block, std::size_t b, const Columns& columns, Normal& out) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  out.H.setZero(n, n);
  out.g.setZero(n);
  out.s = block.square;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& ci = columns[static_cast<std::size_t>(i)];
    if (b < ci.from_block) continue;
    out.g[i] = block.vector[ci.index];
    for (Eigen::Index j = 0; j <= i; ++j) {
      const auto& cj = columns[static_cast<std::size_t>(j)];
      if (b < cj.from_block) continue;
      out.H(i, j) = out.H(j, i) = block.information(ci.index, cj.index);
    }
  }
}

/// Cholesky after scaling to a unit diagonal; false when a column is dependent.
bool solve(const Eigen::MatrixXd& H, const Eigen::VectorXd& g, Eigen::VectorXd& x,
           Eigen::VectorXd* inverse_diagonal = nullptr) {
  const Eigen::VectorXd d = H.diagonal();
  if (!(d.minCoeff() > 0.0)) return false;
  const Eigen::VectorXd scale = d.cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> llt(scale.asDiagonal() * H * scale.asDiagonal());
  if (llt.info() != Eigen::Success) return false;
  if (llt.matrixLLT().diagonal().cwiseAbs2().minCoeff() < kDependent) return false;
  x = scale.asDiagonal() * llt.solve(scale.asDiagonal() * g);
  if (inverse_diagonal != nullptr) {
    const Eigen::MatrixXd inverse = llt.solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
    *inverse_diagonal = inverse.diagonal().cwiseProduct(scale.cwiseAbs2());
  }
  return true;
}

}  // namespace

BlockFit BlockStatistics::fit(const Columns& columns, std::size_t group) const {
  const auto n = static_cast<Eigen::Index>(columns.size());
  const auto blocks = static_cast<Eigen::Index>(blocks_.size());
  std::vector<Normal> parts(blocks_.size());
  Normal total;
  total.H.setZero(n, n);
  total.g.setZero(n);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    gather(blocks_[b], b, columns, parts[b]);
    total.H += parts[b].H;
    total.g += parts[b].g;
    total.s += parts[b].s;
  }
  BlockFit fit;
  fit.replicas.resize(n, blocks);
  fit.heldout_loss.setZero(blocks);
  if (n == 0) {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      fit.heldout_loss[static_cast<Eigen::Index>(b)] = parts[b].s;
    }
    fit.loss = total.s;
    fit.usable = true;
    return fit;
  }
  if (!solve(total.H, total.g, fit.estimate, &fit.model_variance)) return fit;
  fit.loss = total.s - fit.estimate.dot(total.g);
  Eigen::VectorXd x, mean = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::VectorXd> replicas;
  for (std::size_t first = 0; first < blocks_.size(); first += group) {
    const std::size_t last = std::min(first + group, blocks_.size());
    Normal rest = total;
    double weight = 0.0;
    for (std::size_t b = first; b < last; ++b) {
      rest.H -= parts[b].H;
      rest.g -= parts[b].g;
      weight += blocks_[b].weight;
    }
    if (weight <= 0.0) {
      x = fit.estimate;  // nothing seen here: leaving it out changes nothing
    } else {
      // A column that lives in one group alone cannot be predicted for that group: not usable.
      if (!solve(rest.H, rest.g, x)) return fit;
      replicas.push_back(x);
      mean += x;
    }
    for (std::size_t b = first; b < last; ++b) {
      const auto k = static_cast<Eigen::Index>(b);
      fit.replicas.col(k) = x;
      fit.heldout_loss[k] = parts[b].s - 2.0 * x.dot(parts[b].g) + x.dot(parts[b].H * x);
    }
  }
  const double count = static_cast<double>(replicas.size());
  if (count < 2.0) return fit;
  mean /= count;
  fit.covariance.setZero(n, n);
  for (const auto& replica : replicas) {
    fit.covariance += (count - 1.0) / count * (replica - mean) * (replica - mean).transpose();
  }
  fit.usable = true;
  return fit;
}

Eigen::VectorXd BlockStatistics::loss(const Columns& columns,
                                      const Eigen::Ref<const Eigen::VectorXd>& values) const {
  Eigen::VectorXd loss(static_cast<Eigen::Index>(blocks_.size()));
  Normal part;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    gather(blocks_[b], b, columns, part);
    loss[static_cast<Eigen::Index>(b)] =
        part.s - 2.0 * values.dot(part.g) + values.dot(part.H * values);
  }
  return loss;
}

double paired_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd d = a - b;
  const double n = static_cast<double>(d.size());
  if (n < 2) return 0.0;
  const double mean = d.mean();
  const double variance = (d.array() - mean).square().sum() / (n - 1.0);
  return variance > 0.0 ? mean / std::sqrt(variance / n) : 0.0;
}

double equivalent_z(double wald, Eigen::Index dof) {
  if (dof <= 1) return std::sqrt(std::max(0.0, wald));
  // Wilson and Hilferty's cube root makes chi-square normal; past z = 4 it falls behind, so the tail
  // is continued in proportion to sqrt(wald), which is exact for one degree of freedom.
  const double k = static_cast<double>(dof);
  const auto z = [k](double w) {
    return (std::cbrt(w / k) - (1.0 - 2.0 / (9.0 * k))) / std::sqrt(2.0 / (9.0 * k));
  };
  constexpr double kJoin = 4.0;
  const double root = 1.0 - 2.0 / (9.0 * k) + kJoin * std::sqrt(2.0 / (9.0 * k));
  const double join = k * root * root * root;
  return wald <= join ? std::max(0.0, z(wald)) : kJoin * std::sqrt(wald / join);
}

}  // namespace bodyschema
