#include "region_statistics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "bodyschema/vision/robot_looks.hpp"
#include "learned_background.hpp"

namespace bodyschema {
namespace {

// Beyond the search region, background colours are taken from a ring this wide, px.
constexpr int kRing = 16;
// Robot colours are first taken from where the prediction is deepest, as long as that leaves this
// share of it: at its edge it may well be wrong.
constexpr double kSureShareOfBox = 0.25;
constexpr float kHistogramMemory = 0.9f;
// One colour alone never decides against all its neighbours.
constexpr float kMostLogOdds = 1.4f;
// Log odds per px of distance from the predicted outline.
constexpr float kPriorSlope = 0.08f;
// The local background is the mean over a square with this half side, px.
constexpr int kLocalRadius = 6;
// So near to the robot pixels are mixtures, px.
constexpr int kMixed = 2;

}  // namespace

float noise_of(const Image& image) {
  std::array<std::size_t, 256> histogram{};
  const auto row = static_cast<std::ptrdiff_t>(image.width) * image.channels;
  const auto step = static_cast<std::ptrdiff_t>(image.channels);
  for (int v = 1; v + 1 < image.height; v += 2) {
    for (int u = 1; u + 1 < image.width; u += 2) {
      const auto* p = image.pixel(u, v);
      const int sum = p[-row - step] - 2 * p[-row] + p[-row + step] - 2 * p[-step] + 4 * p[0] - 2 * p[step] +
                      p[row - step] - 2 * p[row] + p[row + step];
      // The weights' norm is 6: in whole levels of one pixel's noise, finer by that much.
      ++histogram[static_cast<std::size_t>(std::min(std::abs(sum), 255))];
    }
  }
  return std::max(noise_from_differences(histogram) / 6.0f, kLeastNoiseSd);
}

namespace {

std::size_t cell_of(const Image& image, std::size_t pixel) {
  return RobotLooks::cell(image.data.data() + pixel * static_cast<std::size_t>(image.channels), image.channels);
}

}  // namespace

float RegionStatistics::collect(const Image& image, const BinaryMask& where, const PixelBox& box,
                                Histogram& histogram) {
  histogram.assign(RobotLooks::kCells, 0.0f);
  float count = 0.0f;
  for (int v = box.v0; v <= box.v1; ++v) {
    const auto* row = where.row(v);
    const auto begin = static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width);
    for (int w = box.u0 >> 6; w <= box.u1 >> 6; ++w) {
      for (std::uint64_t word = row[w]; word != 0; word &= word - 1) {
        const auto u = static_cast<std::size_t>(64 * w + std::countr_zero(word));
        histogram[cell_of(image, begin + u)] += 1.0f;
        count += 1.0f;
      }
    }
  }
  return count;
}

void RegionStatistics::measure_depth(const BinaryMask& predicted, int reach) {
  const auto width = static_cast<std::size_t>(predicted.width());
  const auto far = static_cast<std::int16_t>(reach + 1);
  depth_.assign(width * static_cast<std::size_t>(predicted.height()), static_cast<std::int16_t>(-far));
  const auto add = [&](const BinaryMask& mask) {
    for (int v = box_.v0; v <= box_.v1; ++v) {
      const auto* row = mask.row(v);
      auto* depth = depth_.data() + static_cast<std::size_t>(v) * width;
      for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
        for (std::uint64_t word = row[w]; word != 0; word &= word - 1) {
          ++depth[64 * w + std::countr_zero(word)];
        }
      }
    }
  };
  // Each step of growing or shrinking adds one to the pixels it holds; there is no zero.
  work_ = predicted;
  for (int i = 0; i < reach; ++i) {
    morphology_.dilate(work_);
    add(work_);
  }
  work_ = predicted;
  add(work_);
  add(work_);
  for (int i = 0; i < reach; ++i) {
    morphology_.erode(work_);
    add(work_);
  }
}

void RegionStatistics::decide(const Image& image, int reach, BinaryMask& robot) {
  float robot_count = 0.0f;
  float background_count = 0.0f;
  for (std::size_t i = 0; i < RobotLooks::kCells; ++i) {
    robot_count += robot_histogram_[i];
    background_count += background_histogram_[i];
  }
  evidence_.resize(RobotLooks::kCells);
  const float robot_scale = 1.0f / (robot_count + 1.0f);
  const float background_scale = 1.0f / (background_count + 1.0f);
  // A colour that neither side has shown says nothing.
  constexpr float kFloor = 1e-4f;
  for (std::size_t i = 0; i < RobotLooks::kCells; ++i) {
    const float odds =
        (robot_histogram_[i] * robot_scale + kFloor) / (background_histogram_[i] * background_scale + kFloor);
    evidence_[i] = std::clamp(std::log(odds), -kMostLogOdds, kMostLogOdds);
  }

  // Mean evidence of 3x3 pixels plus the prediction's say.
  const auto width = static_cast<std::size_t>(image.width);
  const auto columns = static_cast<std::size_t>(box_.width());
  odds_.resize(columns + 2);
  row_sums_.assign(3 * columns, 0.0f);
  robot.fill(false);
  const auto sum_row = [&](int v) {
    const auto begin = static_cast<std::size_t>(v) * width + static_cast<std::size_t>(box_.u0);
    for (std::size_t u = 0; u < columns; ++u) odds_[u + 1] = evidence_[cell_of(image, begin + u)];
    odds_[0] = odds_[1];
    odds_[columns + 1] = odds_[columns];
    float* out = row_sums_.data() + static_cast<std::size_t>(v % 3) * columns;
    for (std::size_t u = 0; u < columns; ++u) out[u] = odds_[u] + odds_[u + 1] + odds_[u + 2];
  };
  sum_row(box_.v0);
  for (int v = box_.v0; v <= box_.v1; ++v) {
    if (v < box_.v1) sum_row(v + 1);
    const float* above = row_sums_.data() + static_cast<std::size_t>(std::max(v - 1, box_.v0) % 3) * columns;
    const float* here = row_sums_.data() + static_cast<std::size_t>(v % 3) * columns;
    const float* below = row_sums_.data() + static_cast<std::size_t>(std::min(v + 1, box_.v1) % 3) * columns;
    const auto* depth = depth_.data() + static_cast<std::size_t>(v) * width + static_cast<std::size_t>(box_.u0);
    for (std::size_t u = 0; u < columns; ++u) {
      const int d = depth[u];
      const float odds = (above[u] + here[u] + below[u]) / 9.0f + kPriorSlope * static_cast<float>(d);
      const bool is_robot = d > reach || (d >= -reach && odds > 0.0f);
      if (is_robot) robot.set(box_.u0 + static_cast<int>(u), v);
    }
  }
}

void RegionStatistics::separate(const Image& image, const BinaryMask& predicted, const VisionSetup& setup,
                                BinaryMask& robot, BackgroundModel& local) {
  if (local.width != image.width || local.height != image.height || local.channels != image.channels) {
    local = BackgroundModel(image.width, image.height, image.channels);
  }
  std::fill(local.precision.begin(), local.precision.end(), 0.0f);
  local.noise_sd = setup.noise_levels > 0.0 ? static_cast<float>(setup.noise_levels) : noise_of(image);
  robot.fill(false);
  const int reach = setup.search_px;
  box_ = bounding_box(predicted).grown(reach + kRing, image.width, image.height);
  if (box_.empty()) return;
  measure_depth(predicted, reach);

  // Where the prediction is most likely right: deep inside, and well outside.
  inside_ = predicted;
  work_ = predicted;
  const auto enough = static_cast<std::size_t>(kSureShareOfBox * static_cast<double>(predicted.count()));
  for (int depth = 0; depth < reach; ++depth) {
    morphology_.erode(work_);
    if (work_.count() <= enough) break;
    inside_ = work_;
  }
  outside_ = predicted;
  morphology_.dilate(outside_, std::max(reach / 2, 2));
  const auto invert = [&](BinaryMask& mask) {
    work_ = mask;
    mask.fill(false);
    for (int v = box_.v0; v <= box_.v1; ++v) set_run(mask, v, box_.u0, box_.u1 + 1, true);
    mask -= work_;
  };
  invert(outside_);

  for (int round = 0; round < 2; ++round) {
    const float robot_count = collect(image, inside_, box_, robot_histogram_);
    collect(image, outside_, box_, background_histogram_);
    if (!remembered_.empty()) {
      for (std::size_t i = 0; i < RobotLooks::kCells; ++i) robot_histogram_[i] += remembered_[i] * robot_count;
    }
    decide(image, reach, robot);
    if (round > 0) break;
    inside_ = robot;
    morphology_.erode(inside_, 2);
    if (inside_.count() == 0) inside_ = robot;
    outside_ = robot;
    morphology_.dilate(outside_, 2);
    invert(outside_);
  }
  // Remembered as shares, so that near and far hands count alike.
  inside_ = robot;
  morphology_.erode(inside_, 2);
  const float count = collect(image, inside_, box_, robot_histogram_);
  if (count > 0.0f) {
    if (remembered_.empty()) {
      remembered_ = robot_histogram_;
      for (auto& value : remembered_) value /= count;
    } else {
      for (std::size_t i = 0; i < RobotLooks::kCells; ++i) {
        remembered_[i] = kHistogramMemory * remembered_[i] + (1.0f - kHistogramMemory) * robot_histogram_[i] / count;
      }
    }
  }
  work_.fill(true);
  average_.around(image, robot, work_, box_, kMixed, kLocalRadius, local);
}

}  // namespace bodyschema
