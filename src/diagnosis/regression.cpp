#include "regression.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bodyschema::diagnosis {
namespace {

/// Calls `visit(i)` for every view in order of time, after `observe` has seen all samples up to it.
template <class Observe, class Visit>
void replay(const MeasurementSource& source, Observe observe, Visit visit) {
  const auto stream = source.stream();
  std::size_t next = 0;
  for (std::size_t v = 0; v < source.views().size(); ++v) {
    const auto until = source.views()[v].joints.utime;
    for (; next < stream.size() && stream[next].utime <= until; ++next) observe(stream[next]);
    visit(v);
  }
}

}  // namespace

double Linearisation::rms_px() const {
  double square = 0.0, weight = 0.0;
  for (const auto& view : views) {
    square += view.square;
    weight += view.weight;
  }
  return weight > 0.0 ? std::sqrt(square / weight) : 0.0;
}

Linearisation linearise(MeasurementSource& source, ErrorModel model) {
  Linearisation result;
  const auto count = source.views().size();
  const auto offsets = model.offsets();
  bool sags = false;
  for (std::size_t e = 0; e < model.size(); ++e) sags = sags || model[e].follows_gravity();
  Instant sagged;
  result.instants.resize(count);
  result.corrections.assign(count, Corrections(offsets.size()));
  model.forget();
  replay(
      source, [&](const JointSample& s) { model.observe(s); },
      [&](std::size_t v) {
        source.instant(v, offsets, result.instants[v]);
        model.corrections(result.instants[v], result.corrections[v]);
        if (!sags) return;
        // Gravity acts on the arm where it stands, sagged.
        source.instant(v, -result.corrections[v].dq, sagged);
        result.instants[v].gravity_torque = sagged.gravity_torque;
        result.instants[v].payload_torque = sagged.payload_torque;
        model.corrections(result.instants[v], result.corrections[v]);
      });
  source.compress(result.corrections, result.views);
  return result;
}

std::vector<SparseColumn> effect_columns(MeasurementSource& source, const Linearisation& at,
                                         const std::vector<std::unique_ptr<Effect>>& effects,
                                         const CoordinateLayout& layout) {
  struct Probe {
    std::unique_ptr<Effect> low, high;
    double scale = 1.0;  ///< typical over the step
  };
  std::vector<Probe> probes;
  for (const auto& effect : effects) {
    for (std::size_t p = 0; p < effect->parameters().size(); ++p) {
      const auto& parameter = std::as_const(*effect).parameters()[p];
      if (!parameter.fitted) continue;
      Probe probe{effect->clone(), effect->clone(), 1.0};
      const double step = parameter.value == 0.0 ? parameter.typical : 0.05 * parameter.typical;
      probe.high->parameters()[p].value += step;
      if (parameter.value != 0.0) probe.low->parameters()[p].value -= step;
      probe.scale = parameter.typical / (parameter.value == 0.0 ? step : 2.0 * step);
      probe.low->forget();
      probe.high->forget();
      probes.push_back(std::move(probe));
    }
  }
  std::vector<SparseColumn> columns(probes.size());
  for (auto& column : columns) column.views.resize(source.views().size());
  const auto joints = static_cast<Eigen::Index>(source.roles().names.size());
  Corrections low(joints), high(joints);
  Eigen::VectorXd x_low(layout.size()), x_high(layout.size());
  replay(
      source,
      [&](const JointSample& sample) {
        for (auto& probe : probes) {
          if (!probe.low->has_memory()) continue;
          probe.low->observe(sample);
          probe.high->observe(sample);
        }
      },
      [&](std::size_t v) {
        for (std::size_t c = 0; c < probes.size(); ++c) {
          low.clear();
          high.clear();
          probes[c].low->apply(at.instants[v], low);
          probes[c].high->apply(at.instants[v], high);
          layout.read(low, x_low);
          layout.read(high, x_high);
          for (Eigen::Index i = 0; i < layout.size(); ++i) {
            const double d = (x_high[i] - x_low[i]) * probes[c].scale;
            if (d != 0.0) {
              columns[c].views[v].push_back({static_cast<std::uint32_t>(i), static_cast<float>(d)});
            }
          }
        }
      });
  return columns;
}

SparseColumn joint_column(const CoordinateLayout& layout, Eigen::Index joint, const std::vector<double>& value) {
  SparseColumn column;
  column.views.resize(value.size());
  const auto coordinate = static_cast<std::uint32_t>(layout.joint(joint));
  for (std::size_t v = 0; v < value.size(); ++v) {
    if (value[v] != 0.0) column.views[v].push_back({coordinate, static_cast<float>(value[v])});
  }
  return column;
}

BlockStatistics accumulate(const std::vector<CompressedView>& views, const BlockPlan& plan,
                           const std::vector<const SparseColumn*>& columns, std::size_t switchable) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  const auto few = static_cast<Eigen::Index>(switchable);
  std::vector<BlockStatistics::Block> result(plan.block_count());
  for (std::size_t b = 0; b < result.size(); ++b) {
    result[b].information.setZero(n, n);
    result[b].vector.setZero(n);
    if (few > 0) result[b].tails.resize(plan.cell_start_s[b].size() - 1);
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor AM;
  BlockStatistics::Tail tail;
  // Backwards, so that the sums of the switchable columns so far are those of a block's tail.
  for (std::size_t v = views.size(); v-- > 0;) {
    const auto& view = views[v];
    const std::size_t b = plan.block_of_view[v], cell = plan.cell_of_view[v];
    auto& block = result[b];
    if (v + 1 == views.size() || plan.block_of_view[v + 1] != b) {
      tail.information.setZero(few, n);
      tail.vector.setZero(few);
    }
    if (view.weight > 0.0) {
      const double w = plan.weight_of_view[v];
      block.square += w * view.square;
      block.weight += w * view.weight;
      AM.setZero(view.information.rows(), n);
      for (Eigen::Index c = 0; c < n; ++c) {
        double g = 0.0;
        for (const auto& e : columns[static_cast<std::size_t>(c)]->views[v]) {
          const auto i = static_cast<Eigen::Index>(e.coordinate);
          AM.col(c) += (w * static_cast<double>(e.value)) * view.information.col(i);
          g += static_cast<double>(e.value) * view.vector[i];
        }
        block.vector[c] += w * g;
        if (c < few) tail.vector[c] += w * g;
      }
      for (Eigen::Index c = 0; c < n; ++c) {
        for (const auto& e : columns[static_cast<std::size_t>(c)]->views[v]) {
          const auto row = AM.row(static_cast<Eigen::Index>(e.coordinate));
          block.information.col(c).head(c + 1) += static_cast<double>(e.value) * row.head(c + 1).transpose();
          if (c < few) tail.information.row(c) += static_cast<double>(e.value) * row;
        }
      }
    }
    const bool begins = v == 0 || plan.block_of_view[v - 1] != b || plan.cell_of_view[v - 1] != cell;
    if (few > 0 && cell > 0 && begins) block.tails[cell - 1] = tail;
  }
  for (auto& block : result) {
    block.information = block.information.selfadjointView<Eigen::Upper>();
  }
  return BlockStatistics(std::move(result));
}

}  // namespace bodyschema::diagnosis
