#include "single_colour_background.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace bodyschema {
namespace {

// While the surface is found, block means within this many levels of it belong to it. Narrow, so
// that a robot of a similar colour stays out; uneven light is taken in as the surface bends to it.
constexpr double kWidestGate = 6.0;
// Share of what is known that survives each frame once the surface is found.
constexpr double kMemory = 0.9;
// Every frame counts at first, later one in a few: light changes slowly.
constexpr int kEagerFrames = 20;
constexpr int kUpkeepFrames = 5;

std::array<double, 6> terms_at(double x, double y) {
  return {1.0, x, y, x * x, x * y, y * y};
}

}  // namespace

SingleColourBackground::SingleColourBackground(const VisionSetup& setup, int width, int height)
    : setup_(setup), columns_(std::max(width / kBlock, 1)), rows_(std::max(height / kBlock, 1)) {
  model_.width = width;
  model_.height = height;
}

void SingleColourBackground::measure_blocks(const Image& frame) {
  const auto blocks = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const auto channels = static_cast<std::size_t>(frame.channels);
  for (std::size_t c = 0; c < channels; ++c) block_mean_[c].resize(blocks);
  block_variance_.resize(blocks);
  const int step_u = std::min(kBlock, frame.width);
  const int step_v = std::min(kBlock, frame.height);
  const int n = step_u * step_v;
  std::size_t block = 0;
  for (int bv = 0; bv < rows_; ++bv) {
    for (int bu = 0; bu < columns_; ++bu, ++block) {
      std::array<int, 3> sum{};
      std::array<int, 3> squares{};
      for (int v = bv * step_v; v < (bv + 1) * step_v; ++v) {
        const auto* pixel = frame.pixel(bu * step_u, v);
        for (int u = 0; u < step_u; ++u) {
          for (std::size_t c = 0; c < channels; ++c, ++pixel) {
            sum[c] += *pixel;
            squares[c] += *pixel * *pixel;
          }
        }
      }
      double variance = 0.0;
      for (std::size_t c = 0; c < channels; ++c) {
        block_mean_[c][block] = static_cast<float>(sum[c]) / static_cast<float>(n);
        variance += (squares[c] - static_cast<double>(sum[c]) * sum[c] / n) / std::max(n - 1, 1);
      }
      block_variance_[block] = static_cast<float>(variance / static_cast<double>(channels));
    }
  }
}

double SingleColourBackground::residual(std::size_t block) const {
  const auto u = static_cast<double>(block % static_cast<std::size_t>(columns_));
  const auto v = static_cast<double>(block / static_cast<std::size_t>(columns_));
  const auto terms = terms_at((2.0 * u + 1.0) / columns_ - 1.0, (2.0 * v + 1.0) / rows_ - 1.0);
  double worst = 0.0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(model_.channels); ++c) {
    double expected = 0.0;
    for (std::size_t t = 0; t < kTerms; ++t) expected += surface_[c][t] * terms[t];
    worst = std::max(worst, std::abs(static_cast<double>(block_mean_[c][block]) - expected));
  }
  return worst;
}

void SingleColourBackground::find_colour() {
  surface_ = {};
  const auto channels = static_cast<std::size_t>(model_.channels);
  if (setup_.background_rgb) {
    const auto& rgb = *setup_.background_rgb;
    for (std::size_t c = 0; c < channels; ++c) surface_[c][0] = rgb[c];
    if (channels == 1) surface_[0][0] = (rgb[0] + rgb[1] + rgb[2]) / 3.0;
    return;
  }
  // The fullest of coarse colour cells; two grids, half a cell apart, so that no colour is split.
  constexpr int kCells = 17;
  std::vector<int> counts(kCells * kCells * kCells);
  int most = 0;
  for (int offset = 0; offset <= 8; offset += 8) {
    std::fill(counts.begin(), counts.end(), 0);
    for (std::size_t b = 0; b < block_variance_.size(); ++b) {
      int cell = 0;
      for (std::size_t c = 0; c < channels; ++c) {
        cell = cell * kCells + (static_cast<int>(block_mean_[c][b]) + offset) / 16;
      }
      if (++counts[static_cast<std::size_t>(cell)] > most) {
        most = counts[static_cast<std::size_t>(cell)];
        for (std::size_t c = channels; c-- > 0; cell /= kCells) {
          surface_[c][0] = 16.0 * (cell % kCells) + 8.0 - offset;
        }
      }
    }
  }
}

void SingleColourBackground::accumulate(double gate, Moments& moments) const {
  for (std::size_t b = 0; b < block_variance_.size(); ++b) {
    if (residual(b) > gate) continue;
    const auto u = static_cast<double>(b % static_cast<std::size_t>(columns_));
    const auto v = static_cast<double>(b / static_cast<std::size_t>(columns_));
    const auto terms = terms_at((2.0 * u + 1.0) / columns_ - 1.0, (2.0 * v + 1.0) / rows_ - 1.0);
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j < kTerms; ++j) {
        moments.normal[i * kTerms + j] += terms[i] * terms[j];
      }
      for (std::size_t c = 0; c < static_cast<std::size_t>(model_.channels); ++c) {
        moments.right[c][i] += terms[i] * static_cast<double>(block_mean_[c][b]);
      }
    }
    moments.weight += 1.0;
  }
}

void SingleColourBackground::solve(const Moments& moments, std::size_t terms) {
  if (moments.weight < 1.0) return;
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;
  const auto n = static_cast<Eigen::Index>(terms);
  Matrix normal(n, n);
  for (std::size_t i = 0; i < terms; ++i) {
    for (std::size_t j = 0; j < terms; ++j) {
      normal(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = moments.normal[i * kTerms + j];
    }
  }
  // A trace of ridge on slope and curvature keeps corners that nothing supports from running off.
  for (Eigen::Index i = 1; i < n; ++i) normal(i, i) += 1e-4 * moments.weight;
  const Eigen::LDLT<Matrix> factored(normal);
  for (std::size_t c = 0; c < static_cast<std::size_t>(model_.channels); ++c) {
    Vector right(n);
    for (std::size_t i = 0; i < terms; ++i) right(static_cast<Eigen::Index>(i)) = moments.right[c][i];
    const Vector solution = factored.solve(right);
    surface_[c] = {};
    for (std::size_t i = 0; i < terms; ++i) surface_[c][i] = solution(static_cast<Eigen::Index>(i));
  }
}

void SingleColourBackground::update(const Image& frame) {
  if (ready_ && frames_++ >= kEagerFrames && frames_ % kUpkeepFrames != 0) return;
  if (!ready_) model_ = BackgroundModel(frame.width, frame.height, frame.channels);
  measure_blocks(frame);
  const auto inlier_quantile = [&](double gate, bool variance) {
    scratch_.clear();
    for (std::size_t b = 0; b < block_variance_.size(); ++b) {
      const double r = residual(b);
      if (r <= gate) scratch_.push_back(variance ? block_variance_[b] : static_cast<float>(r));
    }
    if (scratch_.empty()) return 0.0;
    const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 2);
    std::nth_element(scratch_.begin(), middle, scratch_.end());
    return static_cast<double>(*middle);
  };

  if (!ready_) {
    find_colour();
    // Constant, plane, quadratic, each growing into what it explains; then the gate closes.
    double gate = 8.0 + kWidestGate;  // the colour is known to half a cell
    for (int round = 0; round < 20; ++round) {
      const std::size_t terms = round < 3 ? 1 : (round < 10 ? 3 : kTerms);
      Moments moments;
      accumulate(gate, moments);
      solve(moments, terms);
      history_ = moments;
      gate = round < 16 ? kWidestGate : std::clamp(5.0 * inlier_quantile(kWidestGate, false), 1.5, kWidestGate);
    }
    ready_ = true;
  } else {
    const double gate = 4.0 * static_cast<double>(model_.noise_sd) / kBlock + 2.0;
    Moments moments;
    accumulate(gate, moments);
    for (auto& value : history_.normal) value *= kMemory;
    for (auto& channel : history_.right) {
      for (auto& value : channel) value *= kMemory;
    }
    history_.weight *= kMemory;
    for (std::size_t i = 0; i < moments.normal.size(); ++i) history_.normal[i] += moments.normal[i];
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kTerms; ++i) history_.right[c][i] += moments.right[c][i];
    }
    history_.weight += moments.weight;
    if (moments.weight > 0.0) solve(history_, kTerms);
  }

  double sd = setup_.noise_levels;
  if (sd <= 0.0) {
    const double gate = 4.0 * static_cast<double>(model_.noise_sd) / kBlock + 2.0;
    const double variance = inlier_quantile(gate, true);
    sd = variance > 0.0 ? std::sqrt(variance) : static_cast<double>(model_.noise_sd);
  }
  model_.noise_sd = std::max(static_cast<float>(sd), kLeastNoiseSd);
  render();
}

void SingleColourBackground::render() {
  std::fill(model_.precision.begin(), model_.precision.end(), 1.0f / (model_.noise_sd * model_.noise_sd));
  // Pixel u lies at (u + 1/2) / block in block units, whatever remains beyond the last block.
  const double scale_x = 2.0 / (static_cast<double>(columns_) * std::min(kBlock, model_.width));
  const double scale_y = 2.0 / (static_cast<double>(rows_) * std::min(kBlock, model_.height));
  const auto channels = static_cast<std::size_t>(model_.channels);
  for (std::size_t c = 0; c < channels; ++c) {
    const auto& s = surface_[c];
    for (int v = 0; v < model_.height; ++v) {
      const double y = (v + 0.5) * scale_y - 1.0;
      const auto a = static_cast<float>(s[0] + s[2] * y + s[5] * y * y);
      const auto b = static_cast<float>(s[1] + s[4] * y);
      const auto q = static_cast<float>(s[3]);
      float* out =
          model_.mean.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(model_.width) * channels + c;
      for (int u = 0; u < model_.width; ++u, out += channels) {
        const float x = (static_cast<float>(u) + 0.5f) * static_cast<float>(scale_x) - 1.0f;
        *out = a + x * (b + q * x);
      }
    }
  }
}

}  // namespace bodyschema
