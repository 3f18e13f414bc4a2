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

/// Sum over a block of the product of two columns, each from where it begins.
double product(const BlockStatistics::Block& block, std::size_t b, const Column& i, const Column& j) {
  if (b < i.from_block || b < j.from_block) return 0.0;
  const std::size_t cell_i = b == i.from_block ? i.from_cell : 0;
  const std::size_t cell_j = b == j.from_block ? j.from_cell : 0;
  if (cell_i == 0 && cell_j == 0) return block.information(i.index, j.index);
  return cell_i >= cell_j ? block.tails[cell_i - 1].information(i.index, j.index)
                          : block.tails[cell_j - 1].information(j.index, i.index);
}

double score(const BlockStatistics::Block& block, std::size_t b, const Column& i) {
  if (b < i.from_block) return 0.0;
  const std::size_t cell = b == i.from_block ? i.from_cell : 0;
  return cell == 0 ? block.vector[i.index] : block.tails[cell - 1].vector[i.index];
}

void gather(const BlockStatistics::Block& block, std::size_t b, const Columns& columns, Normal& out) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  out.H.resize(n, n);
  out.g.resize(n);
  out.s = block.square;
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& ci = columns[static_cast<std::size_t>(i)];
    out.g[i] = score(block, b, ci);
    for (Eigen::Index j = 0; j <= i; ++j) {
      out.H(i, j) = out.H(j, i) = product(block, b, ci, columns[static_cast<std::size_t>(j)]);
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

/// Whether a column lives in the blocks left out alone. What is left of it then is no zero but the rounding of a
/// difference of sums.
bool gone(const Eigen::MatrixXd& rest, const Eigen::MatrixXd& total) {
  return (rest.diagonal().array() < kDependent * total.diagonal().array()).any();
}

/// False with fewer than two replicas.
bool jackknife(const std::vector<Eigen::VectorXd>& replicas, Eigen::MatrixXd& covariance) {
  if (replicas.size() < 2) return false;
  const double count = static_cast<double>(replicas.size());
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(replicas.front().size());
  for (const auto& replica : replicas) mean += replica / count;
  covariance.setZero(mean.size(), mean.size());
  for (const auto& replica : replicas) {
    covariance.noalias() += (count - 1.0) / count * (replica - mean) * (replica - mean).transpose();
  }
  return true;
}

}  // namespace

std::size_t BlockStatistics::seen_blocks(std::size_t group) const {
  std::size_t seen = 0;
  for (std::size_t first = 0; first < blocks_.size(); first += group) {
    const std::size_t last = std::min(first + group, blocks_.size());
    const auto of_group = blocks().subspan(first, last - first);
    seen += std::any_of(of_group.begin(), of_group.end(), [](const Block& block) { return block.weight > 0.0; });
  }
  return seen;
}

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
  Eigen::VectorXd x;
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
      if (gone(rest.H, total.H) || !solve(rest.H, rest.g, x)) return fit;
      replicas.push_back(x);
    }
    for (std::size_t b = first; b < last; ++b) {
      const auto k = static_cast<Eigen::Index>(b);
      fit.replicas.col(k) = x;
      fit.heldout_loss[k] = parts[b].s - 2.0 * x.dot(parts[b].g) + x.dot(parts[b].H * x);
    }
  }
  fit.usable = jackknife(replicas, fit.covariance);
  return fit;
}

Eigen::VectorXd BlockStatistics::heldout_with_prior(const Columns& columns, const Eigen::VectorXd& precision) const {
  const auto n = static_cast<Eigen::Index>(columns.size());
  std::vector<Normal> parts(blocks_.size());
  Normal total;
  total.H = precision.asDiagonal();
  total.g.setZero(n);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    gather(blocks_[b], b, columns, parts[b]);
    total.H += parts[b].H;
    total.g += parts[b].g;
  }
  Eigen::VectorXd loss(static_cast<Eigen::Index>(blocks_.size()));
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Eigen::VectorXd x = (total.H - parts[b].H).ldlt().solve(total.g - parts[b].g);
    loss[static_cast<Eigen::Index>(b)] = parts[b].s - 2.0 * x.dot(parts[b].g) + x.dot(parts[b].H * x);
  }
  return loss;
}

NestedFits::NestedFits(const BlockStatistics& statistics, const Columns& base, std::size_t group)
    : statistics_(statistics), base_(base), group_(group), base_fit_(statistics.fit(base, group)) {
  if (!base_fit_.usable || base.empty()) return;
  const auto blocks = statistics.blocks();
  Normal part;
  Eigen::MatrixXd H =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(base.size()), static_cast<Eigen::Index>(base.size()));
  Eigen::VectorXd g = Eigen::VectorXd::Zero(H.rows());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    gather(blocks[b], b, base, part);
    H += part.H;
    g += part.g;
    information_.push_back(part.H);
    vector_.push_back(part.g);
  }
  total_ = factorise(H, g, 0, 0);
  for (std::size_t first = 0; first < blocks.size(); first += group) {
    const std::size_t last = std::min(first + group, blocks.size());
    Eigen::MatrixXd rest_H = H;
    Eigen::VectorXd rest_g = g;
    double weight = 0.0;
    for (std::size_t b = first; b < last; ++b) {
      rest_H -= information_[b];
      rest_g -= vector_[b];
      weight += blocks[b].weight;
    }
    if (weight > 0.0) parts_.push_back(factorise(rest_H, rest_g, first, last));
  }
}

NestedFits::Part NestedFits::factorise(const Eigen::MatrixXd& information, const Eigen::VectorXd& vector,
                                       std::size_t first, std::size_t last) const {
  Part part;
  part.scale = information.diagonal().cwiseSqrt().cwiseInverse();
  part.factor.compute(part.scale.asDiagonal() * information * part.scale.asDiagonal());
  part.estimate = part.scale.asDiagonal() * part.factor.solve(part.scale.asDiagonal() * vector);
  part.first = first;
  part.last = last;
  return part;
}

BlockFit NestedFits::with(const Columns& more) const {
  BlockFit fit;
  if (!base_fit_.usable) return fit;
  const auto n = static_cast<Eigen::Index>(base_.size()), k = static_cast<Eigen::Index>(more.size());
  if (n == 0 || k == 0) {
    auto all = base_;
    all.insert(all.end(), more.begin(), more.end());
    return statistics_.fit(all, group_);
  }
  const auto blocks = statistics_.blocks();
  // Base against new columns, new against new, and the new columns' scores, block beside block.
  const auto count = static_cast<Eigen::Index>(blocks.size());
  Eigen::MatrixXd B(n, k * count), C(k, k * count), d(k, count);
  for (Eigen::Index b = 0; b < count; ++b) {
    const auto at = static_cast<std::size_t>(b);
    for (Eigen::Index j = 0; j < k; ++j) {
      const auto& column = more[static_cast<std::size_t>(j)];
      for (Eigen::Index i = 0; i < n; ++i) {
        B(i, b * k + j) = product(blocks[at], at, base_[static_cast<std::size_t>(i)], column);
      }
      for (Eigen::Index i = 0; i < k; ++i) {
        C(i, b * k + j) = product(blocks[at], at, more[static_cast<std::size_t>(i)], column);
      }
      d(j, b) = score(blocks[at], at, column);
    }
  }
  Eigen::MatrixXd all_B = Eigen::MatrixXd::Zero(n, k), all_C = Eigen::MatrixXd::Zero(k, k);
  for (Eigen::Index b = 0; b < count; ++b) {
    all_B += B.middleCols(b * k, k);
    all_C += C.middleCols(b * k, k);
  }
  const Eigen::VectorXd all_d = d.rowwise().sum();

  Eigen::MatrixXd rest_B, rest_C, Y, S;
  Eigen::VectorXd rest_d, x(n + k);
  // Solves one part with the new columns; leaves the Schur complement's factor in `schur`.
  Eigen::LLT<Eigen::MatrixXd> schur;
  Eigen::VectorXd scale;
  const auto solve_part = [&](const Part& part) {
    if (!(rest_C.diagonal().minCoeff() > 0.0) || gone(rest_C, all_C)) return false;
    Y = part.scale.asDiagonal() * part.factor.solve(part.scale.asDiagonal() * rest_B);
    scale = rest_C.diagonal().cwiseSqrt().cwiseInverse();
    S = scale.asDiagonal() * (rest_C - rest_B.transpose() * Y) * scale.asDiagonal();
    schur.compute(S);
    if (schur.info() != Eigen::Success || schur.matrixLLT().diagonal().cwiseAbs2().minCoeff() < kDependent) {
      return false;
    }
    x.tail(k) = scale.asDiagonal() * schur.solve(scale.asDiagonal() * (rest_d - rest_B.transpose() * part.estimate));
    x.head(n) = part.estimate - Y * x.tail(k);
    return true;
  };

  rest_B = all_B;
  rest_C = all_C;
  rest_d = all_d;
  if (!solve_part(total_)) return fit;
  fit.estimate = x;
  fit.independent = schur.matrixLLT().diagonal().cwiseAbs2().minCoeff();
  fit.loss = base_fit_.loss - x.tail(k).dot(all_d - all_B.transpose() * total_.estimate);
  const Eigen::MatrixXd inverse =
      scale.asDiagonal() * schur.solve(Eigen::MatrixXd::Identity(k, k)) * scale.asDiagonal();
  fit.model_variance.resize(n + k);
  fit.model_variance.head(n) = base_fit_.model_variance + (Y * inverse).cwiseProduct(Y).rowwise().sum();
  fit.model_variance.tail(k) = inverse.diagonal();

  fit.replicas = fit.estimate.replicate(1, count);
  std::vector<Eigen::VectorXd> replicas;
  replicas.reserve(parts_.size());
  for (const auto& part : parts_) {
    rest_B = all_B;
    rest_C = all_C;
    rest_d = all_d;
    for (std::size_t b = part.first; b < part.last; ++b) {
      const auto at = static_cast<Eigen::Index>(b);
      rest_B -= B.middleCols(at * k, k);
      rest_C -= C.middleCols(at * k, k);
      rest_d -= d.col(at);
    }
    if (!solve_part(part)) return fit;
    replicas.push_back(x);
    for (std::size_t b = part.first; b < part.last; ++b) fit.replicas.col(static_cast<Eigen::Index>(b)) = x;
  }
  fit.heldout_loss.resize(count);
  for (Eigen::Index b = 0; b < count; ++b) {
    const auto at = static_cast<std::size_t>(b);
    const auto head = fit.replicas.col(b).head(n), tail = fit.replicas.col(b).tail(k);
    fit.heldout_loss[b] = blocks[at].square - 2.0 * (head.dot(vector_[at]) + tail.dot(d.col(b))) +
                          head.dot(information_[at] * head) + 2.0 * head.dot(B.middleCols(b * k, k) * tail) +
                          tail.dot(C.middleCols(b * k, k) * tail);
  }
  fit.usable = jackknife(replicas, fit.covariance);
  return fit;
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
  const auto z = [k](double w) { return (std::cbrt(w / k) - (1.0 - 2.0 / (9.0 * k))) / std::sqrt(2.0 / (9.0 * k)); };
  constexpr double kJoin = 4.0;
  const double root = 1.0 - 2.0 / (9.0 * k) + kJoin * std::sqrt(2.0 / (9.0 * k));
  const double join = k * root * root * root;
  return wald <= join ? std::max(0.0, z(wald)) : kJoin * std::sqrt(wald / join);
}

double z_of_few(double z, std::size_t blocks, std::size_t usual) {
  if (blocks >= usual) return z;
  if (blocks < 2) return 0.0;
  const double few = static_cast<double>(blocks) - 1.0, many = static_cast<double>(usual) - 1.0;
  const auto shrink = [](double dof) { return (8.0 * dof + 1.0) / (8.0 * dof + 3.0); };
  const double normal = shrink(few) * std::sqrt(few * std::log1p(z * z / few)) / shrink(many);
  return std::min(z, std::sqrt(many * std::expm1(normal * normal / many)));
}

}  // namespace bodyschema
