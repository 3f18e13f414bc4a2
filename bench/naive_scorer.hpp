#pragma once

#include <memory>
#include <span>

#include "bodyschema/gl/context.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// What a first implementation does, to measure the engines against: a tile per particle and camera,
/// a viewport and one draw call per part in it, RGBA8 and depth, no culling, everything read back and
/// counted pixel by pixel on the CPU.
std::unique_ptr<SilhouetteScorer> make_naive_scorer(const SilhouetteModel& model,
                                                    std::span<const PinholeIntrinsics> cameras,
                                                    std::unique_ptr<gl::Context> context);

}  // namespace bodyschema
