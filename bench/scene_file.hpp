#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// A model with poses of many particles, as dump_scene writes it and bench_silhouette reads it, so
/// that a robot's meshes can be measured on a machine without the libraries that load robots.
///
/// File: the text "bodyschema-scene-1\n", then little-endian binary without padding: uint32 cameras,
/// parts, particles, culling (0 none, 1 back); per camera fx fy cx cy (double) at 320x240 px; per part
/// uint32 vertices, triangles, the vertices (3 floats, m), the triangles (3 uint32); poses X_CB as
/// rows of 3x4 floats, [particle][camera][part].
struct Scene {
  SilhouetteModel model;
  std::vector<PinholeIntrinsics> cameras;
  std::vector<Eigen::Isometry3f> X_CB;

  [[nodiscard]] std::size_t particles() const { return X_CB.size() / (model.parts.size() * cameras.size()); }
};

namespace detail {

inline constexpr char kSceneMagic[] = "bodyschema-scene-1\n";

template <typename T>
void put(std::ostream& out, const T* data, std::size_t count) {
  out.write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(count * sizeof(T)));
}

template <typename T>
void get(std::istream& in, T* data, std::size_t count) {
  in.read(reinterpret_cast<char*>(data), static_cast<std::streamsize>(count * sizeof(T)));
}

}  // namespace detail

/// Throws std::runtime_error naming the file.
inline void write_scene(const std::string& file, const Scene& scene) {
  std::ofstream out(file, std::ios::binary);
  out << detail::kSceneMagic;
  const std::uint32_t header[] = {
      static_cast<std::uint32_t>(scene.cameras.size()), static_cast<std::uint32_t>(scene.model.parts.size()),
      static_cast<std::uint32_t>(scene.particles()), scene.model.culling == FaceCulling::kBack ? 1u : 0u};
  detail::put(out, header, 4);
  for (const auto& k : scene.cameras) {
    const double values[] = {k.fx, k.fy, k.cx, k.cy};
    detail::put(out, values, 4);
  }
  for (const auto& part : scene.model.parts) {
    const std::uint32_t sizes[] = {static_cast<std::uint32_t>(part.vertices.size()),
                                   static_cast<std::uint32_t>(part.triangles.size())};
    detail::put(out, sizes, 2);
    for (const auto& v : part.vertices) detail::put(out, v.data(), 3);
    for (const auto& t : part.triangles) detail::put(out, t.data(), 3);
  }
  for (const auto& X : scene.X_CB) {
    const Eigen::Matrix<float, 3, 4, Eigen::RowMajor> rows = X.matrix().topRows<3>();
    detail::put(out, rows.data(), 12);
  }
  out.close();
  if (!out) throw std::runtime_error("cannot write " + file);
}

/// Throws std::runtime_error naming the file.
inline Scene read_scene(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string magic(sizeof(detail::kSceneMagic) - 1, '\0');
  detail::get(in, magic.data(), magic.size());
  std::uint32_t header[4] = {0, 0, 0, 0};
  detail::get(in, header, 4);
  const bool plausible = in && magic == detail::kSceneMagic && header[0] >= 1 && header[0] <= 32 && header[1] >= 1 &&
                         header[1] <= 10000 && header[2] >= 1 && header[2] <= 1000000;
  if (!plausible) throw std::runtime_error(file + " is not a scene written by dump_scene");
  Scene scene;
  scene.model.culling = header[3] == 1 ? FaceCulling::kBack : FaceCulling::kNone;
  for (std::uint32_t c = 0; c < header[0]; ++c) {
    double values[4] = {0, 0, 0, 0};
    detail::get(in, values, 4);
    scene.cameras.push_back({320, 240, values[0], values[1], values[2], values[3]});
  }
  for (std::uint32_t p = 0; in && p < header[1]; ++p) {
    std::uint32_t sizes[2] = {0, 0};
    detail::get(in, sizes, 2);
    if (sizes[0] > 50000000 || sizes[1] > 50000000) throw std::runtime_error(file + " is broken");
    TriangleMesh part;
    part.name = "part" + std::to_string(p);
    part.vertices.resize(sizes[0]);
    part.triangles.resize(sizes[1]);
    for (auto& v : part.vertices) detail::get(in, v.data(), 3);
    for (auto& t : part.triangles) detail::get(in, t.data(), 3);
    scene.model.parts.push_back(std::move(part));
  }
  scene.X_CB.resize(std::size_t{header[0]} * header[1] * header[2]);
  for (auto& X : scene.X_CB) {
    Eigen::Matrix<float, 3, 4, Eigen::RowMajor> rows;
    detail::get(in, rows.data(), 12);
    X.matrix().topRows<3>() = rows;
    X.matrix().row(3) << 0.0f, 0.0f, 0.0f, 1.0f;
  }
  if (!in) throw std::runtime_error(file + " ends too early");
  return scene;
}

}  // namespace bodyschema
