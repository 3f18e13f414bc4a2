#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/evaluation/statistics.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/outline_noise.hpp"
#include "experiments.hpp"
#include "honesty_figures.hpp"
#include "trial_runner.hpp"

namespace bodyschema {
namespace {

using simulator::FaultSpec;
using Random = std::mt19937_64;

constexpr double kRate_hz = 10.0;
constexpr double kSeconds = 15.0;
/// Of the logs with an error, the last of so many draws it at twice its size.
constexpr std::size_t kEveryFourth = 4;

double normal(Random& random, double sd) {
  return std::normal_distribution<double>(0.0, sd)(random);
}

double sign(Random& random) {
  return (random() & 1u) != 0 ? 1.0 : -1.0;
}

double between(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// A direction in space, every one as likely.
Eigen::Vector3d direction(Random& random) {
  return Eigen::Vector3d(normal(random, 1.0), normal(random, 1.0), normal(random, 1.0)).normalized();
}

void add_links(TrialSetting& setting, Random& random, double times) {
  for (const char* joint : {"r_shoulder_yaw", "r_wrist_prosup"}) {
    setting.plan.faults.push_back(FaultSpec::of("link_length", joint, times * normal(random, 5.0)));
  }
}

/// A hand of another make: palm and fingers of other sizes, fingers of another thickness, on the same joints.
void add_other_hand(TrialSetting& setting, Random& random, double times) {
  for (const auto& [part, percent] : {std::pair{"palm", 6.0}, std::pair{"fingers", 10.0}}) {
    auto scale = FaultSpec::of("mesh_scale", "", times * percent * sign(random));
    scale.arguments["part"] = part;
    setting.plan.faults.push_back(scale);
  }
  auto thicker = FaultSpec::of("cover_dilation", "", times);  // mm
  thicker.arguments["part"] = "fingers";
  setting.plan.faults.push_back(thicker);
}

void add_focal_length(TrialSetting& setting, Random& random, double times) {
  setting.plan.faults.push_back(FaultSpec::of("focal_length", "", times * sign(random)));
}

void add_lens(TrialSetting& setting, Random& random, double times) {
  setting.simulator.lens_k1 = -std::min(0.4, times * between(random, 0.1, 0.3));
}

void add_camera_pose(TrialSetting& setting, Random& random, double times) {
  const Eigen::Vector3d shift_mm = 5.0 * times * direction(random), turn_deg = 0.5 * times * direction(random);
  constexpr std::array kAxes = {"x", "y", "z"};
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (const auto& [name, value] : {std::pair{"camera_position", shift_mm[i]}, {"camera_rotation", turn_deg[i]}}) {
      auto fault = FaultSpec::of(name, "", value);
      fault.arguments["axis"] = kAxes[static_cast<std::size_t>(i)];
      fault.arguments["source"] = "common";
      setting.plan.faults.push_back(fault);
    }
  }
}

void add_dilation(TrialSetting& setting, Random&, double times) {
  setting.plan.faults.push_back(FaultSpec::of("silhouette_bias", "", times));
}

/// A segmentation that puts outlines beside their place, alike over lengths of them.
void add_outline_noise(TrialSetting& setting, Random& random, double times) {
  const simulator::OutlineNoise noise{times, 20.0, 0.3};
  const std::uint64_t seed = random();
  auto displacers = std::make_shared<std::vector<simulator::OutlineDisplacer>>();
  setting.on_masks = [=, index = std::int64_t{0}](Observation& observation) mutable {
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (!observation.cameras[c] || observation.cameras[c]->coverage.empty()) continue;
      auto& camera = *observation.cameras[c];
      const int width = camera.mask.width(), height = camera.mask.height();
      while (displacers->size() <= c) {
        displacers->emplace_back(width, height, noise, seed, fmt::format("camera {}", displacers->size()));
      }
      std::vector<float> coverage(camera.coverage.begin(), camera.coverage.end());
      for (float& share : coverage) share /= 255.0f;
      (*displacers)[c].displace(seconds(observation.utime), index, coverage);
      BinaryMask mask(width, height);
      for (std::size_t i = 0; i < coverage.size(); ++i) {
        camera.coverage[i] = static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(coverage[i], 0.0f, 1.0f)));
        if (camera.coverage[i] < 128) continue;
        mask.set(static_cast<int>(i) % width, static_cast<int>(i) / width, true);
      }
      camera.mask = std::move(mask);
    }
    ++index;
  };
}

void add_curled_fingers(TrialSetting& setting, Random&, double times) {
  setting.plan.faults.push_back(FaultSpec::of("finger_posture", "", 15.0 * times));
}

void add_held(TrialSetting& setting, Random& random, double) {
  constexpr std::array kThings = {"box", "bottle", "stick"};
  auto held = FaultSpec::of("held", "", 0.0);
  held.arguments["thing"] = kThings[random() % kThings.size()];
  setting.plan.faults.push_back(held);
}

void add_latency(TrialSetting& setting, Random&, double times) {
  setting.plan.faults.push_back(FaultSpec::of("latency", "", 20.0 * times));
}

/// One error that the model knows nothing of, or that lies far outside of what it believes possible.
struct HonestyRow {
  const char* key;
  const char* title;
  /// @param times  how many times its size
  void (*add)(TrialSetting& setting, Random& random, double times);
};

constexpr std::array kHonestyRows = {HonestyRow{"link_length", "link lengths, sd 5 mm", add_links},
                                     HonestyRow{"other_hand", "another hand on the arm", add_other_hand},
                                     HonestyRow{"focal_length", "focal length, 1 %", add_focal_length},
                                     HonestyRow{"lens", "lens k1 -0.1 to -0.3 left out", add_lens},
                                     HonestyRow{"camera_pose", "cameras' pose, 0.5 deg and 5 mm", add_camera_pose},
                                     HonestyRow{"dilation", "outlines dilated by 1 px", add_dilation},
                                     HonestyRow{"outline_noise", "outline noise 1 px over 20 px", add_outline_noise},
                                     HonestyRow{"fingers", "fingers curled 15 deg more", add_curled_fingers},
                                     HonestyRow{"held", "a thing held in the hand", add_held},
                                     HonestyRow{"latency", "latency, 20 ms", add_latency}};

TrialSetting honesty_setting(const ExperimentContext& context, const Configuration& estimator, Random& random) {
  TrialSetting setting = standard_setting(context);
  setting.estimator = estimator;
  setting.simulator.camera_rate_hz = kRate_hz;
  setting.plan.motion = simulator::Motion::kBabble;
  setting.plan.seconds = kSeconds;
  for (auto& [joint, offset] : setting.plan.offsets_deg) offset = normal(random, 4.0);
  return setting;
}

/// Seeds of a log's own draws.
Random random_of(std::uint64_t seed) {
  return Random(seed * 15485863u + 101u);
}

std::vector<const HonestyLog*> pointers(const std::vector<HonestyLog>& logs) {
  std::vector<const HonestyLog*> list;
  for (const auto& log : logs) list.push_back(&log);
  return list;
}

void add_line(ExperimentContext& context, const std::string& title, const HonestyFigures& f) {
  context.table += fmt::format("{:<34} {:>5} {:>10.1f} {:>9.1f} {:>9.1f} {:>10.1f} {:>9.1f} {:>9.1f} {:>9.2f}\n", title,
                               f.logs, 100.0 * f.converged_rate, 100.0 * f.dishonest_frame_rate,
                               100.0 * f.dishonest_log_rate, 100.0 * f.coverage95, 100.0 * f.unconverged_hand_coverage,
                               100.0 * f.hand_sd_published_rate, f.sd_to_error_median);
}

/// What one log came to, for those who want to look at it.
Json log_json(const char* row, const TrialRecord& trial, const HonestyLog& log, bool twice = false) {
  std::map<std::string, int> states;
  std::vector<double> error_mm, sd_mm, offset_z;
  for (const auto& frame : trial.contestants[0].frames) ++states[to_string(frame.state)];
  for (const auto& frame : log) {
    if (frame.hand_error_mm) error_mm.push_back(*frame.hand_error_mm);
    sd_mm.push_back(frame.hand_sd_mm);
    offset_z.push_back(frame.offset_error_deg.cwiseQuotient(frame.offset_sd_deg).cwiseAbs().maxCoeff());
  }
  const auto figures = honesty_figures({&log});
  Json json = {{"row", row}, {"seed", trial.seed}, {"twice", twice}};
  for (const auto& [state, count] : states) json["frames"][state] = count;
  json["dishonest_frame_rate"] = figures.dishonest_frame_rate;
  json["hand_error_median_mm"] = Statistics::of(error_mm).median;
  json["hand_sd_median_mm"] = Statistics::of(sd_mm).median;
  json["worst_offset_median_sd"] = Statistics::of(offset_z).median;
  return json;
}

/// Frame by frame, a line a log: where what was said did not hold.
std::string frames_line(const char* row, const TrialRecord& trial, const HonestyLog& log) {
  Json json = {{"row", row}, {"seed", trial.seed}};
  for (std::size_t f = 0; f < log.size(); ++f) {
    json["state"].push_back(to_string(trial.contestants[0].frames[f].state));
    json["hand_error_mm"].push_back(log[f].hand_error_mm ? Json(*log[f].hand_error_mm) : Json(nullptr));
    json["hand_sd_mm"].push_back(log[f].hand_sd_mm);
    const auto& error = log[f].offset_error_deg;
    const auto& sd = log[f].offset_sd_deg;
    json["worst_offset_sd"].push_back(error.cwiseQuotient(sd).cwiseAbs().maxCoeff());
    json["offset_error_deg"].push_back(std::vector<double>(error.begin(), error.end()));
    json["offset_sd_deg"].push_back(std::vector<double>(sd.begin(), sd.end()));
    for (const auto& p : trial.contestants[0].frames[f].effects) {
      json["effects"][p.name].push_back({p.value / p.si_per_unit, p.sd / p.si_per_unit});
    }
  }
  return json.dump() + '\n';
}

constexpr const char* kHealthy = "healthy";

void add_healthy(ExperimentContext& context, const Configuration& estimator, int count, Json& summary,
                 std::vector<HonestyLog>& all, std::string& frames) {
  std::vector<Contestant> contestants = {{"tolerances", options_for(context, "best")},
                                         {"exact", options_for(context, "best")}};
  contestants[1].beliefs = Pipeline(context.simulated).beliefs();
  const auto records = run_trials(
      context, "honesty: healthy", count,
      [&](std::uint64_t seed) {
        auto random = random_of(seed);
        return honesty_setting(context, estimator, random);
      },
      contestants);
  std::vector<HonestyLog> with, without;
  for (const auto& record : records) {
    with.push_back(honesty_log(record, 0));
    summary["each_log"].push_back(log_json(kHealthy, record, with.back()));
    frames += frames_line(kHealthy, record, with.back());
    without.push_back(honesty_log(record, 1));
  }
  const auto figures = honesty_figures(pointers(with)), exact = honesty_figures(pointers(without));
  summary[kHealthy] = to_json(figures);
  summary[kHealthy]["half_width95_median_deg"] = exact.half_width95_median_deg;  // what is asked of exact robots
  summary["exact"] = to_json(exact);
  add_line(context, kHealthy, figures);
  add_line(context, "healthy, nothing tolerated", exact);
  context.table += fmt::format(
      "  converged within 45 frames in {:.0f} %; nothing tolerated: {:.0f} %, half-width {:.3f} deg\n",
      100.0 * figures.converged_within_45_rate, 100.0 * exact.converged_within_45_rate, exact.half_width95_median_deg);
  all.insert(all.end(), with.begin(), with.end());
}

/// One log with an error.
struct HonestyRun {
  const HonestyRow* row;
  std::uint64_t seed;
  bool twice;
};

/// Errors in turn; of each, every fourth log draws at twice the size. A log's seed does not depend on which rows are
/// asked for.
std::vector<HonestyRun> jobs_of(const ExperimentContext& context, std::uint64_t first, std::size_t faulty) {
  std::vector<HonestyRun> jobs;
  for (std::size_t t = 0; t < faulty; ++t) {
    const HonestyRow& row = kHonestyRows[t % kHonestyRows.size()];
    if (is_asked_for(context.options, row.key)) {
      jobs.push_back({&row, first + t, (t / kHonestyRows.size() + t) % kEveryFourth == kEveryFourth - 1});
    }
  }
  return jobs;
}

std::vector<TrialRecord> run_jobs(const ExperimentContext& context, const Configuration& estimator,
                                  const std::vector<HonestyRun>& jobs) {
  std::vector<std::uint64_t> seeds;
  for (const auto& job : jobs) seeds.push_back(job.seed);
  return run_trials(context, "honesty: one error each", seeds,
                    [&](std::uint64_t seed) {
                      const auto job = std::find_if(jobs.begin(), jobs.end(),
                                                    [&](const HonestyRun& one) { return one.seed == seed; });
                      auto random = random_of(seed);
                      TrialSetting setting = honesty_setting(context, estimator, random);
                      job->row->add(setting, random, job->twice ? 2.0 : 1.0);
                      return setting;
                    },
                    {{"tolerances", options_for(context, "best")}});
}

/// A line for every row; the largest of their medians of sd over error, of logs with an error at its size.
double add_rows(ExperimentContext& context, Json& summary, const std::vector<HonestyRun>& jobs,
                const std::vector<HonestyLog>& logs) {
  double worst_ratio = 0.0;
  for (const auto& row : kHonestyRows) {
    std::vector<const HonestyLog*> of_row, at_size;
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (jobs[i].row != &row) continue;
      of_row.push_back(&logs[i]);
      if (!jobs[i].twice) at_size.push_back(&logs[i]);
    }
    if (of_row.empty()) continue;
    const auto figures = honesty_figures(of_row);
    summary[row.key] = to_json(figures);
    add_line(context, row.title, figures);
    worst_ratio = std::max(worst_ratio, honesty_figures(at_size).sd_to_error_median);
  }
  return worst_ratio;
}

}  // namespace

void run_honesty(ExperimentContext& context, int most_logs) {
  std::vector<std::string> names = {kHealthy};
  for (const auto& row : kHonestyRows) names.emplace_back(row.key);
  check_rows(context.options, names);
  const Configuration estimator =
      Configuration::load(context.recorded / "icub_right/honesty.yaml", context.options.overrides);
  const auto logs = static_cast<std::size_t>(std::min(2 * context.options.trials, most_logs));
  const std::size_t healthy = (logs + 2) / 3, faulty = logs - healthy;
  context.table += fmt::format("\n{:<34} {:>5} {:>10} {:>9} {:>9} {:>10} {:>9} {:>9} {:>9}\n", "honesty", "logs",
                               "converged", "wrong", "logs", "95 % hold", "else", "published", "sd/error");
  Json& summary = context.summary["honesty"];
  std::vector<HonestyLog> all, usual, twice, logs_of;
  std::string frames;
  double worst_ratio = 0.0;
  if (is_asked_for(context.options, kHealthy)) {
    add_healthy(context, estimator, static_cast<int>(healthy), summary, all, frames);
    worst_ratio = summary[kHealthy]["sd_to_error_median"];
  }
  const auto jobs = jobs_of(context, context.options.seed + healthy, faulty);
  const auto records = run_jobs(context, estimator, jobs);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    logs_of.push_back(honesty_log(records[i], 0));
    summary["each_log"].push_back(log_json(jobs[i].row->key, records[i], logs_of.back(), jobs[i].twice));
    frames += frames_line(jobs[i].row->key, records[i], logs_of.back());
    (jobs[i].twice ? twice : usual).push_back(logs_of.back());
  }
  replace_file(context.options.out / "honesty_frames.jsonl", frames);
  worst_ratio = std::max(worst_ratio, add_rows(context, summary, jobs, logs_of));
  const double with_error = honesty_figures(pointers(usual)).converged_rate;
  all.insert(all.end(), usual.begin(), usual.end());
  const auto asked = honesty_figures(pointers(all));
  all.insert(all.end(), twice.begin(), twice.end());
  const auto everything = honesty_figures(pointers(all));
  summary["dishonest_frame_rate"] = everything.dishonest_frame_rate;
  summary["dishonest_log_rate"] = everything.dishonest_log_rate;
  summary["coverage95"] = asked.coverage95;
  summary["unconverged_hand_coverage"] = asked.unconverged_hand_coverage;
  summary["hand_sd_published_rate"] = asked.hand_sd_published_rate;
  summary["converged_rate_with_error"] = with_error;
  summary["sd_to_error_median"] = worst_ratio;
  add_line(context, "all", everything);
  context.table += fmt::format("  logs with an error: converged in {:.0f} % of the frames\n", 100.0 * with_error);
}

}  // namespace bodyschema
