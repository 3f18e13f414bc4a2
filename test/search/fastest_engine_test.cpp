#include "bodyschema/search/fastest_engine.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bodyschema/gl/context.hpp"
#include "silhouette/synthetic_hand.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FastestEngine : public testing::Test {
 protected:
  void SetUp() override { setenv("XDG_CACHE_HOME", cache_.c_str(), 1); }
  /// contour, raster, compute
  static std::vector<EngineTiming> figures(double contour, double raster, double compute) {
    return {
        {"contour", "", contour, "", ""}, {"atlas", "raster", raster, "", ""}, {"atlas", "compute", compute, "", ""}};
  }
  static std::string choice(const std::vector<EngineTiming>& timings, const SilhouetteOptions& options = {}) {
    std::string reason;
    const auto chosen = fastest_of(timings, options, reason);
    return chosen.engine + "/" + chosen.gl_pass;
  }
  const TemporaryFolder folder_;
  const fs::path cache_ = folder_.path() / "cache";
};

TEST_F(FastestEngine, IsTheOneThatTookLeast) {
  EXPECT_EQ(choice(figures(3, 2, 1)), "atlas/compute");
  EXPECT_EQ(choice(figures(3, 1, 2)), "atlas/raster");
  EXPECT_EQ(choice(figures(1, 3, 2)), "contour/auto");
  std::string reason;
  fastest_of(figures(15.25, 3, 1.5), {}, reason);
  EXPECT_EQ(reason, "auto: the fastest of contour 15.25 ms, atlas raster 3.00 ms, atlas compute 1.50 ms");
}

TEST_F(FastestEngine, WhatIsConfiguredIsKept) {
  SilhouetteOptions atlas;
  atlas.engine = "atlas";
  EXPECT_EQ(choice(figures(1, 2, 3), atlas), "atlas/raster");
  SilhouetteOptions raster;
  raster.gl_pass = "raster";
  EXPECT_EQ(choice(figures(5, 4, 1), raster), "atlas/raster");
  EXPECT_EQ(choice(figures(3, 4, 1), raster), "contour/raster");
}

TEST_F(FastestEngine, WhatFailedIsNotTaken) {
  auto timings = figures(5, 0, 0);
  timings[1].error = timings[2].error = "no compute shaders";
  EXPECT_EQ(choice(timings), "contour/auto");
}

TEST_F(FastestEngine, IsMeasuredOnceAndKept) {
  int measured = 0;
  const auto measure = [&] {
    ++measured;
    auto timings = figures(5, 3.25, 1);
    timings[2].error = "lost";
    return timings;
  };
  remembered_timings("key", measure);
  const auto kept = remembered_timings("key", measure);
  EXPECT_EQ(measured, 1);
  EXPECT_EQ(choice(kept), "atlas/raster");
  EXPECT_DOUBLE_EQ(kept.at(1).ms, 3.25);
  remembered_timings("other key", measure);
  EXPECT_EQ(measured, 2);
  const std::string head = "bodyschema engine timings 1\n";
  for (const std::string& damaged :
       {std::string(), std::string("rubbish\n"), head + "contour - 5\n",
        head + "contour - 5\natlas raster 3\natlas compute x\n", head + "contour - 5\natlas raster 3\nhand - 1\n"}) {
    std::ofstream(cache_ / "bodyschema/engines/key") << damaged;
    const int before = measured;
    remembered_timings("key", measure);
    EXPECT_EQ(measured, before + 1) << damaged;
  }
}

TEST_F(FastestEngine, WithoutAGpuNothingIsMeasuredAndContourIsTaken) {
  try {
    if (!gl::Context::create("auto")->is_software()) GTEST_SKIP() << "this machine has a GPU";
  } catch (const gl::ContextError&) {
  }
  const SilhouetteModel hand = synthetic::hand(2000);
  const std::vector<PinholeIntrinsics> cameras{synthetic::camera(160, 120)};
  std::string reason;
  EXPECT_EQ(fastest_engine(hand, cameras, {}, 400, reason).engine, "contour");
  EXPECT_THAT(reason, HasSubstr("auto: "));
  EXPECT_FALSE(fs::exists(cache_ / "bodyschema")) << "there was nothing to keep";
}

TEST_F(FastestEngine, AnEngineThatCountsOtherPixelsIsNotTimed) {
  const std::vector<SilhouetteCounts> expected{{500, 1000, 800}, {0, 0, 800}, {20, 40, 800}};
  EXPECT_EQ(disagreement(expected, expected), "");
  auto rounded = expected;
  rounded[0].predicted = 1009;
  rounded[2].intersection = 25;
  EXPECT_EQ(disagreement(rounded, expected), "");
  auto wrong = expected;
  wrong[0] = {0, 0, 800};
  wrong[2].intersection = 40;
  EXPECT_EQ(disagreement(wrong, expected), "counts 2 of 3 silhouettes wrongly");
  std::string reason;
  auto timings = figures(5.0, 3.0, 1.0);
  timings[2].error = disagreement(wrong, expected);
  EXPECT_EQ(fastest_of(timings, {}, reason).gl_pass, "raster");
  EXPECT_THAT(reason, HasSubstr("atlas compute counts 2 of 3 silhouettes wrongly"));
}

TEST_F(FastestEngine, ATableHasAllThree) {
  const SilhouetteModel hand = synthetic::hand(2000);
  const std::vector<PinholeIntrinsics> cameras{synthetic::camera(64, 48), synthetic::camera(64, 48)};
  const auto timings = time_engines(hand, cameras, {}, 8, 0.05);
  ASSERT_EQ(timings.size(), 3u);
  EXPECT_THAT(timings[0].description, HasSubstr("contour"));
  for (const auto& t : timings) {
    EXPECT_TRUE(!t.error.empty() || t.ms > 0.0) << t.engine << " " << t.gl_pass;
  }
  EXPECT_TRUE(timings[0].error.empty());
}

}  // namespace
}  // namespace bodyschema
