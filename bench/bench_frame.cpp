// Cost of one whole frame: masks, particles, likelihoods, refinement. Our own robot (8k triangles)
// in its simulated room. Names read `engine/mode/triangles/size/particles`; `+ahead`: the next frame's
// masks are found meanwhile. See README.md.

#include <benchmark/benchmark.h>

#include <cstdio>
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

Configuration configuration(const std::string& engine, const std::string& mode, Size size, int particles) {
  const std::filesystem::path file = std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml";
  std::vector<std::string> overrides{"silhouette.engine=" + engine, "estimator.mode=" + mode,
                                     "filter.particles=" + std::to_string(particles)};
  const double focal_px = 257.34 * size.width / 320.0;
  for (const std::string camera : {"cameras.left.", "cameras.right."}) {
    overrides.push_back(camera + "width=" + std::to_string(size.width));
    overrides.push_back(camera + "height=" + std::to_string(size.height));
    overrides.push_back(camera + "fx=" + std::to_string(focal_px));
    overrides.push_back(camera + "fy=" + std::to_string(focal_px));
    overrides.push_back(camera + "cx=" + std::to_string(0.5 * (size.width - 1)));
    overrides.push_back(camera + "cy=" + std::to_string(0.5 * (size.height - 1)));
  }
  return Configuration::load(file, overrides);
}

/// A reach and the empty frames before it, drawn once. Masks are filled in by whoever uses it.
struct Reach {
  std::vector<Observation> background;
  std::vector<Observation> motion;
};

const Reach& reach(Size size) {
  static std::map<std::string, Reach> all;
  if (const auto found = all.find(size.text()); found != all.end()) return found->second;
  const auto made = [&] {
    const Configuration c = configuration("contour", "best", size, 200);
    const RobotSetup setup = RobotSetup::from(c.section("robot"));
    auto settings = simulator::SimulatorSettings::from(c.section("simulator"));
    settings.background_frames = 25;
    settings.entry_frames = 0;
    simulator::SimulationPlan plan;
    plan.frames = 60;
    plan.threads = 2;
    plan.offsets_deg = {{"r_shoulder_pitch", 5}, {"r_elbow", -2}, {"r_wrist_pitch", -7}};
    simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")), settings, plan);
    Reach result;
    std::vector<JointSample> history;
    while (auto frame = simulator.next()) {
      history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
      auto& list = frame->phase == simulator::Phase::kMotion ? result.motion : result.background;
      list.push_back(simulator::to_observation(*frame, history));
    }
    return result;
  };
  return all.emplace(size.text(), made()).first->second;
}

/// Frames of the reach in turn, as the service gets them.
void whole_frame(benchmark::State& state, const std::string& engine, const std::string& mode, Size size, int particles,
                 bool ahead) {
  Pipeline pipeline(configuration(engine, mode, size, particles));
  for (Observation observation : reach(size).background) pipeline.process(observation);
  // The first frames search; what counts is the frame of a running service.
  constexpr std::size_t kWarmUp = 30;
  const auto& motion = reach(size).motion;
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
  const auto& cameras = reach(size).motion.front().cameras;
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
  for (const std::string engine : {"contour", "atlas"}) {
    for (const std::string mode : {"best", "paper"}) {
      for (const Size size : {Size{320, 240}, Size{640, 480}, Size{1280, 720}}) {
        for (const int particles : {50, 200, 1000, 10000}) {
          if (engine == "atlas" && particles > 1000) continue;  // seconds a frame in software
          if (size.width > 320 && particles != 200) continue;
          for (const bool ahead : {false, true}) {
            benchmark::RegisterBenchmark(
                (engine + (ahead ? "+ahead/" : "/") + mode + "/8k/" + size.text() + "/" + std::to_string(particles))
                    .c_str(),
                [=](benchmark::State& state) { whole_frame(state, engine, mode, size, particles, ahead); })
                ->MeasureProcessCPUTime()
                ->UseRealTime()
                ->Unit(benchmark::kMillisecond);
          }
        }
      }
    }
  }
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
