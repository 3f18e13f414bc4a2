#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bodyschema/core/time.hpp"
#include "bodyschema/geometry/pose.hpp"

namespace bodyschema {

/// A quadratic about some parameters in absolute coordinates: -2 ln likelihood = x' A x - 2 b' x + constant.
struct Quadratic {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  static Quadratic zero(Eigen::Index n) { return {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)}; }
  void add(const Quadratic& other, double factor = 1.0) {
    A += factor * other.A;
    b += factor * other.b;
  }
};

/// What a memory is about.
struct MemoryLayout {
  Eigen::VectorXd prior_mean, prior_sd;  ///< of what is estimated, SI
  /// Which of these are angles of joints: what a posture gets wrong shows as if these were wrong in it.
  std::vector<bool> is_joint;
  /// What is not estimated but may be wrong all the same: Schmidt's considered parameters (Jazwinski 1970, section
  /// 8.4). A root of their covariance, SI. Quadratics are over the estimated parameters, then these.
  Eigen::MatrixXd considered_root;
  /// Numbers of the kinds of effects that parameters belong to, below 0 for none; empty: none. What is believed of a
  /// kind is a description by somebody who may be wrong: its `prior_sd` hold up to a factor, 1 or more, that all of its
  /// parameters have in common and that pictures tell (PostureMemory::widening).
  std::vector<Eigen::Index> effect{};
  /// Which of the joints carry the cameras: how they err, a head that sways, says nothing of how the arm's do. Empty:
  /// none.
  std::vector<bool> is_head{};
  [[nodiscard]] Eigen::Index estimated() const { return prior_sd.size(); }
  [[nodiscard]] Eigen::Index size() const { return prior_sd.size() + considered_root.rows(); }
};

struct MemoryOptions {
  double memory_s = 300.0;                 ///< after so long a posture's say has faded to 1/e
  double block_s = 0.25;                   ///< of motion that counts as one posture
  double same_posture_rad = radians(3.0);  ///< joints nearer than this are the same posture
  std::size_t most_blocks = 120;           ///< the oldest are summed up beyond
  double encoder_sd_rad = radians(0.035);  ///< of one reading: noise and rounding; the least a posture gets wrong
  double posture_sd_rad = radians(0.07);   ///< what a posture is believed to get wrong before any was seen, per joint
  double posture_prior = 8.0;              ///< how many told directions that belief counts as
};

/// The estimate: best values, and how well they are known.
struct MemoryEstimate {
  Eigen::VectorXd x;
  Eigen::MatrixXd own;          ///< covariance of x if the model were right
  Eigen::MatrixXd sensitivity;  ///< d x / d considered
  Eigen::MatrixXd covariance;   ///< with what is considered
};

/// How a piece of evidence agrees with the rest.
struct Innovation {
  double nis = 0.0;  ///< normalised innovation squared: of chi-square distribution where all is as believed
  double dof = 0.0;  ///< directions that the piece tells
};

/// What postures taught about a state, kept posture by posture: the fused estimate, the same without any of them and
/// the test of a new one come from the same sums.
///
/// A block is one posture of the arm, or a quarter of a second of motion. Its first pictures speak for it: what the
/// model gets wrong in a posture it gets wrong in all pictures of it, so that more of them teach nothing new. A posture
/// that comes again takes the place of what it said before. Every block is linearised about one state, and again when
/// the estimate has moved on: quadratics from different places claim to know directions that no picture tells (Huang et
/// al., 2010, on the consistency of filters for simultaneous localisation and mapping). What blocks disagree about
/// beyond their pictures' noise is learned as an error of every posture, in the joints' angles (variance components,
/// one of the arm and one of the head, by MacKay's update of their evidence, 1992). What is believed of effects holds
/// as a Student t distribution of four degrees of freedom does (Lange, Little and Taylor, 1989): pictures that
/// contradict it outright are believed, and what is left open is then as wide as they ask for. At most `most_blocks`
/// are kept. Not thread-safe.
class PostureMemory {
 public:
  PostureMemory(MemoryLayout layout, const MemoryOptions& options);

  /// Adds one frame that agrees with what is known.
  /// @param q  joints of the posture, rad
  /// @param frame  the pictures' say, over estimated and considered parameters, divided by the variance of a residual
  /// @param x  where they were linearised
  /// @return the number of the block that it began; nothing where it belongs to one that is there
  std::optional<std::uint64_t> add(double time_s, const Eigen::VectorXd& q, const Quadratic& frame,
                                   const Eigen::VectorXd& x);
  void forget_all();
  /// Numbers of the blocks that are kept one by one.
  [[nodiscard]] std::vector<std::uint64_t> blocks() const;
  /// The block whose pictures were linearised furthest from the estimate, and where they are to be linearised next: at
  /// the estimate, or some way towards it. Nothing where all are near.
  struct Stale {
    std::uint64_t block = 0;
    Eigen::VectorXd x;
  };
  /// @param but  blocks that are not asked about
  [[nodiscard]] std::optional<Stale> most_stale(std::span<const std::uint64_t> but = {}) const;
  /// A block's pictures linearised anew, about x.
  void relinearise(std::uint64_t block, const Quadratic& pictures, const Eigen::VectorXd& x);

  /// Some parameters changed at a time: what was known of them before holds no longer, the rest stays.
  void release(std::span<const Eigen::Index> parameters, double from_s);
  /// From now on pictures find these joints wherever they are: what they read is believed of no posture, and pictures
  /// tell of the rest what they tell of it wherever these joints were. Replaces those named before.
  void loosen(std::span<const Eigen::Index> joints);
  /// The same of the postures that began at this time or later.
  void loosen_since(Eigen::Index joint, double from_s);
  /// What the joint read in postures that began at this time or later is believed again.
  void tighten_since(Eigen::Index joint, double from_s);
  [[nodiscard]] std::span<const Eigen::Index> loose() const { return loose_; }

  [[nodiscard]] const MemoryEstimate& estimate() const;
  /// Of each parameter, by how many times its belief was too narrow: MemoryLayout::effect.
  [[nodiscard]] const Eigen::VectorXd& widening() const;
  /// How far pictures pull each parameter from where it was believed to be, in standard deviations of what that
  /// scatters by where beliefs, noise and what is considered are as said. Of a parameter that pictures hardly tell the
  /// belief gives way by little, whatever they ask for: it is this that tells whether they contradict it (the
  /// innovation of a prior: Bar-Shalom, Li and Kirubarajan, 2001, section 5.4).
  [[nodiscard]] Eigen::VectorXd belief_innovation() const;
  /// How many of the estimated parameters pictures tell: each counts by how much of its prior's say they have taken
  /// over.
  [[nodiscard]] double told() const;
  /// The estimate of one frame: the fused one with that posture's own error, seen by the frame's pictures.
  [[nodiscard]] MemoryEstimate in_posture(const Quadratic& frame) const;
  /// The same of a frame without evidence.
  [[nodiscard]] MemoryEstimate in_posture() const;
  /// ... its covariance's inverse.
  [[nodiscard]] const Eigen::MatrixXd& posture_precision() const;
  /// What pictures say of what is considered, in units of its standard deviations, all that is estimated integrated
  /// out.
  [[nodiscard]] Quadratic of_considered() const;
  /// How a frame agrees with everything that is known.
  [[nodiscard]] Innovation innovation(const Quadratic& frame) const;
  /// The step of some parameters that would make a frame agree best, and how it agrees then.
  struct Step {
    Eigen::VectorXd size;  ///< per parameter, SI
    Innovation left;
  };
  [[nodiscard]] Step step(const Quadratic& frame, std::span<const Eigen::Index> parameters) const;
  /// How a frame agrees, and by how much its normalised innovation squared falls where one parameter alone may have
  /// stepped, for each of some: of chi-square distribution with one degree of freedom where none has.
  struct Agreement {
    Innovation innovation;
    Eigen::VectorXd step_gain;
  };
  [[nodiscard]] Agreement agreement(const Quadratic& frame, std::span<const Eigen::Index> parameters) const;

  /// Chi-square of the state of one posture against everything that is known: with that posture's own error, and what
  /// is considered.
  [[nodiscard]] double distance(const Eigen::VectorXd& x) const;
  /// The best state of one posture given everything and a frame of it.
  [[nodiscard]] Eigen::VectorXd solve_with(const Quadratic& frame) const;

  [[nodiscard]] bool empty() const { return blocks_.empty() && !old_; }
  /// Without any posture: the beliefs alone; what a posture gets wrong is as learned here.
  [[nodiscard]] PostureMemory beliefs() const;
  /// Distinct postures that are remembered.
  [[nodiscard]] std::size_t postures() const { return blocks_.size() + old_postures_; }
  /// Mean NIS per direction of the last postures against the rest; 1: as believed.
  [[nodiscard]] double dispersion() const;
  /// What a posture gets wrong, per joint of the arm, rad; and per joint that carries the cameras.
  [[nodiscard]] double posture_sd_rad() const { return std::sqrt(posture_variance(false)); }
  [[nodiscard]] double head_posture_sd_rad() const { return std::sqrt(posture_variance(true)); }
  [[nodiscard]] const MemoryLayout& layout() const { return layout_; }

 private:
  struct Block {
    std::uint64_t number = 0;
    double begin_s = 0.0, end_s = 0.0;
    Eigen::VectorXd q;                  ///< of its first frame
    Quadratic pictures;                 ///< of its first frame, as last linearised ...
    Eigen::VectorXd x;                  ///< ... about this state
    std::vector<Eigen::Index> loose{};  ///< joints of which it tells nothing that others know
  };
  /// A frame's innovation along the directions that it tells, and what one unit of each parameter adds to it.
  struct Surprise {
    Eigen::VectorXd y;
    Eigen::MatrixXd S;     ///< covariance of y
    Eigen::MatrixXd to_y;  ///< d y / d estimated
  };
  [[nodiscard]] Surprise surprise(const Quadratic& frame) const;
  [[nodiscard]] Quadratic with_posture_error(const Quadratic& block, std::span<const Eigen::Index> loose) const;
  [[nodiscard]] bool is_head(Eigen::Index joint) const;
  [[nodiscard]] double posture_variance(bool head) const;
  [[nodiscard]] double own_variance(Eigen::Index joint, std::span<const Eigen::Index> loose) const;
  [[nodiscard]] Quadratic sum() const;
  [[nodiscard]] MemoryEstimate solve(const Quadratic& sum) const;
  [[nodiscard]] Quadratic of_pictures() const;
  [[nodiscard]] Quadratic prior() const;
  [[nodiscard]] Eigen::VectorXd wider(const MemoryEstimate& estimate) const;
  void changed();
  [[nodiscard]] Eigen::MatrixXd with_considered(const MemoryEstimate& estimate) const;
  void learn_posture_error(const Block& block);
  void fold_oldest();

  MemoryLayout layout_;
  MemoryOptions options_;
  std::vector<Block> blocks_;  ///< the last one is still open
  std::vector<Eigen::Index> loose_;
  std::optional<Quadratic> old_;
  std::size_t old_postures_ = 0;
  std::uint64_t begun_ = 0;
  double now_s_ = 0.0, old_s_ = 0.0;
  /// What postures get wrong, in joints that are not the head's and in those that are.
  struct PostureError {
    double square = 0.0, directions = 0.0;  ///< sums of MacKay's update
    double variance = 0.0;
  } arm_error_, head_error_;
  double nis_ = 0.0, nis_dof_ = 0.0;
  mutable std::optional<MemoryEstimate> estimate_;
  mutable Eigen::VectorXd widening_;           ///< as of estimate_
  mutable Eigen::MatrixXd posture_precision_;  ///< of a posture's state; empty: not worked out yet
};

}  // namespace bodyschema
