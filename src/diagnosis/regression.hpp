#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "bodyschema/diagnosis/block_statistics.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/diagnosis/selection.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "block_plan.hpp"

namespace bodyschema::diagnosis {

/// All views linearised about one error model.
struct Linearisation {
  std::vector<Instant> instants;         ///< one per view
  std::vector<Corrections> corrections;  ///< what the model said there
  std::vector<CompressedView> views;
  [[nodiscard]] double rms_px() const;
};

/// Plays the encoder log through the model and compresses every view about its prediction.
Linearisation linearise(MeasurementSource& source, ErrorModel model);

/// A column of the regression as a map: per view, the coordinates it moves and by how much.
struct SparseColumn {
  struct Entry {
    std::uint32_t coordinate;
    float value;
  };
  std::vector<std::vector<Entry>> views;
};

/// Columns for the fitted parameters of effects, taken one at a time: the change of the
/// corrections per `typical` of the parameter. For an effect at zero this is the secant to its
/// typical size, otherwise the derivative.
std::vector<SparseColumn> effect_columns(MeasurementSource& source, const Linearisation& at,
                                         const std::vector<std::unique_ptr<Effect>>& effects,
                                         const CoordinateLayout& layout);

/// A column that moves one joint by `value(view)` radians.
SparseColumn joint_column(const CoordinateLayout& layout, Eigen::Index joint, const std::vector<double>& value);

/// @param switchable  that many columns, the first ones, may begin within a block
BlockStatistics accumulate(const std::vector<CompressedView>& views, const BlockPlan& plan,
                           const std::vector<const SparseColumn*>& columns, std::size_t switchable = 0);

}  // namespace bodyschema::diagnosis
