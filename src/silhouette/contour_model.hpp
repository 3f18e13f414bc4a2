#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"
#include "contour_kernel.hpp"

namespace bodyschema::contour {

/// Throws FileError naming the part for a mesh that cannot be used (an index beyond the vertices, a vertex
/// that is not finite), std::invalid_argument for no parts at all, or naming a camera of a size out of range.
void check(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras);

/// One part made ready for contour extraction. All coordinates are relative to `centre`.
struct Part {
  Eigen::Vector3f centre;       ///< part frame, metres
  float radius = 0.0f;          ///< of the sphere around centre that holds every vertex
  Eigen::Vector3f half_extent;  ///< of the box around centre, metres
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<bool> closed;  ///< per triangle: belongs to a closed surface
  std::vector<BlockBounds> bounds;
  std::vector<EdgeBlock> blocks;
  std::vector<EdgeEnds> ends;
  std::vector<EdgeRun> runs;  ///< point into the vectors above
};

/// Everything the engine needs to know about a model; const once built, shared between threads.
class Model {
 public:
  explicit Model(const SilhouetteModel& model);
  Model(const Model&) = delete;  // runs point into parts
  Model& operator=(const Model&) = delete;

  [[nodiscard]] std::span<const Part> parts() const { return parts_; }
  [[nodiscard]] FaceCulling culling() const { return culling_; }
  [[nodiscard]] std::size_t max_edges() const { return max_edges_; }
  [[nodiscard]] std::size_t max_vertices() const { return max_vertices_; }

 private:
  std::vector<Part> parts_;
  FaceCulling culling_;
  std::size_t max_edges_ = 0;
  std::size_t max_vertices_ = 0;
};

/// A part as one camera sees it.
enum class View {
  kInvisible,  ///< outside the picture, behind the camera, or a pose that is not finite
  kInFront,    ///< wholly beyond the near plane
  kCut,        ///< the near plane cuts it
};

/// A camera with what follows from its intrinsics.
struct Camera {
  explicit Camera(const PinholeIntrinsics& intrinsics);
  PinholeIntrinsics intrinsics;
  std::array<Eigen::Vector3f, 4> sides;  ///< inward unit normals of the view pyramid's sides
};

/// Pose of a part in a camera, in the terms the kernels want.
struct PlacedPart {
  View view = View::kInvisible;
  Eigen::Matrix3f R_CB;           ///< a rotation, or nearly one (see SilhouetteScorer::score)
  Eigen::Vector3f p_CB;           ///< of the part's centre
  float camera_B[3] = {0, 0, 0};  ///< camera centre, centred part frame
  float P[12] = {0};              ///< centred part frame to homogeneous pixels
};

PlacedPart place(const Part& part, const Camera& camera, const Eigen::Isometry3f& X_CB);

/// A straight piece of outline in the picture, between two points in camera coordinates.
struct Segment {
  Eigen::Vector3f from_C, to_C;
  int weight = 0;    ///< change of the winding number where it is crossed, running left to right
  bool real = true;  ///< false where the near plane made it
};

/// The outlines of all drawn triangles of a part that the near plane cuts, one by one: slow, exact
/// for any mesh, and meant for the rare part that reaches behind the camera. `scratch` needs room
/// for every vertex of the part.
template <typename Sink>
void for_each_cut_segment(const Part& part, FaceCulling culling, const PlacedPart& placed,
                          std::span<Eigen::Vector3f> scratch, Sink&& sink);

}  // namespace bodyschema::contour

#include "cut_segments.hpp"
