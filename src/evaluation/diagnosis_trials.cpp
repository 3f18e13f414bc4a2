#include "diagnosis_trials.hpp"

#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/core/write_file.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/simulator/random.hpp"
#include "bodyschema/simulator/recording.hpp"
#include "in_parallel.hpp"
#include "scratch.hpp"

namespace bodyschema::diagnosis_trials {
namespace {

namespace fs = std::filesystem;
using simulator::FaultSpec;

using HandTruth = std::map<std::pair<Microseconds, std::size_t>, Eigen::Vector3d>;

/// Faults of covers, cameras and held things, which draw_fault does not draw.
constexpr std::array<Drawn, 9> kCoversAndCameras = {{{"mesh_scale:part=hand", 2.0},
                                                     {"mesh_scale:part=forearm", 2.0},
                                                     {"cover_dilation:part=hand", 1.0},
                                                     {"cover_dilation:part=forearm", 1.0},
                                                     {"camera_rotation:source=left,axis=x", 0.5},
                                                     {"camera_rotation:source=right,axis=z", 0.5},
                                                     {"held:thing=stick", 0.0},
                                                     {"held:thing=bottle", 0.0},
                                                     {"held:thing=box", 0.0}}};
constexpr double kShareOfCoversAndCameras = 0.25;
constexpr const char* kRefused = "refused";

std::string argument(const FaultSpec& fault, const char* key) {
  const auto at = fault.arguments.find(key);
  return at == fault.arguments.end() ? std::string() : at->second;
}

bool among(const RightAnswers& answers, const CauseName& cause) {
  return std::find(answers.begin(), answers.end(), cause) != answers.end();
}

/// Of this thread, s: other logs run beside it.
double processor_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

bool is_held(const FaultSpec& fault) {
  return fault.name == "held";
}

double hand_error_mm(const DiagnosisReport& report, const HandTruth& truth, Remainder ResidualSample::*which) {
  double square = 0.0, n = 0.0;
  for (const auto& sample : report.samples) {
    const auto at = truth.find({sample.utime, sample.camera});
    if (at == truth.end() || (sample.*which).rms_px <= 0.0) continue;
    square += ((sample.*which).hand_C_m - at->second).squaredNorm();
    n += 1.0;
  }
  return n > 0.0 ? 1e3 * std::sqrt(square / n) : 0.0;
}

/// A robot that is simulated, and the configuration with which its logs are diagnosed.
class TrialRobot {
 public:
  /// @param of_masks  `diagnosed` for pictures that are masks
  TrialRobot(const Configuration& simulated, Configuration diagnosed, Configuration of_masks, bool masks)
      : setup_(RobotSetup::from(simulated.section("robot"))), rig_(StereoRig::from(simulated.section("cameras"))),
        robot_(load_robot(setup_, rig_)), roles_(JointRoles::of(robot_, setup_, rig_)),
        settings_(simulator::SimulatorSettings::from(simulated.section("simulator"))),
        pictures_{std::move(diagnosed), settings_, kPictures, false}, of_masks_{std::move(of_masks), settings_,
                                                                                masks ? kMasks : kSizing, true},
        kind_(masks ? of_masks_ : pictures_) {
    pictures_.settings.camera_rate_hz = kPictures.rate_hz;
    of_masks_.settings.camera_rate_hz = of_masks_.size.rate_hz;
    constexpr double kOutline_px = 0.3;
    of_masks_.settings.outline_noise.sd_px = kOutline_px;
    of_masks_.settings.background_frames = of_masks_.settings.entry_frames = 0;
  }
  TrialRobot(const TrialRobot&) = delete;
  TrialRobot& operator=(const TrialRobot&) = delete;

  Outcome run(Row row, std::uint64_t seed) const;

 private:
  /// How logs are made and diagnosed.
  struct Kind {
    Configuration configuration;
    simulator::SimulatorSettings settings;
    LogSize size;
    bool masks;
  };

  /// Single causes of all sizes, from invisible to gross; of several, and of those outside the catalogue, such as
  /// matter by themselves; in the background, such as are not seen alone.
  [[nodiscard]] std::vector<FaultSpec> draw(Row row, const simulator::SimulationPlan& plan) const {
    const auto seed = plan.seed;
    simulator::FaultSite site(robot_, setup_, rig_);
    site.begin_s = 0.0;
    site.end_s = kMasks.seconds;
    simulator::Random random(seed, "size of the fault");
    const auto [lowest, highest] = row == kSingle ? std::pair(0.15, 6.0) : std::pair(1.2, 4.0);
    const auto wanted = [&, low = lowest, ratio = highest / lowest] {
      return low * std::pow(ratio, random.uniform(0.0, 1.0));
    };
    if (row == kSingle && random.uniform(0.0, 1.0) < kShareOfCoversAndCameras) {
      return {sized(draw_cover_or_camera(random, kind_.masks), wanted(), plan)};
    }
    simulator::DrawOptions options;
    options.outside_catalogue = row == kOutside;
    std::vector<FaultSpec> faults;
    constexpr int kCrowd = 9;
    const int count = row == kNull ? 0 : row == kTwo ? 2 : row == kBackground ? kCrowd : 1;
    for (int i = 0; i < count; ++i) {
      options.multiple_of_detectable = row == kBackground ? random.uniform(0.2, 0.8) : 3.0;
      auto fault = simulator::draw_fault(seed + 100000u * static_cast<std::uint64_t>(i), site, options);
      faults.push_back(row == kBackground ? std::move(fault) : sized(std::move(fault), wanted(), plan));
      options.exclude.push_back(faults.back().name);
    }
    return faults;
  }

  [[nodiscard]] RightAnswers answers_to(const FaultSpec& fault) const {
    const auto part = argument(fault, "part"), joint = argument(fault, "joint"), source = argument(fault, "source");
    if (is_held(fault)) return {};
    if (fault.name == "camera_rotation") {
      return {{"first_camera", "", ""},
              {"camera_pair", "", ""},
              {"vergence", "", ""},
              {"principal_point", "", "difference"}};
    }
    if (part.empty()) return {{fault.name, joint, source}};
    RightAnswers answers;
    for (const auto* name : {"mesh_scale", "cover_thickness", "silhouette_bias", "segment_size"})
      answers.push_back({name, "", segment_of(part)});
    return answers;
  }

  static FaultSpec draw_cover_or_camera(simulator::Random& random, bool masks) {
    const auto shown = covers_and_cameras(masks);
    const auto& drawn = shown[random.below(shown.size())];
    auto fault = FaultSpec::parse(drawn.spec);
    if (drawn.value <= 0.0) return fault;
    // A cover is never drilled out: it is as moulded, or thicker.
    const double sign = fault.name == "cover_dilation" ? 1.0 : random.sign();
    return fault.set("value", sign * drawn.value);
  }

  /// Whether it lies within what the simulator takes.
  [[nodiscard]] bool can_be_played(const FaultSpec& fault) const {
    try {
      simulator::make_fault(fault, simulator::FaultSite(robot_, setup_, rig_));
      return true;
    } catch (const ConfigurationError&) {
      return false;
    }
  }

  /// The fault with the size that is wanted (Outcome::size): by itself, in a log of masks of the same motion. Offsets
  /// and the usual nuisances are fitted, nothing else; what the same log leaves without the fault is noise.
  [[nodiscard]] FaultSpec sized(FaultSpec fault, double wanted, simulator::SimulationPlan plan) const {
    if (is_held(fault)) return fault;
    constexpr int kRounds = 3;
    constexpr double kNear = 1.25, kMost = 8.0;  // times what it begins with: more is no robot
    const double begin = std::abs(fault.value());
    plan.faults = {};
    const Outcome healthy = outcome_of(of_masks_, plan, true);
    for (int round = 0; round < kRounds; ++round) {
      plan.faults = {fault};
      Outcome seen = outcome_of(of_masks_, plan, true);
      const auto beyond = [](double all, double noise) { return std::sqrt(std::max(0.0, all * all - noise * noise)); };
      double size = std::max(beyond(seen.size_mm, healthy.size_mm) / kMatters_mm,
                             beyond(seen.size_px, healthy.size_px) / kMatters_px);
      if (seen.report.verdict == kRefused) size = 2.0 * wanted;  // too gross for any answer
      const double factor = std::min(wanted / std::max(size, wanted / kMost), kMost * begin / std::abs(fault.value()));
      if (factor < kNear && factor > 1.0 / kNear) break;
      FaultSpec scaled = fault;
      scaled.set("value", fault.value() * factor);
      if (!can_be_played(scaled)) break;
      fault = std::move(scaled);
    }
    return fault;
  }

  /// The segment of the diagnosis that is called so here: the hand, or what comes before it.
  [[nodiscard]] std::string segment_of(const std::string& part) const {
    if (part == "hand") return setup_.hand_link;
    for (const auto& segment : roles_.segments) {
      if (segment.name.find(part) != std::string::npos) return segment.name;
    }
    return part;
  }

  static HandTruth simulate(const Kind& kind, simulator::Simulator simulator, const fs::path& file) {
    HandTruth truth;
    LogWriter log(file);
    simulator::FramePublisher::Options format;
    if (kind.masks) format.format = simulator::PictureFormat::kMasks;
    simulator::FramePublisher publisher(simulator.joint_names(), format);
    while (const auto frame = simulator.next()) {
      publisher.publish(*frame, log);
      for (std::size_t c = 0; c < frame->cameras.size(); ++c) {
        if (frame->cameras[c]) truth[{frame->cameras[c]->utime, c}] = frame->truth[c].X_CP.translation();
      }
    }
    return truth;
  }

  [[nodiscard]] Outcome outcome_of(const Kind& kind, simulator::SimulationPlan plan, bool fit_only) const;

  RobotSetup setup_;
  StereoRig rig_;
  std::shared_ptr<const RobotModel> robot_;
  JointRoles roles_;
  simulator::SimulatorSettings settings_;
  Kind pictures_, of_masks_;
  const Kind& kind_;  ///< of the trials; sizes are measured on masks
};

Outcome TrialRobot::outcome_of(const Kind& kind, simulator::SimulationPlan plan, bool fit_only) const {
  const Scratch log("diagnosis.log");
  plan.seconds = kind.size.seconds;
  if (kind.masks) plan.output = simulator::Output::kSilhouettes;
  const double begin_s = processor_s();
  const auto truth = simulate(kind, {robot_, setup_, rig_, kind.settings, plan}, log.path());
  const double simulated_s = processor_s();
  LogDiagnosisOptions options;
  options.log = log.path();
  options.picture_rate_hz = kind.size.rate_hz;
  options.threads = 1;  // other logs run beside this one
  options.quiet = true;
  options.fit_only = fit_only;
  Outcome outcome;
  outcome.motion_s = plan.seconds - 1.0 / kind.size.rate_hz;
  try {
    outcome.report = diagnose_log(kind.configuration, options);
  } catch (const DataError& e) {
    outcome.report.verdict = kRefused;  // an answer as well
    outcome.report.sentence = e.what();
  }
  outcome.simulation_s = simulated_s - begin_s;
  outcome.diagnosis_s = processor_s() - simulated_s;
  outcome.size_mm = hand_error_mm(outcome.report, truth, &ResidualSample::before);
  outcome.left_mm = hand_error_mm(outcome.report, truth, &ResidualSample::after);
  outcome.size_px = outcome.report.before.rms_px;  // the noise of healthy logs comes off once that is known
  return outcome;
}

Outcome TrialRobot::run(Row row, std::uint64_t seed) const {
  simulator::SimulationPlan plan;
  plan.seed = seed;
  plan.motion = simulator::Motion::kBabble;
  simulator::Random random(seed, "offsets");
  for (const auto& joint : setup_.estimated_joints) plan.offsets_deg[joint] = random.uniform(-7.0, 7.0);
  const double begin_s = processor_s();
  plan.faults = draw(row, plan);
  const double sizing_s = processor_s() - begin_s;
  Outcome outcome = outcome_of(kind_, plan, false);
  outcome.sizing_s = sizing_s;
  outcome.row = row;
  outcome.seed = seed;
  outcome.faults = plan.faults;
  for (const auto& fault : outcome.faults) outcome.answers.push_back(answers_to(fault));
  return outcome;
}

/// What a configuration needs for pictures that are masks.
std::vector<std::string> with_masks(std::vector<std::string> overrides) {
  overrides.insert(overrides.end(), {"vision.method=single_colour", "vision.background_rgb=[0, 0, 0]"});
  return overrides;
}

std::optional<TrialRobot> official_robot(const ExperimentContext& context) {
  const auto models = context.options.data / "icub-models";
  if (!fs::is_directory(models)) return std::nullopt;
  const auto folder = context.recorded / "icub_v2_5";
  // The configurations look for the data where BODYSCHEMA_DATA says; here it is where the caller says.
  const std::vector<std::string> overrides = {
      "robot.urdf=" + (models / "iCub_manual/robots/iCubGazeboV2_5_visuomanip/model.urdf").string(),
      "robot.mesh_search_roots=[\"" + models.string() + "\"]"};
  const auto estimator = folder / "estimator.yaml";
  return std::optional<TrialRobot>(std::in_place, Configuration::load(folder / "simulator.yaml", overrides),
                                   Configuration::load(estimator, overrides),
                                   Configuration::load(estimator, with_masks(overrides)), context.options.masks);
}

}  // namespace

std::vector<Drawn> covers_and_cameras(bool masks) {
  std::vector<Drawn> shown(kCoversAndCameras.begin(), kCoversAndCameras.end());
  if (masks) std::erase_if(shown, [](const Drawn& drawn) { return is_held(FaultSpec::parse(drawn.spec)); });
  return shown;
}

double Record::size() const {
  // No outline of the model shows a thing that is held: it is as large as it is.
  return held ? 1e3 : std::max(size_mm / kMatters_mm, size_px / kMatters_px);
}

std::vector<DiagnosedCause> stated(const Outcome& o) {
  const auto& verdict = o.report.verdict;
  if (verdict != "named" && verdict != "class" && verdict != "none") return {};
  std::vector<DiagnosedCause> list;
  if (verdict != "none") list = o.report.causes;
  list.insert(list.end(), o.report.estimated.begin(), o.report.estimated.end());
  return list;
}

bool is_named(const Outcome& o) {
  return !stated(o).empty();
}

bool is_found(const Outcome& o, std::size_t fault) {
  if (is_held(o.faults[fault])) return !o.report.not_in_model.empty();
  const auto list = stated(o);
  return std::any_of(list.begin(), list.end(), [&](const DiagnosedCause& cause) {
    return std::any_of(cause.same.begin(), cause.same.end(),
                       [&](const auto& name) { return among(o.answers[fault], name); });
  });
}

bool is_first(const Outcome& o) {
  if (is_held(o.faults[0])) return is_found(o, 0);
  const auto list = stated(o);
  return !list.empty() && among(o.answers[0], list.front().cause);
}

bool is_wrong(const Outcome& o) {
  const auto list = stated(o);
  return std::any_of(list.begin(), list.end(), [&](const DiagnosedCause& cause) {
    return std::none_of(o.answers.begin(), o.answers.end(), [&](const RightAnswers& answers) {
      return std::any_of(cause.same.begin(), cause.same.end(), [&](const auto& name) { return among(answers, name); });
    });
  });
}

bool is_not_explained_away(const Outcome& o) {
  if (o.report.verdict != "class") return o.report.verdict == "unexplained";
  const auto joint = argument(o.faults[0], "joint");
  return std::any_of(o.report.causes.begin(), o.report.causes.end(), [&](const DiagnosedCause& cause) {
    return std::any_of(cause.same.begin(), cause.same.end(),
                       [&](const auto& name) { return name.joint == joint || name.source == joint; });
  });
}

double hidden_size(const FaultSpec& fault, const DiagnosedParameter& told, double motion_s) {
  return told.duration_s && motion_s > 0.0 ? fault.value() * *told.duration_s / motion_s : fault.value();
}

namespace {

bool names_a_large_gain(const Outcome& o) {
  constexpr double kLarge = 0.05;
  const auto list = stated(o);
  return std::any_of(list.begin(), list.end(), [](const DiagnosedCause& c) { return c.heldout_gain > kLarge; });
}

Json sizes_of(const Outcome& o) {
  Json sizes = Json::array();
  const auto list = stated(o);
  for (std::size_t f = 0; f < o.faults.size(); ++f) {
    const auto& fault = o.faults[f];
    for (const auto& cause : list) {
      // Millimetres of a cover are not the pixels of its outline.
      if (!among(o.answers[f], cause.cause) || cause.cause.name != fault.name) continue;
      if (cause.parameters.size() != 1 || fault.value() == 0.0) continue;
      const auto& p = cause.parameters.front();
      sizes.push_back(
          {{"estimate", p.estimate}, {"width", p.ci95[1] - p.ci95[0]}, {"truth", hidden_size(fault, p, o.motion_s)}});
    }
  }
  return sizes;
}

struct Job {
  Row row;
  std::uint64_t seed;
  bool official;
  double turn;  ///< when it is run: rows take turns, so that of each as large a share is done
};

/// What tells a log from others, in its line.
Json key_of(Row row, std::uint64_t seed, bool official, bool masks) {
  return {{"row", kNames[row]},
          {"seed", seed},
          {"robot", official ? "official iCub" : "own"},
          {"pictures", masks ? "masks" : "rendered"}};
}

std::vector<Job> jobs_of(const EvaluationOptions& options, bool has_official) {
  constexpr long kEveryFourth = 4;
  std::vector<Job> jobs;
  for (int row = 0; row < kRows; ++row) {
    const auto count = std::max(1L, std::lround(kLogsOf60[static_cast<std::size_t>(row)] * options.trials / 60.0));
    for (long i = 0; i < count; ++i) {
      jobs.push_back({static_cast<Row>(row),
                      options.seed + 1000u * static_cast<std::uint64_t>(row) + static_cast<std::uint64_t>(i),
                      has_official && i % kEveryFourth == kEveryFourth - 1,
                      (static_cast<double>(i) + 0.5) / static_cast<double>(count)});
    }
  }
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) { return a.turn < b.turn; });
  return jobs;
}

/// Lines of a run before; the last one may be cut short.
std::vector<Json> lines_of(const fs::path& file) {
  std::vector<Json> lines;
  std::ifstream in(file);
  for (std::string text; std::getline(in, text);) {
    auto line = Json::parse(text, nullptr, false);
    if (line.is_object()) lines.push_back(std::move(line));
  }
  return lines;
}

/// Lines in their jobs' places, written as they come.
class Lines {
 public:
  Lines(const std::vector<Job>& jobs, const EvaluationOptions& options)
      : file_(options.out / "trials.jsonl"), lines_(jobs.size()) {
    std::vector<Json> before;
    if (options.resume) before = lines_of(file_);
    std::string text;
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      const auto key = key_of(jobs[i].row, jobs[i].seed, jobs[i].official, options.masks);
      const auto at = std::find_if(before.begin(), before.end(), [&](const Json& line) {
        return std::all_of(key.items().begin(), key.items().end(), [&](const auto& item) {
          return line.contains(item.key()) && line[item.key()] == item.value();
        });
      });
      if (at == before.end()) continue;
      lines_[i] = *at;
      text += at->dump() + '\n';
    }
    replace_file(file_, text);
    out_.open(file_, std::ios::app);
  }
  [[nodiscard]] bool has(std::size_t job) const { return !lines_[job].is_null(); }
  void set(std::size_t job, Json line) {
    out_ << line.dump() << '\n' << std::flush;
    lines_[job] = std::move(line);
  }
  /// In the jobs' order, whoever was done first.
  std::vector<Json> finish() {
    out_.close();
    std::erase_if(lines_, [](const Json& line) { return line.is_null(); });
    std::string text;
    for (const auto& line : lines_) text += line.dump() + '\n';
    replace_file(file_, text);
    return std::move(lines_);
  }

 private:
  fs::path file_;
  std::vector<Json> lines_;
  std::ofstream out_;
};

}  // namespace

Json line_of(const Outcome& o) {
  Json faults = Json::array(), answer = Json::array(), found = Json::array();
  for (std::size_t f = 0; f < o.faults.size(); ++f) {
    faults.push_back(o.faults[f].text());
    found.push_back(is_found(o, f));
  }
  auto listed = o.report.causes;
  listed.insert(listed.end(), o.report.estimated.begin(), o.report.estimated.end());
  for (const auto& c : listed) {
    Json names = Json::array();
    for (const auto& name : c.same) names.push_back(name.text());
    answer.push_back({{"sentence", c.sentence}, {"class", names}, {"z", c.z}, {"gain", c.heldout_gain}});
  }
  Json line = key_of(o.row, o.seed, o.official, o.masks);
  line.update({{"faults", faults},
               {"verdict", o.report.verdict},
               {"sentence", o.report.sentence},
               {"found", found},
               {"named", is_named(o)},
               {"first", !o.faults.empty() && is_first(o)},
               {"wrong", is_wrong(o)},
               {"not_explained_away", !o.faults.empty() && is_not_explained_away(o)},
               {"large_gain", names_a_large_gain(o)},
               {"held", std::any_of(o.faults.begin(), o.faults.end(), is_held)},
               {"answer", answer},
               {"sizes", sizes_of(o)},
               {"size_mm", o.size_mm},
               {"seen_px", o.size_px},
               {"left_mm", o.left_mm},
               {"left_px", o.report.after.rms_px},
               {"seconds", o.sizing_s + o.simulation_s + o.diagnosis_s},
               {"sizing_s", o.sizing_s},
               {"simulation_s", o.simulation_s}});
  return line;
}

Record record_of(const Json& line) {
  Record r;
  const auto name = line.at("row").get<std::string>();
  r.row = static_cast<Row>(std::find(kNames.begin(), kNames.end(), name) - kNames.begin());
  r.official = line.at("robot") == "official iCub";
  r.named = line.at("named");
  r.first = line.at("first");
  r.wrong = line.at("wrong");
  r.not_explained_away = line.at("not_explained_away");
  r.large_gain = line.at("large_gain");
  r.held = line.at("held");
  for (const auto& found : line.at("found")) r.found.push_back(found.get<bool>());
  r.verdict = line.at("verdict").get<std::string>();
  r.size_mm = line.at("size_mm");
  r.size_px = line.at("seen_px");
  r.left_mm = line.at("left_mm");
  r.seconds = line.at("seconds");
  for (const auto& size : line.at("sizes"))
    r.sizes.push_back({size.at("estimate"), size.at("width"), size.at("truth")});
  return r;
}

std::vector<Json> run(ExperimentContext& context) {
  const auto& options = context.options;
  const auto estimator = context.recorded / "icub_right" / "estimator.yaml";
  const TrialRobot own(context.simulated, Configuration::load(estimator),
                       Configuration::load(estimator, with_masks({})), options.masks);
  const auto official = official_robot(context);
  const auto jobs = jobs_of(options, official.has_value());
  Lines lines(jobs, options);
  ProgressBar bar("logs with hidden faults", jobs.size());
  const auto begin = std::chrono::steady_clock::now();
  const auto is_over = [&] {
    const std::chrono::duration<double, std::ratio<60>> passed = std::chrono::steady_clock::now() - begin;
    return options.minutes > 0.0 && passed.count() >= options.minutes;
  };
  std::mutex mutex;
  in_parallel(jobs.size(), options.threads, [&](std::size_t i) {
    if (is_over()) return;
    Json line;
    if (!lines.has(i)) {
      auto outcome = (jobs[i].official ? *official : own).run(jobs[i].row, jobs[i].seed);
      outcome.official = jobs[i].official;
      outcome.masks = options.masks;
      line = line_of(outcome);
    }
    const std::scoped_lock lock(mutex);
    if (!line.is_null()) lines.set(i, std::move(line));
    bar.advance(1);
  });
  return lines.finish();
}

}  // namespace bodyschema::diagnosis_trials
