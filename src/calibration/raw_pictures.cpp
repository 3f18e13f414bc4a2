#include "raw_pictures.hpp"

#include <algorithm>
#include <utility>

#include "bodyschema/camera/stereo_rig.hpp"
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
    shown_.push_back(camera.has_distortion() ? Undistorter(camera).valid() : BinaryMask());
  }
}

void RawPictures::segment(std::size_t camera, const Image& image, const PredictedRobot& predicted,
                          CameraObservation& out) {
  segmenters_[camera].segment(image, out.mask, out.valid, out.coverage, predicted);
  const BinaryMask& shown = shown_[camera];
  for (int v = 0; v < shown.height(); ++v) {
    for (int w = 0; w < shown.words_per_row(); ++w) {
      out.mask.row(v)[w] &= shown.row(v)[w];
      out.valid.row(v)[w] &= shown.row(v)[w];
    }
  }
}

bool RawPictures::cameras_stood_still() {
  moved_.clear();
  for (const auto& full : kept_) moved_.push_back(without_pictures(full));
  std::size_t all = 0, known = 0;
  for (std::size_t c = 0; c < segmenters_.size(); ++c) {
    std::vector<Image> frames;
    for (const auto& full : kept_) {
      if (full.cameras[c] && !full.cameras[c]->image.empty()) frames.push_back(full.cameras[c]->image);
    }
    if (frames.size() < kFewestFrames) return false;
    segmenters_[c].learn(frames);
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      auto& camera = moved_[i].cameras[c];
      if (!camera) continue;
      segment(c, kept_[i].cameras[c]->image, {}, *camera);
      all += static_cast<std::size_t>(camera->mask.width()) * static_cast<std::size_t>(camera->mask.height());
      known += camera->valid.count();
    }
  }
  return static_cast<double>(known) > kStands * static_cast<double>(all);
}

void RawPictures::by_what_moved() {
  replace(moved_, true);
}

PictureLog RawPictures::about(std::span<const Corrections> corrections, double reach_px) {
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
      segment(c, frames[k], PredictedRobot(&predicted[k], reach, false), camera);
    }
  }
  return replace(seen, false);
}

std::size_t RawPictures::picture_of(std::size_t camera, Microseconds utime) const {
  const auto pictures = log_.pictures();
  const auto found = std::find_if(pictures.begin(), pictures.end(),
                                  [&](const Picture& p) { return p.camera == camera && p.joints.utime == utime; });
  return static_cast<std::size_t>(found - pictures.begin());
}

PictureLog RawPictures::replace(const std::vector<Observation>& seen, bool learned) {
  PictureLog log(log_.robot(), log_.setup(), log_.rig());
  for (const auto& observation : seen) log.add(observation);
  log.set_encoders({log_.encoders().begin(), log_.encoders().end()});
  log.finish();
  if (learned) log.learned_background();
  return std::exchange(log_, std::move(log));
}

}  // namespace bodyschema
