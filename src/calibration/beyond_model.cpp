#include "beyond_model.hpp"

#include <algorithm>
#include <utility>

#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

// Physical, px of a 320x240 picture.
constexpr double kErr_px = 2.0;    ///< outlines of a fit that is near err by less
constexpr double kThick_px = 1.0;  ///< a piece is at least twice as thick: the ragged edge of a mask is none
constexpr double kBlend_px = 3.0;  ///< so far from such a piece an outline may be part of it
constexpr double kMost = 0.5;      ///< share of the pictures in which what is fixed to a link shows

bool meet(BinaryMask a, const BinaryMask& b) {
  a &= b;
  return a.count() > 0;
}

/// Pieces of one that reach further than `err` beyond the other and are no thin strips.
BinaryMask pieces(BinaryMask one, BinaryMask other, int err, int thick, MaskMorphology& morphology) {
  morphology.dilate(other, err);
  one -= other;
  morphology.erode(one, thick);
  morphology.dilate(one, thick);
  return one;
}

}  // namespace

BeyondModel beyond_model(const PictureLog& log, std::span<const Corrections> corrections) {
  const auto pictures = log.pictures();
  const std::size_t links = log.setup().model.rendered_links.size();
  BeyondModel result;
  result.where.resize(pictures.size());
  SilhouettePreview preview(log);
  MaskMorphology morphology;
  std::vector<double> seen(links, 0.0), held(links, 0.0);
  for (std::size_t p = 0; p < pictures.size(); ++p) {
    const auto& picture = pictures[p];
    const double unit = log.unit_px(p);
    const auto px = [unit](double of_small) { return std::max(1, static_cast<int>(of_small * unit + 0.5)); };
    const BinaryMask model = preview.draw(picture.joints.q, corrections[p], picture.camera);
    BinaryMask known = picture.mask, predicted = model;
    if (!picture.valid.empty()) {
      BinaryMask unknown(known.width(), known.height());
      unknown.fill(true);
      unknown -= picture.valid;
      known |= unknown;  // it may be robot: the model lacks nothing there
    }
    BinaryMask more = pieces(picture.mask, model, px(kErr_px), px(kThick_px), morphology);
    const BinaryMask less = pieces(std::move(predicted), std::move(known), px(kErr_px), px(kThick_px), morphology);
    BinaryMask all = more;
    all |= less;
    if (all.count() == 0) continue;
    ++result.pictures;
    morphology.dilate(all, px(kErr_px + kBlend_px));
    result.where[p] = std::move(all);
    morphology.dilate(more, px(kErr_px) + 2);
    for (std::size_t l = 0; l < links; ++l) {
      std::vector<bool> one(links, false);
      one[l] = true;
      const BinaryMask part = preview.draw_parts(picture.joints.q, corrections[p], picture.camera, one);
      if (part.count() == 0) continue;
      seen[l] += 1.0;
      held[l] += meet(part, more);
    }
  }
  if (const auto link = link_that_holds(held, seen, pictures.size())) {
    result.on_link = log.setup().model.rendered_links[*link];
  }
  return result;
}

std::optional<std::size_t> link_that_holds(std::span<const double> held, std::span<const double> seen,
                                           std::size_t pictures) {
  std::optional<std::size_t> most;
  for (std::size_t l = 0; l < held.size(); ++l) {
    if (held[l] <= kMost * static_cast<double>(pictures)) continue;
    if (!most || held[l] * seen[*most] > held[*most] * seen[l]) most = l;
  }
  return most;
}

void leave_out(PictureLog& log, const BeyondModel& beyond) {
  for (std::size_t p = 0; p < log.pictures().size(); ++p) log.leave_out(p, beyond.where[p]);
}

}  // namespace bodyschema
