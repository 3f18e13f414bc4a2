#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema::simulator {

/// One rigid part as it looks: its surface and its paint.
struct PaintedPart {
  TriangleMesh mesh;                                 ///< metres, part frame
  Eigen::Vector3f albedo = Eigen::Vector3f::Ones();  ///< share of light given back, RGB, 0 to 1
  bool cull_back = false;  ///< leave out triangles that face away (closed parts look the same)
};

/// Lambert shading from one lamp at infinity and light from everywhere.
struct Lighting {
  Eigen::Vector3f to_lamp_C = {0.3f, -0.8f, -0.5f};  ///< unit, camera frame, towards the lamp
  float ambient = 0.45f;
  float diffuse = 0.55f;
};

/// The simulator's own picture maker, independent of the estimator's silhouettes: a scanline
/// rasteriser with a depth buffer that takes `supersampling` x `supersampling` samples of every
/// pixel, on the CPU and bit for bit the same on every run. Lens distortion moves the vertices.
///
/// Results are valid until the next `draw`. One per thread; allocates nothing once warm.
class Rasterizer {
 public:
  /// @param supersampling  samples per pixel along each axis, 1 to 8; odd values put one sample on
  ///                       the pixel's centre
  Rasterizer(std::vector<PaintedPart> parts, int width, int height, int supersampling);

  /// @param X_CB  pose of each part in the camera, metres
  /// @param dilation_px  grows (negative: shrinks) the silhouette by this much, as blooming does
  void draw(std::span<const Eigen::Isometry3f> X_CB, const CameraModel& camera, const Lighting& light,
            float dilation_px = 0.0f);

  /// Pixels outside [u0, u1) x [v0, v1) show background only.
  struct Box {
    int u0 = 0, v0 = 0, u1 = 0, v1 = 0;
    [[nodiscard]] bool empty() const { return u0 >= u1 || v0 >= v1; }
  };
  [[nodiscard]] const Box& box() const { return box_; }
  /// Share of each pixel covered by the robot, 0 to 1, row order.
  [[nodiscard]] const std::vector<float>& coverage() const { return coverage_; }
  /// Sum of the covered samples' colours divided by all samples (levels 0-255), three per pixel: a
  /// pixel is colour + (1 - coverage) * background.
  [[nodiscard]] const std::vector<float>& colour() const { return colour_; }
  /// Pixels whose centre is covered (at least half the samples for even supersampling).
  [[nodiscard]] BinaryMask mask() const;
  /// The part seen at a pixel's middle sample, or -1.
  [[nodiscard]] int part_at(int u, int v) const;

 private:
  struct Corner {
    float x, y, w, shade;  // sample coordinates, 1 / depth, light
  };
  struct ClipVertex {
    Eigen::Vector3f p_C;
    float shade;
  };
  void draw_triangle(const Corner& a, const Corner& b, const Corner& c, bool cull, std::uint32_t part);
  [[nodiscard]] Corner project(const Eigen::Vector3f& p_C, float shade, const CameraModel& camera) const;
  void dilate(float dilation_px);
  void resolve();
  void clear();

  std::vector<PaintedPart> parts_;
  std::vector<std::vector<Eigen::Vector3f>> corner_normals_;  // three per triangle, part frame
  int width_, height_, samples_;
  int sample_width_, sample_height_;
  std::vector<float> inverse_depth_;  // per sample, 0: background
  std::vector<std::uint8_t> part_;    // per sample
  std::vector<float> shade_;          // per sample
  std::vector<float> weight_;         // per sample, 1 but where a dilated outline passes
  struct Change {
    std::size_t to, from;
    float weight;
  };
  std::vector<Change> changes_;  // what dilate did to the present picture
  std::vector<float> distance_;  // scratch of dilate
  std::vector<int> nearest_;     // scratch of dilate
  std::vector<Eigen::Vector3f> points_C_;
  std::vector<Corner> projected_;
  int s0_ = 0, t0_ = 0, s1_ = 0, t1_ = 0;  // touched samples, half open
  Box box_;
  std::vector<float> coverage_;
  std::vector<float> colour_;
};

}  // namespace bodyschema::simulator
