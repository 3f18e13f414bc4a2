#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema::synthetic {

/// A closed, slightly lumpy tube with rounded ends along x, from x = 0 to `length_m`, made of about
/// `triangles` triangles that wind counter-clockwise seen from outside.
inline TriangleMesh lumpy_tube(const std::string& name, float length_m, float half_width_m, float half_height_m,
                               int triangles, float lumps = 0.08f) {
  // segments * 2 * (rings - 1) triangles, with rings about twice the segments.
  const int segments = std::max(3, static_cast<int>(std::lround(std::sqrt(triangles / 4.0))));
  const int rings = std::max(2, triangles / (2 * segments) + 1);
  TriangleMesh mesh;
  mesh.name = name;
  const auto vertex = [&](double along, double around) {
    const double a = kPi * along;
    // Superellipse: flatter in the middle than a sphere.
    const double profile = std::pow(std::sin(a), 0.5) * (1.0 + lumps * std::sin(7.0 * along + 3.0 * std::cos(around)));
    return Eigen::Vector3f(length_m * static_cast<float>(0.5 - 0.5 * std::cos(a)),
                           half_width_m * static_cast<float>(profile * std::cos(around)),
                           half_height_m * static_cast<float>(profile * std::sin(around)));
  };
  mesh.vertices.push_back({0.0f, 0.0f, 0.0f});
  for (int r = 1; r < rings; ++r) {
    for (int s = 0; s < segments; ++s) {
      mesh.vertices.push_back(vertex(static_cast<double>(r) / rings, 2.0 * kPi * s / segments));
    }
  }
  mesh.vertices.push_back({length_m, 0.0f, 0.0f});
  const auto last = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  const auto at = [&](int r, int s) { return static_cast<std::uint32_t>(1 + (r - 1) * segments + s % segments); };
  for (int s = 0; s < segments; ++s) {
    mesh.triangles.push_back({0, at(1, s + 1), at(1, s)});
    for (int r = 1; r + 1 < rings; ++r) {
      mesh.triangles.push_back({at(r, s), at(r, s + 1), at(r + 1, s)});
      mesh.triangles.push_back({at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)});
    }
    mesh.triangles.push_back({last, at(rings - 1, s), at(rings - 1, s + 1)});
  }
  return mesh;
}

/// A hand of 17 closed parts: forearm, palm and five fingers of three phalanges.
inline SilhouetteModel hand(int triangles) {
  SilhouetteModel model;
  const int each = triangles / 17;
  model.parts.push_back(lumpy_tube("forearm", 0.10f, 0.030f, 0.028f, each));
  model.parts.push_back(lumpy_tube("palm", 0.09f, 0.042f, 0.018f, each));
  for (int finger = 0; finger < 5; ++finger) {
    for (int bone = 0; bone < 3; ++bone) {
      model.parts.push_back(lumpy_tube("finger" + std::to_string(finger) + std::to_string(bone),
                                       0.040f - 0.006f * static_cast<float>(bone), 0.010f, 0.009f, each));
    }
  }
  return model;
}

/// Poses of the 17 parts in the frame of the palm. `curl_rad` bends every finger joint.
inline std::vector<Eigen::Isometry3f> hand_posture(float curl_rad) {
  using Eigen::AngleAxisf;
  using Eigen::Translation3f;
  using Eigen::Vector3f;
  std::vector<Eigen::Isometry3f> X_PB;
  X_PB.push_back(Eigen::Isometry3f(Translation3f(-0.095f, 0.0f, 0.0f)));
  X_PB.push_back(Eigen::Isometry3f::Identity());
  for (int finger = 0; finger < 5; ++finger) {
    const bool thumb = finger == 0;
    Eigen::Isometry3f X(
        Translation3f(thumb ? 0.03f : 0.085f, thumb ? 0.035f : 0.03f - 0.02f * static_cast<float>(finger - 1), 0.0f));
    X.rotate(AngleAxisf(thumb ? 0.9f : 0.15f - 0.08f * static_cast<float>(finger - 1), Vector3f::UnitZ()));
    for (int bone = 0; bone < 3; ++bone) {
      X.rotate(AngleAxisf(curl_rad, Vector3f::UnitY()));
      X_PB.push_back(X);
      X.translate(Vector3f(0.036f - 0.006f * static_cast<float>(bone), 0.0f, 0.0f));
    }
  }
  return X_PB;
}

/// A camera of the recording's proportions at another size: f = 257.34 px at 320 px of width.
inline PinholeIntrinsics camera(int width, int height) {
  const double f = 257.34 * width / 320.0;
  return {width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1)};
}

/// Poses [particle][camera][part] of hands about 0.3 m in front of two cameras 68 mm apart, turned
/// by about `spread_rad` and moved by about `spread_m` around one common pose.
inline std::vector<Eigen::Isometry3f> stereo_particles(std::size_t particles, std::size_t cameras, std::uint32_t seed,
                                                       float spread_rad = 0.1f, float spread_m = 0.01f) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Isometry3f> X_CB;
  for (std::size_t i = 0; i < particles; ++i) {
    Eigen::Isometry3f X_LP(Eigen::Translation3f(0.01f + spread_m * normal(random), 0.0f + spread_m * normal(random),
                                                0.30f + spread_m * normal(random)));
    X_LP.rotate(Eigen::AngleAxisf(0.6f + spread_rad * normal(random), Eigen::Vector3f::UnitZ()));
    X_LP.rotate(Eigen::AngleAxisf(0.5f + spread_rad * normal(random), Eigen::Vector3f::UnitY()));
    X_LP.rotate(Eigen::AngleAxisf(0.4f + spread_rad * normal(random), Eigen::Vector3f::UnitX()));
    const auto X_PB = hand_posture(0.35f + spread_rad * normal(random));
    for (std::size_t c = 0; c < cameras; ++c) {
      const Eigen::Isometry3f X_CL(Eigen::Translation3f(-0.068f * static_cast<float>(c), 0.0f, 0.0f));
      for (const auto& X : X_PB) X_CB.push_back(X_CL * X_LP * X);
    }
  }
  return X_CB;
}

}  // namespace bodyschema::synthetic
