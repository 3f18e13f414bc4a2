#include "raw_pictures.hpp"

#include <algorithm>
#include <utility>

#include "bodyschema/outline/outline_measurement.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kFewestFrames = 3;  ///< of which two can agree against the third
/// Statistical. Share of the pictures' pixels that show what stands still, where cameras do.
constexpr double kStands = 0.5;

/// What a fit wants of an observation, the pictures themselves left out.
Observation without_pictures(const Observation& full) {
  Observation o;
  o.utime = full.utime;
  for (const auto& seen : full.cameras) {
    auto& camera = o.cameras.emplace_back();
    if (!seen || seen->image.empty()) continue;
    camera.emplace();
    camera->utime = seen->utime;
    camera->joints = seen->joints;
  }
  return o;
}

VisionSetup with_auto(VisionSetup vision) {
  vision.method = SegmentationMethod::kAuto;
  return vision;
}

}  // namespace

RawPictures::RawPictures(PictureLog& log, const VisionSetup& vision, const std::vector<Observation>& kept)
    : log_(log), vision_(with_auto(vision)), kept_(kept) {
  for (const auto& camera : log.rig().cameras) {
    segmenters_.emplace_back(vision_, camera.name, camera.intrinsics.width, camera.intrinsics.height);
  }
}

bool RawPictures::by_what_moved() {
  std::vector<Observation> seen;
  for (const auto& full : kept_) seen.push_back(without_pictures(full));
  std::size_t all = 0, known = 0;
  for (std::size_t c = 0; c < segmenters_.size(); ++c) {
    std::vector<Image> frames;
    for (const auto& full : kept_) {
      if (full.cameras[c] && !full.cameras[c]->image.empty()) frames.push_back(full.cameras[c]->image);
    }
    if (frames.size() < kFewestFrames) return false;
    segmenters_[c].learn(frames);
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      auto& camera = seen[i].cameras[c];
      if (!camera) continue;
      segmenters_[c].segment(kept_[i].cameras[c]->image, camera->mask, camera->valid, camera->coverage);
      all += static_cast<std::size_t>(camera->mask.width()) * static_cast<std::size_t>(camera->mask.height());
      known += camera->valid.count();
    }
  }
  if (static_cast<double>(known) < kStands * static_cast<double>(all)) return false;
  replace(seen, true);
  return true;
}

void RawPictures::about(std::span<const Corrections> corrections, double reach_px) {
  std::vector<Observation> seen;
  for (const auto& full : kept_) seen.push_back(without_pictures(full));
  SilhouettePreview preview(log_);
  MaskMorphology morphology;
  for (std::size_t c = 0; c < segmenters_.size(); ++c) {
    const double reach = reach_px * picture_unit(log_.rig().cameras[c].intrinsics);
    std::vector<Image> frames;
    std::vector<BinaryMask> predicted, robots;
    std::vector<std::size_t> where;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      if (!seen[i].cameras[c]) continue;
      const auto p = picture_of(c, seen[i].cameras[c]->utime);
      if (p == log_.pictures().size()) {
        seen[i].cameras[c].reset();
        continue;
      }
      where.push_back(i);
      frames.push_back(kept_[i].cameras[c]->image);
      predicted.push_back(preview.draw(log_.pictures()[p].joints.q, corrections[p], c));
      robots.push_back(predicted.back());
      morphology.dilate(robots.back(), static_cast<int>(reach));
    }
    segmenters_[c].learn(frames, robots);
    for (std::size_t k = 0; k < where.size(); ++k) {
      auto& camera = *seen[where[k]].cameras[c];
      segmenters_[c].segment(frames[k], camera.mask, camera.valid, camera.coverage,
                             PredictedRobot(&predicted[k], reach, false));
    }
  }
  replace(seen, false);
}

std::size_t RawPictures::picture_of(std::size_t camera, Microseconds utime) const {
  const auto pictures = log_.pictures();
  const auto found = std::find_if(pictures.begin(), pictures.end(), [&](const Picture& p) {
    return p.camera == camera && p.joints.utime == utime;
  });
  return static_cast<std::size_t>(found - pictures.begin());
}

void RawPictures::replace(const std::vector<Observation>& seen, bool learned) {
  PictureLog log(log_.robot(), log_.setup(), log_.rig());
  for (const auto& observation : seen) log.add(observation);
  log.set_encoders({log_.encoders().begin(), log_.encoders().end()});
  log.finish();
  if (learned) log.learned_background();
  log_ = std::move(log);
}

}  // namespace bodyschema
