// Cost of scoring silhouettes, by engine, triangles, picture size and particles. Stereo: 200 particles
// are 400 silhouettes. See README.md.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "atlas_scorer.hpp"
#ifdef BODYSCHEMA_BENCH_SEARCH
#include "bodyschema/search/search_level.hpp"
#endif
#include "bodyschema/silhouette/contour_points.hpp"
#include "naive_scorer.hpp"
#include "scene_file.hpp"
#include "silhouette/reference.hpp"
#include "silhouette/synthetic_hand.hpp"

namespace {

using namespace bodyschema;

struct Size {
  int width, height;
};

std::string gl_platform() {
  const char* wish = std::getenv("BODYSCHEMA_GL_PLATFORM");
  return wish != nullptr ? wish : "auto";
}

// The file of a robot's scene, null where there is none.
const char* scene_file(const std::string& triangles) {
  if (triangles == "63k") return std::getenv("BODYSCHEMA_BENCH_SCENE");
  return triangles == "200k" ? std::getenv("BODYSCHEMA_BENCH_SCENE_200K") : nullptr;
}

// Made when first asked for, and kept.
const Scene& scene_of(const std::string& triangles) {
  static std::map<std::string, Scene> scenes;
  const auto found = scenes.find(triangles);
  if (found != scenes.end()) return found->second;
  Scene scene;
  if (const char* file = scene_file(triangles)) {
    scene = read_scene(file);
  } else {
    scene.model = synthetic::hand(1000 * std::stoi(triangles));
    scene.cameras = {synthetic::camera(320, 240), synthetic::camera(320, 240)};
    scene.X_CB = synthetic::stereo_particles(1000, 2, 1, 0.05f, 0.01f);
  }
  return scenes.emplace(triangles, std::move(scene)).first->second;
}

std::vector<PinholeIntrinsics> resized(const Scene& scene, Size size) {
  std::vector<PinholeIntrinsics> cameras;
  for (const auto& k : scene.cameras) {
    const double scale = size.width / static_cast<double>(k.width);
    const double cut = 0.5 * (scale * k.height - size.height);  // 16:9 shows less above and below
    cameras.push_back({size.width, size.height, scale * k.fx, scale * k.fy, scale * (k.cx + 0.5) - 0.5,
                       scale * (k.cy + 0.5) - 0.5 - cut});
  }
  return cameras;
}

std::unique_ptr<SilhouetteScorer> make(const std::string& engine, const SilhouetteModel& model,
                                       std::span<const PinholeIntrinsics> cameras) {
  if (engine == "contour") return make_silhouette_scorer(model, cameras, {"contour", "auto", 0});
  auto context = gl::Context::create(gl_platform());
  if (engine == "naive") return make_naive_scorer(model, cameras, std::move(context));
  AtlasOptions options;
  options.threads = 0;
  if (engine == "atlas_raster") options.pass = AtlasPass::kRaster;
  return make_atlas_scorer(model, cameras, std::move(context), options);
}

// Scenes hold a thousand particles; more are the same again.
std::vector<Eigen::Isometry3f> poses_of(const Scene& scene, std::size_t particles) {
  const std::size_t per_particle = scene.cameras.size() * scene.model.parts.size();
  std::vector<Eigen::Isometry3f> X_CB;
  for (std::size_t i = 0; i < particles; ++i) {
    const auto first = scene.X_CB.begin() + static_cast<std::ptrdiff_t>(i % scene.particles() * per_particle);
    X_CB.insert(X_CB.end(), first, first + static_cast<std::ptrdiff_t>(per_particle));
  }
  return X_CB;
}

// What the cameras saw: the last particle of the scene.
std::vector<ObservedSilhouette> observed_in(const Scene& scene, std::span<const PinholeIntrinsics> cameras) {
  const std::size_t parts = scene.model.parts.size();
  std::vector<ObservedSilhouette> observed(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    observed[c].mask = reference::silhouette(
        scene.model, cameras[c], std::span(scene.X_CB).last(cameras.size() * parts).subspan(c * parts, parts));
  }
  return observed;
}

// Whether counts are within 3 px or 0.1 % of the brute-force reference, for a few particles.
bool agrees(const Scene& scene, std::span<const PinholeIntrinsics> cameras,
            std::span<const ObservedSilhouette> observed, std::span<const SilhouetteCounts> counts) {
  constexpr std::size_t kChecked = 4;
  for (std::size_t i = 0; i < std::min(kChecked * cameras.size(), counts.size()); ++i) {
    const std::size_t c = i % cameras.size();
    const auto mask = reference::silhouette(
        scene.model, cameras[c], std::span(scene.X_CB).subspan(i * scene.model.parts.size(), scene.model.parts.size()));
    const auto expected = reference::compare(mask, observed[c]);
    const auto close = [](std::uint32_t a, std::uint32_t b) {
      return std::abs(static_cast<double>(a) - b) <= std::max(3.0, 0.001 * b);
    };
    if (!close(counts[i].predicted, expected.predicted) || !close(counts[i].intersection, expected.intersection) ||
        counts[i].observed != expected.observed) {
      std::fprintf(stderr, "image %zu: predicted %u, intersection %u; reference %u, %u\n", i, counts[i].predicted,
                   counts[i].intersection, expected.predicted, expected.intersection);
      return false;
    }
  }
  return true;
}

#ifdef BODYSCHEMA_BENCH_SEARCH

// Engine "contour+search": as hypotheses are scored whose best is refined afterwards. Counts of every step-th pixel,
// times step^2, are within 1 % of brute force on all pixels and the full mesh.
bool agrees_at_level(const Scene& scene, const SearchLevel& level, std::span<const PinholeIntrinsics> cameras,
                     std::span<const ObservedSilhouette> observed, std::span<const SilhouetteCounts> counts) {
  const double pixels = level.step * level.step;
  for (std::size_t i = 0; i < std::min(4 * cameras.size(), counts.size()); ++i) {
    const std::size_t c = i % cameras.size();
    const auto mask = reference::silhouette(
        scene.model, cameras[c], std::span(scene.X_CB).subspan(i * scene.model.parts.size(), scene.model.parts.size()));
    const auto expected = reference::compare(mask, observed[c]);
    if (std::abs(pixels * counts[i].predicted - expected.predicted) > 0.01 * expected.predicted ||
        std::abs(pixels * counts[i].intersection - expected.intersection) > 0.01 * expected.predicted) {
      std::fprintf(stderr, "image %zu: predicted %.0f, intersection %.0f; reference %u, %u\n", i,
                   pixels * counts[i].predicted, pixels * counts[i].intersection, expected.predicted,
                   expected.intersection);
      return false;
    }
  }
  return true;
}

#endif

void score(benchmark::State& state, const std::string& engine, const std::string& triangles, Size size,
           std::size_t particles) {
  const Scene& scene = scene_of(triangles);
  const auto cameras = resized(scene, size);
  const auto X_CB = poses_of(scene, particles);
  std::unique_ptr<SilhouetteScorer> scorer;
  try {
    scorer = make(engine, scene.model, cameras);
  } catch (const std::exception& error) {
    state.SkipWithError(error.what());
    return;
  }
  const auto observed = observed_in(scene, cameras);
  scorer->set_observation(observed);
  std::vector<SilhouetteCounts> counts(particles * cameras.size());
  scorer->score(X_CB, counts);
  if (!agrees(scene, cameras, observed, counts)) {
    state.SkipWithError("counts differ from the reference");
    return;
  }
  for (auto _ : state) {
    scorer->set_observation(observed);
    scorer->score(X_CB, counts);
    benchmark::DoNotOptimize(counts.data());
  }
  double covered = 0.0;
  for (const auto& count : counts) covered += count.predicted;
  state.counters["silhouettes/s"] =
      benchmark::Counter(static_cast<double>(counts.size()), benchmark::Counter::kIsIterationInvariantRate);
  state.counters["covered_%"] =
      100.0 * covered / static_cast<double>(counts.size()) / (static_cast<double>(size.width) * size.height);
}

void extract(benchmark::State& state, const std::string& triangles) {
  const Scene& scene = scene_of(triangles);
  ContourExtractor extractor(scene.model, scene.cameras);
  std::size_t points = 0;
  for (auto _ : state) {
    points = extractor.extract(std::span(scene.X_CB).first(scene.model.parts.size()), 0).size();
  }
  state.counters["points"] = static_cast<double>(points);
}

#ifdef BODYSCHEMA_BENCH_SEARCH

void score_at_level(benchmark::State& state, const std::string& triangles, Size size, std::size_t particles) {
  const Scene& scene = scene_of(triangles);
  const auto cameras = resized(scene, size);
  const SearchLevel level = search_level(scene.model, cameras);
  const auto scorer = make("contour", level.model, level.cameras);
  const auto X_CB = poses_of(scene, particles);
  const auto observed = observed_in(scene, cameras);
  std::vector<ObservedSilhouette> coarse(cameras.size());
  std::vector<SilhouetteCounts> counts(particles * cameras.size());
  const auto run = [&] {
    for (std::size_t c = 0; c < cameras.size(); ++c) coarse[c].mask = every_nth_pixel(observed[c].mask, level.step);
    scorer->set_observation(coarse);
    scorer->score(X_CB, counts);
    benchmark::DoNotOptimize(counts.data());
  };
  run();
  if (!agrees_at_level(scene, level, cameras, observed, counts)) {
    state.SkipWithError("counts differ from the reference");
    return;
  }
  for (auto _ : state) run();
  std::size_t drawn = 0;
  for (const auto& part : level.model.parts) drawn += part.triangles.size();
  state.counters["step"] = level.step;
  state.counters["drawn"] = static_cast<double>(drawn);
}

#endif

void register_all() {
  const std::vector<std::string> all{"2k", "8k", "30k", "63k", "200k"};
  const auto absent = [](const std::string& t) { return (t == "63k" || t == "200k") && scene_file(t) == nullptr; };
  for (const Size size : {Size{320, 240}, Size{160, 120}, Size{640, 480}, Size{1280, 720}}) {
    for (const std::string& triangles : all) {
      if (absent(triangles)) continue;
      for (const std::size_t particles : {50u, 200u, 1000u, 10000u}) {
        for (const std::string engine : {"naive", "atlas_raster", "atlas", "contour"}) {
          if (engine == "naive" && particles > 200) continue;  // minutes, and nobody asks
          const std::string name = engine + "/" + triangles + "/" + std::to_string(size.width) + "x" +
                                   std::to_string(size.height) + "/" + std::to_string(particles);
          benchmark::RegisterBenchmark(
              name.c_str(), [=](benchmark::State& state) { score(state, engine, triangles, size, particles); })
              ->MeasureProcessCPUTime()
              ->Unit(benchmark::kMillisecond);
        }
#ifdef BODYSCHEMA_BENCH_SEARCH
        benchmark::RegisterBenchmark(
            ("contour+search/" + triangles + "/" + std::to_string(size.width) + "x" + std::to_string(size.height) +
             "/" + std::to_string(particles))
                .c_str(),
            [=](benchmark::State& state) { score_at_level(state, triangles, size, particles); })
            ->MeasureProcessCPUTime()
            ->Unit(benchmark::kMillisecond);
#endif
      }
    }
  }
  for (const std::string& triangles : all) {
    if (absent(triangles)) continue;
    benchmark::RegisterBenchmark(("outline/" + triangles + "/320x240/1").c_str(),
                                 [=](benchmark::State& state) { extract(state, triangles); })
        ->MeasureProcessCPUTime()
        ->Unit(benchmark::kMillisecond);
  }
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  try {
    const Scene& scene = scene_of("2k");
    for (const std::string engine : {"naive", "atlas", "contour"}) {
      try {
        benchmark::AddCustomContext(engine, make(engine, scene.model, scene.cameras)->description());
      } catch (const gl::ContextError& error) {
        benchmark::AddCustomContext(engine, error.what());
      }
    }
    register_all();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_silhouette: %s\n", error.what());
    return 1;
  }
  benchmark::Shutdown();
}
