#include <stdexcept>

#include "atlas_scorer.hpp"
#include "bodyschema/gl/context.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"
#include "contour_scorer.hpp"
#include "fallback_scorer.hpp"

namespace bodyschema {

std::unique_ptr<SilhouetteScorer> make_silhouette_scorer(const SilhouetteModel& model,
                                                         std::span<const PinholeIntrinsics> cameras,
                                                         const SilhouetteOptions& options, std::string* reason) {
  const auto because = [&](std::string why) {
    if (reason != nullptr) *reason = std::move(why);
  };
  const auto atlas = [&](std::unique_ptr<gl::Context> context) {
    AtlasOptions atlas_options;
    atlas_options.threads = options.threads;
    if (options.gl_pass == "raster") atlas_options.pass = AtlasPass::kRaster;
    return with_contour_to_fall_back_on(make_atlas_scorer(model, cameras, std::move(context), atlas_options), model,
                                        cameras, options.threads);
  };
  if (options.gl_pass != "auto" && options.gl_pass != "raster" && options.gl_pass != "compute") {
    throw std::invalid_argument("silhouette gl_pass '" + options.gl_pass + "', expected auto, raster or compute");
  }
  if (options.engine == "contour") {
    because("the configuration asks for contour");
    return make_contour_scorer(model, cameras, options.threads);
  }
  if (options.engine == "atlas") {
    because("the configuration asks for atlas");
    return atlas(gl::Context::create(options.gl_platform));
  }
  if (options.engine != "auto") {
    throw std::invalid_argument("silhouette engine '" + options.engine + "', expected auto, contour or atlas");
  }
  try {
    auto context = gl::Context::create(options.gl_platform);
    if (!context->is_software()) {
      because("auto: " + context->description() + " is a GPU");
      return atlas(std::move(context));
    }
    because("auto: no GPU, " + context->description() + " draws in software");
  } catch (const gl::ContextError& error) {
    because(std::string("auto: ") + error.what());
  }
  return make_contour_scorer(model, cameras, options.threads);
}

}  // namespace bodyschema
