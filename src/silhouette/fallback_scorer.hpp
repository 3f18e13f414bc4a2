#pragma once

#include <memory>
#include <span>

#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// Scores with `first` until its GL context is lost (gl::ContextError: driver reset, GPU gone), and
/// with the contour engine from that call on, which is repeated there: no frame is lost, and both
/// engines count the same pixels but for those on an outline. description() says so.
///
/// The environment variable BODYSCHEMA_LOSE_GL_AFTER=N loses the context at the Nth scoring, for
/// tests of whole programs.
std::unique_ptr<SilhouetteScorer> with_contour_to_fall_back_on(std::unique_ptr<SilhouetteScorer> first,
                                                               const SilhouetteModel& model,
                                                               std::span<const PinholeIntrinsics> cameras, int threads);

}  // namespace bodyschema
