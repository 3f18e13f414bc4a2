#include "block_regression.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "bodyschema/evidence/distributions.hpp"

namespace bodyschema::diagnosis {
namespace {

/// So little of a column's own information left, and rounding says the rest.
constexpr double kRounding = 1e-9;

Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& S) {
  return S.ldlt().solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()));
}

/// With so much on the diagonal that columns which say the same do not stop a fit.
Eigen::MatrixXd stiffened(Eigen::MatrixXd H) {
  H.diagonal() *= 1.0 + kRounding;
  H.diagonal().array() += 1e-300;
  return H;
}

double blocks_factor(std::size_t blocks) {
  const double n = static_cast<double>(blocks);
  return n > 1.0 ? n / (n - 1.0) : 1.0;
}

}  // namespace

AddedColumns::AddedColumns(std::size_t blocks, Eigen::Index base, Eigen::Index added)
    : B(blocks, Eigen::MatrixXd::Zero(base, added)), C(blocks, Eigen::MatrixXd::Zero(added, added)),
      d(blocks, Eigen::VectorXd::Zero(added)) {}

AddedColumns AddedColumns::only(const std::vector<Eigen::Index>& columns) const {
  AddedColumns some;
  for (std::size_t b = 0; b < d.size(); ++b) {
    some.B.push_back(B[b](Eigen::all, columns));
    some.C.push_back(C[b](columns, columns));
    some.d.push_back(d[b](columns));
  }
  return some;
}

double Scores::z() const {
  const Eigen::VectorXd all = t();
  double largest = 0.0;
  for (Eigen::Index i = 0; i < all.size(); ++i) {
    const double n = dof[i];
    largest = std::max(largest, (8.0 * n + 1.0) / (8.0 * n + 3.0) * std::sqrt(n * std::log1p(all[i] * all[i] / n)));
  }
  return largest;
}

Eigen::VectorXd Scores::estimate() const {
  return stiffened(S).ldlt().solve(total);
}

BlockRegression::BlockRegression(std::vector<BaseBlock> blocks, Eigen::VectorXd precision, Eigen::VectorXd away)
    : blocks_(std::move(blocks)), precision_(std::move(precision)), away_(std::move(away)),
      pull_(-precision_.cwiseProduct(away_)), H_(Eigen::MatrixXd::Zero(precision_.size(), precision_.size())) {
  Eigen::VectorXd g = pull_;
  for (const auto& block : blocks_) {
    H_ += block.H;
    g += block.g;
  }
  Eigen::MatrixXd with_beliefs = H_;
  with_beliefs.diagonal() += precision_;
  total_.compute(stiffened(with_beliefs));
  step_ = total_.solve(g);
  for (const auto& block : blocks_) left_.push_back(block.g - block.H * step_);
}

Scores BlockRegression::score(const AddedColumns& added) const {
  const auto k = added.size();
  const auto n = static_cast<Eigen::Index>(blocks_.size());
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(size(), k), C = Eigen::MatrixXd::Zero(k, k);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    B += added.B[b];
    C += added.C[b];
  }
  Scores s;
  s.Y = total_.solve(B);
  s.S = C - B.transpose() * s.Y;
  s.u.resize(k, n);
  Eigen::MatrixXd share(k, n);  // of the information
  for (Eigen::Index b = 0; b < n; ++b) {
    const auto at = static_cast<std::size_t>(b);
    s.u.col(b) = added.d[at] - added.B[at].transpose() * step_ - s.Y.transpose() * left_[at];
    for (Eigen::Index i = 0; i < k; ++i) {
      const auto y = s.Y.col(i);
      share(i, b) = added.C[at](i, i) - 2.0 * y.dot(added.B[at].col(i)) + y.dot(blocks_[at].H * y);
    }
  }
  s.beliefs = -s.Y.transpose() * precision_.cwiseSqrt().asDiagonal();
  s.total = s.u.rowwise().sum() - s.Y.transpose() * (pull_ - precision_.cwiseProduct(step_));
  s.independent = s.S.diagonal().cwiseQuotient(C.diagonal().cwiseMax(1e-300)).cwiseMax(0.0);
  s.sd.resize(k);
  s.dof.resize(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const double best = s.total[i] / std::max(1e-300, s.S(i, i));
    const double whole = share.row(i).cwiseMax(0.0).sum();
    const double carriers = whole > 0.0 ? whole * whole / share.row(i).squaredNorm() : 1.0;
    s.dof[i] = std::max(0.5, carriers - 1.0);
    const double scatter = (s.u.row(i) - best * share.row(i)).squaredNorm() * (s.dof[i] + 1.0) / s.dof[i];
    // Never less than white noise has.
    s.sd[i] = std::sqrt(std::max(scatter, whole) + s.beliefs.row(i).squaredNorm());
  }
  return s;
}

Heldout BlockRegression::heldout(const AddedColumns& added) const {
  const auto n = size(), k = added.size();
  const auto count = static_cast<Eigen::Index>(blocks_.size());
  const auto part = [&](std::size_t b, Eigen::MatrixXd& H, Eigen::VectorXd& g) {
    H.resize(n + k, n + k);
    g.resize(n + k);
    H.topLeftCorner(n, n) = blocks_[b].H;
    g.head(n) = blocks_[b].g;
    if (k == 0) return;
    H.topRightCorner(n, k) = added.B[b];
    H.bottomLeftCorner(k, n) = added.B[b].transpose();
    H.bottomRightCorner(k, k) = added.C[b];
    g.tail(k) = added.d[b];
  };
  Eigen::MatrixXd H, total = Eigen::MatrixXd::Zero(n + k, n + k);
  Eigen::VectorXd g, vector = Eigen::VectorXd::Zero(n + k);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    part(b, H, g);
    total += H;
    vector += g;
  }
  total.diagonal().head(n) += precision_;
  vector.head(n) += pull_;
  Heldout result;
  result.estimate = stiffened(total).ldlt().solve(vector);
  result.loss.resize(count);
  result.replicas.resize(n + k, count);
  for (Eigen::Index b = 0; b < count; ++b) {
    part(static_cast<std::size_t>(b), H, g);
    Eigen::MatrixXd rest = total - H;
    // A column that lives in this block alone is not known without it: it stays at zero.
    rest.diagonal() += 1e-7 * total.diagonal();
    const Eigen::VectorXd x = stiffened(std::move(rest)).ldlt().solve(vector - g);
    result.replicas.col(b) = x;
    result.loss[b] = blocks_[static_cast<std::size_t>(b)].square - 2.0 * x.dot(g) + x.dot(H * x);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (precision_[i] <= 0.0) continue;
    const double off = result.estimate[i] + away_[i];
    result.beliefs += precision_[i] * off * off;
  }
  return result;
}

Eigen::MatrixXd BlockRegression::covariance() const {
  Eigen::MatrixXd with_beliefs = H_;
  with_beliefs.diagonal() += precision_;
  const Eigen::MatrixXd Q = symmetric_inverse(stiffened(with_beliefs));
  Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(size(), size());
  for (const auto& u : left_) meat += u * u.transpose();
  meat *= blocks_factor(blocks_.size());
  meat.diagonal() += precision_;
  Eigen::MatrixXd covariance = Q * meat * Q;
  for (Eigen::Index i = 0; i < size(); ++i) {
    const double least = Q(i, i), own = covariance(i, i);
    if (own >= least) continue;
    if (own <= 0.0) {
      covariance(i, i) = least;
      continue;
    }
    covariance.row(i) *= std::sqrt(least / own);
    covariance.col(i) *= std::sqrt(least / own);
  }
  return covariance;
}

Eigen::MatrixXd BlockRegression::covariance(const Scores& scores) const {
  const Eigen::MatrixXd Q = symmetric_inverse(stiffened(scores.S));
  const Eigen::MatrixXd meat =
      blocks_factor(blocks_.size()) * scores.u * scores.u.transpose() + scores.beliefs * scores.beliefs.transpose();
  Eigen::MatrixXd covariance = Q * meat * Q;
  covariance.diagonal() = covariance.diagonal().cwiseMax(Q.diagonal());
  return covariance;
}

double chance_threshold(const std::vector<Scores>& scores, double level, std::uint64_t seed) {
  constexpr int kDraws = 1000;
  Eigen::Index rows = 0;
  for (const auto& s : scores) rows += s.u.rows();
  if (rows == 0) return 0.0;
  const auto blocks = scores.front().u.cols(), beliefs = scores.front().beliefs.cols();
  Eigen::MatrixXf all(rows, blocks + beliefs);
  Eigen::Index row = 0;
  for (const auto& s : scores) {
    for (Eigen::Index i = 0; i < s.u.rows(); ++i, ++row) {
      const double length = std::sqrt(s.u.row(i).squaredNorm() + s.beliefs.row(i).squaredNorm());
      const double scale = length > 0.0 ? 1.0 / length : 0.0;
      all.row(row).head(blocks) = (scale * s.u.row(i)).cast<float>();
      all.row(row).tail(beliefs) = (scale * s.beliefs.row(i)).cast<float>();
    }
  }
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  const Eigen::MatrixXf draws = Eigen::MatrixXf::NullaryExpr(blocks + beliefs, kDraws, [&] { return normal(random); });
  std::vector<float> largest(kDraws, 0.0f);
  constexpr Eigen::Index kAtOnce = 512;
  for (Eigen::Index first = 0; first < rows; first += kAtOnce) {
    const Eigen::MatrixXf t = all.middleRows(first, std::min(kAtOnce, rows - first)) * draws;
    for (int f = 0; f < kDraws; ++f) {
      auto& most = largest[static_cast<std::size_t>(f)];
      most = std::max(most, t.col(f).cwiseAbs().maxCoeff());
    }
  }
  std::sort(largest.begin(), largest.end());
  const auto exceeded = [&](double share) {
    const auto at = static_cast<std::size_t>(std::ceil((1.0 - share) * kDraws));
    return static_cast<double>(largest[std::min<std::size_t>(at, kDraws - 1)]);
  };
  constexpr double kTold = 10.0 / kDraws;  // ten of them lie beyond
  if (level >= kTold) return exceeded(level);
  const double comparisons = kTold / normal_tail(exceeded(kTold));
  return normal_quantile(level / comparisons);
}

double neighbours_alike(const std::vector<Scores>& scores) {
  double sum = 0.0, count = 0.0;
  for (const auto& s : scores) {
    for (Eigen::Index i = 0; i < s.u.rows(); ++i) {
      const Eigen::RowVectorXd u = s.u.row(i).array() - s.u.row(i).mean();
      const double square = u.squaredNorm();
      if (square <= 0.0 || u.size() < 3) continue;
      sum += u.head(u.size() - 1).dot(u.tail(u.size() - 1)) / square;
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

double paired_t(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd d = a - b;
  const double n = static_cast<double>(d.size());
  if (n < 2) return 0.0;
  const double mean = d.mean();
  const double variance = (d.array() - mean).square().sum() / (n - 1.0);
  return variance > 0.0 ? mean / std::sqrt(variance / n) : 0.0;
}

}  // namespace bodyschema::diagnosis
