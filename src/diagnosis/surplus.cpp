#include "surplus.hpp"

#include <algorithm>
#include <cmath>

#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "limits.hpp"

namespace bodyschema::diagnosis {
namespace {

/// Pixels that are seen and lie beyond.
double beyond(const Picture& picture, const BinaryMask& allowed) {
  double count = 0.0;
  for (int v = 0; v < allowed.height(); ++v) {
    for (int u = 0; u < allowed.width(); ++u) {
      const bool judged = picture.valid.empty() || picture.valid.at(u, v);
      count += judged && picture.mask.at(u, v) && !allowed.at(u, v) ? 1.0 : 0.0;
    }
  }
  return count;
}

}  // namespace

Surplus surplus(LogFit& fit, const LogAbout& log, const std::vector<std::size_t>& pictures) {
  SilhouettePreview preview(fit.log());
  MaskMorphology morphology;
  std::vector<std::vector<double>> of_block(log.blocks);
  for (const auto p : pictures) {
    if (log.precision[p] <= 0.0) continue;
    const auto& picture = fit.log().pictures()[p];
    const auto& k = fit.log().rig().cameras[picture.camera].intrinsics;
    const double reach_px = limits::kSearch_px * picture_unit(k);
    auto silhouette = preview.draw(picture.joints.q, log.at.corrections[p], picture.camera);
    morphology.dilate(silhouette, static_cast<int>(std::lround(reach_px)));
    const double pixels = beyond(picture, silhouette);
    auto& measurement = fit.measurement();
    measurement.projection().place(picture.joints.q, log.at.corrections[p], picture.camera);
    const double depth = std::max(0.0, measurement.projection().hand().translation().z());
    of_block[log.block_of[p]].push_back(pixels < reach_px * reach_px ? 0.0 : pixels * depth * depth / (k.fx * k.fy));
  }
  std::vector<double> areas;
  double seen = 0.0;
  for (const auto& areas_of_pictures : of_block) {
    if (areas_of_pictures.empty()) continue;
    seen += 1.0;
    if (const double area = median(areas_of_pictures); area > 0.0) areas.push_back(area);
  }
  if (areas.empty()) return {};
  return {static_cast<double>(areas.size()) / seen, median(areas)};
}

}  // namespace bodyschema::diagnosis
