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
/// A column that lives in one block alone is not known without it: this share of the whole keeps it at zero.
constexpr double kAlone = 1e-7;
/// Of a block's mean information on a column.
constexpr double kLittle = 1e-3;
/// Columns whose sum is smaller, in standard deviations, are no finding however blocks weigh.
constexpr double kStandsOut = 2.0;
/// Weights follow from what a fit leaves, and the fit from the weights.
constexpr int kRounds = 2;

Eigen::MatrixXd symmetric_inverse(const Eigen::MatrixXd& S) {
  return S.ldlt().solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()));
}

/// With so much on the diagonal that columns which say the same do not stop a fit.
Eigen::MatrixXd stiffened(Eigen::MatrixXd H) {
  H.diagonal() *= 1.0 + kRounding;
  H.diagonal().array() += 1e-300;
  return H;
}

/// Weights of blocks in the fit of one column: 1 for those whose own noise says all of how they differ.
/// @param u, share  each block's score and information
Eigen::RowVectorXd even_weights(const Eigen::RowVectorXd& u, const Eigen::RowVectorXd& share) {
  const double whole = share.sum();
  if (whole <= 0.0) return Eigen::RowVectorXd::Ones(share.size());
  const double n = static_cast<double>(share.size());
  // What hardly knows the column says nothing of how blocks differ.
  const double least = kLittle * whole / n;
  const double best = u.sum() / whole;
  const double q = ((u - best * share).array().square() / (share.array() + least)).sum();
  const double between = std::max(0.0, q - (n - 1.0)) / std::max(1e-300, whole - share.squaredNorm() / whole);
  return (1.0 + between * share.array()).inverse().matrix();
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
  double largest = 0.0;
  for (Eigen::Index i = 0; i < even_t.size(); ++i) {
    const double n = even_dof[i];
    largest =
        std::max(largest, (8.0 * n + 1.0) / (8.0 * n + 3.0) * std::sqrt(n * std::log1p(even_t[i] * even_t[i] / n)));
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
  return std::move(score(std::span(&added, 1)).front());
}

std::vector<Scores> BlockRegression::score(std::span<const AddedColumns> list, bool evenly) const {
  std::vector<const AddedColumns*> pointers;
  for (const auto& added : list) pointers.push_back(&added);
  return score(std::span<const AddedColumns* const>(pointers), evenly);
}

std::vector<Scores> BlockRegression::score(std::span<const AddedColumns* const> list, bool evenly) const {
  Eigen::Index columns = 0;
  for (const auto* added : list) columns += added->size();
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(size(), columns);
  Eigen::Index first = 0;
  for (const auto* added : list) {
    for (const auto& own : added->B) B.middleCols(first, added->size()) += own;
    first += added->size();
  }
  // Products of all columns at once: they are most of the work.
  const Eigen::MatrixXd Y = total_.solve(B);
  Eigen::MatrixXd quadratic(columns, static_cast<Eigen::Index>(blocks_.size())), HY;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    HY.noalias() = blocks_[b].H * Y;
    quadratic.col(static_cast<Eigen::Index>(b)) = Y.cwiseProduct(HY).colwise().sum().transpose();
  }
  std::vector<Scores> result;
  first = 0;
  for (const auto* added : list) {
    result.push_back(
        score(*added, Y.middleCols(first, added->size()), quadratic.middleRows(first, added->size()), evenly));
    first += added->size();
  }
  return result;
}

Scores BlockRegression::score(const AddedColumns& added, const Eigen::MatrixXd& Y, const Eigen::MatrixXd& quadratic,
                              bool evenly) const {
  const auto k = added.size();
  const auto n = static_cast<Eigen::Index>(blocks_.size());
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(size(), k), C = Eigen::MatrixXd::Zero(k, k);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    B += added.B[b];
    C += added.C[b];
  }
  Scores s;
  s.Y = Y;
  s.S = C - B.transpose() * s.Y;
  s.u.resize(k, n);
  Eigen::MatrixXd share(k, n);  // of the information
  for (Eigen::Index b = 0; b < n; ++b) {
    const auto at = static_cast<std::size_t>(b);
    s.u.col(b) = added.d[at] - added.B[at].transpose() * step_ - s.Y.transpose() * left_[at];
    for (Eigen::Index i = 0; i < k; ++i) {
      share(i, b) = added.C[at](i, i) - 2.0 * s.Y.col(i).dot(added.B[at].col(i)) + quadratic(i, b);
    }
  }
  s.beliefs = -s.Y.transpose() * precision_.cwiseSqrt().asDiagonal();
  s.total = s.u.rowwise().sum() - s.Y.transpose() * (pull_ - precision_.cwiseProduct(step_));
  s.independent = s.S.diagonal().cwiseQuotient(C.diagonal().cwiseMax(1e-300)).cwiseMax(0.0);
  s.sd.resize(k);
  s.dof.resize(k);
  s.even_t.resize(k);
  s.even_dof.resize(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const double best = s.total[i] / std::max(1e-300, s.S(i, i));
    const double whole = share.row(i).cwiseMax(0.0).sum();
    const double carriers = whole > 0.0 ? whole * whole / share.row(i).squaredNorm() : 1.0;
    s.dof[i] = std::max(0.5, carriers - 1.0);
    const double scatter = (s.u.row(i) - best * share.row(i)).squaredNorm() * (s.dof[i] + 1.0) / s.dof[i];
    // Never less than white noise has.
    s.sd[i] = std::sqrt(std::max(scatter, whole) + s.beliefs.row(i).squaredNorm());
    s.even_t[i] = s.total[i] / std::max(1e-300, s.sd[i]);
    s.even_dof[i] = s.dof[i];
    if (!evenly || std::abs(s.even_t[i]) < kStandsOut) continue;
    Weighed even{s.u.row(i), share.row(i).cwiseMax(0.0)};
    for (int round = 0; round < kRounds; ++round) even = weigh(added, i, even_weights(even.u, even.share));
    s.even_t[i] = even.t;
    s.even_dof[i] = even.dof;
  }
  return s;
}

BlockRegression::Weighed BlockRegression::weigh(const AddedColumns& added, Eigen::Index column,
                                                const Eigen::RowVectorXd& weight) const {
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size(), size());
  Eigen::VectorXd g = pull_, B = Eigen::VectorXd::Zero(size());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const double w = weight[static_cast<Eigen::Index>(b)];
    H += w * blocks_[b].H;
    g += w * blocks_[b].g;
    B += w * added.B[b].col(column);
  }
  H.diagonal() += precision_;
  const Eigen::LDLT<Eigen::MatrixXd> fit(stiffened(std::move(H)));
  const Eigen::VectorXd step = fit.solve(g), Y = fit.solve(B);
  Weighed result{Eigen::RowVectorXd(weight.size()), Eigen::RowVectorXd(weight.size())};
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto at = static_cast<Eigen::Index>(b);
    const Eigen::VectorXd HY = blocks_[b].H * Y, own = added.B[b].col(column);
    result.u[at] = added.d[b][column] - own.dot(step) - Y.dot(blocks_[b].g) + HY.dot(step);
    result.share[at] = std::max(0.0, added.C[b](column, column) - 2.0 * Y.dot(own) + Y.dot(HY));
  }
  const Eigen::RowVectorXd u = weight.cwiseProduct(result.u), share = weight.cwiseProduct(result.share);
  const double sum = u.sum() - Y.dot(pull_ - precision_.cwiseProduct(step)), whole = share.sum();
  if (whole <= 0.0) return result;
  result.dof = std::max(0.5, whole * whole / share.squaredNorm() - 1.0);
  const double scatter = (u - sum / whole * share).squaredNorm() * (result.dof + 1.0) / result.dof;
  const double white = weight.dot(share), of_beliefs = Y.cwiseProduct(precision_.cwiseSqrt()).squaredNorm();
  result.t = sum / std::sqrt(std::max(scatter, white) + of_beliefs);
  return result;
}

const std::vector<BlockRegression::Rest>& BlockRegression::rests() const {
  if (!rests_.empty()) return rests_;
  Eigen::MatrixXd total = H_;
  total.diagonal() += precision_;
  Eigen::VectorXd g = pull_;
  for (const auto& block : blocks_) g += block.g;
  for (const auto& block : blocks_) {
    Eigen::MatrixXd H = total - block.H;
    H.diagonal() += kAlone * total.diagonal();
    auto& rest = rests_.emplace_back();
    rest.H.compute(stiffened(std::move(H)));
    rest.x = rest.H.solve(g - block.g);
  }
  return rests_;
}

Heldout BlockRegression::heldout(const AddedColumns& added) const {
  const auto n = size(), k = added.size();
  const auto count = static_cast<Eigen::Index>(blocks_.size());
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(n, k), C = Eigen::MatrixXd::Zero(k, k);
  Eigen::VectorXd d = Eigen::VectorXd::Zero(k);
  for (std::size_t b = 0; k > 0 && b < blocks_.size(); ++b) {
    B += added.B[b];
    C += added.C[b];
    d += added.d[b];
  }
  const Eigen::VectorXd alone = kAlone * C.diagonal();
  // Both together, the base eliminated.
  Eigen::VectorXd x(n + k);
  const auto solve = [&](const Eigen::LDLT<Eigen::MatrixXd>& base, const Eigen::VectorXd& base_x,
                         const Eigen::MatrixXd& cross, Eigen::MatrixXd own, const Eigen::VectorXd& gradient) {
    x.head(n) = base_x;
    if (k == 0) return;
    const Eigen::MatrixXd Y = base.solve(cross);
    own = stiffened(std::move(own));
    own.noalias() -= cross.transpose() * Y;
    x.tail(k) = own.ldlt().solve(gradient - cross.transpose() * base_x);
    x.head(n) -= Y * x.tail(k);
  };
  Heldout result;
  solve(total_, step_, B, C, d);
  result.estimate = x;
  result.loss.resize(count);
  result.replicas.resize(n + k, count);
  for (Eigen::Index b = 0; b < count; ++b) {
    const auto at = static_cast<std::size_t>(b);
    const auto& block = blocks_[at];
    const auto& rest = rests()[at];
    if (k == 0) {
      solve(rest.H, rest.x, B, C, d);
    } else {
      Eigen::MatrixXd own = C - added.C[at];
      own.diagonal() += alone;
      solve(rest.H, rest.x, B - added.B[at], std::move(own), d - added.d[at]);
    }
    result.replicas.col(b) = x;
    const auto of_base = x.head(n), of_added = x.tail(k);
    result.loss[b] = block.square - 2.0 * of_base.dot(block.g) + of_base.dot(block.H * of_base);
    if (k == 0) continue;
    result.loss[b] +=
        of_added.dot(added.C[at] * of_added) + 2.0 * of_added.dot(added.B[at].transpose() * of_base - added.d[at]);
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
  // A fit follows the blocks that know most, and what it leaves of them is too little: left out, each shows how it errs
  // (jackknife).
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size(), size());
  for (const auto& rest : rests()) {
    const Eigen::VectorXd moved = rest.x - step_;
    covariance += moved * moved.transpose();
  }
  covariance /= blocks_factor(blocks_.size());
  covariance += Q * precision_.asDiagonal() * Q;
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
