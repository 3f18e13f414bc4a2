#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/robot_model.hpp"
#include "robot/robot_test_data.hpp"
#include "temporary_folder.hpp"
#include "robot/tiny_meshes.hpp"

namespace bodyschema {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

struct Bounds {
  Eigen::Vector3f low, high;
};
Bounds bounds(const TriangleMesh& mesh) {
  Bounds b{mesh.vertices.front(), mesh.vertices.front()};
  for (const auto& p : mesh.vertices) {
    b.low = b.low.cwiseMin(p);
    b.high = b.high.cwiseMax(p);
  }
  return b;
}

void expect_bounds(const TriangleMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const Bounds b = bounds(mesh);
  EXPECT_LT((b.low - low).norm(), 1e-6) << b.low.transpose();
  EXPECT_LT((b.high - high).norm(), 1e-6) << b.high.transpose();
}

class MeshTest : public testing::Test {
 protected:
  std::shared_ptr<const RobotModel> load(const std::string& visuals) {
    const auto urdf = folder_.write("tiny.urdf", one_part_urdf(visuals));
    return RobotModel::load({urdf, {}, {"part"}});
  }
  /// The one part of a URDF whose only visual is this OBJ.
  std::shared_ptr<const RobotModel> load_obj(const TriangleMesh& mesh) {
    folder_.write("part.obj", obj_text(mesh));
    return load(mesh_visual("part.obj"));
  }
  TemporaryFolder folder_;
  const Eigen::Vector3f low_{-0.1f, 0.0f, 0.02f}, high_{0.2f, 0.05f, 0.4f};
  const TriangleMesh box_ = test_box(low_, high_);
};

TEST_F(MeshTest, EveryFormatGivesTheSameWeldedBox) {
  folder_.write("a.obj", obj_text(box_));
  folder_.write("b.STL", binary_stl(box_));
  folder_.write("c.stl", ascii_stl(box_));
  folder_.write("d.dae", dae_text(box_, "1", "Y_UP", "", ""));
  for (const char* file : {"a.obj", "b.STL", "c.stl", "d.dae"}) {
    SCOPED_TRACE(file);
    const auto robot = load(mesh_visual(file));
    ASSERT_EQ(robot->meshes().size(), 1u);
    const LinkMesh& part = robot->meshes()[0];
    EXPECT_EQ(part.link, "part");
    EXPECT_EQ(part.mesh.vertices.size(), 8u);
    EXPECT_EQ(part.mesh.triangles.size(), 12u);
    EXPECT_TRUE(part.closed);
    EXPECT_TRUE(part.consistent_winding);
    EXPECT_NEAR(signed_volume(part.mesh), 0.3 * 0.05 * 0.38, 1e-8);
    expect_bounds(part.mesh, low_, high_);
    EXPECT_THAT(robot->warnings(), IsEmpty());
  }
}

TEST_F(MeshTest, PolygonsOfAnObjBecomeTriangles) {
  folder_.write("quads.obj",
                "mtllib /etc/passwd\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  const auto robot = load(mesh_visual("quads.obj"));
  EXPECT_EQ(robot->meshes()[0].mesh.triangles.size(), 12u);
  EXPECT_NEAR(signed_volume(robot->meshes()[0].mesh), 1.0, 1e-6);
}

TEST_F(MeshTest, ColladaUnitAndNodesApplyButItsUpAxisDoesNot) {
  // Centimetres; the inner node turns x to y about z, the outer one moves along z by 2 units.
  for (const char* up : {"Y_UP", "Z_UP", "X_UP"}) {
    SCOPED_TRACE(up);
    folder_.write("part.dae", dae_text(test_box({0, 0, 0}, {10, 20, 30}), "0.01", up, "<translate>0 0 2</translate>",
                                       "<rotate>0 0 1 90</rotate>"));
    const auto robot = load(mesh_visual("part.dae"));
    expect_bounds(robot->meshes()[0].mesh, {-0.2f, 0.0f, 0.02f}, {0.0f, 0.1f, 0.32f});
  }
}

TEST_F(MeshTest, AMirroringNodeKeepsTheOutsideOutside) {
  folder_.write("part.dae", dae_text(box_, "1", "Z_UP", "<scale>1 -1 1</scale>", ""));
  const auto robot = load(mesh_visual("part.dae"));
  EXPECT_GT(signed_volume(robot->meshes()[0].mesh), 0.0);
  EXPECT_THAT(robot->warnings(), IsEmpty());
}

TEST_F(MeshTest, ScaleThenOriginApplyAndAMirroringScaleKeepsTheOutsideOutside) {
  folder_.write("part.obj", obj_text(test_box({0, 0, 0}, {100, 200, 300})));
  const auto robot =
      load(mesh_visual("part.obj", "0.001 -0.001 0.001", R"(<origin xyz="1 2 3" rpy="0 0 1.5707963267949"/>)"));
  // y is mirrored to [-0.2, 0], then x -> y and y -> -x, then moved.
  expect_bounds(robot->meshes()[0].mesh, {1.0f, 2.0f, 3.0f}, {1.2f, 2.1f, 3.3f});
  EXPECT_GT(signed_volume(robot->meshes()[0].mesh), 0.0);
  EXPECT_THAT(robot->warnings(), IsEmpty());
}

TEST_F(MeshTest, PrimitivesAreClosedAndOfTheRightSize) {
  const auto volume_of = [&](const std::string& shape) {
    const auto robot = load("<visual><geometry>" + shape + "</geometry></visual>");
    EXPECT_TRUE(robot->meshes()[0].closed);
    EXPECT_THAT(robot->warnings(), IsEmpty());
    return signed_volume(robot->meshes()[0].mesh);
  };
  EXPECT_NEAR(volume_of(R"(<box size="0.1 0.2 0.3"/>)"), 0.006, 1e-8);
  const double cylinder = 3.14159265 * 0.05 * 0.05 * 0.2;
  EXPECT_NEAR(volume_of(R"(<cylinder radius="0.05" length="0.2"/>)"), cylinder, 0.005 * cylinder);
  const double sphere = 4.0 / 3.0 * 3.14159265 * 0.001;
  EXPECT_NEAR(volume_of(R"(<sphere radius="0.1"/>)"), sphere, 0.015 * sphere);
}

TEST_F(MeshTest, SeveralVisualsOfALinkBecomeOneMesh) {
  folder_.write("part.obj", obj_text(box_));
  const auto robot = load(mesh_visual("part.obj") +
                          R"(<visual><origin xyz="1 0 0"/><geometry><box size="0.2 0.2 0.2"/></geometry></visual>)");
  EXPECT_EQ(robot->meshes()[0].mesh.vertices.size(), 16u);
  EXPECT_EQ(robot->meshes()[0].mesh.triangles.size(), 24u);
  EXPECT_NEAR(bounds(robot->meshes()[0].mesh).high.x(), 1.1f, 1e-6);
}

TEST_F(MeshTest, MeshesOfOtherLinksAreNeverOpened) {
  const auto urdf = folder_.write("tiny.urdf", one_part_urdf(mesh_visual("not_there.stl")));
  const auto robot = RobotModel::load({urdf, {}, {}});
  EXPECT_THAT(robot->meshes(), IsEmpty());
}

TEST_F(MeshTest, PackageNamesAreSearchedInEveryRoot) {
  folder_.write("roots/two/pkg/meshes/part.obj", obj_text(box_));
  std::filesystem::create_directories(folder_.path() / "roots/one");
  const auto urdf = folder_.write("robots/tiny.urdf", one_part_urdf(mesh_visual("package://pkg/meshes/part.obj")));
  const auto robot = RobotModel::load({urdf, {folder_.path() / "roots/one", folder_.path() / "roots/two/"}, {"part"}});
  EXPECT_EQ(robot->meshes()[0].mesh.triangles.size(), 12u);
}

TEST_F(MeshTest, AFolderAboveIsReachedOnlyWhenItIsASearchRoot) {
  folder_.write("meshes/part.obj", obj_text(box_));
  const auto urdf = folder_.write("robots/tiny.urdf", one_part_urdf(mesh_visual("../meshes/part.obj")));
  EXPECT_THROW(RobotModel::load({urdf, {}, {"part"}}), FileError);
  EXPECT_NO_THROW(RobotModel::load({urdf, {folder_.path()}, {"part"}}));
}

TEST_F(MeshTest, AnOpenPartIsNamedWithItsBoundaryEdges) {
  TriangleMesh open = box_;
  open.triangles.erase(open.triangles.begin(), open.triangles.begin() + 2);  // no bottom
  const auto robot = load_obj(both(open, test_box({1, 1, 1}, {2, 2, 2})));
  EXPECT_FALSE(robot->meshes()[0].closed);
  ASSERT_EQ(robot->warnings().size(), 1u);
  EXPECT_THAT(robot->warnings()[0], HasSubstr("link 'part', mesh 'part.obj': not closed: 4 boundary "
                                              "edges in 1 of 2 components"));
}

TEST_F(MeshTest, AnInsideOutComponentIsTurnedAndReported) {
  TriangleMesh wrong = test_box({1, 1, 1}, {2, 2, 2});
  turn_over(wrong);
  const auto robot = load_obj(both(test_box({0, 0, 0}, {0.5, 0.5, 0.5}), wrong));
  EXPECT_NEAR(signed_volume(robot->meshes()[0].mesh), 1.125, 1e-6);
  EXPECT_TRUE(robot->meshes()[0].consistent_winding);
  ASSERT_EQ(robot->warnings().size(), 1u);
  EXPECT_THAT(robot->warnings()[0], HasSubstr("1 of 2 components were inside out"));
}

TEST_F(MeshTest, TheWallOfACavityIsRightAsItIs) {
  TriangleMesh cavity = test_box({0.4f, 0.4f, 0.4f}, {0.6f, 0.6f, 0.6f});
  turn_over(cavity);
  const auto robot = load_obj(both(test_box({0, 0, 0}, {1, 1, 1}), cavity));
  EXPECT_NEAR(signed_volume(robot->meshes()[0].mesh), 1.0 - 0.008, 1e-6);
  EXPECT_THAT(robot->warnings(), IsEmpty());
}

TEST_F(MeshTest, TrianglesWoundAgainstTheirNeighboursAreTurned) {
  TriangleMesh wrong = box_;
  std::swap(wrong.triangles[5][1], wrong.triangles[5][2]);
  std::swap(wrong.triangles[8][1], wrong.triangles[8][2]);
  const auto robot = load_obj(wrong);
  EXPECT_NEAR(signed_volume(robot->meshes()[0].mesh), 0.3 * 0.05 * 0.38, 1e-8);
  ASSERT_EQ(robot->warnings().size(), 1u);
  EXPECT_THAT(robot->warnings()[0], HasSubstr("2 triangles were wound against their neighbours"));
}

TEST_F(MeshTest, AMoebiusStripHasNoOutsideAndIsLeftAlone) {
  TriangleMesh strip;
  constexpr std::uint32_t n = 12;
  for (std::uint32_t i = 0; i < n; ++i) {
    const float a = 6.2831853f * static_cast<float>(i) / n, half = a / 2;
    for (const float side : {-0.3f, 0.3f}) {
      const float r = 1.0f + side * std::cos(half);
      strip.vertices.emplace_back(r * std::cos(a), r * std::sin(a), side * std::sin(half));
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const bool last = i + 1 == n;  // the strip closes on itself upside down
    const std::uint32_t a = 2 * i, b = 2 * i + 1;
    const std::uint32_t c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    strip.triangles.push_back({a, c, b});
    strip.triangles.push_back({b, c, d});
  }
  const auto robot = load_obj(strip);
  EXPECT_FALSE(robot->meshes()[0].consistent_winding);
  EXPECT_FALSE(robot->meshes()[0].closed);
  ASSERT_EQ(robot->warnings().size(), 1u);
  EXPECT_THAT(robot->warnings()[0], HasSubstr("winding inconsistent"));
}

TEST_F(MeshTest, VerticesWithinATenthOfAMicrometreAreOne) {
  TriangleMesh shifted = box_;
  for (auto& p : shifted.vertices) p.x() += 3e-8f;
  TriangleMesh mixed = box_;  // half the triangles use the shifted copy
  mixed.vertices.insert(mixed.vertices.end(), shifted.vertices.begin(), shifted.vertices.end());
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 2) {
    for (auto& v : mixed.triangles[t]) v += 8;
  }
  folder_.write("part.stl", binary_stl(mixed));
  const auto robot = load(mesh_visual("part.stl"));
  EXPECT_EQ(robot->meshes()[0].mesh.vertices.size(), 8u);
  EXPECT_TRUE(robot->meshes()[0].closed);
}

TEST(RecordingRobot, TheTwoOpenCoversAreNamed) {
  SKIP_WITHOUT("eyehand-sim");
  for (const char* file : {"icub_unity/robot.yaml", "icub_unity/robot_v1.yaml"}) {
    const auto robot = robot_setup(file).load();
    EXPECT_EQ(robot->meshes().size(), 21u);
    EXPECT_THAT(robot->warnings(), ElementsAre(HasSubstr("link 'r_upper_arm', mesh 'r_upper_arm.obj': not closed: 157 "
                                                         "boundary edges"),
                                               HasSubstr("link 'r_forearm', mesh 'r_forearm.obj': not closed: 110 "
                                                         "boundary edges")));
    for (const auto& part : robot->meshes()) {
      EXPECT_EQ(part.closed, part.link != "r_upper_arm" && part.link != "r_forearm") << part.link;
      EXPECT_TRUE(part.consistent_winding) << part.link;
    }
    EXPECT_FALSE(robot->has_masses());
  }
}

TEST(OfficialRobot, LoadsUnmodified) {
  SKIP_WITHOUT("icub-models");
  const auto robot = robot_setup("icub_v2_5/robot.yaml").load();
  EXPECT_EQ(robot->meshes().size(), 25u);
  EXPECT_TRUE(robot->has_masses());
  for (const auto& part : robot->meshes()) {
    const Bounds b = bounds(part.mesh);
    EXPECT_LT((b.high - b.low).maxCoeff(), 0.2f) << part.link;  // a wrong unit would show
    EXPECT_GT((b.high - b.low).maxCoeff(), 0.01f) << part.link;
    EXPECT_TRUE(part.closed) << part.link;
  }
}

TEST(OwnRobot, IsClosedWoundOutwardAndSmall) {
  const auto robot = robot_setup("icub_right/robot.yaml").load();
  EXPECT_THAT(robot->warnings(), IsEmpty());
  EXPECT_TRUE(robot->has_masses());
  std::size_t hand_triangles = 0;
  for (const auto& part : robot->meshes()) {
    EXPECT_TRUE(part.closed && part.consistent_winding) << part.link;
    EXPECT_GT(signed_volume(part.mesh), 0.0) << part.link;
    if (part.link != "r_upper_arm" && part.link != "r_elbow_1") {
      hand_triangles += part.mesh.triangles.size();
    }
  }
  EXPECT_GT(hand_triangles, 6000u);
  EXPECT_LT(hand_triangles, 10000u);
}

}  // namespace
}  // namespace bodyschema
