#include "learned_background.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "bodyschema/vision/mask_operations.hpp"
#include "region_statistics.hpp"

namespace bodyschema {
namespace {

// Colours belong together within this many standard deviations of the noise, all channels.
constexpr float kGateSigma = 4.5f;
// Sightings are counted up to here: about two seconds at 30 Hz, then old and new weigh the same.
constexpr std::uint16_t kMostSupport = 60;
// While the robot is in view, this many rows are kept up to date in each frame; of small pictures an eighth.
constexpr int kUpkeepRows = 60;
constexpr int kLeastUpkeepStep = 8;
// The noise of one pixel is believed as if it had been seen this often before.
constexpr float kPriorSightings = 20.0f;
constexpr std::size_t kStillFrames = 12;
constexpr int kChangeGrid = 4;
constexpr std::uint8_t kUndecided = 255;
// Pixels with a clear majority are believed in patches of at least this share of the picture.
constexpr double kLeastPatch = 0.02;

/// The gate for squared distances over all channels, in variances of one channel.
constexpr float gate_squared(int channels) {
  return kGateSigma * kGateSigma * (channels == 1 ? 1.0f : 1.6f);
}

}  // namespace

float noise_from_differences(const std::array<std::size_t, 256>& histogram) {
  std::size_t end = histogram.size();
  double sd = 0.0;
  for (int round = 0; round < 20; ++round) {
    double all = 0.0;
    for (std::size_t d = 0; d < end; ++d) all += static_cast<double>(histogram[d]);
    double below = 0.0;
    double median = 0.0;
    for (std::size_t d = 0; d < end; ++d) {
      const auto here = static_cast<double>(histogram[d]);
      if (here > 0.0 && below + here >= 0.5 * all) {
        // Rounded differences of d stand for [d - 1/2, d + 1/2), zero for [0, 1/2).
        const double begin = d == 0 ? 0.0 : static_cast<double>(d) - 0.5;
        median = begin + (d == 0 ? 0.5 : 1.0) * (0.5 * all - below) / here;
        break;
      }
      below += here;
    }
    sd = median / 0.6745;
    const auto next = static_cast<std::size_t>(std::min(std::ceil(4.0 * sd) + 1.0, 256.0));
    if (next >= end) break;
    end = next;
  }
  return std::max(static_cast<float>(sd), kLeastNoiseSd);
}

float noise_between(const Image& a, const Image& b) {
  std::array<std::size_t, 256> histogram{};
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    ++histogram[static_cast<std::size_t>(std::abs(int{a.data[i]} - int{b.data[i]}))];
  }
  return std::max(noise_from_differences(histogram) / std::sqrt(2.0f), kLeastNoiseSd);
}

double FrameSelection::change(const Image& a, const Image& b) const {
  const float limit = 6.0f * std::max(noise_sd_, kLeastNoiseSd) + 1.0f;
  std::size_t changed = 0;
  std::size_t all = 0;
  for (int v = kChangeGrid / 2; v < a.height; v += kChangeGrid) {
    for (int u = kChangeGrid / 2; u < a.width; u += kChangeGrid, ++all) {
      const auto* p = a.pixel(u, v);
      const auto* q = b.pixel(u, v);
      int worst = 0;
      for (int c = 0; c < a.channels; ++c) worst = std::max(worst, std::abs(int{p[c]} - int{q[c]}));
      if (static_cast<float>(worst) > limit) ++changed;
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(changed) / static_cast<double>(all);
}

void FrameSelection::clear() {
  *this = FrameSelection();
}

void FrameSelection::add(const Image& frame) {
  if (!previous_.empty() && early_noise_.size() < 9) {
    early_noise_.push_back(noise_between(previous_, frame));
    auto sorted = early_noise_;
    std::sort(sorted.begin(), sorted.end());
    noise_sd_ = sorted[sorted.size() / 2];
  }
  previous_ = frame;
  if (!frames_.empty()) {
    const double changed = change(frames_.back(), frame);
    // A few frames of stillness are welcome, to average the noise.
    const bool still = changed < 0.002;
    if (still && ++still_frames_ > kStillFrames) return;
    if (!still && changed < step_) return;
  }
  frames_.push_back(frame);
  if (frames_.size() < kCapacity) return;
  for (std::size_t i = 1; 2 * i < frames_.size(); ++i) frames_[i] = std::move(frames_[2 * i]);
  frames_.resize((frames_.size() + 1) / 2);
  still_frames_ /= 2;
  step_ = step_ == 0.0 ? 0.01 : 1.5 * step_;
}

LearnedBackground::LearnedBackground(const VisionSetup& setup, int width, int height) : setup_(setup) {
  model_.width = width;
  model_.height = height;
}

void LearnedBackground::start(const Image& frame) {
  model_ = BackgroundModel(frame.width, frame.height, frame.channels);
  model_.noise_sd = static_cast<float>(setup_.noise_levels);
  const auto n = model_.pixels();
  support_.assign(n, 0);
  variance_.assign(n, 0.0f);
  rival_support_.assign(n, 0);
  rival_.assign(n * static_cast<std::size_t>(frame.channels), 0.0f);
}

void LearnedBackground::set_precision(std::size_t i) {
  const float typical = model_.noise_sd * model_.noise_sd;
  const float n = support_[i];
  if (n < static_cast<float>(setup_.min_sightings)) {
    model_.precision[i] = 0.0f;
    return;
  }
  const float own = (kPriorSightings * typical + n * variance_[i]) / (kPriorSightings + n);
  model_.precision[i] = 1.0f / (std::max(own, typical) + typical / n);
}

template <int kChannels>
void LearnedBackground::cluster_row(std::span<const Image> frames, int v, std::vector<Candidates>& candidates) const {
  struct Cluster {
    std::array<float, kChannels> mean{};
    std::uint64_t seen = 0;
    float count = 0.0f;
  };
  constexpr std::size_t kMostClusters = 12;
  std::array<Cluster, kMostClusters> clusters;
  const float gate = gate_squared(kChannels) * model_.noise_sd * model_.noise_sd;
  for (int u = 0; u < model_.width; ++u) {
    // Leader clustering: each frame joins the first cluster near it or founds one.
    std::size_t used = 0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      const auto* pixel = frames[k].pixel(u, v);
      std::size_t join = 0;
      for (; join < used; ++join) {
        float distance = 0.0f;
        for (std::size_t c = 0; c < kChannels; ++c) {
          const float d = static_cast<float>(pixel[c]) - clusters[join].mean[c];
          distance += d * d;
        }
        // A young cluster's mean is uncertain itself.
        if (distance <= gate * (1.0f + 1.0f / clusters[join].count)) break;
      }
      if (join == used) {
        if (used == kMostClusters) continue;
        clusters[used++] = Cluster{};
      }
      auto& cluster = clusters[join];
      cluster.count += 1.0f;
      cluster.seen |= std::uint64_t{1} << k;
      for (std::size_t c = 0; c < kChannels; ++c) {
        cluster.mean[c] += (static_cast<float>(pixel[c]) - cluster.mean[c]) / cluster.count;
      }
    }
    const auto kept = std::min(used, kCandidates);
    std::partial_sort(clusters.begin(), clusters.begin() + static_cast<std::ptrdiff_t>(kept),
                      clusters.begin() + static_cast<std::ptrdiff_t>(used),
                      [](const Cluster& a, const Cluster& b) { return a.count > b.count; });
    auto& out =
        candidates[static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width) + static_cast<std::size_t>(u)];
    for (std::size_t k = 0; k < kept; ++k) {
      out[k].seen = clusters[k].seen;
      for (std::size_t c = 0; c < kChannels; ++c) out[k].mean[c] = clusters[k].mean[c];
    }
  }
}

void LearnedBackground::choose(std::size_t frame_count, const std::vector<Candidates>& candidates,
                               std::vector<std::uint8_t>& choice) const {
  const int width = model_.width;
  const int height = model_.height;
  const auto at = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  // Plain majorities first, where many pixels agree: a small patch of them is more likely a part of
  // the robot that never moved out of the way, such as a forearm at the border of the picture.
  BinaryMask clear(width, height);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const auto& best = candidates[at(u, v)];
      const int first = std::popcount(best[0].seen);
      const int second = std::popcount(best[1].seen);
      clear.set(u, v, 5 * first >= 3 * static_cast<int>(frame_count) && 2 * first >= 5 * second);
    }
  }
  const double least_patch = kLeastPatch * static_cast<double>(candidates.size());
  ComponentFilter().remove_small(clear, static_cast<int>(least_patch));
  choice.assign(candidates.size(), kUndecided);
  std::vector<std::size_t> undecided;
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (clear.at(u, v)) {
        choice[at(u, v)] = 0;
      } else {
        undecided.push_back(at(u, v));
      }
    }
  }
  // From their borders inwards: a neighbour uncovers and is covered at almost the same frames.
  // Nothing seen at all is a candidate too: a pixel that the robot never left.
  std::vector<std::pair<std::size_t, std::uint8_t>> decided;
  while (!undecided.empty()) {
    decided.clear();
    for (const auto i : undecided) {
      const int u = static_cast<int>(i % static_cast<std::size_t>(width));
      const int v = static_cast<int>(i / static_cast<std::size_t>(width));
      std::array<int, kCandidates + 1> disagreement{};
      int neighbours = 0;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          const int a = u + du, b = v + dv;
          if (a < 0 || b < 0 || a >= width || b >= height) continue;
          const auto j = at(a, b);
          if (choice[j] == kUndecided) continue;
          ++neighbours;
          const auto seen = choice[j] < kCandidates ? candidates[j][choice[j]].seen : 0;
          for (std::size_t k = 0; k < kCandidates; ++k) {
            disagreement[k] += std::popcount(candidates[i][k].seen ^ seen);
          }
          disagreement[kCandidates] += std::popcount(seen);
        }
      }
      if (neighbours < 2) continue;
      const auto best = std::min_element(disagreement.begin(), disagreement.end());
      decided.emplace_back(i, static_cast<std::uint8_t>(best - disagreement.begin()));
    }
    if (decided.empty()) break;
    for (const auto& [i, k] : decided) choice[i] = k;
    std::erase_if(undecided, [&](std::size_t i) { return choice[i] != kUndecided; });
  }
  // No majority anywhere to start from: the most frequent colour is the best guess.
  for (const auto i : undecided) choice[i] = 0;
}

template <int kChannels>
void LearnedBackground::average_row(std::span<const Image> frames, int v, const std::vector<Candidates>& candidates,
                                    const std::vector<std::uint8_t>& choice) {
  const float gate = gate_squared(kChannels) * model_.noise_sd * model_.noise_sd;
  for (int u = 0; u < model_.width; ++u) {
    const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width) + static_cast<std::size_t>(u);
    support_[i] = 0;
    if (choice[i] >= kCandidates) continue;
    const auto& middle = candidates[i][choice[i]].mean;
    std::array<float, kChannels> sum{};
    float squares = 0.0f;
    float count = 0.0f;
    for (const auto& frame : frames) {
      const auto* pixel = frame.pixel(u, v);
      float distance = 0.0f;
      std::array<float, kChannels> d{};
      for (std::size_t c = 0; c < kChannels; ++c) {
        d[c] = static_cast<float>(pixel[c]) - middle[c];
        distance += d[c] * d[c];
      }
      if (distance > gate) continue;
      for (std::size_t c = 0; c < kChannels; ++c) sum[c] += d[c];
      squares += distance;
      count += 1.0f;
    }
    float shift = 0.0f;
    for (std::size_t c = 0; c < kChannels; ++c) {
      const float mean_shift = count > 0.0f ? sum[c] / count : 0.0f;
      model_.mean[i * kChannels + c] = middle[c] + mean_shift;
      shift += mean_shift * mean_shift;
    }
    variance_[i] = count > 1.0f ? std::max(squares - count * shift, 0.0f) / (kChannels * (count - 1.0f)) : 0.0f;
    // Fewer than one frame in twenty is a passing robot rather than the background.
    const bool enough = count >= 0.05f * static_cast<float>(frames.size());
    support_[i] = enough ? static_cast<std::uint16_t>(count) : 0;
  }
}

void LearnedBackground::learn(std::span<const Image> frames, float noise_sd) {
  if (frames.empty()) return;
  frames = frames.first(std::min(frames.size(), FrameSelection::kCapacity));
  start(frames.front());
  if (setup_.noise_levels <= 0.0) model_.noise_sd = std::max(noise_sd, kLeastNoiseSd);
  std::vector<Candidates> candidates(model_.pixels());
  std::vector<std::uint8_t> choice;
  const bool gray = model_.channels == 1;
  for (int v = 0; v < model_.height; ++v) {
    gray ? cluster_row<1>(frames, v, candidates) : cluster_row<3>(frames, v, candidates);
  }
  choose(frames.size(), candidates, choice);
  for (int v = 0; v < model_.height; ++v) {
    gray ? average_row<1>(frames, v, candidates, choice) : average_row<3>(frames, v, candidates, choice);
  }
  if (setup_.noise_levels <= 0.0 && frames.size() > 4) {
    // The spread around the learned colours is a better witness than two frames were.
    std::vector<float> spread;
    for (std::size_t i = 0; i < variance_.size(); ++i) {
      if (support_[i] > 4) spread.push_back(variance_[i]);
    }
    if (!spread.empty()) {
      const auto middle = spread.begin() + static_cast<std::ptrdiff_t>(spread.size() / 2);
      std::nth_element(spread.begin(), middle, spread.end());
      model_.noise_sd = std::max(std::sqrt(*middle), kLeastNoiseSd);
    }
  }
  for (std::size_t i = 0; i < support_.size(); ++i) {
    set_precision(i);
    support_[i] = std::min(support_[i], kMostSupport);
  }
  frames_seen_ = static_cast<int>(frames.size());
}

/// The colour that most of the frames without the robot have at each pixel: the mean about the one with most others
/// within the noise.
template <int kChannels>
void LearnedBackground::agree_row(std::span<const Image> frames, std::span<const BinaryMask> robots, int v) {
  constexpr std::size_t kFewestSightings = 2;
  const float gate = 2.0f * gate_squared(kChannels) * model_.noise_sd * model_.noise_sd;  // of a difference of two
  std::vector<const std::uint8_t*> seen;
  const auto near = [gate](const std::uint8_t* a, const std::uint8_t* b) {
    float distance = 0.0f;
    for (std::size_t c = 0; c < kChannels; ++c) {
      const float d = static_cast<float>(a[c]) - static_cast<float>(b[c]);
      distance += d * d;
    }
    return distance <= gate;
  };
  for (int u = 0; u < model_.width; ++u) {
    const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width) + static_cast<std::size_t>(u);
    seen.clear();
    for (std::size_t k = 0; k < frames.size(); ++k) {
      if (!robots[k].at(u, v)) seen.push_back(frames[k].pixel(u, v));
    }
    support_[i] = 0;
    std::size_t most = 0;
    const std::uint8_t* middle = nullptr;
    for (const auto* a : seen) {
      const auto count = static_cast<std::size_t>(
          std::count_if(seen.begin(), seen.end(), [&](const std::uint8_t* b) { return near(a, b); }));
      if (count <= most) continue;
      most = count;
      middle = a;
    }
    if (most < kFewestSightings || 2 * most <= seen.size()) continue;
    std::array<float, kChannels> sum{};
    float squares = 0.0f;
    for (const auto* b : seen) {
      if (!near(middle, b)) continue;
      for (std::size_t c = 0; c < kChannels; ++c) {
        sum[c] += static_cast<float>(b[c]);
        squares += static_cast<float>(b[c]) * static_cast<float>(b[c]);
      }
    }
    const auto n = static_cast<float>(most);
    for (std::size_t c = 0; c < kChannels; ++c) {
      model_.mean[i * kChannels + c] = sum[c] / n;
      squares -= sum[c] * sum[c] / n;
    }
    support_[i] = static_cast<std::uint16_t>(most);
    variance_[i] = std::max(squares, 0.0f) / (kChannels * (n - 1.0f));
  }
}

void LearnedBackground::learn_beside(std::span<const Image> frames, std::span<const BinaryMask> robots) {
  start(frames.front());
  if (setup_.noise_levels <= 0.0) {
    std::vector<float> noise = {kLeastNoiseSd};
    for (std::size_t k = 1; k < frames.size(); ++k) noise.push_back(noise_between(frames[k - 1], frames[k]));
    std::sort(noise.begin(), noise.end());
    model_.noise_sd = noise[noise.size() / 2];
  }
  for (int v = 0; v < model_.height; ++v) {
    model_.channels == 1 ? agree_row<1>(frames, robots, v) : agree_row<3>(frames, robots, v);
  }
  const int configured = std::exchange(setup_.min_sightings, 2);  // as many as agree at least
  for (std::size_t i = 0; i < support_.size(); ++i) set_precision(i);
  setup_.min_sightings = configured;
  frames_seen_ = static_cast<int>(frames.size());
}

template <int kChannels>
void LearnedBackground::update_row(const Image& frame, int v, const BinaryMask* robot) {
  const auto begin = static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width);
  const auto* pixel = frame.pixel(0, v);
  const float noise = model_.noise_sd * model_.noise_sd;
  const float gate = gate_squared(kChannels);
  float sum = 0.0f;
  float count = 0.0f;
  for (int u = 0; u < model_.width; ++u, pixel += kChannels) {
    if (robot != nullptr && robot->at(u, v)) continue;
    const auto i = begin + static_cast<std::size_t>(u);
    const auto n = static_cast<float>(support_[i]);
    std::array<float, kChannels> d;
    float distance = 0.0f;
    for (std::size_t c = 0; c < kChannels; ++c) {
      d[c] = static_cast<float>(pixel[c]) - model_.mean[i * kChannels + c];
      distance += d[c] * d[c];
    }
    const float variance = model_.precision[i] > 0.0f ? 1.0f / model_.precision[i] : noise;
    if (n > 0.0f && distance <= gate * (variance + noise / n)) {
      const float rate = 1.0f / (n + 1.0f);
      for (std::size_t c = 0; c < kChannels; ++c) model_.mean[i * kChannels + c] += rate * d[c];
      const float innovation = distance / (kChannels * (1.0f + 1.0f / n));
      variance_[i] += (innovation - variance_[i]) * std::max(1.0f / n, 0.02f);
      sum += innovation;
      count += 1.0f;
      if (support_[i] < kMostSupport) ++support_[i];
      if (rival_support_[i] > 0) --rival_support_[i];
    } else {
      float rival_distance = 0.0f;
      for (std::size_t c = 0; c < kChannels; ++c) {
        const float r = static_cast<float>(pixel[c]) - rival_[i * kChannels + c];
        rival_distance += r * r;
      }
      if (rival_support_[i] == 0) {
        for (std::size_t c = 0; c < kChannels; ++c) rival_[i * kChannels + c] = pixel[c];
        rival_support_[i] = 1;
      } else if (rival_distance <= gate * 2.0f * noise) {
        ++rival_support_[i];
        const float rate = 1.0f / static_cast<float>(rival_support_[i]);
        for (std::size_t c = 0; c < kChannels; ++c) {
          rival_[i * kChannels + c] += rate * (static_cast<float>(pixel[c]) - rival_[i * kChannels + c]);
        }
      } else {
        --rival_support_[i];
      }
      if (rival_support_[i] > support_[i]) {
        for (std::size_t c = 0; c < kChannels; ++c)
          std::swap(rival_[i * kChannels + c], model_.mean[i * kChannels + c]);
        std::swap(rival_support_[i], support_[i]);
        variance_[i] = noise;
      }
    }
    set_precision(i);
  }
  innovation_sum_ += static_cast<double>(sum);
  innovation_count_ += static_cast<double>(count);
}

void LearnedBackground::update(const Image& frame, const BinaryMask* robot, bool full) {
  if (frames_seen_ == 0) start(frame);
  ++frames_seen_;
  if (model_.noise_sd <= 0.0f) {
    // The first two frames give the noise, without which nothing can be compared.
    if (first_.empty()) {
      first_ = frame;
      first_robot_ = robot != nullptr ? *robot : BinaryMask();
      return;
    }
    model_.noise_sd = noise_between(first_, frame);
    // A camera that turned between the two finds a room's texture in their difference; a single picture's is less.
    if (setup_.method == SegmentationMethod::kAuto) model_.noise_sd = std::min(model_.noise_sd, noise_of(frame));
    const Image first = std::move(first_);
    first_ = Image{};
    const BinaryMask* covered = first_robot_.empty() ? nullptr : &first_robot_;
    for (int v = 0; v < model_.height; ++v) {
      model_.channels == 1 ? update_row<1>(first, v, covered) : update_row<3>(first, v, covered);
    }
    innovation_sum_ = innovation_count_ = 0.0;
  }
  const int first_row = full ? 0 : upkeep_row_;
  const int upkeep = std::max(kLeastUpkeepStep, model_.height / kUpkeepRows);
  const int step = full ? 1 : upkeep;
  if (!full) upkeep_row_ = (upkeep_row_ + 1) % upkeep;
  for (int v = first_row; v < model_.height; v += step) {
    model_.channels == 1 ? update_row<1>(frame, v, robot) : update_row<3>(frame, v, robot);
  }
  // Follow the noise once a good part of a picture has been compared.
  if (setup_.noise_levels <= 0.0 && innovation_count_ > 0.25 * static_cast<double>(model_.pixels())) {
    const double variance = innovation_sum_ / innovation_count_;
    const double old = static_cast<double>(model_.noise_sd) * static_cast<double>(model_.noise_sd);
    model_.noise_sd = std::max(static_cast<float>(std::sqrt(0.8 * old + 0.2 * variance)), kLeastNoiseSd);
    innovation_sum_ = innovation_count_ = 0.0;
  }
}

}  // namespace bodyschema
