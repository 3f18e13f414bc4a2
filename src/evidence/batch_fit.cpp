#include "bodyschema/evidence/batch_fit.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bodyschema/evidence/shape_error.hpp"

namespace bodyschema {
namespace {

/// A log is all of one time: nothing fades.
MemoryOptions unfading(MemoryOptions options) {
  options.memory_s = 1e12;
  options.most_blocks = 100000;
  return options;
}

constexpr double kFinest_px = 6.0;

}  // namespace

Eigen::VectorXd posture_of(const Eigen::VectorXd& q, const JointRoles& roles) {
  Eigen::VectorXd result(static_cast<Eigen::Index>(roles.arm.size() + roles.head.size()));
  Eigen::Index i = 0;
  for (const auto* group : {&roles.arm, &roles.head}) {
    for (const auto joint : *group) result(i++) = q(joint);
  }
  return result;
}

MemoryLayout memory_layout(const State& state, const Considered& considered) {
  MemoryLayout layout;
  layout.prior_mean = state.prior_mean();
  layout.prior_sd = state.prior_sd();
  for (const auto& parameter : state.parameters()) {
    const auto& effect = state.model()[parameter.ref.effect];
    layout.is_joint.push_back(effect.name() == "joint_offset" || effect.name() == "head_offset");
    layout.is_head.push_back(effect.name() == "head_offset");
  }
  layout.considered_root = considered.root;
  return layout;
}

BatchFit::BatchFit(LogFit& fit, State state, const std::vector<Belief>& tolerances, const BatchSettings& settings)
    : fit_(fit), state_(std::move(state)), beside_(Considered::beside(state_, tolerances)), settings_(settings),
      memory_(memory_layout(state_, beside_), unfading(settings.memory)), estimate_(memory_.estimate()),
      noise_(fit.log().rig().cameras.size(), OutlineNoise(settings.noise)) {
  group_postures();
}

/// Pictures in a row that show one posture, or a quarter of a second of motion.
void BatchFit::group_postures() {
  const auto pictures = fit_.log().pictures();
  posture_of_.assign(pictures.size(), 0);
  Eigen::VectorXd q;
  double begin_s = 0.0;
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    const Eigen::VectorXd own = posture_of(pictures[p].joints.q, fit_.log().roles());
    const double time_s = seconds(pictures[p].joints.utime);
    const bool stays = q.size() > 0 && (own - q).cwiseAbs().maxCoeff() < settings_.memory.same_posture_rad;
    if (q.size() == 0 || (!stays && time_s - begin_s >= settings_.memory.block_s)) {
      if (q.size() > 0) ++postures_;
      q = own;
      begin_s = time_s;
    }
    posture_of_[p] = postures_;
  }
  if (q.size() > 0) ++postures_;
}

OutlineSearch BatchFit::search() const {
  return {kFinest_px, settings_.spacing_px, widest_robust_px(noise_)};
}

void BatchFit::widen(const Eigen::VectorXd& factor) {
  for (auto* covariance : {&estimate_.own, &estimate_.covariance}) {
    *covariance = (factor.asDiagonal() * *covariance * factor.asDiagonal()).eval();
  }
}

void BatchFit::meet(const MemoryEstimate& other) {
  const Eigen::MatrixXd own = memory_.estimate().own;
  // P_b of (P_a + P_b)^-1 P_b, without an inverse of what is hardly known.
  move_to(estimate_.x + own * (own + other.own).ldlt().solve(other.x - estimate_.x));
}

void BatchFit::move_to(const Eigen::VectorXd& x) {
  const Eigen::VectorXd moved = x - estimate_.x;
  estimate_.x = x;
  for (auto* covariance : {&estimate_.own, &estimate_.covariance}) *covariance += moved * moved.transpose();
  state_.set(estimate_.x);
  std::vector<std::size_t> pictures;
  for (std::size_t p = 0; p < at_.evidence.size(); ++p) {
    if (at_.evidence[p].weight > 0.0) pictures.push_back(p);
  }
  at_ = fit_.linearise(state_.model(), at_.coordinates, search(), pictures);
}

void BatchFit::run(double from_px, const std::vector<std::size_t>& pictures) {
  FitSettings settings{.iterations = settings_.iterations,
                       .from_px = from_px,
                       .finest_px = kFinest_px,
                       .robust_px = 3.0,
                       .spacing_px = settings_.spacing_px,
                       .variance_px2 = mean_variance_px2(noise_)};
  fit_.fit(state_, settings, pictures);
  measure(pictures);
  // With the noise as it is: how far beliefs and pictures pull, and which outlines are somebody else's.
  settings.from_px = 0.0;
  settings.robust_px = widest_robust_px(noise_);
  settings.variance_px2 = mean_variance_px2(noise_);
  fit_.fit(state_, settings, pictures);
  measure(pictures);
  fuse(pictures);
}

void BatchFit::measure(const std::vector<std::size_t>& pictures) {
  constexpr double kRobust_px = 3.0;
  noise_ = fit_.noise(state_.model(), {kFinest_px, settings_.spacing_px, kRobust_px}, settings_.noise, pictures);
}

/// All postures about the state, fused; the state moves to what comes of it until it stays.
void BatchFit::fuse(const std::vector<std::size_t>& pictures) {
  constexpr int kRounds = 4;
  const auto refs = state_.refs();
  auto beside = fitted_parameters(beside_.effects);
  auto coordinates = fit_.moved_by(state_.model(), refs);
  const auto more = fit_.moved_by(beside_.effects, beside);
  coordinates.insert(coordinates.end(), more.begin(), more.end());
  std::sort(coordinates.begin(), coordinates.end());
  coordinates.erase(std::unique(coordinates.begin(), coordinates.end()), coordinates.end());
  const auto n = state_.size(), m = static_cast<Eigen::Index>(beside.size());
  const auto all = fit_.log().pictures();
  const Eigen::VectorXd start = state_.x();
  std::vector<std::vector<OutlinePoint>> points(all.size());
  const auto keep = [&](std::size_t p, std::span<const OutlinePoint> seen) {
    points[p].assign(seen.begin(), seen.end());
  };
  for (int round = 0; round < kRounds; ++round) {
    for (auto& of_picture : points) of_picture.clear();
    at_ = fit_.linearise(state_.model(), coordinates, search(), pictures, keep);
    misfit_ = fit_.misfit(at_, at_.sampled());
    const auto own = fit_.directions(at_, state_.model(), refs), other = fit_.directions(at_, beside_.effects, beside);
    std::vector<Eigen::Index> position(static_cast<std::size_t>(fit_.coordinates().size()), -1);
    for (std::size_t i = 0; i < coordinates.size(); ++i) position[coordinates[i]] = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd x = state_.x();
    memory_.forget_all();
    for (std::size_t first = 0; first < all.size();) {
      std::size_t last = first;
      Quadratic posture = Quadratic::zero(n + m);
      std::vector<double> seen(noise_.size(), 0.0);
      for (; last < all.size() && posture_of_[last] == posture_of_[first]; ++last) {
        seen[all[last].camera] += at_.evidence[last].weight > 0.0;
      }
      double total = 0.0;
      for (std::size_t p = first; p < last; ++p) {
        const auto& evidence = at_.evidence[p];
        if (evidence.weight <= 0.0) continue;
        total += 1.0;
        const double unit = fit_.log().unit_px(p);
        // The pictures of a posture count as one of each camera.
        const double precision = 1.0 / (unit * unit * noise_[all[p].camera].variance_px2() * seen[all[p].camera]);
        Eigen::MatrixXd J = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(coordinates.size()), n + m);
        for (Eigen::Index k = 0; k < n + m; ++k) {
          const auto& direction =
              k < n ? own[p][static_cast<std::size_t>(k)] : other[p][static_cast<std::size_t>(k - n)];
          for (const auto& step : direction) J(position[step.coordinate], k) = step.amount;
        }
        posture.A += precision * J.transpose() * evidence.A * J;
        posture.b += precision * J.transpose() * evidence.b;
      }
      if (total > 0.0) {
        posture.b += posture.A.leftCols(n) * x;
        memory_.add(seconds(all[first].joints.utime), posture_of(all[first].joints.q, fit_.log().roles()), posture, x);
      }
      first = last;
    }
    if (memory_.empty()) break;
    state_.set(memory_.estimate().x);
    const Eigen::VectorXd moved = (state_.x() - x).cwiseQuotient(memory_.layout().prior_sd);
    if (moved.cwiseAbs().maxCoeff() < 1e-3) break;
  }
  estimate_ = memory_.estimate();
  add_shape_error(points);
}

void BatchFit::add_shape_error(const std::vector<std::vector<OutlinePoint>>& points) {
  const auto& cameras = fit_.log().rig().cameras;
  ShapeError shape;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    std::vector<std::vector<OutlinePoint>> shown(postures_);  // a posture's pictures err alike
    for (std::size_t p = 0; p < points.size(); ++p) {
      if (fit_.log().pictures()[p].camera != c) continue;
      auto& own = shown[posture_of_[p]];
      own.insert(own.end(), points[p].begin(), points[p].end());
    }
    for (const auto& own : shown) {
      if (!own.empty()) shape.add(own, c, picture_unit(cameras[c].intrinsics));
    }
  }
  const double share = shape.variance_px2(settings_.noise.floor_px, memory_.told()) / noise_.front().variance_px2();
  const Eigen::MatrixXd covariance = shape_covariance(memory_, share);
  estimate_.own += covariance;
  estimate_.covariance += covariance;
}

}  // namespace bodyschema
