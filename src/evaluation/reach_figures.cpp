#include "reach_figures.hpp"

#include <spdlog/fmt/fmt.h>

#include <map>
#include <optional>

namespace bodyschema {
namespace {

constexpr std::size_t kReachedFrames = 10;

/// Frames until below 1 mm and 1 degree for good; nothing when that never happens.
std::optional<double> frames_to_converge(const std::vector<FrameRecord>& frames, std::size_t camera) {
  double until = 0.0;
  bool good = false;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].position_mm[camera] < 0.0) continue;  // no picture says neither
    good = frames[i].position_mm[camera] < 1.0 && frames[i].rotation_deg[camera] < 1.0;
    if (!good) until = static_cast<double>(i + 1);
  }
  return good ? std::optional(until) : std::nullopt;
}

std::string frames_text(const ReachResult& r) {
  if (r.never == r.trials) return "never";
  std::string text = fmt::format("{:.1f}", r.frames_to_converge.mean);
  if (r.never > 0) text += fmt::format(", never in {}", r.never);
  return text;
}

/// The same estimator in the same colour in every chart.
int colour_of(const std::string& contestant) {
  static const std::map<std::string, int> colours{
      {"best.stereo", 0}, {"paper.stereo", 1}, {"best.mono", 2}, {"paper.mono", 3}};
  const auto found = colours.find(contestant);
  return found != colours.end() ? found->second : -1;
}

}  // namespace

double mean_of_last(const std::vector<FrameRecord>& frames, std::size_t camera,
                    const std::array<double, 2> FrameRecord::*figure) {
  double sum = 0.0;
  int n = 0;
  for (std::size_t i = frames.size() - std::min(kReachedFrames, frames.size()); i < frames.size(); ++i) {
    const double value = (frames[i].*figure)[camera];
    if (value < 0.0) continue;
    sum += value;
    ++n;
  }
  return n > 0 ? sum / n : 0.0;
}

ReachResult reach_result(const std::vector<TrialRecord>& trials, std::size_t contestant, std::size_t camera) {
  std::vector<double> position, rotation, frames;
  for (const auto& trial : trials) {
    const auto& record = trial.contestants[contestant].frames;
    if (record.empty()) continue;
    position.push_back(mean_of_last(record, camera, &FrameRecord::position_mm));
    rotation.push_back(mean_of_last(record, camera, &FrameRecord::rotation_deg));
    if (const auto converged = frames_to_converge(record, camera)) frames.push_back(*converged);
  }
  return {position.size(), Statistics::of(position), Statistics::of(rotation), position.size() - frames.size(),
          Statistics::of(frames)};
}

Json to_json(const ReachResult& r) {
  const auto figures = [](const Statistics& s) { return Json{{"mean", s.mean}, {"sd", s.sd}, {"worst", s.worst}}; };
  Json frames = {{"mean", nullptr}, {"never", r.never}};
  if (r.never < r.trials) frames["mean"] = r.frames_to_converge.mean;
  return {{"trials", r.trials},
          {"position_mm", figures(r.position_mm)},
          {"orientation_deg", figures(r.rotation_deg)},
          {"frames_to_converge", frames}};
}

void add_row(ExperimentContext& context, const std::string& name, const ReachResult& r) {
  context.table += fmt::format("{:<38} {:>5.2f} +- {:<5.2f} {:>5.2f} +- {:<5.2f} {:>6.2f} {:>6.2f} {:>7}\n", name,
                               r.position_mm.mean, r.position_mm.sd, r.rotation_deg.mean, r.rotation_deg.sd,
                               r.position_mm.worst, r.rotation_deg.worst, frames_text(r));
}

void add_heading(ExperimentContext& context, const std::string& title, int trials) {
  context.table += fmt::format(
      "\n{} ({} trials; means over them of each one's last ten frames)\n{:<38} {:>14} {:>14} {:>6} {:>6} {:>7}\n",
      title, trials, "", "position mm", "rotation deg", "worst", "worst", "frames");
}

void chart_errors(ExperimentContext& context, const std::string& title, const std::vector<TrialRecord>& trials,
                  const std::vector<Contestant>& contestants, std::size_t camera) {
  context.report.heading(title);
  struct Figure {
    const char* what;
    const char* unit;
    std::array<double, 2> FrameRecord::*values;
  };
  for (const Figure& figure : {Figure{"position error", "mm", &FrameRecord::position_mm},
                               Figure{"orientation error", "deg", &FrameRecord::rotation_deg}}) {
    Chart chart;
    chart.title = std::string(figure.what) + ", mean of " + std::to_string(trials.size()) + " trials";
    chart.x_label = "frame";
    chart.y_label = figure.unit;
    chart.logarithmic_y = true;
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      ChartSeries series{contestants[i].name, {}, {}};
      for (std::size_t f = 0; f < trials.front().contestants[i].frames.size(); ++f) {
        std::vector<double> values;
        for (const auto& trial : trials) {
          if (f >= trial.contestants[i].frames.size()) continue;
          const double value = (trial.contestants[i].frames[f].*figure.values)[camera];
          if (value >= 0.0) values.push_back(value);
        }
        if (values.empty()) continue;
        series.x.push_back(static_cast<double>(f));
        series.y.push_back(Statistics::of(values).mean);
      }
      series.colour = colour_of(contestants[i].name);
      chart.series.push_back(std::move(series));
    }
    context.report.chart(chart);
  }
}

void judge_converged(ExperimentContext& context, const std::string& mode, const std::vector<TrialRecord>& trials,
                     std::size_t contestant) {
  int in_time = 0;
  int converged_frames = 0;
  int false_frames = 0;
  for (const auto& trial : trials) {
    bool found = false;
    const auto& frames = trial.contestants[contestant].frames;
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (frames[i].state != EstimatorState::kConverged) continue;
      if (!found && i < 45) ++in_time;
      found = true;
      ++converged_frames;
      if (frames[i].position_mm[kLeft] > 2.0) ++false_frames;
    }
  }
  const double within = static_cast<double>(in_time) / static_cast<double>(trials.size());
  const double wrong = converged_frames > 0 ? static_cast<double>(false_frames) / converged_frames : 0.0;
  context.summary[mode]["converged"] = {{"within_45_rate", within}, {"false_rate", wrong}};
  context.table +=
      fmt::format("{}: state converged within 45 frames in {:.0f} %, wrong (over 2 mm) in {:.2f} % of its frames\n",
                  mode, 100.0 * within, 100.0 * wrong);
}

}  // namespace bodyschema
