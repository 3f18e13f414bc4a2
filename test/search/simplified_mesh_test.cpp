#include "bodyschema/search/simplified_mesh.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bodyschema/geometry/mesh_topology.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "bodyschema/search/search_level.hpp"
#include "silhouette/reference.hpp"
#include "test_data.hpp"
#include "temporary_folder.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;

/// A ball that is a little flattened, of 2 * rings^2 triangles.
TriangleMesh ball(int rings, float radius_m) {
  TriangleMesh mesh;
  const int around = rings;
  for (int i = 0; i <= rings; ++i) {
    for (int k = 0; k < around; ++k) {
      const double polar = kPi * i / rings, turn = 2 * kPi * k / around;
      mesh.vertices.emplace_back(radius_m * static_cast<float>(std::sin(polar) * std::cos(turn)),
                                 radius_m * static_cast<float>(std::sin(polar) * std::sin(turn)),
                                 0.8f * radius_m * static_cast<float>(std::cos(polar)));
      if (i == 0 || i == rings) break;
    }
  }
  const auto at = [&](int i, int k) {
    if (i == 0) return 0u;
    if (i == rings) return static_cast<std::uint32_t>(mesh.vertices.size() - 1);
    return static_cast<std::uint32_t>(1 + (i - 1) * around + k % around);
  };
  for (int i = 0; i < rings; ++i) {
    for (int k = 0; k < around; ++k) {
      if (i > 0) mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
      if (i + 1 < rings) mesh.triangles.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
    }
  }
  return mesh;
}

class SimplifiedMesh : public testing::Test {
 protected:
  void SetUp() override {
    setenv("XDG_CACHE_HOME", cache_.c_str(), 1);
    if (simplified_mesh(ball(60, 0.05f), 1e-3).triangles.size() == ball(60, 0.05f).triangles.size()) {
      GTEST_SKIP() << "built without meshoptimizer (libmeshoptimizer-dev)";
    }
    fs::remove_all(cache_);
  }
  [[nodiscard]] std::vector<fs::path> files() const {
    std::vector<fs::path> list;
    for (const auto& entry : fs::recursive_directory_iterator(cache_)) {
      if (entry.is_regular_file()) list.push_back(entry.path());
    }
    return list;
  }
  const TemporaryFolder folder_;
  const fs::path cache_ = folder_.path() / "cache";
};

TEST_F(SimplifiedMesh, HasFewTrianglesAndStaysClosed) {
  const TriangleMesh full = ball(100, 0.05f);
  const TriangleMesh simple = simplified_mesh(full, 1e-4);
  EXPECT_LT(simple.triangles.size(), full.triangles.size() / 4);
  EXPECT_TRUE(build_topology(simple).closed());
}

// Against brute force, at the distance where the bound is a pixel: the area between the outlines is at most so wide.
TEST_F(SimplifiedMesh, ItsOutlineKeepsTheBound) {
  const double bound_m = 1e-4, depth_m = 1.0;
  const TriangleMesh full = ball(100, 0.05f);
  const TriangleMesh simple = simplified_mesh(full, bound_m);
  const PinholeIntrinsics camera{400, 400, 4000, 4000, 199.5, 199.5};
  for (const double turn : {0.0, 0.4, 1.1, 1.57}) {
    Eigen::Isometry3f X = Eigen::Isometry3f::Identity();
    X.translation().z() = static_cast<float>(depth_m);
    X.rotate(Eigen::AngleAxisf(static_cast<float>(turn), Eigen::Vector3f(1, 0.3f, 0).normalized()));
    const auto a = reference::silhouette({{full}, FaceCulling::kNone}, camera, {&X, 1});
    const auto b = reference::silhouette({{simple}, FaceCulling::kNone}, camera, {&X, 1});
    const auto counts = reference::compare(a, {b, {}});
    const double outline_px = 2.0 * kPi * 0.045 * camera.fx / depth_m;  // of the flattened ball, about
    const double width_px = (counts.union_count() - counts.intersection) / outline_px;
    EXPECT_LT(width_px, 1.1 * bound_m * camera.fx / depth_m);  // its views are others than these
  }
}

TEST_F(SimplifiedMesh, IsKeptInTheCache) {
  const TriangleMesh full = ball(60, 0.05f);
  const TriangleMesh made = simplified_mesh(full, 1e-4);
  ASSERT_EQ(files().size(), 1u);
  const auto written = fs::last_write_time(files()[0]);
  const TriangleMesh kept = simplified_mesh(full, 1e-4);
  EXPECT_EQ(fs::last_write_time(files()[0]), written);
  EXPECT_EQ(kept.triangles, made.triangles);
  EXPECT_EQ(kept.vertices, made.vertices);
  simplified_mesh(full, 2e-4);
  EXPECT_EQ(files().size(), 2u) << "another bound is another mesh";
  EXPECT_NE(simplified_mesh(ball(60, 0.06f), 1e-4).vertices, made.vertices);
  EXPECT_EQ(files().size(), 3u) << "another mesh as well";
}

TEST_F(SimplifiedMesh, ADamagedCacheIsMadeAgain) {
  const TriangleMesh full = ball(60, 0.05f);
  const TriangleMesh made = simplified_mesh(full, 1e-4);
  const fs::path file = files().at(0);
  std::string bytes(fs::file_size(file), '\0');
  std::ifstream(file, std::ios::binary).read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  std::string index = bytes;
  index[index.size() - 1] = '\x7f';  // a vertex that is not there
  for (const std::string& damaged : {std::string(), std::string("rubbish"), bytes.substr(0, bytes.size() / 2), index}) {
    std::ofstream(file, std::ios::binary) << damaged;
    EXPECT_EQ(simplified_mesh(full, 1e-4).triangles, made.triangles);
  }
}

TEST_F(SimplifiedMesh, WithoutACacheItIsMadeEachTime) {
  const TriangleMesh full = ball(60, 0.05f);
  const TriangleMesh made = simplified_mesh(full, 1e-4);
  std::ofstream(cache_ / "file") << "no folder";
  setenv("XDG_CACHE_HOME", (cache_ / "file").c_str(), 1);
  EXPECT_EQ(simplified_mesh(full, 1e-4).triangles, made.triangles);
}

// The official hand of 62,888 triangles on a search's level of 320x240: counts are those of brute force on every pixel
// of the full mesh within 1 %.
TEST_F(SimplifiedMesh, TheOfficialHandCountsTheSameWithinOnePercent) {
  SKIP_WITHOUT("icub-models");
  const fs::path models = data_folder() / "icub-models";
  RobotModelOptions options;
  options.urdf = models / "iCub_manual/robots/iCubGazeboV2_5_visuomanip/model.urdf";
  options.mesh_search_roots = {models};
  options.rendered_links = {"r_hand"};
  for (const char* finger : {"thumb", "index", "middle", "ring", "little"}) {
    for (int k = 0; k < 4; ++k)
      options.rendered_links.push_back("r_hand_" + std::string(finger) + "_" + std::to_string(k));
  }
  SilhouetteModel hand;
  const auto robot = RobotModel::load(options);
  for (const auto& link : robot->meshes()) hand.parts.push_back(link.mesh);
  const std::vector<PinholeIntrinsics> cameras{{320, 240, 257.34, 257.34, 159.5, 119.5}};
  const SearchLevel level = search_level(hand, cameras);
  const auto scorer = make_silhouette_scorer(level.model, level.cameras, {"contour", "auto", 0});
  std::size_t full_triangles = 0, triangles = 0;
  for (const auto& part : hand.parts) full_triangles += part.triangles.size();
  for (const auto& part : level.model.parts) triangles += part.triangles.size();
  EXPECT_EQ(full_triangles, 62888u);
  std::printf("%zu of %zu triangles\n", triangles, full_triangles);
  EXPECT_LT(triangles, full_triangles * 2 / 3);
  ForwardKinematics kinematics(robot, options.rendered_links);
  std::vector<Pose> X_WB(hand.parts.size());
  kinematics.compute(Eigen::VectorXd::Zero(robot->joint_count()), X_WB);
  for (const double turn : {0.0, 0.9, 2.0, 3.5}) {
    Pose X_CP = Pose::Identity();  // of the palm
    X_CP.translation() = Eigen::Vector3d(0.02, 0.01, 0.3);
    X_CP.rotate(Eigen::AngleAxisd(turn, Eigen::Vector3d(0.6, 0.8, 0)));
    std::vector<Eigen::Isometry3f> X_CB;
    for (const auto& X : X_WB) X_CB.push_back((X_CP * X_WB[0].inverse() * X).cast<float>());
    const double full = static_cast<double>(reference::silhouette(hand, cameras[0], X_CB).count());
    const BinaryMask drawn = scorer->render(X_CB, 0);
    EXPECT_NEAR(static_cast<double>(drawn.count()) * level.step * level.step, full, 0.01 * full)
        << "turned by " << turn;
  }
}

}  // namespace
}  // namespace bodyschema
