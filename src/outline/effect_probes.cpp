#include "bodyschema/outline/effect_probes.hpp"

#include <algorithm>
#include <utility>

namespace bodyschema {

std::vector<ParameterRef> fitted_parameters(const ErrorModel& model) {
  std::vector<ParameterRef> list;
  for (std::size_t e = 0; e < model.size(); ++e) {
    for (std::size_t p = 0; p < model[e].parameters().size(); ++p) {
      if (model[e].parameters()[p].fitted) list.push_back({e, p});
    }
  }
  return list;
}

EffectProbes::EffectProbes(const ErrorModel& model, std::vector<ParameterRef> parameters,
                           const Coordinates& coordinates)
    : parameters_(std::move(parameters)), low_(model.roles().no_corrections()), high_(low_) {
  for (const auto& coordinate : coordinates.all()) places_.emplace_back(&coordinate.in(low_), &coordinate.in(high_));
  for (const auto& ref : parameters_) {
    probes_.push_back({model[ref.effect].clone(), model[ref.effect].clone(), 1.0, ref.effect});
  }
  for (std::size_t e = 0; e < model.size(); ++e) {
    if (model[e].follows_motion() && !model[e].has_memory()) beside_.push_back({model[e].clone(), e, 0.0});
  }
  follow(model);
}

void EffectProbes::place(Probe& probe, std::size_t parameter, double value) const {
  constexpr double kNear = 0.05;  // of the typical size
  auto& low = probe.low->parameters()[parameter];
  auto& high = probe.high->parameters()[parameter];
  const double reach = value == 0.0 ? low.typical : kNear * low.typical;
  low.value = value == 0.0 ? 0.0 : std::max(value - reach, low.at_least);
  high.value = value + reach;
  probe.step = high.value - low.value;
}

void EffectProbes::follow(const ErrorModel& model) {
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const auto& effect = model[parameters_[i].effect];
    for (std::size_t p = 0; p < effect.parameters().size(); ++p) {
      probes_[i].low->parameters()[p].value = probes_[i].high->parameters()[p].value = effect.parameters()[p].value;
    }
    place(probes_[i], parameters_[i].parameter, effect.parameters()[parameters_[i].parameter].value);
  }
  for (auto& beside : beside_) {
    const auto values = model[beside.which].parameters();
    const auto own = beside.effect->parameters();
    for (std::size_t p = 0; p < values.size(); ++p) own[p].value = values[p].value;
  }
}

void EffectProbes::observe(const JointSample& sample) {
  for (auto& probe : probes_) {
    if (!probe.low->has_memory()) continue;
    probe.low->observe(sample);
    probe.high->observe(sample);
  }
}

void EffectProbes::forget() {
  for (auto& probe : probes_) {
    probe.low->forget();
    probe.high->forget();
  }
}

void EffectProbes::find_times(const Instant& at) {
  for (auto& beside : beside_) {
    low_.clear();
    beside.effect->apply(at, low_);
    beside.later_s = low_.later_s;
  }
  low_.clear();
}

void EffectProbes::directions(const Instant& at, std::vector<Direction>& out) {
  out.resize(probes_.size());
  find_times(at);
  for (std::size_t i = 0; i < probes_.size(); ++i) {
    const Effect &low = *probes_[i].low, &high = *probes_[i].high;
    double later_s = 0.0;
    for (const auto& beside : beside_) later_s += beside.which == probes_[i].effect ? 0.0 : beside.later_s;
    low_.later_s = high_.later_s = later_s;
    const auto is_nothing = [](const EffectParameter& p) { return !p.fitted || p.value == 0.0; };
    // Of an effect that is at zero nothing is known but its own change: the usual case, of a whole catalogue.
    if (!std::all_of(low.parameters().begin(), low.parameters().end(), is_nothing)) low.apply(at, low_);
    high.apply(at, high_);
    out[i].clear();
    for (std::size_t c = 0; c < places_.size(); ++c) {
      // Only what an effect has changed is put back.
      const double d = std::exchange(*places_[c].second, 0.0) - std::exchange(*places_[c].first, 0.0);
      if (d != 0.0) out[i].push_back({static_cast<std::uint32_t>(c), d / probes_[i].step});
    }
  }
}

}  // namespace bodyschema
