#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "bodyschema/estimator/estimator_options.hpp"
#include "bodyschema/evidence/outline_noise.hpp"
#include "bodyschema/evidence/posture_memory.hpp"
#include "bodyschema/evidence/shape_error.hpp"
#include "frame_model.hpp"
#include "hypothesis_scorer.hpp"
#include "limits.hpp"

namespace bodyschema {

/// A state moved onto the observed outline, and what the outline says about it there.
struct OutlineFit {
  Eigen::VectorXd x;
  FrameEvidence evidence;  ///< about x
  Quadratic quadratic;     ///< the same, divided by the variance of a residual, in absolute coordinates
  std::vector<std::vector<OutlinePoint>> points;  ///< matched ones, per camera
  /// What is left of evidence and quadratic without the pieces of the outline that show something else.
  struct Seen {
    FrameEvidence evidence;
    Quadratic quadratic;
  } seen;
  Quadratic at_its_stamp;  ///< as `seen.quadratic`, were the pictures' stamps right ...
  TimeEvidence time;       ///< ... and what these say of that
  double misfit = 0.0;     ///< chi-square: of the outline, and of x against what held it
};

/// A search from several starts that is carried on from picture to picture. What has been found is a state, which the
/// next pictures show as well.
struct StartSearch {
  std::vector<Eigen::VectorXd> starts;
  std::size_t next = 0;           ///< of these to be followed
  bool by_pictures = false;       ///< one that pictures show, where there are pictures, before all that they do not
  double least = 3.0;             ///< Hammoude distance of the best, in the picture in which it was found; 1 more where
                                  ///< pictures were asked and do not show it
  Eigen::VectorXd best;           ///< empty: none yet
  std::optional<OutlineFit> fit;  ///< of the best; nothing: it was found in an earlier picture
};

/// Moves states onto a frame's observed outline by Gauss-Newton, held by what a memory knows. One thread.
class OutlineFitter {
 public:
  /// @param search_renders  how often searches may look at one frame anew; at least two starts can be followed whatever
  ///   it is: one in a search, and one beside it
  OutlineFitter(FrameModel& model, HypothesisScorer& scorer, const EstimatorOptions& options, std::size_t cameras,
                int search_renders);

  /// From where the arm was to where this frame and the memory together see it.
  OutlineFit follow(const Frame& frame, const PostureMemory& memory, const Eigen::VectorXd& start);
  /// The same from farther away, looking far at first.
  OutlineFit follow_from(const Frame& frame, const Eigen::VectorXd& start, const PostureMemory& memory);
  /// From here on searches may look at pictures anew as often as one frame allows: counted, not timed, so that a replay
  /// finds what was found live.
  void begin_frame() { searched_renders_ = 0; }
  /// Whether one more start may be followed in this frame, and leaves room for `more` of them.
  [[nodiscard]] bool may_follow(int more = 0) const;
  /// Follows starts as far as the frame allows and judges them by how their silhouettes fit, or as the search says;
  /// `scorer` must have the same frame.
  /// @param room  as in may_follow
  /// @return whether all of them have been followed
  bool go_on(const Frame& frame, const PostureMemory& memory, StartSearch& search, int room = 0);
  /// What a search that is through has found, in this frame.
  OutlineFit found(const Frame& frame, const PostureMemory& memory, StartSearch& search);
  /// What a frame says about a state as it is; nothing where its outline does not lie near.
  std::optional<Quadratic> about(const Frame& frame, const Eigen::VectorXd& x);

  /// Whether a fit's silhouettes lie clearly nearer to the masks than another's; `scorer` must have the frame.
  [[nodiscard]] bool clearly_nearer(const OutlineFit& fit, const OutlineFit& other);
  /// Whether what the pictures show of the predicted outline was found, in the masks or in the pictures themselves, and
  /// near enough; of a hand at the edge of the picture that may be too little to learn from.
  [[nodiscard]] bool lies_near(const Frame& frame, const FrameEvidence& evidence) const;
  /// The same of enough outline to be learned from.
  [[nodiscard]] bool fits(const Frame& frame, const FrameEvidence& evidence) const;
  /// Whether pictures show this outline; without any, whether they did.
  [[nodiscard]] bool pictures_show(const Frame& frame, const FrameEvidence& evidence) const;
  /// Whether pictures show a fit's outline, and not the other's.
  [[nodiscard]] bool only_first_shown(const Frame& frame, const OutlineFit& fit, const OutlineFit& other) const;
  /// Whether what is left of an outline without odd pieces is enough to be learned from, and lies near.
  [[nodiscard]] bool rest_fits(const OutlineFit::Seen& seen) const;
  /// From now on parts that no joint moves against the cameras count as one posture of so many: what they say, and what
  /// hides them or is taken for them, is the same in all of them.
  void count_still_parts_once(std::size_t postures);
  /// Measures the outlines' noise on what a good fit leaves.
  void learn_noise(const OutlineFit& fit);
  /// Measures how far stamps err on a fit that agrees with a memory.
  void learn_stamps(const Frame& frame, const OutlineFit& fit, const PostureMemory& memory);
  [[nodiscard]] double stamp_sd_s() const { return stamps_.sd_s(); }
  /// Measures what outlines get wrong alike in all postures on what the fit of a new one leaves.
  /// @param fitted  parameters that all postures together tell
  void learn_shape(const OutlineFit& fit, double fitted);
  [[nodiscard]] bool knows_shape() const { return shape_.known(); }
  /// ... its variance, over that of what differs from posture to posture: a frame's quadratic divided by it says what
  /// the frame would tell if nothing else erred.
  [[nodiscard]] double shape_variance_share(double fitted) const;
  [[nodiscard]] const std::vector<OutlineNoise>& noise() const { return noise_; }
  /// What outlines get wrong in all postures was learned about an arm that is somewhere else.
  void forget_shape() { shape_.forget(); }

 private:
  /// @param more_steps  at most, at the last distance, until the outline has settled
  void refine(const Frame& frame, const PostureMemory& memory, std::span<const double> search_px, int more_steps,
              OutlineFit& fit);
  /// @param sd_px  px of a 320x240 picture; of what is found, where it is more than the pictures' noise
  /// @return how far it moves the outline, px of a 320x240 picture, rms
  double take_step(const Frame& frame, const PostureMemory& memory, double search_px, double sd_px, OutlineFit& fit);
  void look(const Frame& frame, double search_px, double sd_px, bool last, OutlineFit& fit);
  /// The last look, with odd pieces and without them.
  void look_twice(const Frame& frame, double search_px, OutlineFit& fit);
  /// Points of a fit by which outlines are judged.
  [[nodiscard]] std::vector<OutlinePoint> shown(const OutlineFit& fit, std::size_t camera) const;
  [[nodiscard]] Quadratic quadratic_of(const FrameEvidence& evidence, const Eigen::VectorXd& x, bool with_beside,
                                       double sd_px) const;
  [[nodiscard]] TimeEvidence time_of(const FrameEvidence& evidence, const Eigen::VectorXd& x) const;
  [[nodiscard]] std::vector<OutlineSearch> searches(double search_px, bool last, bool without_odd = false) const;

  FrameModel& model_;
  HypothesisScorer& scorer_;
  const EstimatorOptions& options_;
  std::vector<OutlineNoise> noise_;  ///< per camera
  std::vector<double> part_weight_;  ///< as OutlineSearch
  int search_renders_;               ///< at most, in one frame
  int searched_renders_ = 0;         ///< in this one
  int renders_ = 0;                  ///< of all that was looked at
  ShapeError shape_{limits::kRecentPostures};
  StampNoise stamps_;
};

}  // namespace bodyschema
