#include "bodyschema/vision/scene_colours.hpp"

#include <numeric>

#include "bodyschema/vision/mask_operations.hpp"

namespace bodyschema {
namespace {

/// Share of a prediction that is always believed.
constexpr double kCoreShare = 0.3;

BinaryMask core_of(const BinaryMask& predicted, double reach_px) {
  MaskMorphology morphology;
  for (int by = static_cast<int>(reach_px); by > 0; by = by * 3 / 4) {
    BinaryMask core = predicted;
    morphology.erode(core, by);
    if (static_cast<double>(core.count()) >= kCoreShare * static_cast<double>(predicted.count())) return core;
  }
  return predicted;
}

RobotLooks shares_of(const std::vector<double>& counts, int channels) {
  RobotLooks looks;
  const double all = std::accumulate(counts.begin(), counts.end(), 0.0);
  if (all <= 0.0) return looks;
  looks.channels = channels;
  for (const double count : counts) looks.share.push_back(static_cast<float>(count / all));
  return looks;
}

}  // namespace

SceneColourCounts::SceneColourCounts() : robot_(RobotLooks::kCells, 0.0), rest_(RobotLooks::kCells, 0.0) {}

void SceneColourCounts::add(const Image& image, const BinaryMask& predicted, double reach_px,
                            const BinaryMask& beside) {
  channels_ = image.channels;
  const BinaryMask core = core_of(predicted, reach_px);
  for (int v = 0; v < image.height; ++v) {
    for (int u = 0; u < image.width; ++u) {
      if (core.at(u, v)) {
        robot_[RobotLooks::cell(image.pixel(u, v), channels_)] += 1.0;
      } else if (!beside.at(u, v)) {
        rest_[RobotLooks::cell(image.pixel(u, v), channels_)] += 1.0;
      }
    }
  }
}

SceneColours SceneColourCounts::shares() const {
  return {shares_of(robot_, channels_), shares_of(rest_, channels_)};
}

}  // namespace bodyschema
