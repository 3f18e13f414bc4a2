// Cost of one whole frame: masks, particles, likelihoods, refinement. Our own robot (8k triangles), or both arms of a
// G1 (200k; where BODYSCHEMA_DATA has it), in a simulated room. Names read `engine/mode/triangles/size/particles`;
// `+ahead`: the next frame's masks are found meanwhile; `played`: a whole reach to and fro, with the frames in which
// the arm is found. See README.md.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"
#include "bodyschema/camera/picture_reduction.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace {

using namespace bodyschema;

struct Size {
  int width, height;
  [[nodiscard]] std::string text() const { return std::to_string(width) + "x" + std::to_string(height); }
};

/// Whose frames are measured.
struct Robot {
  std::string triangles;
  std::filesystem::path configuration;  ///< of the source tree
  double focal_px;                      ///< of a picture 320 px wide
  std::map<std::string, double> offsets_deg;
};

const Robot kOurs{"8k",
                  "config/icub_right/evaluation.yaml",
                  257.34,
                  {{"r_shoulder_pitch", 5}, {"r_elbow", -2}, {"r_wrist_pitch", -7}}};
const Robot kG1{"200k",
                "bench/g1/evaluation.yaml",
                302.5,
                {{"right_shoulder_pitch_joint", 3}, {"right_elbow_joint", -2}, {"right_wrist_pitch_joint", -4}}};

Configuration configuration(const Robot& robot, const std::string& engine, const std::string& mode, Size size,
                            int particles) {
  std::vector<std::string> overrides{"silhouette.engine=" + engine, "estimator.mode=" + mode,
                                     "filter.particles=" + std::to_string(particles)};
  const double focal_px = robot.focal_px * size.width / 320.0;
  for (const std::string camera : {"cameras.left.", "cameras.right."}) {
    overrides.push_back(camera + "width=" + std::to_string(size.width));
    overrides.push_back(camera + "height=" + std::to_string(size.height));
    overrides.push_back(camera + "fx=" + std::to_string(focal_px));
    overrides.push_back(camera + "fy=" + std::to_string(focal_px));
    overrides.push_back(camera + "cx=" + std::to_string(0.5 * (size.width - 1)));
    overrides.push_back(camera + "cy=" + std::to_string(0.5 * (size.height - 1)));
  }
  return Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / robot.configuration, overrides);
}

/// A reach and the empty frames before it, drawn once. Masks are filled in by whoever uses it.
struct Reach {
  std::vector<Observation> background;
  std::vector<Observation> motion;
  std::vector<JointSample> encoders;
};

const Reach& reach(const Robot& robot, Size size) {
  static std::map<std::string, Reach> all;
  const std::string key = robot.triangles + size.text();
  if (const auto found = all.find(key); found != all.end()) return found->second;
  const auto made = [&] {
    const Configuration c = configuration(robot, "contour", "best", size, 200);
    const RobotSetup setup = RobotSetup::from(c.section("robot"));
    auto settings = simulator::SimulatorSettings::from(c.section("simulator"));
    settings.background_frames = 25;
    settings.entry_frames = 0;
    simulator::SimulationPlan plan;
    plan.frames = 60;
    plan.threads = 2;
    plan.offsets_deg = robot.offsets_deg;
    const StereoRig rig = StereoRig::from(c.section("cameras"));
    simulator::Simulator simulator(load_robot(setup, rig), setup, rig, settings, plan);
    Reach result;
    auto& history = result.encoders;
    while (auto frame = simulator.next()) {
      history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
      auto& list = frame->phase == simulator::Phase::kMotion ? result.motion : result.background;
      list.push_back(simulator::to_observation(*frame, history));
    }
    return result;
  };
  return all.emplace(key, made()).first->second;
}

/// Pictures as they come out of messages, which takes what `jpeg/SIZE` says.
void as_read(const Pipeline& pipeline, Observation& observation) {
  for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
    const int n = pipeline.rig().cameras[c].intrinsics.reduction;
    if (n > 1 && observation.cameras[c]) observation.cameras[c]->image = reduced(observation.cameras[c]->image, n);
  }
}

/// Frames of the reach in turn, as the service gets them.
void whole_frame(benchmark::State& state, const Robot& robot, const std::string& engine, const std::string& mode,
                 Size size, int particles, bool ahead) {
  Pipeline pipeline(configuration(robot, engine, mode, size, particles), std::nullopt, PictureReading::kAsNeeded);
  for (Observation observation : reach(robot, size).background) {
    as_read(pipeline, observation);
    pipeline.process(observation);
  }
  // The first frames search; what counts is the frame of a running service.
  constexpr std::size_t kWarmUp = 30;
  const auto& motion = reach(robot, size).motion;
  for (std::size_t i = 0; i < kWarmUp; ++i) {
    Observation observation = motion[i];
    as_read(pipeline, observation);
    pipeline.process(observation);
  }
  std::size_t at = kWarmUp;
  const auto next_observation = [&] {
    Observation observation = motion[at];
    as_read(pipeline, observation);
    at = at + 1 < motion.size() ? at + 1 : kWarmUp;
    return observation;
  };
  Observation next = next_observation();
  StageTimes sum;
  double segmentation_ms = 0.0;
  bool estimated = true;
  for (auto _ : state) {
    state.PauseTiming();
    Observation observation = std::move(next);
    next = next_observation();
    state.ResumeTiming();
    const Estimate estimate = pipeline.process(observation, ahead ? &next : nullptr);
    estimated = estimated && estimate.state != EstimatorState::kLearningBackground &&
                estimate.state != EstimatorState::kHandNotInView;
    segmentation_ms += pipeline.segmentation_ms();
    sum.kinematics_ms += estimate.times.kinematics_ms;
    sum.scoring_ms += estimate.times.scoring_ms;
    sum.filter_ms += estimate.times.filter_ms;
    sum.refinement_ms += estimate.times.refinement_ms;
  }
  if (!estimated) state.SkipWithError("a frame gave no estimate: nothing was measured");
  const auto mean = benchmark::Counter::kAvgIterations;
  state.counters["mask_ms"] = benchmark::Counter(segmentation_ms, mean);
  state.counters["kinematics_ms"] = benchmark::Counter(sum.kinematics_ms, mean);
  state.counters["scoring_ms"] = benchmark::Counter(sum.scoring_ms, mean);
  state.counters["filter_ms"] = benchmark::Counter(sum.filter_ms, mean);
  state.counters["refine_ms"] = benchmark::Counter(sum.refinement_ms, mean);
  state.counters["particles_per_s"] =
      benchmark::Counter(static_cast<double>(particles), benchmark::Counter::kIsIterationInvariantRate);
}

/// A reach played to and fro, background and all, as bench_latency does it, without an end: every frame comes later
/// than the one before, with the encoder samples in between.
class ToAndFro {
 public:
  explicit ToAndFro(const Reach& reach) : samples_(reach.encoders) {
    for (const auto* phase : {&reach.background, &reach.motion}) {
      for (const auto& observation : *phase) frames_.push_back(&observation);
    }
    first_us_ = std::min(frames_.front()->utime, samples_.front().utime);
    length_us_ = std::max(frames_.back()->utime, samples_.back().utime) - first_us_;
  }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }

  Observation next() {
    if (at_ == frames_.size()) {
      at_ = 0;
      sample_ = 0;
      forwards_ = !forwards_;
      begin_us_ += length_us_ + kBetweenLaps_us;
    }
    Observation observation = *frames_[forwards_ ? at_ : frames_.size() - 1 - at_];
    ++at_;
    observation.utime = moved(observation.utime);
    observation.encoders.clear();
    observation.encoders_begin_anew = false;
    for (auto& camera : observation.cameras) {
      if (!camera) continue;
      camera->utime = moved(camera->utime);
      turn(camera->joints);
    }
    for (; sample_ < samples_.size(); ++sample_) {
      JointSample sample = samples_[forwards_ ? sample_ : samples_.size() - 1 - sample_];
      turn(sample);
      if (sample.utime > observation.utime + kBetweenLaps_us) break;
      observation.encoders.push_back(std::move(sample));
    }
    return observation;
  }

 private:
  static constexpr Microseconds kBetweenLaps_us = 10'000;
  [[nodiscard]] Microseconds moved(Microseconds stamp) const {
    return begin_us_ + (forwards_ ? stamp - first_us_ : length_us_ - (stamp - first_us_));
  }
  void turn(JointSample& sample) const {
    sample.utime = moved(sample.utime);
    if (!forwards_) sample.qdot = -sample.qdot;
  }

  std::vector<const Observation*> frames_;
  const std::vector<JointSample>& samples_;
  Microseconds first_us_ = 0, length_us_ = 0, begin_us_ = 1'000'000;
  std::size_t at_ = 0, sample_ = 0;
  bool forwards_ = true;
};

double processor_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

double quantile(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

/// Every frame of a reach that is played, the first ones too; an iteration is all of it. The processor time of all
/// threads until the estimate is out, which other programs on the machine change least.
void played(benchmark::State& state, const Robot& robot, Size size, int particles) {
  constexpr int kLaps = 4;
  std::vector<double> until_out_ms, all_ms;
  std::size_t converged = 0;
  for (auto _ : state) {
    Pipeline pipeline(configuration(robot, "contour", "best", size, particles), std::nullopt,
                      PictureReading::kAsNeeded);
    ToAndFro frames(reach(robot, size));
    for (std::size_t i = 0; i < kLaps * frames.frames(); ++i) {
      Observation observation = frames.next();
      as_read(pipeline, observation);
      const double begin_ms = processor_ms();
      const Estimate estimate = pipeline.process(
          observation, nullptr, [&](const Estimate&) { until_out_ms.push_back(processor_ms() - begin_ms); });
      all_ms.push_back(processor_ms() - begin_ms);
      converged += estimate.state == EstimatorState::kConverged;
    }
  }
  std::sort(until_out_ms.begin(), until_out_ms.end());
  std::sort(all_ms.begin(), all_ms.end());
  state.counters["median_ms"] = quantile(until_out_ms, 0.5);
  state.counters["p99_ms"] = quantile(until_out_ms, 0.99);
  state.counters["max_ms"] = until_out_ms.back();
  state.counters["all_median_ms"] = quantile(all_ms, 0.5);
  state.counters["all_p99_ms"] = quantile(all_ms, 0.99);
  state.counters["converged"] = static_cast<double>(converged) / static_cast<double>(all_ms.size());
}

/// Both pictures of a frame out of their messages.
void jpeg(benchmark::State& state, Size size) {
  const auto& cameras = reach(kOurs, size).motion.front().cameras;
  std::vector<bot_core::image_t> messages;
  for (const auto& camera : cameras) messages.push_back(to_jpeg_message(camera->image, 0, 90));
  Image out;
  for (auto _ : state) {
    for (const auto& m : messages) {
      const ImageView view{0, 0, m.width, m.height, m.row_stride, m.pixelformat, m.data};
      if (!unpack(view, out, {}, picture_reduction(size.width, size.height)).ok())
        return state.SkipWithError("a JPEG did not decode");
    }
  }
}

void add_played(const Robot& robot, Size size, int particles) {
  benchmark::RegisterBenchmark(
      ("played/contour/" + robot.triangles + "/" + size.text() + "/" + std::to_string(particles)).c_str(),
      [=, &robot](benchmark::State& state) { played(state, robot, size, particles); })
      ->Iterations(1)
      ->MeasureProcessCPUTime()
      ->Unit(benchmark::kMillisecond);
}

void register_all() {
  for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) {
    benchmark::RegisterBenchmark(("jpeg/" + size.text()).c_str(), [=](benchmark::State& state) {
      jpeg(state, size);
    })->Unit(benchmark::kMillisecond);
  }
  const auto add = [](const Robot& robot, const std::string& engine, const std::string& mode, Size size,
                      int particles) {
    for (const bool ahead : {false, true}) {
      benchmark::RegisterBenchmark(
          (engine + (ahead ? "+ahead/" : "/") + mode + "/" + robot.triangles + "/" + size.text() + "/" +
           std::to_string(particles))
              .c_str(),
          [=, &robot](benchmark::State& state) { whole_frame(state, robot, engine, mode, size, particles, ahead); })
          ->MeasureProcessCPUTime()
          ->UseRealTime()
          ->Unit(benchmark::kMillisecond);
    }
  };
  for (const std::string engine : {"contour", "atlas"}) {
    for (const std::string mode : {"best", "paper"}) {
      for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) {
        for (const int particles : {50, 200, 1000, 10000}) {
          if (engine == "atlas" && particles > 1000) continue;  // seconds a frame in software
          if (size.width > 320 && particles != 200) continue;
          add(kOurs, engine, mode, size, particles);
        }
      }
    }
  }
  for (const Size size : {Size{320, 240}, Size{1280, 720}}) add_played(kOurs, size, 200);
  const char* data = std::getenv("BODYSCHEMA_DATA");
  if (data == nullptr || !std::filesystem::exists(std::filesystem::path(data) / "real/robots/g1")) return;
  for (const std::string engine : {"contour", "atlas"}) {
    for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) add(kG1, engine, "best", size, 200);
  }
  for (const Size size : {Size{320, 240}, Size{1280, 720}}) add_played(kG1, size, 200);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  try {
    register_all();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_frame: %s\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
}
