#include "bodyschema/geometry/mesh_topology.hpp"

#include <gtest/gtest.h>

#include "silhouette/synthetic_hand.hpp"

namespace bodyschema {
namespace {

TriangleMesh tetrahedron() {
  return {"tetrahedron", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(MeshTopology, ClosedTetrahedron) {
  const auto topology = build_topology(tetrahedron());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.edges.size(), 6u);
  EXPECT_EQ(topology.component_closed, std::vector<bool>{true});
  for (const auto& edge : topology.edges) {
    const auto runs = [&](std::uint32_t triangle, std::uint32_t from, std::uint32_t to) {
      const auto& t = topology.triangles[triangle];
      return (t[0] == from && t[1] == to) || (t[1] == from && t[2] == to) || (t[2] == from && t[0] == to);
    };
    EXPECT_TRUE(runs(edge.left, edge.from, edge.to));
    EXPECT_TRUE(runs(edge.right, edge.to, edge.from));
  }
}

TEST(MeshTopology, WeldsEqualPositionsAndDropsWhatCollapses) {
  auto mesh = tetrahedron();
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const auto v : t) soup.vertices.push_back(mesh.vertices[v]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  soup.vertices.push_back(mesh.vertices[0]);
  soup.triangles.push_back({0, 12, 1});  // two corners at the same place
  const auto topology = build_topology(soup);
  EXPECT_EQ(topology.vertices.size(), 4u);
  EXPECT_EQ(topology.triangles.size(), 4u);
  EXPECT_TRUE(topology.closed());
}

TEST(MeshTopology, MissingTriangleLeavesThreeOpenEdges) {
  auto mesh = tetrahedron();
  mesh.triangles.pop_back();
  const auto topology = build_topology(mesh);
  EXPECT_EQ(topology.edges.size(), 3u);
  EXPECT_EQ(topology.open_edges.size(), 3u);
  EXPECT_EQ(topology.component_closed, std::vector<bool>{false});
}

TEST(MeshTopology, DisagreeingWindingIsOpen) {
  auto mesh = tetrahedron();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  const auto topology = build_topology(mesh);
  EXPECT_FALSE(topology.closed());
  EXPECT_EQ(topology.open_edges.size(), 6u);  // three edges, both sides of each
}

TEST(MeshTopology, SurfacesAreToldApart) {
  auto mesh = tetrahedron();
  const auto other = tetrahedron();
  for (const auto& v : other.vertices) mesh.vertices.push_back(v + Eigen::Vector3f(5, 0, 0));
  for (auto t : other.triangles) {
    for (auto& v : t) v += 4;
    mesh.triangles.push_back(t);
  }
  mesh.triangles.pop_back();
  const auto topology = build_topology(mesh);
  EXPECT_EQ(topology.component_closed, (std::vector<bool>{true, false}));
}

TEST(MeshTopology, FourTrianglesOnAnEdgeArePaired) {
  // Two tetrahedra that touch along the edge 0-1.
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.push_back({0, -1, 0});
  mesh.vertices.push_back({0, 0, -1});
  for (const auto& t : std::vector<std::array<std::uint32_t, 3>>{{0, 4, 1}, {0, 1, 5}, {0, 5, 4}, {1, 4, 5}}) {
    mesh.triangles.push_back(t);
  }
  const auto topology = build_topology(mesh);
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.edges.size(), 12u);
}

TEST(SyntheticHand, IsClosedAndWindsOutward) {
  for (const int triangles : {500, 2000, 8000, 30000}) {
    const auto model = synthetic::hand(triangles);
    ASSERT_EQ(model.parts.size(), 17u);
    std::size_t count = 0;
    for (const auto& part : model.parts) {
      EXPECT_TRUE(build_topology(part).closed()) << part.name;
      double volume = 0.0;
      for (const auto& t : part.triangles) {
        volume += part.vertices[t[0]].cross(part.vertices[t[1]]).dot(part.vertices[t[2]]) / 6.0;
      }
      EXPECT_GT(volume, 1e-7) << part.name;
      count += part.triangles.size();
    }
    EXPECT_NEAR(static_cast<double>(count), triangles, 0.2 * triangles);
  }
}

}  // namespace
}  // namespace bodyschema
