#include "bodyschema/evidence/posture_memory.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

/// A direction of which a piece says less than this, in units of what was believed of it, is not told by it.
constexpr double kLeastTold = 0.1;
/// Of what is believed of effects: heavy enough for a description that is plainly wrong, near a normal distribution
/// where it is not.
constexpr double kStudent_dof = 4.0;
/// Postures that must have been seen before beliefs give way: one or two are fitted as well to some other outline, and
/// what is believed is all that speaks against it.
constexpr std::size_t kLeastPostures = 3;
/// Blocks after which the dispersion has forgotten one.
constexpr double kRecentBlocks = 12.0;
/// Physical. rad; a joint whose encoder says nothing may be this far from where it was last: it has a range of motion.
constexpr double kAnywhere_rad = 1.5;

bool among(std::span<const Eigen::Index> list, Eigen::Index joint) {
  return std::find(list.begin(), list.end(), joint) != list.end();
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& A) {
  return A.ldlt().solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
}

}  // namespace

PostureMemory::PostureMemory(MemoryLayout layout, const MemoryOptions& options)
    : layout_(std::move(layout)), options_(options), widening_(Eigen::VectorXd::Ones(layout_.estimated())) {
  arm_error_.variance = head_error_.variance = std::pow(options.posture_sd_rad, 2);
}

bool PostureMemory::is_head(Eigen::Index joint) const {
  return !layout_.is_head.empty() && layout_.is_head[static_cast<std::size_t>(joint)];
}

double PostureMemory::posture_variance(bool head) const {
  return std::max((head ? head_error_ : arm_error_).variance, std::pow(options_.encoder_sd_rad, 2));
}

/// What a posture gets wrong in one joint's angle.
double PostureMemory::own_variance(Eigen::Index joint, std::span<const Eigen::Index> loose) const {
  if (among(loose, joint)) return std::pow(kAnywhere_rad, 2);
  return posture_variance(is_head(joint));
}

/// The pictures see x + e with e the posture's own error, N(0, R): marginalised, A becomes (I + A R)^-1 A.
Quadratic PostureMemory::with_posture_error(const Quadratic& block, std::span<const Eigen::Index> loose) const {
  Eigen::MatrixXd damping = Eigen::MatrixXd::Identity(block.A.rows(), block.A.cols());
  for (std::size_t i = 0; i < layout_.is_joint.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (layout_.is_joint[i]) damping.col(k) += own_variance(k, loose) * block.A.col(k);
  }
  const Eigen::PartialPivLU<Eigen::MatrixXd> lu(damping);
  Quadratic result{lu.solve(block.A), lu.solve(block.b)};
  result.A = 0.5 * (result.A + result.A.transpose()).eval();
  return result;
}

Quadratic PostureMemory::of_pictures() const {
  Quadratic total = Quadratic::zero(layout_.size());
  const auto kept = [&](double then_s) { return std::exp(-std::max(0.0, now_s_ - then_s) / options_.memory_s); };
  if (old_) total.add(*old_, kept(old_s_));
  for (const auto& block : blocks_) {
    total.add(with_posture_error(block.pictures, block.loose), kept(block.end_s));
  }
  return total;
}

/// What is believed, as wide as it was found to be.
Quadratic PostureMemory::prior() const {
  Quadratic result = Quadratic::zero(layout_.size());
  const Eigen::VectorXd precision = layout_.prior_sd.cwiseProduct(widening_).array().square().inverse();
  result.A.diagonal().head(layout_.estimated()) = precision;
  result.b.head(layout_.estimated()) = precision.cwiseProduct(layout_.prior_mean);
  return result;
}

Quadratic PostureMemory::sum() const {
  (void)estimate();  // finds how wide the prior is
  Quadratic total = of_pictures();
  total.add(prior());
  return total;
}

/// One step of expectation and maximisation: the expected weight of a Student t distribution, whose inverse is the
/// square of the widening.
Eigen::VectorXd PostureMemory::wider(const MemoryEstimate& estimate) const {
  const Eigen::VectorXd square = ((estimate.x - layout_.prior_mean).cwiseAbs2() + estimate.own.diagonal())
                                     .cwiseQuotient(layout_.prior_sd.cwiseAbs2());
  Eigen::VectorXd result = Eigen::VectorXd::Ones(square.size());
  for (Eigen::Index k = 0; k < square.size(); ++k) {
    const Eigen::Index effect = layout_.effect[static_cast<std::size_t>(k)];
    if (effect < 0) continue;
    double sum = kStudent_dof, count = kStudent_dof;
    for (Eigen::Index i = 0; i < square.size(); ++i) {
      if (layout_.effect[static_cast<std::size_t>(i)] != effect) continue;
      sum += square[i];
      count += 1.0;
    }
    result[k] = std::sqrt(std::max(1.0, sum / count));
  }
  return result;
}

MemoryEstimate PostureMemory::solve(const Quadratic& total) const {
  const auto n = layout_.estimated(), m = layout_.considered_root.rows();
  MemoryEstimate result;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(total.A.topLeftCorner(n, n));
  result.x = ldlt.solve(total.b.head(n));
  result.own = ldlt.solve(Eigen::MatrixXd::Identity(n, n));
  result.sensitivity = -ldlt.solve(total.A.topRightCorner(n, m));
  result.covariance = with_considered(result);
  return result;
}

Eigen::MatrixXd PostureMemory::with_considered(const MemoryEstimate& estimate) const {
  if (layout_.considered_root.rows() == 0) return estimate.own;
  const Eigen::MatrixXd T = estimate.sensitivity * layout_.considered_root;
  return estimate.own + T * T.transpose();
}

const MemoryEstimate& PostureMemory::estimate() const {
  if (estimate_) return *estimate_;
  constexpr int kMostSteps = 30;
  constexpr double kSettled = 0.01;  // a hundredth of a standard deviation
  widening_.setOnes();               // from the narrowest on: where beliefs and pictures may both be right, beliefs are
  const Quadratic pictures = of_pictures();
  for (int step = 0;; ++step) {
    Quadratic total = pictures;
    total.add(prior());
    estimate_ = solve(total);
    if (layout_.effect.empty() || postures() < kLeastPostures || step == kMostSteps) break;
    const Eigen::VectorXd next = wider(*estimate_);
    if ((next - widening_).cwiseQuotient(widening_).cwiseAbs().maxCoeff() < kSettled) break;
    widening_ = next;
  }
  return *estimate_;
}

const Eigen::VectorXd& PostureMemory::widening() const {
  (void)estimate();
  return widening_;
}

void PostureMemory::changed() {
  estimate_.reset();
  posture_precision_.resize(0, 0);
}

const Eigen::MatrixXd& PostureMemory::posture_precision() const {
  if (posture_precision_.size() == 0) posture_precision_ = inverse(in_posture().covariance);
  return posture_precision_;
}

Eigen::VectorXd PostureMemory::solve_with(const Quadratic& frame) const {
  const auto n = layout_.estimated();
  const auto& precision = posture_precision();
  return (precision + frame.A.topLeftCorner(n, n)).ldlt().solve(precision * estimate().x + frame.b.head(n));
}

double PostureMemory::distance(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd away = x - estimate().x;
  return away.dot(posture_precision() * away);
}

Quadratic PostureMemory::of_considered() const {
  const auto n = layout_.estimated(), m = layout_.considered_root.rows();
  const Quadratic total = sum();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(total.A.topLeftCorner(n, n));
  const Eigen::MatrixXd across = total.A.topRightCorner(n, m);
  const Eigen::VectorXd sd = layout_.considered_root.rowwise().norm();
  return {
      sd.asDiagonal() * (total.A.bottomRightCorner(m, m) - across.transpose() * ldlt.solve(across)) * sd.asDiagonal(),
      sd.cwiseProduct(total.b.tail(m) - across.transpose() * ldlt.solve(total.b.head(n)))};
}

PostureMemory PostureMemory::beliefs() const {
  PostureMemory result = *this;
  result.forget_all();
  return result;
}

MemoryEstimate PostureMemory::in_posture() const {
  MemoryEstimate result = estimate();
  for (std::size_t i = 0; i < layout_.is_joint.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (layout_.is_joint[i]) result.own(k, k) += own_variance(k, loose_);
  }
  result.covariance = with_considered(result);
  return result;
}

Eigen::VectorXd PostureMemory::belief_innovation() const {
  const auto& e = estimate();
  // x - mean = K (what pictures show): it scatters by P - own, and by what is considered.
  const Eigen::VectorXd prior = layout_.prior_sd.cwiseProduct(widening_).cwiseAbs2();
  const Eigen::VectorXd scatter = prior + e.covariance.diagonal() - 2.0 * e.own.diagonal();
  // Of what nothing is told both differences are rounding.
  constexpr double kNothing = 1e-9;
  return (scatter.array() > kNothing * prior.array())
      .select((e.x - layout_.prior_mean).array() / scatter.array().max(1e-300).sqrt(), 0.0);
}

double PostureMemory::told() const {
  return static_cast<double>(layout_.estimated()) -
         estimate().own.diagonal().cwiseQuotient(layout_.prior_sd.cwiseAbs2()).cwiseMin(1.0).sum();
}

MemoryEstimate PostureMemory::in_posture(const Quadratic& frame) const {
  const auto n = layout_.estimated(), m = layout_.considered_root.rows();
  const MemoryEstimate before = in_posture();
  // What is considered errs alike in memory and frame: it is carried through, not added.
  const Eigen::MatrixXd precision = inverse(before.own);
  MemoryEstimate after;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(precision + frame.A.topLeftCorner(n, n));
  after.x = ldlt.solve(precision * before.x + frame.b.head(n));
  after.own = ldlt.solve(Eigen::MatrixXd::Identity(n, n));
  after.sensitivity = ldlt.solve(precision * before.sensitivity - frame.A.topRightCorner(n, m));
  after.covariance = with_considered(after);
  return after;
}

PostureMemory::Surprise PostureMemory::surprise(const Quadratic& frame) const {
  const auto n = layout_.estimated(), m = layout_.considered_root.rows();
  const auto& known = estimate();
  const Quadratic seen = with_posture_error(frame, loose_);
  // In units of what was believed.
  const Eigen::MatrixXd scale = layout_.prior_sd.asDiagonal();
  const Eigen::MatrixXd W = scale * seen.A.topLeftCorner(n, n) * scale;
  const Eigen::VectorXd score = scale * (seen.b.head(n) - seen.A.topLeftCorner(n, n) * known.x);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(W);
  Eigen::Index first = 0;
  while (first < n && eigen.eigenvalues()[first] < kLeastTold) ++first;
  const Eigen::Index told = n - first;
  Surprise result;
  if (told == 0) return result;
  const Eigen::VectorXd root = eigen.eigenvalues().tail(told).cwiseSqrt();
  const Eigen::MatrixXd U = eigen.eigenvectors().rightCols(told);
  result.y = root.cwiseInverse().asDiagonal() * (U.transpose() * score);
  // Of y: pictures' noise, what is not known, and what is considered, in memory and frame alike.
  result.to_y = root.asDiagonal() * U.transpose() * layout_.prior_sd.cwiseInverse().asDiagonal();
  result.S = Eigen::MatrixXd::Identity(told, told) + result.to_y * known.own * result.to_y.transpose();
  if (m > 0) {
    const Eigen::MatrixXd E = root.cwiseInverse().asDiagonal() *
                                  (U.transpose() * (scale * seen.A.topRightCorner(n, m))) * layout_.considered_root +
                              result.to_y * known.sensitivity * layout_.considered_root;
    result.S += E * E.transpose();
  }
  return result;
}

PostureMemory::Step PostureMemory::step(const Quadratic& frame, std::span<const Eigen::Index> parameters) const {
  Step result{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size())), {}};
  const Surprise seen = surprise(frame);
  if (seen.y.size() == 0) return result;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(seen.S);
  const Eigen::VectorXd z = ldlt.solve(seen.y);
  result.left = {seen.y.dot(z), static_cast<double>(seen.y.size())};
  Eigen::MatrixXd G(seen.y.size(), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    G.col(static_cast<Eigen::Index>(i)) = seen.to_y.col(parameters[i]);
  }
  const Eigen::MatrixXd SG = ldlt.solve(G);
  Eigen::MatrixXd F = G.transpose() * SG;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    F(k, k) += 1.0 / std::pow(layout_.prior_sd[parameters[i]], 2);  // no further than what was believed possible
  }
  const Eigen::VectorXd g = SG.transpose() * seen.y;
  result.size = F.ldlt().solve(g);
  result.left.nis -= g.dot(result.size);
  result.left.dof -= static_cast<double>(parameters.size());
  return result;
}

PostureMemory::Agreement PostureMemory::agreement(const Quadratic& frame,
                                                  std::span<const Eigen::Index> parameters) const {
  Agreement result{{}, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()))};
  const Surprise seen = surprise(frame);
  if (seen.y.size() == 0) return result;
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(seen.S);
  const Eigen::VectorXd z = ldlt.solve(seen.y);
  result.innovation = {seen.y.dot(z), static_cast<double>(seen.y.size())};
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Eigen::VectorXd direction = seen.to_y.col(parameters[i]);
    const double told = direction.dot(ldlt.solve(direction));
    if (told > 0.0) result.step_gain[static_cast<Eigen::Index>(i)] = std::pow(direction.dot(z), 2) / told;
  }
  return result;
}

Innovation PostureMemory::innovation(const Quadratic& frame) const {
  return agreement(frame, {}).innovation;
}

std::optional<std::uint64_t> PostureMemory::add(double time_s, const Eigen::VectorXd& q, const Quadratic& frame,
                                                const Eigen::VectorXd& x) {
  now_s_ = time_s;
  if (!blocks_.empty()) {
    auto& open = blocks_.back();
    const bool stays = (q - open.q).cwiseAbs().maxCoeff() < options_.same_posture_rad;
    if (stays || time_s - open.begin_s < options_.block_s) {
      open.end_s = time_s;
      return std::nullopt;
    }
  }
  Block block{++begun_, time_s, time_s, q, frame, x, loose_};
  // Of postures in which some joint may be anywhere, what usual ones get wrong is not learned.
  if (!empty() && loose_.empty()) learn_posture_error(block);
  // The posture again: it counts as one still.
  std::erase_if(blocks_,
                [&](const Block& other) { return (q - other.q).cwiseAbs().maxCoeff() < options_.same_posture_rad; });
  blocks_.push_back(std::move(block));
  while (blocks_.size() > options_.most_blocks) fold_oldest();
  changed();
  return begun_;
}

std::vector<std::uint64_t> PostureMemory::blocks() const {
  std::vector<std::uint64_t> numbers;
  for (const auto& block : blocks_) numbers.push_back(block.number);
  return numbers;
}

std::optional<PostureMemory::Stale> PostureMemory::most_stale(std::span<const std::uint64_t> but) const {
  // Physical: a joint turned by this moves an outline by a tenth of a pixel otherwise than its derivative says ...
  constexpr double kLinear_rad = 0.007;
  constexpr double kLinear = 0.5;    // of what was believed, for what is no angle
  constexpr double kFarthest = 5.0;  // ... and by this many times that at once, outlines are lost from sight
  const auto& x = estimate().x;
  std::optional<Stale> stalest;
  double most = 1.0;
  for (const auto& block : blocks_) {
    if (std::find(but.begin(), but.end(), block.number) != but.end()) continue;
    double far = 0.0;
    Eigen::VectorXd aim = x;
    for (const auto k : block.loose) aim[k] = block.x[k];  // where it was in that posture
    for (Eigen::Index k = 0; k < layout_.estimated(); ++k) {
      const double linear = layout_.is_joint[static_cast<std::size_t>(k)] ? kLinear_rad : kLinear * layout_.prior_sd[k];
      far = std::max(far, std::abs(aim[k] - block.x[k]) / linear);
    }
    if (far <= most) continue;
    most = far;
    stalest = Stale{block.number, block.x + std::min(1.0, kFarthest / far) * (aim - block.x)};
  }
  return stalest;
}

void PostureMemory::relinearise(std::uint64_t number, const Quadratic& pictures, const Eigen::VectorXd& x) {
  for (auto& block : blocks_) {
    if (block.number != number) continue;
    block.pictures = pictures;
    block.x = x;
    changed();
    return;
  }
}

void PostureMemory::fold_oldest() {
  const auto block = blocks_.begin();
  if (!old_) {
    old_ = Quadratic::zero(layout_.size());
    old_s_ = block->end_s;
  }
  const double kept = std::exp(-std::max(0.0, block->end_s - old_s_) / options_.memory_s);
  old_->A *= kept;
  old_->b *= kept;
  old_->add(with_posture_error(block->pictures, block->loose));
  old_s_ = std::max(old_s_, block->end_s);
  ++old_postures_;
  blocks_.erase(block);
}

/// `block` is not among the others.
void PostureMemory::learn_posture_error(const Block& block) {
  const auto n = layout_.estimated();
  changed();
  const auto rest = estimate();
  const Innovation agreement = innovation(block.pictures);
  const double kept = std::exp(-1.0 / kRecentBlocks);
  nis_ = kept * nis_ + agreement.nis;
  nis_dof_ = kept * nis_dof_ + agreement.dof;

  // The error of this posture given the others: N(0, variance) before, seen through pictures and what is not known.
  std::vector<Eigen::Index> joints;
  for (Eigen::Index i = 0; i < n; ++i) {
    if (layout_.is_joint[static_cast<std::size_t>(i)]) joints.push_back(i);
  }
  if (joints.empty()) return;
  const Eigen::MatrixXd A = block.pictures.A.topLeftCorner(n, n);
  const Eigen::VectorXd score = block.pictures.b.head(n) - A * rest.x;
  // Information of the pictures with what is not known of the state integrated out.
  const Eigen::MatrixXd damping = (Eigen::MatrixXd::Identity(n, n) + A * rest.covariance).inverse();
  const Eigen::MatrixXd M = damping * A;
  const Eigen::VectorXd s = damping * score;
  const auto count = static_cast<Eigen::Index>(joints.size());
  Eigen::MatrixXd precision = M(joints, joints);
  precision = 0.5 * (precision + precision.transpose()).eval();
  for (Eigen::Index i = 0; i < count; ++i)
    precision(i, i) += 1.0 / posture_variance(is_head(joints[static_cast<std::size_t>(i)]));
  const Eigen::MatrixXd V = inverse(precision);
  const Eigen::VectorXd error = V * s(joints);
  const double prior = std::pow(options_.posture_sd_rad, 2);
  for (const bool head : {false, true}) {
    auto& learned = head ? head_error_ : arm_error_;
    const double variance = posture_variance(head);
    for (Eigen::Index i = 0; i < count; ++i) {
      if (is_head(joints[static_cast<std::size_t>(i)]) != head) continue;
      learned.square += error[i] * error[i];
      learned.directions += std::clamp(1.0 - V(i, i) / variance, 0.0, 1.0);
    }
    learned.variance =
        (options_.posture_prior * prior + learned.square) / (options_.posture_prior + learned.directions);
  }
  changed();
}

void PostureMemory::forget_all() {
  blocks_.clear();
  old_.reset();
  old_postures_ = 0;
  nis_ = nis_dof_ = 0.0;
  changed();
}

void PostureMemory::loosen(std::span<const Eigen::Index> joints) {
  if (std::equal(joints.begin(), joints.end(), loose_.begin(), loose_.end())) return;
  loose_.assign(joints.begin(), joints.end());
  changed();
}

void PostureMemory::loosen_since(Eigen::Index joint, double from_s) {
  for (auto& block : blocks_) {
    if (block.begin_s >= from_s && !among(block.loose, joint)) block.loose.push_back(joint);
  }
  changed();
}

void PostureMemory::tighten_since(Eigen::Index joint, double from_s) {
  for (auto& block : blocks_) {
    if (block.begin_s >= from_s) std::erase(block.loose, joint);
  }
  changed();
}

void PostureMemory::release(std::span<const Eigen::Index> parameters, double from_s) {
  (void)estimate();  // finds how wide the prior is
  const Quadratic believed = prior();
  std::vector<Block> later;
  while (!blocks_.empty() && blocks_.back().begin_s >= from_s) {
    later.insert(later.begin(), std::move(blocks_.back()));
    blocks_.pop_back();
  }
  while (!blocks_.empty()) fold_oldest();
  if (old_) {
    for (const auto k : parameters) {
      // Integrated out, with what was believed of it; the new value is believed of as the old one was.
      old_->A(k, k) += believed.A(k, k);
      old_->b(k) += believed.b(k);
      const Eigen::VectorXd column = old_->A.col(k);
      const double pivot = column(k), b = old_->b(k);
      old_->A -= column * column.transpose() / pivot;
      old_->b -= column * (b / pivot);
    }
  }
  blocks_ = std::move(later);
  changed();
}

double PostureMemory::dispersion() const {
  return nis_dof_ > 0.0 ? nis_ / nis_dof_ : 1.0;
}

}  // namespace bodyschema
