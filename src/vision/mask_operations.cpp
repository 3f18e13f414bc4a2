#include "bodyschema/vision/mask_operations.hpp"

#include <algorithm>
#include <bit>

namespace bodyschema {

PixelBox PixelBox::grown(int px, int picture_width, int picture_height) const {
  if (empty()) return *this;
  return {std::max(u0 - px, 0), std::max(v0 - px, 0), std::min(u1 + px, picture_width - 1),
          std::min(v1 + px, picture_height - 1)};
}

PixelBox bounding_box(const BinaryMask& mask) {
  PixelBox box{mask.width(), mask.height(), -1, -1};
  for (int v = 0; v < mask.height(); ++v) {
    const auto* row = mask.row(v);
    for (int w = 0; w < mask.words_per_row(); ++w) {
      if (row[w] == 0) continue;
      box.u0 = std::min(box.u0, 64 * w + std::countr_zero(row[w]));
      box.u1 = std::max(box.u1, 64 * w + 63 - std::countl_zero(row[w]));
      box.v0 = std::min(box.v0, v);
      box.v1 = v;
    }
  }
  return box.v1 < 0 ? PixelBox{} : box;
}

template <bool kErode>
void MaskMorphology::step(BinaryMask& mask) {
  const int words = mask.words_per_row();
  const int height = mask.height();
  if (words == 0 || height == 0) return;
  const int last_bit = (mask.width() - 1) & 63;
  const std::uint64_t padding = last_bit == 63 ? 0 : ~((std::uint64_t{1} << (last_bit + 1)) - 1);
  // Erosion is dilation of the complement; rows are widened one by one into a three-row window so
  // that the picture can be overwritten in place.
  const auto stride = static_cast<std::size_t>(words);
  rows_.resize(3 * stride);
  const auto widen = [&](int v) {
    const auto* in = mask.row(v);
    auto* out = rows_.data() + static_cast<std::size_t>(v % 3) * stride;
    const auto load = [&](int w) {
      std::uint64_t word = kErode ? ~in[w] : in[w];
      if (w == words - 1) word &= ~padding;
      return word;
    };
    for (int w = 0; w < words; ++w) {
      const std::uint64_t word = load(w);
      std::uint64_t wide = word | (word << 1) | (word >> 1);
      if (w > 0) wide |= load(w - 1) >> 63;
      if (w + 1 < words) wide |= load(w + 1) << 63;
      if (w == words - 1) wide &= ~padding;
      out[w] = wide;
    }
  };
  widen(0);
  for (int v = 0; v < height; ++v) {
    if (v + 1 < height) widen(v + 1);
    const auto* above = rows_.data() + static_cast<std::size_t>(std::max(v - 1, 0) % 3) * stride;
    const auto* here = rows_.data() + static_cast<std::size_t>(v % 3) * stride;
    const auto* below = rows_.data() + static_cast<std::size_t>(std::min(v + 1, height - 1) % 3) * stride;
    auto* out = mask.row(v);
    for (int w = 0; w < words; ++w) {
      const std::uint64_t wide = above[w] | here[w] | below[w];
      out[w] = kErode ? ~wide : wide;
    }
    if (kErode) out[words - 1] &= ~padding;
  }
}

namespace {

/// Sets, in a row of words, what lies up to `reach` pixels after a set one. Each pass doubles the reach: many steps
/// cost no more than a few.
void spread_up(std::uint64_t* row, int words, int reach) {
  for (int done = 0; done < reach;) {
    const int step = std::min(done + 1, reach - done);
    const int whole = step >> 6, part = step & 63;
    for (int w = words - 1; w >= whole; --w) {
      std::uint64_t moved = row[w - whole] << part;
      if (part != 0 && w > whole) moved |= row[w - whole - 1] >> (64 - part);
      row[w] |= moved;
    }
    done += step;
  }
}

/// The same before a set one.
void spread_down(std::uint64_t* row, int words, int reach) {
  for (int done = 0; done < reach;) {
    const int step = std::min(done + 1, reach - done);
    const int whole = step >> 6, part = step & 63;
    for (int w = 0; w + whole < words; ++w) {
      std::uint64_t moved = row[w + whole] >> part;
      if (part != 0 && w + whole + 1 < words) moved |= row[w + whole + 1] << (64 - part);
      row[w] |= moved;
    }
    done += step;
  }
}

}  // namespace

template <bool kErode>
void MaskMorphology::steps(BinaryMask& mask, int count) {
  constexpr int kFew = 2;
  if (count <= kFew) {
    for (int i = 0; i < count; ++i) step<kErode>(mask);
    return;
  }
  const int words = mask.words_per_row(), height = mask.height();
  if (words == 0 || height == 0) return;
  const int used = mask.width() & 63;
  const std::uint64_t in_picture = used == 0 ? ~std::uint64_t{0} : (std::uint64_t{1} << used) - 1;
  const auto stride = static_cast<std::size_t>(words);
  // Along rows, both ways; then whole rows, likewise.
  rows_.resize((static_cast<std::size_t>(height) + 1) * stride);
  std::uint64_t* other = rows_.data() + static_cast<std::size_t>(height) * stride;
  for (int v = 0; v < height; ++v) {
    auto* row = mask.row(v);
    auto* out = rows_.data() + static_cast<std::size_t>(v) * stride;
    for (int w = 0; w < words; ++w) other[w] = kErode ? ~row[w] : row[w];
    other[words - 1] &= in_picture;
    std::copy_n(other, words, out);
    spread_up(out, words, count);
    out[words - 1] &= in_picture;
    spread_down(other, words, count);
    for (int w = 0; w < words; ++w) row[w] = out[w] |= other[w];
  }
  const auto add = [&](std::uint64_t* to, const std::uint64_t* from) {
    for (int w = 0; w < words; ++w) to[w] |= from[w];
  };
  for (int done = 0; done < count;) {
    const int reach = std::min(done + 1, count - done);
    for (int v = height - 1; v >= reach; --v) add(mask.row(v), mask.row(v - reach));
    for (int v = 0; v + reach < height; ++v) {
      auto* row = rows_.data() + static_cast<std::size_t>(v) * stride;
      add(row, row + static_cast<std::size_t>(reach) * stride);
    }
    done += reach;
  }
  for (int v = 0; v < height; ++v) {
    auto* row = mask.row(v);
    add(row, rows_.data() + static_cast<std::size_t>(v) * stride);
    for (int w = 0; kErode && w < words; ++w) row[w] = ~row[w];
    row[words - 1] &= in_picture;
  }
}

void MaskMorphology::erode(BinaryMask& mask, int count) {
  steps<true>(mask, count);
}

void MaskMorphology::dilate(BinaryMask& mask, int count) {
  steps<false>(mask, count);
}

int ComponentFilter::root(int run) {
  while (runs_[static_cast<std::size_t>(run)].parent != run) {
    auto& parent = runs_[static_cast<std::size_t>(run)].parent;
    parent = runs_[static_cast<std::size_t>(parent)].parent;
    run = parent;
  }
  return run;
}

void ComponentFilter::label(const BinaryMask& mask, bool value, bool eight_connected) {
  runs_.clear();
  const int width = mask.width();
  const int reach = eight_connected ? 1 : 0;
  std::size_t above_begin = 0;
  std::size_t above_end = 0;
  for (int v = 0; v < mask.height(); ++v) {
    const std::size_t begin = runs_.size();
    const auto* row = mask.row(v);
    // First pixel at or after `u` whose bit equals `wanted`.
    const auto find = [&](int u, bool wanted) {
      while (u < width) {
        std::uint64_t word = wanted ? row[u >> 6] : ~row[u >> 6];
        word >>= (u & 63);
        if (word != 0) return std::min(u + std::countr_zero(word), width);
        u = (u | 63) + 1;
      }
      return width;
    };
    for (int u = find(0, value); u < width;) {
      const int end = find(u, !value);
      const bool on_border = v == 0 || v == mask.height() - 1 || u == 0 || end == width;
      runs_.push_back({v, u, end, static_cast<int>(runs_.size()), end - u, on_border});
      u = find(end, value);
    }
    std::size_t above = above_begin;
    for (std::size_t i = begin; i < runs_.size(); ++i) {
      while (above < above_end && runs_[above].end + reach <= runs_[i].begin) ++above;
      for (std::size_t j = above; j < above_end && runs_[j].begin < runs_[i].end + reach; ++j) {
        const int a = root(static_cast<int>(i));
        const int b = root(static_cast<int>(j));
        if (a == b) continue;
        auto& low = runs_[static_cast<std::size_t>(std::min(a, b))];
        auto& high = runs_[static_cast<std::size_t>(std::max(a, b))];
        high.parent = std::min(a, b);
        low.area += high.area;
        low.on_border = low.on_border || high.on_border;
      }
    }
    above_begin = begin;
    above_end = runs_.size();
  }
}

void set_run(BinaryMask& mask, int v, int begin, int end, bool value) {
  auto* row = mask.row(v);
  for (int u = begin; u < end;) {
    const int stop = std::min((u | 63) + 1, end);
    const int n = stop - u;
    const std::uint64_t bits = (n == 64 ? ~std::uint64_t{0} : ((std::uint64_t{1} << n) - 1)) << (u & 63);
    if (value) {
      row[u >> 6] |= bits;
    } else {
      row[u >> 6] &= ~bits;
    }
    u = stop;
  }
}

void ComponentFilter::remove_small(BinaryMask& mask, int min_px) {
  if (min_px <= 1) return;
  label(mask, true, true);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const auto& piece = runs_[static_cast<std::size_t>(root(static_cast<int>(i)))];
    if (piece.area < min_px) set_run(mask, runs_[i].v, runs_[i].begin, runs_[i].end, false);
  }
}

int ComponentFilter::largest_piece(const BinaryMask& mask) {
  label(mask, true, true);
  int largest = 0;
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    largest = std::max(largest, runs_[static_cast<std::size_t>(root(static_cast<int>(i)))].area);
  }
  return largest;
}

void ComponentFilter::fill_small_holes(BinaryMask& mask, int max_px) {
  if (max_px <= 0) return;
  label(mask, false, false);
  for (std::size_t i = 0; i < runs_.size(); ++i) {
    const auto& piece = runs_[static_cast<std::size_t>(root(static_cast<int>(i)))];
    if (!piece.on_border && piece.area <= max_px) {
      set_run(mask, runs_[i].v, runs_[i].begin, runs_[i].end, true);
    }
  }
}

}  // namespace bodyschema
