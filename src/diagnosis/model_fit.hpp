#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "bodyschema/diagnosis/block_statistics.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "block_plan.hpp"
#include "regression.hpp"

namespace bodyschema::diagnosis {

/// Which fitted parameter each column of an error model's regression is.
struct ParameterRef {
  std::size_t effect;
  std::size_t parameter;
};

/// A model's regression about itself: columns are its fitted parameters in units of `typical`,
/// then extra ones.
struct ModelFit {
  Linearisation at;
  std::vector<SparseColumn> columns;
  std::vector<SparseColumn> extra;  ///< fitted beside the parameters; no model applies them
  std::vector<ParameterRef> parameters;
  std::optional<BlockStatistics> statistics;
  Columns all;
  BlockFit fit;
};

/// Fits error models to pictures. Steps are taken against the counterparts of the outline that lie
/// within the search, and kept only where the whole outline then lies better (the misfit, which
/// also counts what the search does not reach), so that a fit neither runs off along a direction
/// that nobody sees nor settles on a neighbour's outline.
class ModelFitter {
 public:
  ModelFitter(MeasurementSource& source, const CoordinateLayout& layout, double block_s)
      : source_(source), layout_(layout), block_s_(block_s) {}

  struct Settings {
    int iterations = 8;  ///< at most
    std::function<void(double)> progress{};
    std::size_t every = 1;  ///< every n-th instant only, where the source can leave some out
    bool from_afar = true;  ///< approaches first
  };
  /// Fits the model's parameters, which end at the optimum. Parameters that the log cannot see stay
  /// where they are.
  ModelFit fit(ErrorModel& model, const std::vector<const SparseColumn*>& extra, const Settings& settings);

  /// From afar: looks for the outlines as far off as they seem to be, then ever closer, on some of
  /// the pictures. Returns the distance at which they are left, px; does nothing and returns 0 where
  /// the source knows which point belongs to which.
  /// @param from_px  looks at least that far at first
  double approach(ErrorModel& model, const std::vector<const SparseColumn*>& extra, double from_px = 0.0);

  /// The regression about a model as it is, with the search at its narrowest.
  ModelFit about(const ErrorModel& model, const std::vector<const SparseColumn*>& extra);
  /// Normal equations and fit of `at` on the present plan.
  void accumulate_on(const std::vector<const SparseColumn*>& extra, ModelFit& at) const;

  /// The narrowest search, px.
  void set_finest(double search_px) { finest_px_ = search_px; }
  [[nodiscard]] double finest() const { return finest_px_; }
  static constexpr double kFinest_px = 4.0;  ///< unless set otherwise
  /// All pictures with the search at its narrowest.
  void look_closely() { source_.set_search(finest_px_); }
  /// Blocks by the noise that a fit leaves.
  void set_plan(BlockPlan plan) { plan_ = std::move(plan); }
  [[nodiscard]] const BlockPlan& plan() const { return *plan_; }

 private:
  ModelFit regress(const ErrorModel& model, const std::vector<const SparseColumn*>& extra);
  ModelFit regress(const ErrorModel& model, Linearisation at, const std::vector<const SparseColumn*>& extra);

  MeasurementSource& source_;
  const CoordinateLayout& layout_;
  double block_s_;
  double finest_px_ = kFinest_px;
  std::optional<BlockPlan> plan_;
};

/// Huber's cost of all outline points, px^2 a point; points that the second prediction no longer
/// shows in the pictures count as lost.
double misfit(const Linearisation& at, double outline);
/// How many outline points were predicted.
double outline_points(const Linearisation& at);
/// Mean distance that a misfit stands for, px.
double typical_distance_px(double misfit);

/// `model` back to the middle between itself and `other`, which holds the same effects first.
void go_half_way(const ErrorModel& other, ErrorModel& model);

}  // namespace bodyschema::diagnosis
