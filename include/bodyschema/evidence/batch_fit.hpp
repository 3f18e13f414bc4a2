#pragma once

#include <Eigen/Core>
#include <vector>

#include "bodyschema/evidence/log_fit.hpp"
#include "bodyschema/evidence/outline_noise.hpp"
#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/evidence/state.hpp"

namespace bodyschema {

struct BatchSettings {
  OutlineNoise::Prior noise;
  MemoryOptions memory;
  double spacing_px = 3.0;  ///< of outline samples, px of a 320x240 picture
  int iterations = 25;      ///< at most, of each of the fits
};

/// The answer of a whole log at once: a state fitted to all of its pictures, with the noise measured on what the fit
/// leaves and the uncertainty by the same rules as in the running estimator (PostureMemory, ShapeError), all postures
/// linearised about the result.
class BatchFit {
 public:
  /// @param state  where it starts; beliefs about it are its priors
  /// @param tolerances  what may be wrong besides
  BatchFit(LogFit& fit, State state, const std::vector<Belief>& tolerances, const BatchSettings& settings);

  /// Where the fit begins; beliefs stay as they are.
  void start_at(const Eigen::VectorXd& x) { state_.set(x); }
  /// @param from_px  how far off outlines are looked for at first, px of a 320x240 picture
  /// @param pictures  which; empty: all
  void run(double from_px, const std::vector<std::size_t>& pictures = {});

  [[nodiscard]] const State& state() const { return state_; }
  /// Values and covariance over the state's parameters.
  [[nodiscard]] const MemoryEstimate& estimate() const { return estimate_; }
  /// Standard deviations of the estimate times these factors, one a parameter: what a log says of itself beyond what
  /// its pictures' noise explains.
  void widen(const Eigen::VectorXd& factor);
  /// Another reading of the same pictures, of no less say: the state moves to the mean of both, each weighted by what
  /// it claims to know, and is uncertain by as much as it moved. (Two readings of one thing share what pictures and
  /// postures get wrong; half their difference is what each reading errs by.)
  void meet(const MemoryEstimate& other);
  /// The state is put where something else decides that it is, along what pictures hardly tell: covariances become mean
  /// squared errors about that place.
  void move_to(const Eigen::VectorXd& x);
  [[nodiscard]] const PostureMemory& memory() const { return memory_; }
  [[nodiscard]] const Considered& beside() const { return beside_; }
  [[nodiscard]] const std::vector<OutlineNoise>& noise() const { return noise_; }
  /// The pictures about the result; evidence over LinearLog::coordinates.
  [[nodiscard]] const LinearLog& at() const { return at_; }
  /// Mean cost of an outline point, px^2 of a 320x240 picture: comparable between fits of the same pictures.
  [[nodiscard]] double misfit() const { return misfit_; }
  /// Which posture each picture shows.
  [[nodiscard]] const std::vector<std::size_t>& posture_by_picture() const { return posture_of_; }
  [[nodiscard]] std::size_t postures() const { return postures_; }
  /// How the search for outlines was when the fit ended.
  [[nodiscard]] OutlineSearch search() const;

 private:
  void group_postures();
  void measure(const std::vector<std::size_t>& pictures);
  void fuse(const std::vector<std::size_t>& pictures);
  /// What outlines get wrong alike in all postures, on what the fit leaves of each picture.
  void add_shape_error(const std::vector<std::vector<OutlinePoint>>& points);

  LogFit& fit_;
  State state_;
  Considered beside_;
  BatchSettings settings_;
  PostureMemory memory_;
  MemoryEstimate estimate_;
  std::vector<OutlineNoise> noise_;
  LinearLog at_;
  double misfit_ = 0.0;
  std::vector<std::size_t> posture_of_;
  std::size_t postures_ = 0;
};

/// Joint angles that tell one posture from another: arm and head.
Eigen::VectorXd posture_of(const Eigen::VectorXd& q, const JointRoles& roles);
/// What a memory about a state has to know.
MemoryLayout memory_layout(const State& state, const Considered& considered);

}  // namespace bodyschema
