// Every engine against the brute-force reference, on the same cases.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>

#include "atlas_scorer.hpp"
#include "bodyschema/core/error.hpp"
#include "silhouette/reference.hpp"
#include "silhouette/synthetic_hand.hpp"

namespace bodyschema {
namespace {

struct EngineChoice {
  std::string name;
  SilhouetteOptions options;
  std::string kernel;  // BODYSCHEMA_CONTOUR_KERNEL
  AtlasOptions atlas;
};

void PrintTo(const EngineChoice& choice, std::ostream* out) {
  *out << choice.name;
}

class Engine : public testing::TestWithParam<EngineChoice> {
 protected:
  void SetUp() override {
    if (GetParam().options.engine != "atlas") return;
    try {
      gl::Context::create(GetParam().options.gl_platform);
    } catch (const gl::ContextError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  std::unique_ptr<SilhouetteScorer> make(const SilhouetteModel& model,
                                         std::span<const PinholeIntrinsics> cameras) const {
    if (GetParam().kernel.empty()) {
      unsetenv("BODYSCHEMA_CONTOUR_KERNEL");
    } else {
      setenv("BODYSCHEMA_CONTOUR_KERNEL", GetParam().kernel.c_str(), 1);
    }
    const auto& options = GetParam().options;
    if (options.engine != "atlas") return make_silhouette_scorer(model, cameras, options);
    return make_atlas_scorer(model, cameras, gl::Context::create(options.gl_platform), GetParam().atlas);
  }
};

// 3 px or 0.1 %, whichever is more.
void expect_close(std::uint32_t engine, std::uint32_t reference, const std::string& what) {
  const double allowed = std::max(3.0, 0.001 * reference);
  EXPECT_NEAR(engine, reference, allowed) << what;
}

void expect_close(const SilhouetteCounts& engine, const SilhouetteCounts& reference, const std::string& where) {
  expect_close(engine.predicted, reference.predicted, "predicted, " + where);
  expect_close(engine.intersection, reference.intersection, "intersection, " + where);
  EXPECT_EQ(engine.observed, reference.observed) << "observed, " << where;
}

// Scores all particles and compares each count with the reference.
void expect_scores(SilhouetteScorer& scorer, const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                   std::span<const ObservedSilhouette> observed, std::span<const Eigen::Isometry3f> X_CB) {
  const std::size_t images = X_CB.size() / model.parts.size();
  std::vector<SilhouetteCounts> counts(images, SilhouetteCounts{7, 7, 7});
  scorer.set_observation(observed);
  scorer.score(X_CB, counts);
  for (std::size_t i = 0; i < images; ++i) {
    const std::size_t c = i % cameras.size();
    const auto mask =
        reference::silhouette(model, cameras[c], X_CB.subspan(i * model.parts.size(), model.parts.size()));
    expect_close(counts[i], reference::compare(mask, observed[c]),
                 "particle " + std::to_string(i / cameras.size()) + " camera " + std::to_string(c));
  }
}

std::vector<ObservedSilhouette> observe(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                                        std::uint32_t seed) {
  const auto X_CB = synthetic::stereo_particles(1, cameras.size(), seed);
  std::vector<ObservedSilhouette> observed(cameras.size());
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    observed[c].mask =
        reference::silhouette(model, cameras[c], std::span(X_CB).subspan(c * model.parts.size(), model.parts.size()));
  }
  return observed;
}

std::size_t differences(const BinaryMask& a, const BinaryMask& b) {
  std::size_t n = 0;
  for (int v = 0; v < a.height(); ++v) {
    for (int u = 0; u < a.width(); ++u) n += a.at(u, v) != b.at(u, v) ? 1 : 0;
  }
  return n;
}

TriangleMesh without_every(TriangleMesh mesh, std::size_t n) {
  std::vector<std::array<std::uint32_t, 3>> kept;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (i % n != 0) kept.push_back(mesh.triangles[i]);
  }
  mesh.triangles = kept;
  return mesh;
}

// An open half tube, seen from both sides in random poses.
TriangleMesh half_of(TriangleMesh mesh) {
  mesh.triangles.resize(mesh.triangles.size() / 2);
  return mesh;
}

TEST_P(Engine, StereoHand) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240), synthetic::camera(320, 240)};
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observe(model, cameras, 1), synthetic::stereo_particles(20, 2, 2));
}

TEST_P(Engine, MonoHandWithValidMask) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240)};
  auto observed = observe(model, cameras, 3);
  observed[0].valid = BinaryMask(320, 240);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) observed[0].valid.set(u, v, (u / 7 + v / 5) % 3 != 0);
  }
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, synthetic::stereo_particles(10, 1, 4));
}

// A focal length changed by s scales camera x and y; a moved principal point shears them.
TEST_P(Engine, PosesMayScaleAndShear) {
  auto model = synthetic::hand(2000);
  model.parts.front() = half_of(model.parts.front());
  const std::vector cameras{synthetic::camera(320, 240)};
  auto X_CB = synthetic::stereo_particles(8, 1, 18);
  for (std::size_t i = 0; i < X_CB.size(); ++i) {
    const float much = 0.02f * static_cast<float>(i / 17);  // up to 14 %
    Eigen::Matrix3f warp;
    warp << 1.0f + much, 0.0f, much, 0.0f, 1.0f - much, -0.5f * much, 0.0f, 0.0f, 1.0f;
    X_CB[i].matrix().topRows<3>() = (warp * X_CB[i].matrix().topRows<3>()).eval();
    X_CB[i].linear() *= 1.0f + 0.5f * much;
  }
  for (const auto culling : {FaceCulling::kNone, FaceCulling::kBack}) {
    model.culling = culling;
    const auto scorer = make(model, cameras);
    expect_scores(*scorer, model, cameras, observe(model, cameras, 19), X_CB);
  }
}

TEST_P(Engine, OddSizesAndDifferentCameras) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(161, 119), synthetic::camera(333, 77)};
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observe(model, cameras, 5), synthetic::stereo_particles(10, 2, 6));
}

// llvmpipe leaves a loop after 65,535 rounds: a workgroup of eight invocations saw nothing of so many edges.
TEST_P(Engine, MeshesOfManyTriangles) {
  const auto model = synthetic::hand(300000);
  const std::vector cameras{synthetic::camera(160, 120)};
  const auto observed = observe(model, cameras, 31);
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, synthetic::stereo_particles(1, 1, 32));
}

TEST_P(Engine, TinyPicture) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(1, 1), synthetic::camera(65, 3)};
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observe(model, cameras, 5), synthetic::stereo_particles(10, 2, 6));
}

TEST_P(Engine, OneAndAThousandParticles) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(64, 48), synthetic::camera(64, 48)};
  const auto scorer = make(model, cameras);
  const auto observed = observe(model, cameras, 7);
  for (const std::size_t particles : {1u, 1000u, 3u}) {
    expect_scores(*scorer, model, cameras, observed, synthetic::stereo_particles(particles, 2, 8, 0.3f, 0.05f));
  }
}

TEST_P(Engine, OpenMeshesWithBothCullings) {
  const unsigned seed = 9;
  for (const auto culling : {FaceCulling::kNone, FaceCulling::kBack}) {
    SilhouetteModel model;
    model.culling = culling;
    model.parts.push_back(half_of(synthetic::lumpy_tube("cover", 0.12f, 0.05f, 0.04f, 800)));
    model.parts.push_back(without_every(synthetic::lumpy_tube("holes", 0.12f, 0.05f, 0.04f, 800), 5));
    model.parts.push_back(synthetic::lumpy_tube("closed", 0.05f, 0.01f, 0.01f, 300));
    const std::vector cameras{synthetic::camera(320, 240)};
    std::mt19937 random(seed);
    std::normal_distribution<float> normal;
    std::vector<Eigen::Isometry3f> X_CB;
    for (int i = 0; i < 20; ++i) {
      for (int part = 0; part < 3; ++part) {
        Eigen::Isometry3f X(Eigen::Translation3f(0.06f * normal(random), 0.06f * normal(random), 0.4f));
        X.rotate(Eigen::Quaternionf(normal(random), normal(random), normal(random), normal(random)).normalized());
        X_CB.push_back(X);
      }
    }
    std::vector<ObservedSilhouette> observed(1);
    observed[0].mask = BinaryMask(320, 240);
    for (int v = 50; v < 150; ++v) {
      for (int u = 100; u < 200; ++u) observed[0].mask.set(u, v);
    }
    const auto scorer = make(model, cameras);
    expect_scores(*scorer, model, cameras, observed, X_CB);
  }
}

TEST_P(Engine, DisagreeingWindingIsDrawnWithoutCulling) {
  auto tube = synthetic::lumpy_tube("mixed", 0.12f, 0.05f, 0.04f, 800);
  for (std::size_t i = 0; i < tube.triangles.size(); i += 3) {
    std::swap(tube.triangles[i][0], tube.triangles[i][1]);
  }
  const SilhouetteModel model{{tube}, FaceCulling::kNone};
  const std::vector cameras{synthetic::camera(320, 240)};
  std::vector<Eigen::Isometry3f> X_CB{Eigen::Isometry3f(Eigen::Translation3f(-0.06f, 0.0f, 0.4f))};
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(320, 240);
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, X_CB);
}

TEST_P(Engine, PartTurnedInsideOutDoesNotPunchAHole) {
  auto inverted = synthetic::lumpy_tube("inside out", 0.12f, 0.05f, 0.04f, 800);
  for (auto& t : inverted.triangles) std::swap(t[0], t[1]);
  const auto other = synthetic::lumpy_tube("other", 0.10f, 0.04f, 0.06f, 800);
  const std::vector cameras{synthetic::camera(320, 240)};
  const std::vector<Eigen::Isometry3f> X_CB(2, Eigen::Isometry3f(Eigen::Translation3f(-0.06f, 0, 0.4f)));
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(320, 240);
  for (const auto culling : {FaceCulling::kNone, FaceCulling::kBack}) {
    const SilhouetteModel model{{inverted, other}, culling};
    const auto scorer = make(model, cameras);
    expect_scores(*scorer, model, cameras, observed, X_CB);
  }
}

TEST_P(Engine, UnweldedTrianglesAreOneSurface) {
  const auto tube = synthetic::lumpy_tube("soup", 0.12f, 0.05f, 0.04f, 800);
  TriangleMesh soup;
  for (const auto& t : tube.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const auto v : t) soup.vertices.push_back(tube.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const SilhouetteModel model{{soup}, FaceCulling::kNone};
  const std::vector cameras{synthetic::camera(320, 240)};
  std::vector<Eigen::Isometry3f> X_CB{Eigen::Isometry3f(Eigen::Translation3f(-0.06f, 0.0f, 0.4f))};
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(320, 240);
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, X_CB);
}

TEST_P(Engine, PartsBehindAndAcrossTheNearPlane) {
  for (const auto culling : {FaceCulling::kNone, FaceCulling::kBack}) {
    SilhouetteModel model;
    model.culling = culling;
    model.parts.push_back(synthetic::lumpy_tube("across", 0.30f, 0.03f, 0.03f, 400));
    model.parts.push_back(synthetic::lumpy_tube("behind", 0.10f, 0.03f, 0.03f, 300));
    model.parts.push_back(synthetic::lumpy_tube("front", 0.05f, 0.02f, 0.02f, 300));
    const std::vector cameras{synthetic::camera(160, 120)};
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    std::vector<Eigen::Isometry3f> X_CB;
    for (int i = 0; i < 12; ++i) {
      // Starts behind the camera and reaches forward past it, or the other way round.
      Eigen::Isometry3f across(Eigen::Translation3f(0.05f * normal(random), 0.05f * normal(random), -0.1f));
      across.rotate(Eigen::AngleAxisf(-1.4f + 0.2f * normal(random), Eigen::Vector3f::UnitY()));
      across.rotate(Eigen::AngleAxisf(normal(random), Eigen::Vector3f::UnitX()));
      X_CB.push_back(across);
      X_CB.push_back(Eigen::Isometry3f(Eigen::Translation3f(0.0f, 0.0f, -0.3f)));
      X_CB.push_back(Eigen::Isometry3f(Eigen::Translation3f(0.1f * normal(random), 0.1f * normal(random), 0.5f)));
    }
    std::vector<ObservedSilhouette> observed(1);
    observed[0].mask = BinaryMask(160, 120);
    for (int v = 25; v < 75; ++v) {
      for (int u = 50; u < 100; ++u) observed[0].mask.set(u, v);
    }
    const auto scorer = make(model, cameras);
    expect_scores(*scorer, model, cameras, observed, X_CB);
  }
}

TEST_P(Engine, CameraInsideAPart) {
  const SilhouetteModel model{{synthetic::lumpy_tube("around", 0.30f, 0.1f, 0.1f, 800)}, FaceCulling::kNone};
  const std::vector cameras{synthetic::camera(160, 120)};
  std::vector<Eigen::Isometry3f> X_CB{Eigen::Isometry3f(Eigen::Translation3f(-0.15f, 0.0f, 0.0f))};
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(160, 120);
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, X_CB);
}

TEST_P(Engine, EmptyViews) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  const auto scorer = make(model, cameras);
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(160, 120);
  observed[0].mask.set(3, 4);
  scorer->set_observation(observed);
  const Eigen::Vector3f outside[] = {{0, 0, -1}, {3, 0, 1}, {-3, 0, 1}, {0, 3, 1}, {0, -3, 1}};
  for (const auto& p : outside) {
    std::vector<Eigen::Isometry3f> X_CB(17, Eigen::Isometry3f(Eigen::Translation3f(p)));
    std::vector<SilhouetteCounts> counts(1);
    scorer->score(X_CB, counts);
    EXPECT_EQ(counts[0], (SilhouetteCounts{0, 0, 1}));
  }
  std::vector<SilhouetteCounts> none;
  scorer->score({}, none);
}

TEST_P(Engine, PosesThatAreNotNumbersDrawNothing) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  const auto scorer = make(model, cameras);
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(160, 120);
  scorer->set_observation(observed);
  const auto good = synthetic::stereo_particles(1, 1, 1);
  std::vector<SilhouetteCounts> expected(1), counts(1);
  scorer->score(good, expected);
  ASSERT_GT(expected[0].predicted, 100u);
  for (const float bad : {std::nanf(""), std::numeric_limits<float>::infinity(), 1e30f}) {
    std::vector<Eigen::Isometry3f> X_CB(17, Eigen::Isometry3f(Eigen::Translation3f(bad, 0, bad)));
    scorer->score(X_CB, counts);
    EXPECT_EQ(counts[0].predicted, 0u);
    for (auto& X : X_CB) {
      X.matrix().setIdentity();
      X.linear().setConstant(bad);
    }
    scorer->score(X_CB, counts);
    EXPECT_EQ(counts[0].predicted, 0u);
    scorer->score(good, counts);  // nothing is left behind
    EXPECT_EQ(counts[0], expected[0]);
  }
}

TEST_P(Engine, CameraMaskLeavesCamerasOut) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120), synthetic::camera(160, 120)};
  const auto scorer = make(model, cameras);
  const auto observed = observe(model, cameras, 12);
  scorer->set_observation(observed);
  const auto X_CB = synthetic::stereo_particles(5, 2, 13);
  std::vector<SilhouetteCounts> both(10), left(10, SilhouetteCounts{9, 9, 9}), right(10);
  scorer->score(X_CB, both);
  scorer->score(X_CB, left, 1u);
  scorer->score(X_CB, right, 2u);
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(left[i], i % 2 == 0 ? both[i] : SilhouetteCounts{});
    EXPECT_EQ(right[i], i % 2 == 1 ? both[i] : SilhouetteCounts{});
  }
}

TEST_P(Engine, TilesDoNotBleed) {
  // Each particle hangs over another side of the picture; its neighbours see nothing of it.
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(64, 48), synthetic::camera(64, 48)};
  std::vector<Eigen::Isometry3f> X_CB;
  for (int i = 0; i < 40; ++i) {
    for (int c = 0; c < 2; ++c) {
      const float x = i % 4 == 0 ? -0.2f : i % 4 == 1 ? 0.2f : 5.0f;
      for (const auto& X : synthetic::hand_posture(0.3f)) {
        X_CB.push_back(Eigen::Isometry3f(Eigen::Translation3f(x, i % 8 < 4 ? 0.1f : -0.1f, 0.3f)) * X);
      }
    }
  }
  std::vector<ObservedSilhouette> observed(2);
  for (auto& o : observed) {
    o.mask = BinaryMask(64, 48);
    o.mask.fill(true);
  }
  const auto scorer = make(model, cameras);
  expect_scores(*scorer, model, cameras, observed, X_CB);
}

TEST_P(Engine, PixelCentresLieAtIntegers) {
  // A square whose sides project to u = 9.9 .. 20.1 and v = 4.9 .. 12.1 covers the centres
  // 10..20 x 5..12; moved by 0.2 px to the right, 11..20 (20.3) x 5..12.
  const PinholeIntrinsics camera{64, 32, 100.0, 100.0, 31.5, 15.5};
  TriangleMesh square;
  const auto at = [&](double u, double v) { return Eigen::Vector3f(camera.ray({u, v}).cast<float>()); };
  square.vertices = {at(9.9, 4.9), at(20.1, 4.9), at(20.1, 12.1), at(9.9, 12.1)};
  square.triangles = {{0, 2, 1}, {0, 3, 2}};
  const SilhouetteModel model{{square}, FaceCulling::kNone};
  const std::vector cameras{camera};
  const auto scorer = make(model, cameras);
  std::vector<Eigen::Isometry3f> X_CB{Eigen::Isometry3f::Identity()};
  BinaryMask expected(64, 32);
  for (int v = 5; v <= 12; ++v) {
    for (int u = 10; u <= 20; ++u) expected.set(u, v);
  }
  EXPECT_EQ(scorer->render(X_CB, 0), expected);
  X_CB[0].translation().x() = 0.002f;  // 0.2 px at z = 1 m
  for (int v = 5; v <= 12; ++v) expected.set(10, v, false);
  EXPECT_EQ(scorer->render(X_CB, 0), expected);
}

TEST_P(Engine, RenderAgreesWithScore) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240), synthetic::camera(160, 120)};
  const auto scorer = make(model, cameras);
  const auto observed = observe(model, cameras, 14);
  scorer->set_observation(observed);
  const auto X_CB = synthetic::stereo_particles(1, 2, 15);
  std::vector<SilhouetteCounts> counts(2);
  scorer->score(X_CB, counts);
  for (std::size_t c = 0; c < 2; ++c) {
    const auto X_of = std::span(X_CB).subspan(17 * c, 17);
    const auto mask = scorer->render(X_of, c);
    EXPECT_EQ(reference::compare(mask, observed[c]), counts[c]);
    EXPECT_LE(differences(mask, reference::silhouette(model, cameras[c], X_of)), 3u);
  }
}

TEST_P(Engine, ScoresAreRepeatable) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240), synthetic::camera(320, 240)};
  const auto scorer = make(model, cameras);
  scorer->set_observation(observe(model, cameras, 16));
  const auto X_CB = synthetic::stereo_particles(50, 2, 17);
  std::vector<SilhouetteCounts> first(100), again(100);
  scorer->score(X_CB, first);
  for (int i = 0; i < 5; ++i) {
    scorer->score(X_CB, again);
    EXPECT_EQ(first, again);
  }
}

TEST_P(Engine, RejectsWhatItCannotUse) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  const auto scorer = make(model, cameras);
  std::vector<ObservedSilhouette> observed(1);
  observed[0].mask = BinaryMask(160, 121);
  EXPECT_THROW(scorer->set_observation(observed), std::invalid_argument);
  observed[0].mask = BinaryMask(160, 120);
  observed[0].valid = BinaryMask(10, 10);
  EXPECT_THROW(scorer->set_observation(observed), std::invalid_argument);
  EXPECT_THROW(scorer->set_observation({}), std::invalid_argument);

  EXPECT_THROW(make(SilhouetteModel{}, cameras), std::invalid_argument);
  EXPECT_THROW(make(model, {}), std::invalid_argument);
  auto broken = model;
  broken.parts[3].triangles[0][1] = 100000;
  EXPECT_THROW(make(broken, cameras), FileError);
  broken = model;
  broken.parts[3].vertices[0].x() = std::nanf("");
  EXPECT_THROW(make(broken, cameras), FileError);
  broken = model;
  broken.parts[3].triangles.clear();
  EXPECT_THROW(make(broken, cameras), FileError);
  auto flat = cameras;
  flat[0].height = 0;
  EXPECT_THROW(make(model, flat), std::invalid_argument);
  flat = cameras;
  flat[0].fx = -1.0;
  EXPECT_THROW(make(model, flat), std::invalid_argument);
}

EngineChoice contour_engine(const char* name, int threads, const char* kernel) {
  return {name, {"contour", "auto", threads}, kernel, {}};
}

EngineChoice atlas_engine(const char* name, const char* platform, AtlasPass pass) {
  return {name, {"atlas", platform, 0}, "", {pass, 8192, 4096}};
}

INSTANTIATE_TEST_SUITE_P(
    Silhouette, Engine,
    testing::Values(
        contour_engine("contour", 2, ""), contour_engine("contour_baseline", 1, "baseline"),
        atlas_engine("atlas_compute_egl_device", "egl_device", AtlasPass::kCompute),
        atlas_engine("atlas_compute_osmesa", "osmesa", AtlasPass::kCompute),
        atlas_engine("atlas_raster_egl_device", "egl_device", AtlasPass::kRaster),
        atlas_engine("atlas_raster_osmesa", "osmesa", AtlasPass::kRaster),
        // Room for a single tile or two, and few tiles at once: many passes.
        EngineChoice{"atlas_raster_many_passes", {"atlas", "egl_surfaceless", 0}, "", {AtlasPass::kRaster, 384, 33}},
        EngineChoice{"atlas_compute_many_passes", {"atlas", "egl_surfaceless", 0}, "", {AtlasPass::kCompute, 384, 33}},
        // What a GPU runs, on llvmpipe.
        EngineChoice{"atlas_compute_as_on_gpu",
                     {"atlas", "egl_surfaceless", 0},
                     "",
                     {AtlasPass::kCompute, 8192, 4096, 2, true}}),
    [](const auto& param_info) { return param_info.param.name; });

TEST(Contour, ResultsDoNotDependOnThreads) {
  const auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240), synthetic::camera(320, 240)};
  const auto observed = observe(model, cameras, 21);
  const auto X_CB = synthetic::stereo_particles(100, 2, 22);
  std::vector<SilhouetteCounts> expected;
  for (const int threads : {1, 2, 3, 8}) {
    const auto scorer = make_silhouette_scorer(model, cameras, {"contour", "auto", threads});
    scorer->set_observation(observed);
    std::vector<SilhouetteCounts> counts(200);
    scorer->score(X_CB, counts);
    if (expected.empty()) expected = counts;
    EXPECT_EQ(counts, expected) << threads << " threads";
  }
}

TEST(Contour, ClosedMeshesLookTheSameWithBothCullings) {
  auto model = synthetic::hand(2000);
  const std::vector cameras{synthetic::camera(320, 240)};
  const auto X_CB = synthetic::stereo_particles(20, 1, 23);
  std::vector<SilhouetteCounts> none(20), back(20);
  make_silhouette_scorer(model, cameras, {"contour", "auto", 1})->score(X_CB, none);
  model.culling = FaceCulling::kBack;
  make_silhouette_scorer(model, cameras, {"contour", "auto", 1})->score(X_CB, back);
  EXPECT_EQ(none, back);
}

TEST(MakeScorer, AutoTakesContourWhereOpenGlDrawsInSoftware) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  bool gpu = false;
  try {
    gpu = !gl::Context::create("auto")->is_software();
  } catch (const gl::ContextError&) {
  }
  std::string reason;
  const auto scorer = make_silhouette_scorer(model, cameras, {}, &reason);
  EXPECT_THAT(scorer->description(), testing::StartsWith(gpu ? "atlas on " : "contour ("));
  EXPECT_THAT(reason, testing::StartsWith(gpu ? "auto: " : "auto: no "));  // no GPU, no OpenGL
}

// Runs in a process of its own, where EGL finds no vendor and there is no OSMesa.
void choose_without_gl(const char* engine) {
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/vendor.json", 1);
  setenv("BODYSCHEMA_OSMESA", "/nowhere/libOSMesa.so", 1);
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  try {
    std::string reason;
    const auto scorer = make_silhouette_scorer(model, cameras, {engine, "auto", 1}, &reason);
    std::fprintf(stderr, "%s because %s\n", scorer->description().c_str(), reason.c_str());
    std::_Exit(0);
  } catch (const gl::ContextError& error) {
    std::fprintf(stderr, "%s\n", error.what());
    std::_Exit(3);
  }
}

TEST(MakeScorerDeathTest, WithoutOpenGlAutoIsContourAndAtlasSaysWhy) {
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(choose_without_gl("auto"), testing::ExitedWithCode(0),
              "contour .* because auto: no headless OpenGL context");
  EXPECT_EXIT(choose_without_gl("atlas"), testing::ExitedWithCode(3), "no headless OpenGL context");
}

TEST(MakeScorer, NamesUnknownEngine) {
  const auto model = synthetic::hand(500);
  const std::vector cameras{synthetic::camera(160, 120)};
  try {
    make_silhouette_scorer(model, cameras, {"contuor", "auto", 1});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("contuor"));
  }
  EXPECT_THROW(make_silhouette_scorer(model, cameras, {"contour", "auto", -1}), std::invalid_argument);
}

}  // namespace
}  // namespace bodyschema
