#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/triangle_mesh.hpp"
#include "bodyschema/simulator/lens.hpp"

namespace bodyschema::simulator {

/// What a surface is painted with.
struct Paint {
  Eigen::Vector3f albedo = Eigen::Vector3f::Ones();  ///< share of light given back, RGB, 0 to 1
  float gloss = 0.0f;       ///< share of the lamp's light in the middle of its mirror image, 0 to 1
  float sharpness = 60.0f;  ///< exponent of Blinn and Phong: how small that image is
  bool table = false;       ///< the albedo is that of the table's top at the point seen (Kitchen)
};

/// One rigid part as it looks: its surface and its paint.
struct PaintedPart {
  TriangleMesh mesh;                                 ///< metres, part frame
  Eigen::Vector3f albedo = Eigen::Vector3f::Ones();  ///< share of light given back, RGB, 0 to 1
  bool cull_back = false;  ///< leave out triangles that face away (closed parts look the same)
  /// Several paints: used instead of `albedo`. For each triangle the number of its paint.
  std::vector<Paint> paints{};
  std::vector<std::uint8_t> paint_of_triangle{};
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

  /// Which part of a picture is drawn, and which parts of the scene.
  struct Cut {
    int v0 = 0, v1 = 0;                    ///< rows [v0, v1) are right afterwards; others may be or not
    const Lens::Extent* extent = nullptr;  ///< of those rows; what lies outside is left out. Null: not known
    std::span<const char> hidden{};        ///< one per part, not 0: not there. Empty: all are there
  };
  /// The same without coverage, colours and mask: samples only, for a Composer.
  void draw_samples(std::span<const Eigen::Isometry3f> X_CB, const CameraModel& camera, const Lighting& light,
                    float dilation_px, const Cut& cut);
  /// A ball around a part, in its frame.
  struct Ball {
    Eigen::Vector3f centre_B;
    float radius;
  };
  [[nodiscard]] const Ball& ball(std::size_t part) const { return balls_[part]; }
  /// Samples per pixel along each axis; a row of samples holds width times that many.
  [[nodiscard]] int samples_per_pixel() const { return samples_; }
  /// 1 / depth in 1/m of every sample, 0 where nothing is. The others are defined where something is.
  [[nodiscard]] const std::vector<float>& inverse_depth() const { return inverse_depth_; }
  /// Ambient and diffuse light on the surface.
  [[nodiscard]] const std::vector<float>& shade() const { return shade_; }
  /// Cosine between the surface's normal and the direction midway between lamp and camera; empty without gloss.
  [[nodiscard]] const std::vector<float>& shine() const { return shine_; }
  [[nodiscard]] const std::vector<std::uint16_t>& paint_index() const { return paint_; }
  [[nodiscard]] const std::vector<Paint>& paints() const { return paints_; }
  /// Share of a sample that is covered, other than 1 on dilated outlines only; empty: 1 everywhere.
  [[nodiscard]] const std::vector<float>& sample_weight() const { return changes_.empty() ? no_weight_ : weight_; }

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
    float x, y, w;  // sample coordinates, 1 / depth
  };
  struct Lit {
    float shade = 0.0f, shine = 0.0f;
  };
  struct ClipVertex {
    Eigen::Vector3f p_C;
    Lit lit;
  };
  template <class Light>
  void draw_triangle(const Corner& a, const Corner& b, const Corner& c, bool cull, std::uint16_t paint, bool glossy,
                     const Light& light);
  [[nodiscard]] Corner project(const Eigen::Vector3f& p_C, const CameraModel& camera) const;
  [[nodiscard]] bool out_of_sight(std::size_t part, const Eigen::Isometry3f& X_CB, const Lens::Extent& extent) const;
  void dilate(float dilation_px);
  void resolve();
  void clear();

  std::vector<PaintedPart> parts_;
  std::vector<Ball> balls_;               // around each part
  std::vector<Paint> paints_;             // of all parts
  std::vector<std::size_t> first_paint_;  // of each part
  std::vector<std::uint8_t> part_of_paint_;
  bool any_gloss_ = false;
  std::vector<std::vector<Eigen::Vector3f>> corner_normals_;  // three per triangle, part frame
  int width_, height_, samples_;
  int sample_width_, sample_height_;
  std::vector<float> inverse_depth_;  // per sample, 0: background
  std::vector<std::uint16_t> paint_;  // per sample
  std::vector<float> shade_;          // per sample
  std::vector<float> shine_;          // per sample, if anything is glossy
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
  std::vector<float> no_weight_;  // always empty
  std::vector<Eigen::Vector3f> resolved_paint_;
  int band_t0_ = 0, band_t1_ = 0;          // rows of samples drawn at all
  int s0_ = 0, t0_ = 0, s1_ = 0, t1_ = 0;  // touched samples, half open
  Box box_;
  std::vector<float> coverage_;
  std::vector<float> colour_;
};

}  // namespace bodyschema::simulator
