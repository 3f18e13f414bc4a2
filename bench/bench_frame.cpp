// Cost of one whole frame: masks, particles, likelihoods, refinement. Our own robot (8k triangles), or both arms of a
// G1 (200k; where BODYSCHEMA_DATA has it), in a simulated room. Names read `engine/mode/triangles/size/particles`;
// `+ahead`: the next frame's masks are found meanwhile. See README.md.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bodyschema/bus/messages.hpp"
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
    std::vector<JointSample> history;
    while (auto frame = simulator.next()) {
      history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
      auto& list = frame->phase == simulator::Phase::kMotion ? result.motion : result.background;
      list.push_back(simulator::to_observation(*frame, history));
    }
    return result;
  };
  return all.emplace(key, made()).first->second;
}

/// Frames of the reach in turn, as the service gets them.
void whole_frame(benchmark::State& state, const Robot& robot, const std::string& engine, const std::string& mode,
                 Size size, int particles, bool ahead) {
  Pipeline pipeline(configuration(robot, engine, mode, size, particles));
  for (Observation observation : reach(robot, size).background) pipeline.process(observation);
  // The first frames search; what counts is the frame of a running service.
  constexpr std::size_t kWarmUp = 30;
  const auto& motion = reach(robot, size).motion;
  for (std::size_t i = 0; i < kWarmUp; ++i) {
    Observation observation = motion[i];
    pipeline.process(observation);
  }
  std::size_t at = kWarmUp;
  const auto next_observation = [&] {
    Observation observation = motion[at];
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

/// Both pictures of a frame out of their messages.
void jpeg(benchmark::State& state, Size size) {
  const auto& cameras = reach(kOurs, size).motion.front().cameras;
  std::vector<bot_core::image_t> messages;
  for (const auto& camera : cameras) messages.push_back(to_jpeg_message(camera->image, 0, 90));
  Image out;
  for (auto _ : state) {
    for (const auto& m : messages) {
      const ImageView view{0, 0, m.width, m.height, m.row_stride, m.pixelformat, m.data};
      if (!unpack(view, out).ok()) return state.SkipWithError("a JPEG did not decode");
    }
  }
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
  const char* data = std::getenv("BODYSCHEMA_DATA");
  if (data == nullptr || !std::filesystem::exists(std::filesystem::path(data) / "real/robots/g1")) return;
  for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) add(kG1, "contour", "best", size, 200);
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
