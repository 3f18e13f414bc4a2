#include "colour_evidence.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "pack_bits.hpp"

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
// Beyond the reach of a prediction, px, all evidence is the prediction's.
constexpr float kAside_px = 4.0f;
// Log odds by which a pixel as far off as the prediction may be belongs to the side that is predicted.
constexpr float kPrediction = 0.7f;

// What all pictures show beside what this one shows there: as much.
constexpr float kScene = 0.5f;
// From here on a pixel has the colours of the rest: log odds, mean of its neighbourhood.
constexpr float kDeny = 0.5f;
// Less than this in the mean of a pixel's neighbourhood says nothing: log odds.
constexpr float kWeak = 0.25f;

// Beside the robot the background's variety is measured up to here, px.
constexpr double kBeside_px = 8.0;

constexpr float kFar = 1e4f;

/// Makes a mask of this size of it, with nothing in it.
void clear(BinaryMask& mask, const BinaryMask& like) {
  if (mask.width() != like.width() || mask.height() != like.height()) {
    mask = BinaryMask(like.width(), like.height());
  } else {
    mask.fill(false);
  }
}

/// The row two pixels further on or back, where what lies beyond the box is as its border.
std::uint64_t word_two_before(const std::uint64_t* row, int w) {
  return (row[w] << 2) | (w > 0 ? row[w - 1] >> 62 : 0);
}
std::uint64_t word_two_after(const std::uint64_t* row, int w, int words) {
  return (row[w] >> 2) | (w + 1 < words ? row[w + 1] << 62 : 0);
}

}  // namespace

std::size_t RobotLooks::cell(const std::uint8_t* p, int channels) {
  constexpr int kShift = 8 - kBits;
  if (channels == 1) return p[0];
  return (static_cast<std::size_t>(p[0] >> kShift) << (2 * kBits)) |
         (static_cast<std::size_t>(p[1] >> kShift) << kBits) | static_cast<std::size_t>(p[2] >> kShift);
}

void ColourEvidence::look_at(const BinaryMask& predicted, double reach_px, bool whole) {
  unit_ = picture_unit(predicted.width(), predicted.height());
  reach_px_ = reach_px;
  rough_ = reach_px > kRough_px * unit_;
  predicted_ = predicted;
  const int width = predicted.width(), height = predicted.height();
  box_ = bounding_box(predicted).grown(static_cast<int>(reach_px + kRing_px * unit_), width, height);
  if (whole) box_ = {0, 0, width - 1, height - 1};
  clear(in_box_, predicted);
  clear(judged_, predicted);
  band_ = predicted;
  if (box_.empty()) {
    band_.fill(false);
    return;
  }
  for (int v = box_.v0; v <= box_.v1; ++v) set_run(in_box_, v, box_.u0, box_.u1 + 1, true);
  first_u_ = box_.u0 & ~63;
  stride_ = static_cast<std::size_t>((box_.u1 | 63) + 1 - first_u_) + 1;
  tile_px_ = std::max(8, static_cast<int>(kTile_px * unit_));
  columns_ = (box_.width() + tile_px_ - 1) / tile_px_;
  rows_ = (box_.height() + tile_px_ - 1) / tile_px_;
  measure_distance();
}

/// Distance to the nearest pixel of the other side, by two passes over all that is not further away than anyone asks.
void ColourEvidence::measure_distance() {
  const int asked_px =
      static_cast<int>(std::ceil(std::max(reach_px_ + static_cast<double>(kAside_px), kBeside_px * unit_))) + 1;
  morphology_.dilate(band_, asked_px);
  work_ = predicted_;
  morphology_.erode(work_, asked_px);
  band_ -= work_;
  band_ &= in_box_;
  distance_.assign(static_cast<std::size_t>(box_.height() + 2) * stride_ + 1, kFar);
  mark_outline();
  for (int v = box_.v0; v <= box_.v1; ++v) pass_on(v, true);
  for (int v = box_.v1; v >= box_.v0; --v) pass_on(v, false);
}

/// Both pixels that an outline runs between are half a pixel away from it.
void ColourEvidence::mark_outline() {
  constexpr float kHalf = 0.5f;
  const int words = predicted_.words_per_row();
  const int last = predicted_.width() - 1;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const auto* row = predicted_.row(v);
    const auto* above = predicted_.row(std::max(v - 1, box_.v0));
    const auto* below = predicted_.row(std::min(v + 1, box_.v1));
    std::uint64_t carried = 0;
    for (int w = 0; w < words; ++w) {
      // Bit u: that pixel and the next one differ.
      std::uint64_t differs = row[w] ^ ((row[w] >> 1) | (w + 1 < words ? row[w + 1] << 63 : 0));
      if (w == last >> 6) differs &= ~(~std::uint64_t{0} << (last & 63));
      const std::uint64_t outline = differs | (differs << 1) | carried | (row[w] ^ above[w]) | (row[w] ^ below[w]);
      carried = differs >> 63;
      for (std::uint64_t bits = outline & in_box_.row(v)[w]; bits != 0; bits &= bits - 1) {
        distance_[index(64 * w + std::countr_zero(bits), v)] = kHalf;
      }
    }
  }
}

/// What the row before, and the pixel before in this one, have of the distance.
void ColourEvidence::pass_on(int v, bool forwards) {
  constexpr float kStraight = 1.0f, kDiagonal = 1.4142f;
  constexpr int kWord = 64;
  const auto stride = static_cast<std::ptrdiff_t>(stride_);
  const int first = box_.u0 >> 6, last = box_.u1 >> 6;
  std::array<float, kWord> best;
  for (int i = first; i <= last; ++i) {
    const int w = forwards ? i : first + last - i;
    if (band_.row(v)[w] == 0) continue;
    float* here = distance_.data() + index(64 * w, v);
    const float* before = forwards ? here - stride : here + stride;
    for (int k = 0; k < kWord; ++k) {
      best[static_cast<std::size_t>(k)] =
          std::min(std::min(here[k], before[k] + kStraight), std::min(before[k - 1], before[k + 1]) + kDiagonal);
    }
    if (forwards) {
      float least = here[-1];
      for (int k = 0; k < kWord; ++k) here[k] = least = std::min(best[static_cast<std::size_t>(k)], least + kStraight);
    } else {
      float least = here[kWord];
      for (int k = kWord; k-- > 0;) here[k] = least = std::min(best[static_cast<std::size_t>(k)], least + kStraight);
    }
  }
}

void ColourEvidence::within(float px, BinaryMask& out) {
  constexpr std::size_t kWord = 64;
  clear(out, predicted_);
  hits_.resize(kWord);
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      if (band_.row(v)[w] == 0) continue;
      const float* distance = distance_.data() + index(64 * w, v);
      for (std::size_t k = 0; k < kWord; ++k) hits_[k] = static_cast<std::uint8_t>(distance[k] <= px);
      pack_bits(hits_.data(), kWord, out.row(v) + w);
      out.row(v)[w] &= in_box_.row(v)[w];
    }
  }
}

/// The depth from which on a pixel is robot, however wrong the prediction: a share of it is always believed.
float ColourEvidence::core_depth() const {
  constexpr std::size_t kDepths = 128;
  std::array<std::size_t, kDepths> deeper{};
  std::size_t inside = 0;
  for_each_in(predicted_, [&](int u, int v) {
    ++inside;
    ++deeper[std::min(static_cast<std::size_t>(distance_[index(u, v)]), kDepths - 1)];
  });
  const auto least = static_cast<std::size_t>(kSureShare * static_cast<double>(inside));
  std::size_t count = 0;
  for (std::size_t k = kDepths; k-- > 0;) {
    count += deeper[k];
    if (count >= least) return std::min(static_cast<float>(k), static_cast<float>(reach_px_));
  }
  return 0.0f;
}

/// From where the prediction is most likely right.
void ColourEvidence::find_sides() {
  const auto before = [](float px) { return std::nextafter(px, 0.0f); };
  const float core = std::max(core_depth(), kClear_px);
  const auto outside = static_cast<float>(std::max(0.6 * reach_px_, static_cast<double>(kClear_px)));
  within(before(core), robot_pixels_);
  within(before(outside), rest_pixels_);
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      const auto inside = predicted_.row(v)[w], box = in_box_.row(v)[w];
      robot_pixels_.row(v)[w] = inside & box & ~robot_pixels_.row(v)[w];
      rest_pixels_.row(v)[w] = ~inside & box & ~rest_pixels_.row(v)[w];
    }
  }
}

/// From what was decided. Pixels beside a border of that mix both colours.
void ColourEvidence::find_sides_again(const BinaryMask& robot) {
  constexpr int kBeside = 2;
  const int words = robot.words_per_row();
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const auto* row = robot.row(v);
    const auto* above = robot.row(std::max(v - kBeside, box_.v0));
    const auto* below = robot.row(std::min(v + kBeside, box_.v1));
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      const auto box = in_box_.row(v)[w];
      const auto mixed = (row[w] ^ word_two_before(row, w)) | (row[w] ^ word_two_after(row, w, words)) |
                         (row[w] ^ above[w]) | (row[w] ^ below[w]);
      robot_pixels_.row(v)[w] = row[w] & box & ~mixed;
      rest_pixels_.row(v)[w] = ~row[w] & box & ~mixed;
    }
    // The border of the box has nothing beside it, wherever that ends a robot.
    for (const int u : {box_.u0, box_.u0 + 1, box_.u1 - 1, box_.u1}) {
      const bool here = robot.at(u, v);
      const bool mixed =
          robot.at(std::max(u - kBeside, box_.u0), v) != here || robot.at(std::min(u + kBeside, box_.u1), v) != here ||
          ((above[u >> 6] ^ row[u >> 6]) >> (u & 63) & 1) != 0 || ((below[u >> 6] ^ row[u >> 6]) >> (u & 63) & 1) != 0;
      robot_pixels_.set(u, v, here && !mixed);
      rest_pixels_.set(u, v, !here && !mixed);
    }
  }
}

/// Numbers the cells that the box shows: few of all there are.
void ColourEvidence::find_cells(const Image& image) {
  constexpr std::uint16_t kUnseen = 0xffff;
  number_.assign(RobotLooks::kCells, kUnseen);
  palette_.clear();
  cell_.resize(distance_.size());
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const auto* pixel = image.pixel(box_.u0, v);
    auto* out = cell_.data() + index(box_.u0, v);
    for (int u = box_.u0; u <= box_.u1; ++u, pixel += image.channels) {
      const std::size_t cell = RobotLooks::cell(pixel, image.channels);
      if (number_[cell] == kUnseen) {
        number_[cell] = static_cast<std::uint16_t>(palette_.size());
        palette_.push_back(static_cast<std::uint16_t>(cell));
      }
      *out++ = number_[cell];
    }
  }
}

void ColourEvidence::collect(const BinaryMask& pixels, Side& side) const {
  const std::size_t n = palette_.size();
  const auto tiles = static_cast<std::size_t>(columns_ * rows_);
  side.tiles.assign(tiles * n, 0.0f);
  side.total.assign(tiles, 0.0f);
  side.all.assign(n, 0.0f);
  side.count = 0.0f;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    const auto* row = pixels.row(v);
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      if (row[w] == 0) continue;
      const auto* cells = cell_.data() + index(64 * w, v);
      for (int u = std::max(64 * w, box_.u0); u <= std::min(64 * w + 63, box_.u1);) {
        // As far as the word and the tile go.
        const int end = std::min({box_.u0 + ((u - box_.u0) / tile_px_ + 1) * tile_px_, 64 * w + 64, box_.u1 + 1});
        const int bits_before = u - 64 * w, length = end - u;
        float* counts = side.tiles.data() + tile_of(u, v) * n;
        for (auto bits = row[w] >> bits_before & ~std::uint64_t{0} >> (64 - length); bits != 0; bits &= bits - 1) {
          counts[cells[bits_before + std::countr_zero(bits)]] += 1.0f;
        }
        u = end;
      }
    }
  }
  for (std::size_t tile = 0; tile < tiles; ++tile) {
    const float* counts = side.tiles.data() + tile * n;
    for (std::size_t k = 0; k < n; ++k) side.all[k] += counts[k];
    for (std::size_t k = 0; k < n; ++k) side.total[tile] += counts[k];
    side.count += side.total[tile];
  }
}

/// Log likelihood ratio of a colour in a tile, by that and its neighbours.
float ColourEvidence::evidence_of(const RobotLooks& looks, const SceneColours* colours, std::size_t tile,
                                  std::size_t cell) const {
  const std::size_t n = palette_.size();
  const float whole = rough_ ? kWholeCountRough : kWholeCount;
  const float known = looks.known() ? (rough_ ? kWholeCountRough : kKnownCount) : 0.0f;
  const int row = static_cast<int>(tile) / columns_, column = static_cast<int>(tile) % columns_;
  float robot_near = 0.0f, robot_total = 0.0f, rest_near = 0.0f, rest_total = 0.0f;
  for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r) {
    for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c) {
      const auto at = static_cast<std::size_t>(r * columns_ + c);
      robot_near += robot_.tiles[at * n + cell];
      robot_total += robot_.total[at];
      rest_near += rest_.tiles[at * n + cell];
      rest_total += rest_.total[at];
    }
  }
  const float robot_all = whole / std::max(robot_.count, 1.0f), rest_all = whole / std::max(rest_.count, 1.0f);
  float robot =
      (robot_near + robot_all * robot_.all[cell] + (known > 0.0f ? known * looks.share[palette_[cell]] : 0.0f)) /
      (robot_total + whole + known);
  float rest = (rest_near + rest_all * rest_.all[cell]) / (rest_total + whole);
  if (colours != nullptr) {
    robot += kScene * (colours->robot.share[palette_[cell]] - robot);
    rest += kScene * (colours->rest.share[palette_[cell]] - rest);
  }
  return std::clamp(std::log((robot + kFloor) / (rest + kFloor)), -kMostEvidence, kMostEvidence);
}

/// Log likelihood ratio of pixels that are judged and of those around.
void ColourEvidence::weigh(const RobotLooks& looks, const SceneColours* colours) {
  const std::size_t n = palette_.size();
  evidence_.resize(distance_.size());
  known_evidence_.assign(static_cast<std::size_t>(columns_ * rows_) * n, std::numeric_limits<float>::quiet_NaN());
  const auto far = static_cast<float>(reach_px_) + kAside_px;
  for_each_in(weighed_, [&](int u, int v) {
    const std::size_t i = index(u, v);
    if (distance_[i] > far) {
      evidence_[i] = predicted_.at(u, v) ? kMostEvidence : -kMostEvidence;
      return;
    }
    const std::size_t tile = tile_of(u, v);
    float& known = known_evidence_[tile * n + cell_[i]];
    if (std::isnan(known)) known = evidence_of(looks, colours, tile, cell_[i]);
    evidence_[i] = known;
  });
}

/// Mean evidence of a small square, and the prediction's say, where nothing else decides.
void ColourEvidence::decide(BinaryMask& robot) {
  const int around = smoothing();
  const auto far = static_cast<float>(reach_px_);
  sums_.resize(distance_.size());
  smooth_.resize(distance_.size());
  clear(work_, judged_);  // rows around those that are judged or doubted
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int k = std::max(v - around, box_.v0); k <= std::min(v + around, box_.v1); ++k) {
      for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) work_.row(v)[w] |= judged_.row(k)[w] | doubted_.row(k)[w];
    }
  }
  for_each_in(work_, [&](int u, int v) {
    float sum = 0.0f;
    for (int k = -around; k <= around; ++k) sum += evidence_[index(std::clamp(u + k, box_.u0, box_.u1), v)];
    sums_[index(u, v)] = sum;
  });
  const float share = 1.0f / static_cast<float>((2 * around + 1) * (2 * around + 1));
  const auto mean = [&](int u, int v) {
    float sum = 0.0f;
    for (int k = -around; k <= around; ++k) sum += sums_[index(u, std::clamp(v + k, box_.v0, box_.v1))];
    return sum * share;
  };
  for_each_in(judged_, [&](int u, int v) {
    const std::size_t i = index(u, v);
    const float depth = predicted_.at(u, v) ? distance_[i] : -distance_[i];
    smooth_[i] = mean(u, v);
    robot.set(u, v, smooth_[i] + kPrediction * depth / far > 0.0f);
  });
  for_each_in(doubted_, [&](int u, int v) {
    const bool denied = mean(u, v) < -kDeny;
    denied_.set(u, v, denied);
    robot.set(u, v, !denied);
  });
}

void ColourEvidence::separate(const Image& image, const RobotLooks& looks, const SceneColours* colours,
                              const BinaryMask& known, const BinaryMask& differs, BinaryMask& robot) {
  robot.fill(false);
  clear(denied_, predicted_);
  clear(doubted_, predicted_);
  if (box_.empty()) return;
  within(static_cast<float>(reach_px_), near_);
  const bool anywhere = reach_px_ >= kEverywhere_px * unit_;
  bool asked = false;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) {
      const auto inside = predicted_.row(v)[w], near = near_.row(v)[w], box = in_box_.row(v)[w];
      const auto k = known.row(v)[w];
      const auto reached = anywhere ? ~std::uint64_t{0} : inside | near;
      robot.row(v)[w] = box & ((k & differs.row(v)[w] & reached) | (~k & inside & ~near));
      judged_.row(v)[w] = box & ~k & near;
      if (colours != nullptr) doubted_.row(v)[w] = robot.row(v)[w] & k & ~(inside & ~near);
      asked = asked || (judged_.row(v)[w] | doubted_.row(v)[w]) != 0;
    }
  }
  if (!asked) return;
  weighed_ = judged_;
  for (int v = box_.v0; v <= box_.v1; ++v) {
    for (int w = box_.u0 >> 6; w <= box_.u1 >> 6; ++w) weighed_.row(v)[w] |= doubted_.row(v)[w];
  }
  morphology_.dilate(weighed_, smoothing());
  find_cells(image);
  find_sides();
  for (int round = 0;; ++round) {
    collect(robot_pixels_, robot_);
    collect(rest_pixels_, rest_);
    weigh(looks, colours);
    decide(robot);
    if (round > 0) break;
    // Then, where it may be far off, from what that decides.
    find_sides_again(robot);
  }
}

void ColourEvidence::mark_weak(BinaryMask& weak) {
  weak.fill(false);
  for_each_in(judged_, [&](int u, int v) {
    if (std::abs(smooth_[index(u, v)]) < kWeak) weak.set(u, v);
  });
  // Between robot and background that differ it changes sign within a pixel or two: no weakness.
  morphology_.erode(weak);
  morphology_.dilate(weak, 2);
}

void ColourEvidence::learn(const Image& image, float share, RobotLooks& looks) {
  std::vector<float>& seen = robot_.all;
  seen.assign(RobotLooks::kCells, 0.0f);
  float count = 0.0f;
  const int every = sample_step();
  for (int v = box_.v0; v <= box_.v1; v += every) {
    for (int u = box_.u0; u <= box_.u1; u += every) {
      if (!predicted_.at(u, v) || distance_[index(u, v)] < kClear_px) continue;
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
