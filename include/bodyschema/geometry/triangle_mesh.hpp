#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace bodyschema {

/// A triangle mesh in the frame of the body part that carries it. Vertices in metres; triangles
/// index vertices and wind counter-clockwise seen from outside.
struct TriangleMesh {
  std::string name;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace bodyschema
