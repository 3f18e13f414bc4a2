#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/face_culling.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/geometry/triangle_mesh.hpp"

namespace bodyschema {

/// What is drawn: rigid parts, each moved by its own pose; the silhouette is their union.
struct SilhouetteModel {
  std::vector<TriangleMesh> parts;  ///< metres, part frame
  FaceCulling culling = FaceCulling::kNone;
};

/// What one camera saw. `valid` is empty (all pixels count) or marks the pixels that count at all;
/// pixels outside it enter neither union nor intersection.
struct ObservedSilhouette {
  BinaryMask mask;
  BinaryMask valid;
};

/// Pixel counts of one predicted silhouette against one observed one.
struct SilhouetteCounts {
  std::uint32_t intersection = 0;
  std::uint32_t predicted = 0;
  std::uint32_t observed = 0;
  /// |A u B| = |A| + |B| - |A n B|.
  [[nodiscard]] std::uint32_t union_count() const { return predicted + observed - intersection; }
  friend bool operator==(const SilhouetteCounts&, const SilhouetteCounts&) = default;
};

/// Scores many predicted silhouettes against the observed ones: the project's hot loop.
///
/// One scorer serves one model, one set of cameras and one thread at a time. Results do not depend
/// on thread counts. `score` does not allocate once the batch size has been seen.
/// Nothing throws but a GL engine by itself whose context is lost (gl::ContextError); those that
/// make_silhouette_scorer gives then go on with the contour engine.
class SilhouetteScorer {
 public:
  virtual ~SilhouetteScorer() = default;

  /// One per camera, sizes as the intrinsics; copied. A size that does not fit throws
  /// std::invalid_argument.
  virtual void set_observation(std::span<const ObservedSilhouette> observed) = 0;

  /// @param X_CB  pose of each part in each camera, row-major [particle][camera][part]. The linear
  ///   part may differ from a rotation by scale and shear (not by a reflection): camera parameters
  ///   are folded in there. A pose that is not finite draws nothing.
  /// @param counts  out, row-major [particle][camera]; its size gives the number of particles
  /// A camera may be left out with `camera_mask` (bit c set: camera c is scored; counts of others
  /// are zero), for mono operation and dead cameras.
  virtual void score(std::span<const Eigen::Isometry3f> X_CB, std::span<SilhouetteCounts> counts,
                     std::uint32_t camera_mask = ~0u) = 0;

  /// The predicted silhouette of one particle in one camera, for overlays and tests.
  /// @param X_CB  pose of each part in that camera
  virtual BinaryMask render(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) = 0;

  /// "atlas on llvmpipe (EGL surfaceless, OpenGL 4.5)" or "contour (AVX2, 2 threads)".
  [[nodiscard]] virtual std::string description() const = 0;
};

/// `engine` is "atlas", "contour" or "auto". Auto takes contour when the GL renderer is software
/// or there is no GL at all, and atlas on a GPU; `gl_pass` "auto" is "compute". What is fastest in fact is measured by
/// time_engines; search/fastest_engine.hpp chooses by that.
struct SilhouetteOptions {
  std::string engine = "auto";
  std::string gl_platform = "auto";  ///< "auto", "egl_device", "egl_surfaceless", "osmesa"
  int threads = 0;                   ///< contour: worker threads, 0 = one per core
  /// atlas: "raster" draws triangles through the rasteriser, "compute" adds up contour edges in a shader; "auto".
  std::string gl_pass = "auto";
};

/// Throws FileError for an unusable mesh, std::invalid_argument for an unusable option, ContextError when the atlas
/// is asked for and no context can be had. `reason` (optional) receives why this engine was taken.
std::unique_ptr<SilhouetteScorer> make_silhouette_scorer(const SilhouetteModel& model,
                                                         std::span<const PinholeIntrinsics> cameras,
                                                         const SilhouetteOptions& options = {},
                                                         std::string* reason = nullptr);

/// How long an engine takes here.
struct EngineTiming {
  std::string engine;       ///< as SilhouetteOptions::engine
  std::string gl_pass;      ///< of atlas, as SilhouetteOptions::gl_pass
  double ms = 0.0;          ///< of wall clock for the silhouettes asked for: the least of those measured
  std::string description;  ///< SilhouetteScorer::description()
  std::string error;        ///< why it could not be measured; then nothing else holds
};

/// Measures engine contour and both passes of atlas on this machine with this model: parts are turned at random, where
/// the largest fills a third of the picture. A pass whose counts are not those of contour (a driver's fault) has an
/// error instead of a time. None is given more than its share of `seconds`, but for what one scoring of all silhouettes
/// takes. Throws as make_silhouette_scorer for an unusable model.
/// @param silhouettes  to be scored at once
std::vector<EngineTiming> time_engines(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
                                       const SilhouetteOptions& options, std::size_t silhouettes, double seconds);

/// Empty where `counts` are those `expected` but for rounding along outlines; otherwise what is wrong, for people.
std::string disagreement(std::span<const SilhouetteCounts> counts, std::span<const SilhouetteCounts> expected);

}  // namespace bodyschema
