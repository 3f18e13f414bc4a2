#include "regression.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bodyschema::diagnosis {
namespace {

constexpr double kStill = 0.25 * kPi / 180.0;  ///< within this every joint stands
constexpr double kShortestHold_s = 3.0;

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
  for (std::size_t e = 0; e < model.size(); ++e) {
    sags = sags || model[e].name() == "compliance" || model[e].name() == "payload";
  }
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

BlockPlan plan_blocks(const MeasurementSource& source, const Linearisation& linearisation,
                      double shortest_s) {
  const auto views = source.views();
  BlockPlan plan;
  plan.block_of_view.assign(views.size(), 0);
  plan.weight_of_view.assign(views.size(), 1.0);
  if (views.empty()) return plan;

  // Static holds.
  std::vector<std::pair<std::size_t, std::size_t>> holds;  // [first, last)
  std::vector<bool> still(views.size(), false);
  for (std::size_t v = 0; v < views.size();) {
    std::size_t end = v;
    while (end < views.size() &&
           (views[end].joints.q - views[v].joints.q).cwiseAbs().maxCoeff() < kStill) {
      ++end;
    }
    const bool hold =
        seconds(views[end - 1].joints.utime - views[v].joints.utime) >= kShortestHold_s;
    if (hold) {
      holds.emplace_back(v, end);
      std::fill(still.begin() + static_cast<std::ptrdiff_t>(v),
                still.begin() + static_cast<std::ptrdiff_t>(end), true);
    }
    v = hold ? end : v + 1;
  }

  // Noise correlation: in a hold the true residual is constant, so what varies is noise. The
  // scores b = G'Wr of the arm's joints are the noise as the fit sees it.
  double lagged_time = 0.0;
  for (const auto& [first, last] : holds) {
    for (std::size_t camera = 0; camera < 2; ++camera) {
      std::vector<std::size_t> members;
      for (auto v = first; v < last; ++v) {
        if (views[v].camera == camera && linearisation.views[v].weight > 0.0) members.push_back(v);
      }
      if (members.size() < 16) continue;
      const double step = seconds(views[members.back()].joints.utime -
                                  views[members.front()].joints.utime) /
                          static_cast<double>(members.size() - 1);
      const Eigen::Index coordinates = std::min<Eigen::Index>(7, linearisation.views[first].vector.size());
      Eigen::MatrixXd score(coordinates, static_cast<Eigen::Index>(members.size()));
      for (std::size_t i = 0; i < members.size(); ++i) {
        score.col(static_cast<Eigen::Index>(i)) =
            linearisation.views[members[i]].vector.head(coordinates);
      }
      score.colwise() -= score.rowwise().mean().eval();
      const Eigen::VectorXd variance = score.rowwise().squaredNorm();
      // Integral of the autocorrelation up to its first value below 0.1.
      double time = 0.5 * step;
      const Eigen::Index n = score.cols();
      for (Eigen::Index lag = 1; lag < n / 3; ++lag) {
        const Eigen::VectorXd c = score.leftCols(n - lag).cwiseProduct(score.rightCols(n - lag))
                                      .rowwise().sum();
        double correlation = 0.0;
        int used = 0;
        for (Eigen::Index i = 0; i < coordinates; ++i) {
          if (variance[i] <= 0.0) continue;
          correlation += c[i] / variance[i] * static_cast<double>(n) / static_cast<double>(n - lag);
          ++used;
        }
        correlation = used > 0 ? correlation / used : 0.0;
        if (correlation < 0.1) break;
        time += correlation * step;
      }
      lagged_time = std::max(lagged_time, time);
    }
  }
  plan.correlation_s = lagged_time;
  plan.still_share = static_cast<double>(std::count(still.begin(), still.end(), true)) /
                     static_cast<double>(views.size());
  const double span = seconds(views.back().joints.utime - views.front().joints.utime);
  // At least ten blocks, else there is nothing to hold out.
  plan.length_s = std::min(std::max(shortest_s, 5.0 * lagged_time), std::max(shortest_s, span / 10.0));

  std::size_t block = 0;
  bool in_hold = still[0];
  double start = seconds(views[0].joints.utime);
  plan.start_s.push_back(start);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const double t = seconds(views[v].joints.utime);
    const bool same_instant = v > 0 && views[v].joints.utime - views[v - 1].joints.utime < 1000;
    const bool cut = still[v] != in_hold || (!in_hold && t - start >= plan.length_s);
    if (v > 0 && cut && !same_instant) {
      ++block;
      start = t;
      in_hold = still[v];
      plan.start_s.push_back(start);
    }
    plan.block_of_view[v] = block;
  }
  // A remainder shorter than half a block joins the one before.
  std::vector<int> members(block + 1, 0);
  for (const auto b : plan.block_of_view) ++members[b];
  const double typical = static_cast<double>(views.size()) * plan.length_s / std::max(span, 1e-9);
  std::vector<std::size_t> renamed(block + 1, 0);
  std::vector<double> starts;
  for (std::size_t b = 0; b <= block; ++b) {
    if (b == 0 || members[b] > 0.5 * typical) {
      renamed[b] = starts.size();
      starts.push_back(plan.start_s[b]);
    } else {
      renamed[b] = renamed[b - 1];
    }
  }
  for (auto& b : plan.block_of_view) b = renamed[b];
  plan.start_s = starts;
  // A hold weighs as much as one block of motion.
  for (const auto& [first, last] : holds) {
    const double share = typical / static_cast<double>(last - first);
    for (auto v = first; v < last; ++v) plan.weight_of_view[v] = std::min(1.0, share);
  }
  return plan;
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

SparseColumn joint_column(const CoordinateLayout& layout, Eigen::Index joint,
                          const std::vector<double>& value) {
  SparseColumn column;
  column.views.resize(value.size());
  const auto coordinate = static_cast<std::uint32_t>(layout.joint(joint));
  for (std::size_t v = 0; v < value.size(); ++v) {
    if (value[v] != 0.0) column.views[v].push_back({coordinate, static_cast<float>(value[v])});
  }
  return column;
}

BlockStatistics accumulate(const std::vector<CompressedView>& views, const BlockPlan& plan,
                           const std::vector<const SparseColumn*>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  const std::size_t blocks = plan.start_s.size();
  std::vector<BlockStatistics::Block> result(blocks);
  for (auto& block : result) {
    block.information.setZero(n, n);
    block.vector.setZero(n);
  }
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  RowMajor AM;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto& view = views[v];
    if (view.weight <= 0.0) continue;
    const double w = plan.weight_of_view[v];
    auto& block = result[plan.block_of_view[v]];
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
    }
    for (Eigen::Index c = 0; c < n; ++c) {
      for (const auto& e : columns[static_cast<std::size_t>(c)]->views[v]) {
        block.information.col(c).head(c + 1) +=
            static_cast<double>(e.value) *
            AM.row(static_cast<Eigen::Index>(e.coordinate)).head(c + 1).transpose();
      }
    }
  }
  for (auto& block : result) {
    block.information = block.information.selfadjointView<Eigen::Upper>();
  }
  return BlockStatistics(std::move(result));
}

std::vector<Eigen::VectorXd> accelerations(const MeasurementSource& source) {
  constexpr Microseconds kHalfWindow = 50'000;
  const auto stream = source.stream();
  std::vector<Eigen::VectorXd> result;
  result.reserve(source.views().size());
  for (const auto& view : source.views()) {
    const auto find = [&](Microseconds t) {
      auto at = std::lower_bound(stream.begin(), stream.end(), t,
                                 [](const JointSample& s, Microseconds u) { return s.utime < u; });
      if (at == stream.end() && at != stream.begin()) --at;
      return at;
    };
    const auto a = find(view.joints.utime - kHalfWindow), b = find(view.joints.utime + kHalfWindow);
    Eigen::VectorXd acceleration = Eigen::VectorXd::Zero(view.joints.q.size());
    if (a != stream.end() && b != stream.end() && b->utime > a->utime) {
      acceleration = (b->qdot - a->qdot) / seconds(b->utime - a->utime);
    }
    result.push_back(std::move(acceleration));
  }
  return result;
}

}  // namespace bodyschema::diagnosis
