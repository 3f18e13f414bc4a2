#include "texture.hpp"

#include <algorithm>
#include <cmath>

namespace bodyschema::simulator {
namespace {

float lattice(std::int32_t x, std::int32_t y, std::uint32_t salt) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x85ebca6bu ^ static_cast<std::uint32_t>(y) * 0xc2b2ae35u ^ salt;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  h ^= h >> 15;
  return static_cast<float>(h) * 0x1.0p-32f;
}

}  // namespace

float value_noise(float x, float y, std::uint32_t salt) {
  const float fx = std::floor(x);
  const float fy = std::floor(y);
  const auto ix = static_cast<std::int32_t>(fx);
  const auto iy = static_cast<std::int32_t>(fy);
  const float ax = x - fx;
  const float ay = y - fy;
  const float top = lattice(ix, iy, salt) * (1 - ax) + lattice(ix + 1, iy, salt) * ax;
  const float bottom = lattice(ix, iy + 1, salt) * (1 - ax) + lattice(ix + 1, iy + 1, salt) * ax;
  return top * (1 - ay) + bottom * ay;
}

Texture::Texture(float width_m, float height_m, float texel_m, const Eigen::Vector3f& colour)
    : width_m_(width_m), height_m_(height_m), texel_m_(texel_m) {
  Level base;
  base.width = std::max(2, static_cast<int>(std::lround(width_m / texel_m)));
  base.height = std::max(2, static_cast<int>(std::lround(height_m / texel_m)));
  base.rgb.resize(static_cast<std::size_t>(base.width) * static_cast<std::size_t>(base.height) * 3);
  levels_.push_back(std::move(base));
  rectangle(0, 0, width_m, height_m, {colour, colour});
}

template <class Inside>
void Texture::paint(float x0, float y0, float x1, float y1, const Colours& c, const Inside& inside) {
  Level& base = levels_.front();
  const int column0 = std::max(0, static_cast<int>(std::floor(x0 / texel_m_)));
  const int column1 = std::min(base.width, static_cast<int>(std::ceil(x1 / texel_m_)));
  const int row0 = std::max(0, static_cast<int>(std::floor(y0 / texel_m_)));
  const int row1 = std::min(base.height, static_cast<int>(std::ceil(y1 / texel_m_)));
  for (int row = row0; row < row1; ++row) {
    const float y = (static_cast<float>(row) + 0.5f) * texel_m_;
    for (int column = column0; column < column1; ++column) {
      const float x = (static_cast<float>(column) + 0.5f) * texel_m_;
      if (!inside(x, y)) continue;
      float mix = 0.0f;
      switch (c.fill) {
        case Fill::kPlain: break;
        case Fill::kStripesUp: mix = std::sin((x - x0) / c.pitch_m * 6.2831853f) > 0.0f ? 1.0f : 0.0f; break;
        case Fill::kStripesAcross: mix = std::sin((y - y0) / c.pitch_m * 6.2831853f) > 0.0f ? 1.0f : 0.0f; break;
        case Fill::kChecks: {
          const auto i = static_cast<int>(std::floor((x - x0) / c.pitch_m));
          const auto j = static_cast<int>(std::floor((y - y0) / c.pitch_m));
          mix = ((i + j) & 1) == 0 ? 1.0f : 0.0f;
          break;
        }
        case Fill::kSpeckle: mix = value_noise(x / c.pitch_m * 3.0f, y / c.pitch_m * 3.0f, c.salt); break;
        case Fill::kGradient: mix = (y - y0) / std::max(1e-6f, y1 - y0); break;
        case Fill::kGrain: {
          // Long thin streaks along x that wind a little.
          const float wind = 0.6f * value_noise(x / (12.0f * c.pitch_m), y / (4.0f * c.pitch_m), c.salt + 7u);
          mix = 0.7f * value_noise(x / (25.0f * c.pitch_m), y / c.pitch_m + 3.0f * wind, c.salt) +
                0.3f * value_noise(x / (6.0f * c.pitch_m), 3.0f * y / c.pitch_m, c.salt + 1u);
          break;
        }
      }
      const Eigen::Vector3f colour = c.first + mix * (c.second - c.first);
      std::uint8_t* out = base.rgb.data() + 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(base.width) +
                                                 static_cast<std::size_t>(column));
      for (int k = 0; k < 3; ++k) out[k] = static_cast<std::uint8_t>(std::clamp(colour[k] + 0.5f, 0.0f, 255.0f));
    }
  }
}

void Texture::rectangle(float x0, float y0, float x1, float y1, const Colours& colours) {
  paint(x0, y0, x1, y1, colours, [&](float x, float y) { return x >= x0 && x < x1 && y >= y0 && y < y1; });
}

void Texture::ellipse(float x, float y, float rx, float ry, const Colours& colours) {
  paint(x - rx, y - ry, x + rx, y + ry, colours, [&](float px, float py) {
    const float ax = (px - x) / rx;
    const float ay = (py - y) / ry;
    return ax * ax + ay * ay <= 1.0f;
  });
}

void Texture::turned_rectangle(float x, float y, float width, float height, float angle, const Colours& colours) {
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  const float reach = 0.5f * std::hypot(width, height);
  paint(x - reach, y - reach, x + reach, y + reach, colours, [&](float px, float py) {
    const float along = c * (px - x) + s * (py - y);
    const float across = -s * (px - x) + c * (py - y);
    return std::abs(along) <= 0.5f * width && std::abs(across) <= 0.5f * height;
  });
}

void Texture::mottle(float share, float bump_m, std::uint32_t salt) {
  Level& base = levels_.front();
  for (int row = 0; row < base.height; ++row) {
    for (int column = 0; column < base.width; ++column) {
      const float x = static_cast<float>(column) * texel_m_ / bump_m;
      const float y = static_cast<float>(row) * texel_m_ / bump_m;
      const float factor =
          1.0f + share * (value_noise(x, y, salt) + 0.5f * value_noise(3.1f * x, 3.1f * y, salt + 1u) - 0.75f);
      std::uint8_t* p = base.rgb.data() + 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(base.width) +
                                               static_cast<std::size_t>(column));
      for (int k = 0; k < 3; ++k) {
        p[k] = static_cast<std::uint8_t>(std::clamp(factor * static_cast<float>(p[k]) + 0.5f, 0.0f, 255.0f));
      }
    }
  }
}

void Texture::shade_up(float low, float high) {
  Level& base = levels_.front();
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(base.width);
  for (int row = 0; row < base.height; ++row) {
    const float factor = low + (high - low) * static_cast<float>(row) / static_cast<float>(base.height - 1);
    std::uint8_t* p = base.rgb.data() + static_cast<std::size_t>(row) * row_bytes;
    for (std::size_t i = 0; i < row_bytes; ++i) {
      p[i] = static_cast<std::uint8_t>(std::clamp(factor * static_cast<float>(p[i]) + 0.5f, 0.0f, 255.0f));
    }
  }
}

void Texture::finish() {
  while (levels_.back().width > 8 && levels_.back().height > 8) {
    const Level& fine = levels_.back();
    Level coarse{fine.width / 2, fine.height / 2, {}};
    coarse.rgb.resize(static_cast<std::size_t>(coarse.width) * static_cast<std::size_t>(coarse.height) * 3);
    for (int row = 0; row < coarse.height; ++row) {
      for (int column = 0; column < coarse.width; ++column) {
        for (int k = 0; k < 3; ++k) {
          const auto level = [&](int dx, int dy) {
            return static_cast<int>(
                fine.rgb[static_cast<std::size_t>(((2 * row + dy) * fine.width + 2 * column + dx) * 3 + k)]);
          };
          coarse.rgb[static_cast<std::size_t>((row * coarse.width + column) * 3 + k)] =
              static_cast<std::uint8_t>((level(0, 0) + level(1, 0) + level(0, 1) + level(1, 1) + 2) / 4);
        }
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

Eigen::Vector3f Texture::at(float x, float y, float footprint_m) const {
  std::size_t level = 0;
  float texel = texel_m_;
  while (level + 1 < levels_.size() && footprint_m > 1.4f * texel) {
    texel *= 2.0f;
    ++level;
  }
  const Level& map = levels_[level];
  const float column_f = std::clamp(x / texel - 0.5f, 0.0f, static_cast<float>(map.width - 1) - 1e-3f);
  const float row_f = std::clamp(y / texel - 0.5f, 0.0f, static_cast<float>(map.height - 1) - 1e-3f);
  const auto column = static_cast<int>(column_f);
  const auto row = static_cast<int>(row_f);
  const float ax = column_f - static_cast<float>(column);
  const float ay = row_f - static_cast<float>(row);
  const std::uint8_t* p = map.rgb.data() + 3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(map.width) +
                                                static_cast<std::size_t>(column));
  const std::uint8_t* q = p + 3 * static_cast<std::size_t>(map.width);
  Eigen::Vector3f colour;
  for (int k = 0; k < 3; ++k) {
    colour[k] = (1 - ay) * ((1 - ax) * static_cast<float>(p[k]) + ax * static_cast<float>(p[3 + k])) +
                ay * ((1 - ax) * static_cast<float>(q[k]) + ax * static_cast<float>(q[3 + k]));
  }
  return colour;
}

}  // namespace bodyschema::simulator
