#include "colour_evidence.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace bodyschema {
namespace {

// Lengths are those of a 320x240 picture.
// Beyond where the robot may be, background colours are taken from a ring this wide, px.
constexpr double kRing_px = 20.0;
// Colours are compared with those of the same tile and its neighbours: tiles of this side, px.
constexpr double kTile_px = 24.0;
// Robot colours are first taken from where the prediction is deepest, as long as that leaves this share of it: at its
// edge it may well be wrong.
constexpr double kSureShare = 0.3;
// A prediction that may be further off than this is believed in its core only, px.
constexpr double kRough_px = 8.0;
// Where a prediction is good, this far from its outline a pixel is what is predicted, px: beyond blur.
constexpr float kClear_px = 2.0f;
// What colours of the whole box count beside those nearby: pixels; more where the prediction may be so far off that
// what is nearby need not be.
constexpr float kWholeCount = 60.0f, kWholeCountRough = 1000.0f;
// The same of the robot's colours as known before.
constexpr float kKnownCount = 60.0f;
// A colour that neither side has shown says nothing: share of a cell that nobody has seen.
constexpr float kFloor = 1e-3f;
// One pixel alone never decides against all its neighbours: log odds.
constexpr float kMostEvidence = 2.0f;
// Log odds by which a pixel as far off as the prediction may be belongs to the side that is predicted.
constexpr float kPrediction = 0.7f;

// What all pictures show beside what this one shows there: as much.
constexpr float kScene = 0.5f;
// From here on a pixel has the colours of the rest: log odds, mean of its neighbourhood.
constexpr float kDeny = 0.5f;
// Less than this in the mean of a pixel's neighbourhood says nothing: log odds.
constexpr float kWeak = 0.25f;

double unit_of(const Image& image) {
  return std::sqrt(static_cast<double>(image.width) * image.height / (320.0 * 240.0));
}

}  // namespace

std::size_t RobotLooks::cell(const std::uint8_t* p, int channels) {
  constexpr int kShift = 8 - kBits;
  if (channels == 1) return p[0];
  return (static_cast<std::size_t>(p[0] >> kShift) << (2 * kBits)) |
         (static_cast<std::size_t>(p[1] >> kShift) << kBits) | static_cast<std::size_t>(p[2] >> kShift);
}

/// Distance to the nearest pixel of the other side, by two passes over the box.
void ColourEvidence::measure_depth(const BinaryMask& predicted) {
  const int w = box_.width(), h = box_.height();
  constexpr float kFar = 1e4f, kStraight = 1.0f, kDiagonal = 1.4142f;
  depth_.resize(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
  sums_.assign(depth_.size(), kFar);  // distance to the outline, unsigned
  std::vector<float>& d = sums_;
  const auto inside = [&](int x, int y) { return predicted.at(box_.u0 + x, box_.v0 + y); };
  const auto at = [&](int x, int y) -> float& {
    return d[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)];
  };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const bool here = inside(x, y);
      if (x > 0 && inside(x - 1, y) != here) at(x, y) = at(x - 1, y) = 0.5f;
      if (y > 0 && inside(x, y - 1) != here) at(x, y) = at(x, y - 1) = 0.5f;
    }
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      float best = at(x, y);
      if (x > 0) best = std::min(best, at(x - 1, y) + kStraight);
      if (y > 0) {
        best = std::min(best, at(x, y - 1) + kStraight);
        if (x > 0) best = std::min(best, at(x - 1, y - 1) + kDiagonal);
        if (x + 1 < w) best = std::min(best, at(x + 1, y - 1) + kDiagonal);
      }
      at(x, y) = best;
    }
  }
  for (int y = h - 1; y >= 0; --y) {
    for (int x = w - 1; x >= 0; --x) {
      float best = at(x, y);
      if (x + 1 < w) best = std::min(best, at(x + 1, y) + kStraight);
      if (y + 1 < h) {
        best = std::min(best, at(x, y + 1) + kStraight);
        if (x > 0) best = std::min(best, at(x - 1, y + 1) + kDiagonal);
        if (x + 1 < w) best = std::min(best, at(x + 1, y + 1) + kDiagonal);
      }
      at(x, y) = best;
    }
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      depth_[static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x)] =
          inside(x, y) ? at(x, y) : -at(x, y);
    }
  }
}

/// The depth from which on a pixel is robot, however wrong the prediction: a share of it is always believed.
float ColourEvidence::core_depth(double reach_px) const {
  constexpr std::size_t kDepths = 128;
  std::array<std::size_t, kDepths> deeper{};
  std::size_t inside = 0;
  for (const float d : depth_) {
    if (d <= 0.0f) continue;
    ++inside;
    ++deeper[std::min(static_cast<std::size_t>(d), kDepths - 1)];
  }
  const auto least = static_cast<std::size_t>(kSureShare * static_cast<double>(inside));
  std::size_t count = 0;
  for (std::size_t k = kDepths; k-- > 0;) {
    count += deeper[k];
    if (count >= least) return std::min(static_cast<float>(k), static_cast<float>(reach_px));
  }
  return 0.0f;
}

/// Numbers the cells that the box shows: few of all there are.
void ColourEvidence::find_cells(const Image& image) {
  constexpr std::uint16_t kUnseen = 0xffff;
  number_.assign(RobotLooks::kCells, kUnseen);
  palette_.clear();
  cell_.resize(depth_.size());
  std::size_t i = 0;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const auto* pixel = image.pixel(box_.u0, v);
    for (int u = box_.u0; u <= box_.u1; ++u, ++i, pixel += image.channels) {
      const std::size_t cell = RobotLooks::cell(pixel, image.channels);
      if (number_[cell] == kUnseen) {
        number_[cell] = static_cast<std::uint16_t>(palette_.size());
        palette_.push_back(static_cast<std::uint16_t>(cell));
      }
      cell_[i] = number_[cell];
    }
  }
}

void ColourEvidence::collect(Side& robot, Side& rest) const {
  const std::size_t n = palette_.size();
  for (Side* side : {&robot, &rest}) {
    side->tiles.assign(static_cast<std::size_t>(columns_ * rows_) * n, 0.0f);
    side->all.assign(n, 0.0f);
    side->count = 0.0f;
  }
  std::size_t i = 0;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const int row = (v - box_.v0) / tile_px_;
    for (int u = box_.u0; u <= box_.u1; ++u, ++i) {
      if (side_[i] == 0) continue;
      Side& side = side_[i] > 0 ? robot : rest;
      const auto tile = static_cast<std::size_t>(row * columns_ + (u - box_.u0) / tile_px_);
      side.tiles[tile * n + cell_[i]] += 1.0f;
      side.all[cell_[i]] += 1.0f;
      side.count += 1.0f;
    }
  }
  spread(robot);
  spread(rest);
}

/// Sums over each tile and its eight neighbours.
void ColourEvidence::spread(Side& side) const {
  const std::size_t n = palette_.size();
  side.near.assign(side.tiles.size(), 0.0f);
  side.total.assign(static_cast<std::size_t>(columns_ * rows_), 0.0f);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const auto tile = static_cast<std::size_t>(row * columns_ + column);
      float* out = side.near.data() + tile * n;
      for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
        for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
          const float* in = side.tiles.data() + static_cast<std::size_t>(r * columns_ + c) * n;
          for (std::size_t k = 0; k < n; ++k) out[k] += in[k];
        }
      }
      float total = 0.0f;
      for (std::size_t k = 0; k < n; ++k) total += out[k];
      side.total[tile] = total;
    }
  }
}

/// Log likelihood ratio of every pixel of the box.
void ColourEvidence::weigh(const RobotLooks& looks, const SceneColours* colours, double reach_px) {
  const std::size_t n = palette_.size();
  evidence_.resize(depth_.size());
  const float whole = rough_ ? kWholeCountRough : kWholeCount;
  const float robot_all = whole / std::max(robot_.count, 1.0f), rest_all = whole / std::max(rest_.count, 1.0f);
  const float known = looks.known() ? (rough_ ? kWholeCountRough : kKnownCount) : 0.0f;
  const auto far = static_cast<float>(reach_px);
  std::size_t i = 0;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const int row = (v - box_.v0) / tile_px_;
    for (int u = box_.u0; u <= box_.u1; ++u, ++i) {
      if (std::abs(depth_[i]) > far + 4.0f) {
        evidence_[i] = depth_[i] > 0.0f ? kMostEvidence : -kMostEvidence;
        continue;
      }
      const auto tile = static_cast<std::size_t>(row * columns_ + (u - box_.u0) / tile_px_);
      const std::size_t k = cell_[i];
      float robot = (robot_.near[tile * n + k] + robot_all * robot_.all[k] +
                     (known > 0.0f ? known * looks.share[palette_[k]] : 0.0f)) /
                    (robot_.total[tile] + whole + known);
      float rest = (rest_.near[tile * n + k] + rest_all * rest_.all[k]) / (rest_.total[tile] + whole);
      if (colours != nullptr) {
        robot += kScene * (colours->robot.share[palette_[k]] - robot);
        rest += kScene * (colours->rest.share[palette_[k]] - rest);
      }
      evidence_[i] = std::clamp(std::log((robot + kFloor) / (rest + kFloor)), -kMostEvidence, kMostEvidence);
    }
  }
}

/// Mean evidence of a small square, and the prediction's say.
void ColourEvidence::decide(double reach_px, int smoothing, bool may_deny, const BackgroundModel* background,
                            const BinaryMask& differs, BinaryMask& robot) {
  const int w = box_.width(), h = box_.height();
  const auto width = static_cast<std::size_t>(w);
  const auto far = static_cast<float>(reach_px);
  const auto everywhere = static_cast<float>(kEverywhere_px * unit_);
  sums_.resize(depth_.size());
  smooth_.resize(depth_.size());
  for (int y = 0; y < h; ++y) {  // along rows
    const float* in = evidence_.data() + static_cast<std::size_t>(y) * width;
    float* out = sums_.data() + static_cast<std::size_t>(y) * width;
    for (int x = 0; x < w; ++x) {
      float sum = 0.0f;
      for (int k = -smoothing; k <= smoothing; ++k) sum += in[std::clamp(x + k, 0, w - 1)];
      out[x] = sum;
    }
  }
  const float share = 1.0f / static_cast<float>((2 * smoothing + 1) * (2 * smoothing + 1));
  robot.fill(false);
  if (denied_.width() != robot.width() || denied_.height() != robot.height()) {
    denied_ = BinaryMask(robot.width(), robot.height());
  }
  denied_.fill(false);
  std::size_t i = 0;
  for (int y = 0; y < h; ++y) {
    const auto mean = [&](int x) {
      float sum = 0.0f;
      for (int k = -smoothing; k <= smoothing; ++k) {
        sum += sums_[static_cast<std::size_t>(std::clamp(y + k, 0, h - 1)) * width + static_cast<std::size_t>(x)];
      }
      return sum * share;
    };
    for (int x = 0; x < w; ++x, ++i) {
      const float d = depth_[i];
      smooth_[i] = kMostEvidence;
      const int u = box_.u0 + x, v = box_.v0 + y;
      if (background != nullptr &&
          background->precision[static_cast<std::size_t>(v) * static_cast<std::size_t>(background->width) +
                                static_cast<std::size_t>(u)] > 0.0f) {
        if (!differs.at(u, v) || (d < -far && far < everywhere)) continue;
        if (may_deny && d <= far && mean(x) < -kDeny) {
          denied_.set(u, v);
        } else {
          robot.set(u, v);
        }
        continue;
      }
      if (d < -far) continue;
      const float own = mean(x);
      if (d <= far) smooth_[i] = own;
      if (d > far || own + kPrediction * d / far > 0.0f) robot.set(u, v);
    }
  }
}

void ColourEvidence::separate(const Image& image, const BinaryMask& predicted, double reach_px, const RobotLooks& looks,
                              const SceneColours* colours, const BackgroundModel* background, const BinaryMask& differs,
                              BinaryMask& robot) {
  const double unit = unit_of(image);

  robot.fill(false);
  box_ = bounding_box(predicted).grown(static_cast<int>(reach_px + kRing_px * unit), image.width, image.height);
  if (background != nullptr && reach_px >= kEverywhere_px * unit) box_ = {0, 0, image.width - 1, image.height - 1};
  if (box_.empty()) return;
  tile_px_ = std::max(8, static_cast<int>(kTile_px * unit));
  columns_ = (box_.width() + tile_px_ - 1) / tile_px_;
  rows_ = (box_.height() + tile_px_ - 1) / tile_px_;
  measure_depth(predicted);
  find_cells(image);
  side_.resize(depth_.size());
  std::size_t i = 0;
  // From where the prediction is most likely right; then, where it may be far off, from what that decides.
  rough_ = reach_px > kRough_px * unit;
  const float core = std::max(core_depth(reach_px), kClear_px);
  const auto outside = static_cast<float>(std::max(0.6 * reach_px, static_cast<double>(kClear_px)));
  for (std::size_t k = 0; k < depth_.size(); ++k) {
    side_[k] = depth_[k] >= core ? 1 : (depth_[k] <= -outside ? -1 : 0);
  }
  for (int round = 0;; ++round) {
    collect(robot_, rest_);
    weigh(looks, colours, reach_px);
    decide(reach_px, rough_ ? 2 : 1, colours != nullptr, background, differs, robot);
    if (round > 0) break;
    i = 0;
    for (int v = box_.v0; v <= box_.v1; ++v) {
      for (int u = box_.u0; u <= box_.u1; ++u, ++i) {
        // Pixels beside a border of what was decided mix both colours.
        const bool here = robot.at(u, v);
        bool mixed = false;
        for (const auto& [du, dv] : {std::pair{-2, 0}, {2, 0}, {0, -2}, {0, 2}}) {
          const int a = std::clamp(u + du, box_.u0, box_.u1), b = std::clamp(v + dv, box_.v0, box_.v1);
          mixed = mixed || robot.at(a, b) != here;
        }
        side_[i] = mixed ? 0 : (here ? 1 : -1);
      }
    }
  }
}

void ColourEvidence::mark_weak(BinaryMask& weak) {
  weak.fill(false);
  std::size_t i = 0;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int u = box_.u0; u <= box_.u1; ++u, ++i) {
      if (std::abs(smooth_[i]) < kWeak) weak.set(u, v);
    }
  }
  // Between robot and background that differ it changes sign within a pixel or two: no weakness.
  morphology_.erode(weak);
  morphology_.dilate(weak, 2);
}

void ColourEvidence::learn(const Image& image, const BinaryMask& predicted, float share, RobotLooks& looks) {
  std::vector<float>& seen = robot_.all;
  seen.assign(RobotLooks::kCells, 0.0f);
  float count = 0.0f;
  std::size_t i = 0;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int u = box_.u0; u <= box_.u1; ++u, ++i) {
      if (depth_[i] < kClear_px || !predicted.at(u, v)) continue;
      seen[RobotLooks::cell(image.pixel(u, v), image.channels)] += 1.0f;
      count += 1.0f;
    }
  }
  if (count < 100.0f) return;
  const bool first = !looks.known() || looks.channels != image.channels;
  if (first) looks.share.assign(RobotLooks::kCells, 0.0f);
  looks.channels = image.channels;
  const float rate = first ? 1.0f : share;
  for (std::size_t k = 0; k < RobotLooks::kCells; ++k) {
    looks.share[k] += rate * (seen[k] / count - looks.share[k]);
  }
}

}  // namespace bodyschema
