#pragma once

#include <memory>
#include <span>
#include <string>

#include "bodyschema/gl/context.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// How the atlas engine fills the tiles.
enum class AtlasPass {
  /// Triangles through the rasteriser into a framebuffer, counted by a second shader.
  kRaster,
  /// A compute shader adds up contour edges in shared memory and counts there. Tiles with a part
  /// that the near plane cuts go through the rasteriser all the same.
  kCompute,
};

struct AtlasOptions {
  AtlasPass pass = AtlasPass::kCompute;
  int max_side_px = 8192;  ///< of the framebuffer; less where the driver's limits are lower
  int max_tiles = 4096;    ///< in flight at once; more particles take several passes
  int threads = 1;         ///< that place parts before cameras; 0: one a core
  bool as_on_gpu = false;  ///< the compute pass divided as on a GPU where OpenGL draws in software: slow, for tests
};

/// The GL engine: every particle and camera has a tile of one atlas, cropped to where the model can
/// be; tiles are counted by shaders and only the counts are read back. Takes the context over.
/// Throws what contour::check does, gl::ContextError where the driver falls short.
std::unique_ptr<SilhouetteScorer> make_atlas_scorer(const SilhouetteModel& model,
                                                    std::span<const PinholeIntrinsics> cameras,
                                                    std::unique_ptr<gl::Context> context,
                                                    const AtlasOptions& options = {});

}  // namespace bodyschema
