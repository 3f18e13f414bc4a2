#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "bodyschema/evidence/outline_noise.hpp"
#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/evidence/state.hpp"
#include "bodyschema/outline/outline_measurement.hpp"

namespace bodyschema {

/// A log's pictures linearised about one model.
struct LinearLog {
  std::vector<Instant> instants;           ///< one per picture
  std::vector<Corrections> corrections;    ///< what the model said there
  std::vector<OutlineEvidence> evidence;   ///< over `coordinates`
  std::vector<std::uint32_t> coordinates;  ///< positions in Coordinates
  [[nodiscard]] double rms_px() const;
  [[nodiscard]] double sampled() const;
  /// Share of the predicted outline that has a counterpart.
  [[nodiscard]] double matched_share() const;
};

/// The same over the parameters of a state, block by block or picture by picture.
struct StateEvidence {
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  double square = 0.0, weight = 0.0;
  void add(const StateEvidence& other, double factor = 1.0);
};

/// How a fit goes on.
struct FitSettings {
  int iterations = 10;        ///< at most, once near
  double from_px = 0.0;       ///< looks for outlines this far off at first, px of a 320x240 picture; 0: near already
  double finest_px = 6.0;     ///< and this far in the end
  double robust_px = 3.0;     ///< robust scale in the end; from afar it is half of how far is looked
  double spacing_px = 3.0;    ///< between the points of an outline
  double variance_px2 = 1.0;  ///< of a residual, what neighbours share counted in: weighs pictures against beliefs
  /// Share of the cost: a step that would lower it by less, were all straight, is not taken. For many fits that are
  /// only compared, from near; from afar the way may lead on all the same.
  double least_promise = 0.0;
  std::function<void(double)> progress{};
};

/// Fits states to a log's outlines: Levenberg-Marquardt with the beliefs as priors. Steps are taken against the
/// counterparts of the outline that lie within the search, and kept only where the whole outline then lies better (the
/// misfit, which also counts what the search does not reach), so that a fit neither runs off along a direction that
/// nobody sees nor settles on a neighbour's outline. Results do not depend on the number of threads.
class LogFit {
 public:
  LogFit(PictureLog& log, int threads);
  ~LogFit();

  /// After PictureLog::replace_rig.
  void refresh();
  /// After pictures were added or forgotten: parts that no posture of the log moves in the pictures, a robot's base
  /// before a still camera, show the same in all, and count as seen once.
  void weigh_parts();
  /// Parts that are drawn, and hide what is behind them, but whose own outlines have no say from now on.
  void leave_out(std::vector<bool> parts);

  [[nodiscard]] const Coordinates& coordinates() const;
  [[nodiscard]] PictureLog& log() { return log_; }
  [[nodiscard]] OutlineMeasurement& measurement() { return *workers_.front(); }

  /// What a model says of pictures; their evidence is empty.
  /// @param pictures  which; empty: all. Nothing is said of the others
  LinearLog predict(const ErrorModel& model, std::span<const std::uint32_t> coordinates,
                    std::span<const std::size_t> pictures = {});
  /// Compares pictures with predictions, each with its own. Parameters as of `linearise`.
  void measure(LinearLog& predicted, const OutlineSearch& search, std::span<const std::size_t> pictures = {},
               const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look = {});
  /// Compares pictures with the predictions of a model.
  /// @param coordinates  wanted, by position
  /// @param pictures  which; empty: all. The others' evidence is that of nothing seen
  /// @param look  called for every picture with the matched points, from any thread
  LinearLog linearise(const ErrorModel& model, std::span<const std::uint32_t> coordinates, const OutlineSearch& search,
                      std::span<const std::size_t> pictures = {},
                      const std::function<void(std::size_t, std::span<const OutlinePoint>)>& look = {});
  /// Every picture's evidence about some parameters of a model, in SI, from its linearisation.
  std::vector<StateEvidence> project(const LinearLog& at, const ErrorModel& model,
                                     const std::vector<ParameterRef>& parameters);
  /// How the parameters move each picture's coordinates: [picture][parameter].
  std::vector<std::vector<Direction>> directions(const LinearLog& at, const ErrorModel& model,
                                                 const std::vector<ParameterRef>& parameters);

  /// Fits the state; @return the mean cost of an outline point at the end, px^2 of a 320x240 picture.
  /// @param free  positions of parameters that may move; empty: all
  double fit(State& state, const FitSettings& settings, std::span<const std::size_t> pictures = {});

  /// By how much the b of all pictures together changes along ways of about a standard deviation, as a share of what A
  /// says; at most 1. Where pictures err it is less: outlines that lie far off pull less the further they are, and
  /// others find another counterpart. A step A^-1 b falls short by this, and fits to some of the pictures each seem to
  /// differ less than they do. @param variance_px2  as of FitSettings  @param seed  of the ways that are tried
  double slope(const State& state, const OutlineSearch& search, double variance_px2,
               std::span<const std::size_t> pictures, std::uint64_t seed);

  /// How outlines err in each camera's pictures, measured on what a model leaves.
  std::vector<OutlineNoise> noise(const ErrorModel& model, const OutlineSearch& search,
                                  const OutlineNoise::Prior& prior, std::span<const std::size_t> pictures = {});

  /// Coordinates that some of these parameters move in some picture.
  std::vector<std::uint32_t> moved_by(const ErrorModel& model, const std::vector<ParameterRef>& parameters);

  /// Mean cost of an outline point, px^2 of a 320x240 picture; points that a prediction no longer shows in the
  /// pictures count as lost.
  [[nodiscard]] double misfit(const LinearLog& at, double usual_points) const {
    return mean_cost(at, usual_points, &OutlineEvidence::misfit);
  }

 private:
  [[nodiscard]] double mean_cost(const LinearLog& at, double usual_points, double OutlineEvidence::*cost) const;

  PictureLog& log_;
  std::vector<std::unique_ptr<OutlineMeasurement>> workers_;
  std::vector<double> part_weight_;
  std::vector<bool> left_out_;  ///< by part; empty: none
};

}  // namespace bodyschema
