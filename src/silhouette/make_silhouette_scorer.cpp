#include <stdexcept>

#include "bodyschema/silhouette/silhouette_scorer.hpp"
#include "contour_scorer.hpp"

namespace bodyschema {

std::unique_ptr<SilhouetteScorer> make_silhouette_scorer(const SilhouetteModel& model,
                                                         std::span<const PinholeIntrinsics> cameras,
                                                         const SilhouetteOptions& options,
                                                         std::string* reason) {
  if (options.engine == "contour" || options.engine == "auto") {
    if (reason != nullptr) *reason = "contour, as asked for";
    return make_contour_scorer(model, cameras, options.threads);
  }
  throw std::invalid_argument("silhouette engine '" + options.engine +
                              "', expected auto, contour or atlas");
}

}  // namespace bodyschema
