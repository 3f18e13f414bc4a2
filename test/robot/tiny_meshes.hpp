#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <vector>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// A box from `low` to `high`, wound outward; its vertices come in the order of the binary number
/// zyx.
inline TriangleMesh test_box(const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.emplace_back((i & 1 ? high : low).x(), (i & 2 ? high : low).y(), (i & 4 ? high : low).z());
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

inline void turn_over(TriangleMesh& mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
}

inline TriangleMesh both(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) a.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return a;
}

inline std::string obj_text(const TriangleMesh& mesh) {
  std::ostringstream text;
  for (const auto& p : mesh.vertices) text << "v " << p.x() << " " << p.y() << " " << p.z() << "\n";
  for (const auto& t : mesh.triangles) {
    text << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
  return text.str();
}

/// Every triangle with corners of its own, as STL has it.
inline std::string binary_stl(const TriangleMesh& mesh) {
  std::string text(80, ' ');
  const auto append = [&](const void* data, std::size_t size) { text.append(static_cast<const char*>(data), size); };
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  append(&count, 4);
  for (const auto& t : mesh.triangles) {
    const float normal[3] = {0, 0, 0};
    append(normal, 12);
    for (const auto v : t) append(mesh.vertices[v].data(), 12);
    const std::uint16_t attribute = 0;
    append(&attribute, 2);
  }
  return text;
}

inline std::string ascii_stl(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << "solid box\n";
  for (const auto& t : mesh.triangles) {
    text << "facet normal 0 0 0\n outer loop\n";
    for (const auto v : t) {
      const auto& p = mesh.vertices[v];
      text << "  vertex " << p.x() << " " << p.y() << " " << p.z() << "\n";
    }
    text << " endloop\nendfacet\n";
  }
  text << "endsolid box\n";
  return text.str();
}

/// A COLLADA scene with the mesh under two nested nodes.
inline std::string dae_text(const TriangleMesh& mesh, const std::string& unit_m, const std::string& up_axis,
                            const std::string& outer_transform, const std::string& inner_transform) {
  std::ostringstream text;
  text << R"(<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="u" meter=")"
       << unit_m << R"("/><up_axis>)" << up_axis << R"(</up_axis></asset>
<library_geometries><geometry id="box"><mesh>
<source id="p"><float_array id="pa" count=")"
       << 3 * mesh.vertices.size() << "\">";
  for (const auto& p : mesh.vertices) text << p.x() << " " << p.y() << " " << p.z() << " ";
  text
      << R"(</float_array><technique_common><accessor source="#pa" count=")" << mesh.vertices.size()
      << R"(" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count=")"
      << mesh.triangles.size() << R"("><input semantic="VERTEX" source="#v" offset="0"/><p>)";
  for (const auto& t : mesh.triangles) text << t[0] << " " << t[1] << " " << t[2] << " ";
  text << R"(</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node id="outer">)"
       << outer_transform << R"(<node id="inner">)" << inner_transform
       << R"(<instance_geometry url="#box"/></node></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
)";
  return text.str();
}

/// Six times the signed volume over six: positive when wound outward.
inline double signed_volume(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                          c = mesh.vertices[t[2]].cast<double>();
    sum += a.x() * (b.y() * c.z() - b.z() * c.y()) + a.y() * (b.z() * c.x() - b.x() * c.z()) +
           a.z() * (b.x() * c.y() - b.y() * c.x());
  }
  return sum / 6.0;
}

/// A URDF of one link "part" on a root, with this inside its <visual> elements.
inline std::string one_part_urdf(const std::string& visuals) {
  return R"(<robot name="tiny"><link name="base"/><link name="part">)" + visuals +
         R"(</link><joint name="j" type="revolute"><parent link="base"/><child link="part"/>)"
         R"(<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)";
}

inline std::string mesh_visual(const std::string& filename, const std::string& scale = "1 1 1",
                               const std::string& origin = "") {
  return "<visual>" + origin + "<geometry><mesh filename=\"" + filename + "\" scale=\"" + scale +
         "\"/></geometry></visual>";
}

}  // namespace bodyschema
