#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema::simulator {

/// What the lamp does not reach: the scene as seen from the lamp, and how much of a lamp of some size a point sees
/// past it. Shadows are sharp near what casts them and soft farther away. One per thread.
class ShadowMap {
 public:
  /// @param meshes  that cast shadows; they outlive this, metres
  /// @param to_lamp_W  towards the lamp, any length; @param lamp_size_rad  its width as seen from the scene
  ShadowMap(std::vector<const TriangleMesh*> meshes, const Eigen::Vector3d& to_lamp_W, double lamp_size_rad);

  /// @param X_WB  one pose per mesh; @param hidden  one per mesh, not 0: not there. Empty: all are
  void draw(std::span<const Eigen::Isometry3f> X_WB, std::span<const char> hidden);
  /// Share of the lamp that is seen from a point of the root frame, 0 to 1.
  /// @param cosine  between the lamp and the surface's normal there: a slanting surface would shade itself otherwise
  [[nodiscard]] float lit(const Eigen::Vector3f& p_W, float cosine) const;

 private:
  static constexpr int kSize = 512;
  std::vector<const TriangleMesh*> meshes_;
  Eigen::Matrix3f R_LW_;  // lamp frame: z towards the lamp
  float half_lamp_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::size_t> first_point_;
  float a0_ = 0, b0_ = 0, texel_ = 1;  // where the map lies in the lamp frame, metres
  std::vector<float> height_;          // nearest to the lamp, by texel
  std::vector<float> highest_;         // of all texels within reach of a block of them
  std::vector<float> own_, across_;    // scratch
  int blocks_ = 0;                     // along each side
  float block_per_m_ = 0;
};

}  // namespace bodyschema::simulator
