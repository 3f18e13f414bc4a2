#include "raw_pictures.hpp"

#include <algorithm>
#include <utility>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

constexpr std::size_t kFewestFrames = 3;  ///< of which two can agree against the third
/// Physical. Pictures further apart than this, s, and than so many times the usual distance, are of another recording:
/// what stands before the cameras may have been moved between.
constexpr double kPause_s = 5.0, kPauseShare = 5.0;
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

std::vector<std::size_t> recordings_of(const std::vector<Observation>& kept) {
  std::vector<double> apart;
  for (std::size_t i = 1; i < kept.size(); ++i) apart.push_back(seconds(kept[i].utime - kept[i - 1].utime));
  const double pause_s = std::max(kPause_s, kPauseShare * median(apart));
  std::vector<std::size_t> list(kept.size(), 0);
  std::size_t begin = 0;
  for (std::size_t i = 1; i < kept.size(); ++i) {
    const bool pause = apart[i - 1] > pause_s && i - begin >= kFewestFrames && kept.size() - i >= kFewestFrames;
    if (pause) begin = i;
    list[i] = list[i - 1] + (pause ? 1 : 0);
  }
  return list;
}

RawPictures::RawPictures(PictureLog& log, const VisionSetup& vision, const std::vector<Observation>& kept)
    : log_(log), vision_(with_auto(vision)), kept_(kept), recording_(recordings_of(kept)) {
  const std::size_t count = recording_.empty() ? 1 : recording_.back() + 1;
  for (const auto& camera : log.rig().cameras) {
    auto& own = segmenters_.emplace_back();
    for (std::size_t r = 0; r < count; ++r) {
      own.emplace_back(vision_, camera.name, camera.intrinsics.width, camera.intrinsics.height);
    }
    shown_.push_back(camera.has_distortion() ? Undistorter(camera).valid() : BinaryMask());
  }
}

void RawPictures::segment(std::size_t camera, std::size_t i, const PredictedRobot& predicted, CameraObservation& out) {
  segmenters_[camera][recording_[i]].segment(kept_[i].cameras[camera]->image, out.mask, out.valid, out.coverage,
                                             predicted);
  const BinaryMask& shown = shown_[camera];
  if (shown.empty()) return;
  out.mask &= shown;
  out.valid &= shown;
}

bool RawPictures::cameras_stood_still() {
  moved_.clear();
  for (const auto& full : kept_) moved_.push_back(without_pictures(full));
  std::size_t all = 0, known = 0;
  for (std::size_t c = 0; c < segmenters_.size(); ++c) {
    for (std::size_t r = 0; r < segmenters_[c].size(); ++r) {
      std::vector<Image> frames;
      for (std::size_t i = 0; i < kept_.size(); ++i) {
        if (recording_[i] == r && moved_[i].cameras[c]) frames.push_back(kept_[i].cameras[c]->image);
      }
      if (frames.size() < kFewestFrames) return false;
      segmenters_[c][r].learn(frames);
    }
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      auto& camera = moved_[i].cameras[c];
      if (!camera) continue;
      segment(c, i, {}, *camera);
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
    std::vector<BinaryMask> predicted(kept_.size());
    SceneColourCounts colours;
    for (std::size_t r = 0; r < segmenters_[c].size(); ++r) {
      std::vector<Image> frames;
      std::vector<BinaryMask> robots;
      for (std::size_t i = 0; i < kept_.size(); ++i) {
        if (recording_[i] != r || !seen[i].cameras[c]) continue;
        const auto p = log_.find(c, seen[i].cameras[c]->utime);
        if (!p) {
          seen[i].cameras[c].reset();
          continue;
        }
        frames.push_back(kept_[i].cameras[c]->image);
        predicted[i] = preview.draw(log_.pictures()[*p].joints.q, corrections[*p], c);
        robots.push_back(predicted[i]);
        morphology.dilate(robots.back(), static_cast<int>(reach));
        colours.add(frames.back(), predicted[i], reach, robots.back());
      }
      segmenters_[c][r].learn(frames, robots);
    }
    for (auto& segmenter : segmenters_[c]) segmenter.know_colours(colours.shares());
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      if (seen[i].cameras[c]) segment(c, i, PredictedRobot(&predicted[i], reach, false), *seen[i].cameras[c]);
    }
  }
  return replace(seen, false);
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
