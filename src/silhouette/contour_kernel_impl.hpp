// Included by one translation unit per instruction set; everything here has internal linkage.
#include <cstddef>
#include <cstdint>
#if defined(__AVX2__)
#include <immintrin.h>
#elif defined(__SSE2__)
#include <emmintrin.h>
#endif

#include "contour_kernel.hpp"

namespace bodyschema::contour {
namespace {

// Eight floats. Every product-and-sum is spelt out as fma(), so that the same point or plane met in
// two edges gives the same bits: the outline must close.
#if defined(__AVX2__) && defined(__FMA__)
struct Floats {
  __m256 v;
};
inline Floats load(const float* p) {
  return {_mm256_load_ps(p)};
}
inline Floats splat(float x) {
  return {_mm256_set1_ps(x)};
}
inline Floats operator+(Floats a, Floats b) {
  return {_mm256_add_ps(a.v, b.v)};
}
inline Floats operator-(Floats a, Floats b) {
  return {_mm256_sub_ps(a.v, b.v)};
}
inline Floats operator*(Floats a, Floats b) {
  return {_mm256_mul_ps(a.v, b.v)};
}
inline Floats operator/(Floats a, Floats b) {
  return {_mm256_div_ps(a.v, b.v)};
}
inline Floats fma(Floats a, Floats b, Floats c) {
  return {_mm256_fmadd_ps(a.v, b.v, c.v)};
}
inline Floats min(Floats a, Floats b) {
  return {_mm256_min_ps(a.v, b.v)};
}
inline Floats max(Floats a, Floats b) {
  return {_mm256_max_ps(a.v, b.v)};
}
inline Floats abs(Floats a) {
  return {_mm256_andnot_ps(_mm256_set1_ps(-0.0f), a.v)};
}
inline Floats ceil(Floats a) {
  return {_mm256_ceil_ps(a.v)};
}
inline unsigned greater(Floats a, Floats b) {
  return static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(a.v, b.v, _CMP_GT_OQ)));
}
inline void order(Floats& u0, Floats& v0, Floats& u1, Floats& v1) {
  const __m256 swap = _mm256_cmp_ps(u0.v, u1.v, _CMP_GT_OQ);
  const __m256 u = u0.v;
  const __m256 v = v0.v;
  u0.v = _mm256_blendv_ps(u, u1.v, swap);
  u1.v = _mm256_blendv_ps(u1.v, u, swap);
  v0.v = _mm256_blendv_ps(v, v1.v, swap);
  v1.v = _mm256_blendv_ps(v1.v, v, swap);
}
inline void store(float* p, Floats a) {
  _mm256_store_ps(p, a.v);
}
// row * stride + column, for whole numbers.
inline void store_offsets(std::int32_t* p, Floats row, std::int32_t stride, Floats column) {
  const __m256i begin = _mm256_mullo_epi32(_mm256_cvttps_epi32(row.v), _mm256_set1_epi32(stride));
  _mm256_store_si256(reinterpret_cast<__m256i*>(p), _mm256_add_epi32(begin, _mm256_cvttps_epi32(column.v)));
}
// Lanes with the sign bit where the low bit of `found` differs from u0 > u1.
inline Floats directions(const std::uint32_t* found, Floats u0, Floats u1) {
  const __m256i v = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(found));
  return {_mm256_xor_ps(_mm256_castsi256_ps(_mm256_slli_epi32(v, 31)), _mm256_cmp_ps(u0.v, u1.v, _CMP_GT_OQ))};
}
inline unsigned signs(Floats a) {
  return static_cast<unsigned>(_mm256_movemask_ps(a.v));
}
// For every set of lanes, their numbers in a row, a byte each.
struct LaneTable {
  std::uint64_t lanes[256];
  constexpr LaneTable() : lanes() {
    for (unsigned set = 0; set < 256; ++set) {
      unsigned count = 0;
      for (unsigned lane = 0; lane < 8; ++lane) {
        if ((set >> lane) & 1u) lanes[set] |= static_cast<std::uint64_t>(lane) << (8 * count++);
      }
    }
  }
};
constexpr LaneTable kLaneTable;
// The lanes of a set, moved to the front. Stores write all eight: there is room.
struct Packing {
  __m256i order;
  explicit Packing(unsigned set)
      : order(_mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(kLaneTable.lanes[set])))) {}
  void store(float* p, Floats a) const { _mm256_storeu_ps(p, _mm256_permutevar8x32_ps(a.v, order)); }
  void store(std::uint32_t* p, __m256i a) const {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), _mm256_permutevar8x32_epi32(a, order));
  }
};
// Appends first + lane for the lanes set in `edges`, with the bit of `left_front` below.
inline void append(unsigned edges, unsigned left_front, std::uint32_t first, std::uint32_t*& out) {
  const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  const __m256i front =
      _mm256_and_si256(_mm256_srlv_epi32(_mm256_set1_epi32(static_cast<int>(left_front)), lane), _mm256_set1_epi32(1));
  const __m256i number = _mm256_add_epi32(lane, _mm256_set1_epi32(static_cast<int>(first)));
  const __m256i entry = _mm256_or_si256(_mm256_slli_epi32(number, 1), front);
  Packing(edges).store(out, entry);
  out += __builtin_popcount(edges);
}
// Rows of eight edges (from, to, unused) to columns.
inline void gather_ends(const EdgeEnds* ends, const std::uint32_t* found, Floats from[3], Floats to[3]) {
  __m256 r[8];
  for (int k = 0; k < 8; ++k) {
    r[k] = _mm256_load_ps(ends[found[k] >> 1].from);
  }
  const __m256 a0 = _mm256_unpacklo_ps(r[0], r[1]), a1 = _mm256_unpackhi_ps(r[0], r[1]);
  const __m256 a2 = _mm256_unpacklo_ps(r[2], r[3]), a3 = _mm256_unpackhi_ps(r[2], r[3]);
  const __m256 a4 = _mm256_unpacklo_ps(r[4], r[5]), a5 = _mm256_unpackhi_ps(r[4], r[5]);
  const __m256 a6 = _mm256_unpacklo_ps(r[6], r[7]), a7 = _mm256_unpackhi_ps(r[6], r[7]);
  const __m256 b0 = _mm256_shuffle_ps(a0, a2, 0x44), b1 = _mm256_shuffle_ps(a0, a2, 0xEE);
  const __m256 b2 = _mm256_shuffle_ps(a1, a3, 0x44), b3 = _mm256_shuffle_ps(a1, a3, 0xEE);
  const __m256 b4 = _mm256_shuffle_ps(a4, a6, 0x44), b5 = _mm256_shuffle_ps(a4, a6, 0xEE);
  const __m256 b6 = _mm256_shuffle_ps(a5, a7, 0x44), b7 = _mm256_shuffle_ps(a5, a7, 0xEE);
  from[0].v = _mm256_permute2f128_ps(b0, b4, 0x20);
  from[1].v = _mm256_permute2f128_ps(b1, b5, 0x20);
  from[2].v = _mm256_permute2f128_ps(b2, b6, 0x20);
  to[0].v = _mm256_permute2f128_ps(b3, b7, 0x20);
  to[1].v = _mm256_permute2f128_ps(b0, b4, 0x31);
  to[2].v = _mm256_permute2f128_ps(b1, b5, 0x31);
}
#else
struct Floats {
  float v[kLanes];
};
template <typename Operation>
inline Floats lanewise(Operation operation) {
  Floats r;
  for (int k = 0; k < kLanes; ++k) r.v[k] = operation(k);
  return r;
}
inline Floats load(const float* p) {
  return lanewise([&](int k) { return p[k]; });
}
inline Floats splat(float x) {
  return lanewise([&](int) { return x; });
}
inline Floats operator+(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] + b.v[k]; });
}
inline Floats operator-(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] - b.v[k]; });
}
inline Floats operator*(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] * b.v[k]; });
}
inline Floats operator/(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] / b.v[k]; });
}
inline Floats fma(Floats a, Floats b, Floats c) {
  return lanewise([&](int k) { return a.v[k] * b.v[k] + c.v[k]; });
}
inline Floats min(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] < b.v[k] ? a.v[k] : b.v[k]; });
}
inline Floats max(Floats a, Floats b) {
  return lanewise([&](int k) { return a.v[k] > b.v[k] ? a.v[k] : b.v[k]; });
}
inline Floats abs(Floats a) {
  return lanewise([&](int k) { return a.v[k] < 0.0f ? -a.v[k] : a.v[k]; });
}
// Only for values that fit an int.
inline Floats ceil(Floats a) {
  return lanewise([&](int k) {
    const float whole = static_cast<float>(static_cast<std::int32_t>(a.v[k]));
    return whole < a.v[k] ? whole + 1.0f : whole;
  });
}
inline unsigned greater(Floats a, Floats b) {
  unsigned bits = 0;
  for (int k = 0; k < kLanes; ++k) bits |= (a.v[k] > b.v[k] ? 1u : 0u) << k;
  return bits;
}
inline void order(Floats& u0, Floats& v0, Floats& u1, Floats& v1) {
  for (int k = 0; k < kLanes; ++k) {
    if (u0.v[k] > u1.v[k]) {
      const float u = u0.v[k];
      const float v = v0.v[k];
      u0.v[k] = u1.v[k];
      v0.v[k] = v1.v[k];
      u1.v[k] = u;
      v1.v[k] = v;
    }
  }
}
inline void store(float* p, Floats a) {
  for (int k = 0; k < kLanes; ++k) p[k] = a.v[k];
}
inline void store_offsets(std::int32_t* p, Floats row, std::int32_t stride, Floats column) {
  for (int k = 0; k < kLanes; ++k) {
    p[k] = static_cast<std::int32_t>(row.v[k]) * stride + static_cast<std::int32_t>(column.v[k]);
  }
}
inline Floats directions(const std::uint32_t* found, Floats u0, Floats u1) {
  return lanewise([&](int k) { return ((found[k] & 1u) != 0) != (u0.v[k] > u1.v[k]) ? -1.0f : 1.0f; });
}
inline unsigned signs(Floats a) {
  unsigned bits = 0;
  for (int k = 0; k < kLanes; ++k) bits |= (a.v[k] < 0.0f ? 1u : 0u) << k;
  return bits;
}
struct Packing {
  unsigned set;
  explicit Packing(unsigned lanes) : set(lanes) {}
  void store(float* p, Floats a) const {
    for (unsigned left = set; left != 0; left &= left - 1) *p++ = a.v[__builtin_ctz(left)];
  }
};
inline void append(unsigned edges, unsigned left_front, std::uint32_t first, std::uint32_t*& out) {
  while (edges != 0) {
    const auto lane = static_cast<unsigned>(__builtin_ctz(edges));
    *out++ = ((first + lane) << 1) | ((left_front >> lane) & 1u);
    edges &= edges - 1;
  }
}
inline void gather_ends(const EdgeEnds* ends, const std::uint32_t* found, Floats from[3], Floats to[3]) {
  for (int k = 0; k < kLanes; ++k) {
    const EdgeEnds& edge = ends[found[k] >> 1];
    for (int axis = 0; axis < 3; ++axis) {
      from[axis].v[k] = edge.from[axis];
      to[axis].v[k] = edge.to[axis];
    }
  }
}
#endif

// Sixty-four winding numbers.
#if defined(__AVX2__)
struct Windings {
  __m256i a, b;
};
inline Windings zero_windings() {
  return {_mm256_setzero_si256(), _mm256_setzero_si256()};
}
inline void add_and_clear(Windings& w, std::uint8_t* p) {
  auto* q = reinterpret_cast<__m256i*>(p);
  w.a = _mm256_add_epi8(w.a, _mm256_load_si256(q));
  w.b = _mm256_add_epi8(w.b, _mm256_load_si256(q + 1));
  _mm256_store_si256(q, _mm256_setzero_si256());
  _mm256_store_si256(q + 1, _mm256_setzero_si256());
}
inline std::uint64_t non_zero(const Windings& w) {
  const auto zero = _mm256_setzero_si256();
  const auto low = static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(w.a, zero)));
  const auto high = static_cast<std::uint32_t>(_mm256_movemask_epi8(_mm256_cmpeq_epi8(w.b, zero)));
  return ~(low | (static_cast<std::uint64_t>(high) << 32));
}
#elif defined(__SSE2__)
struct Windings {
  __m128i v[4];
};
inline Windings zero_windings() {
  const auto zero = _mm_setzero_si128();
  return {{zero, zero, zero, zero}};
}
inline void add_and_clear(Windings& w, std::uint8_t* p) {
  auto* q = reinterpret_cast<__m128i*>(p);
  for (int k = 0; k < 4; ++k) {
    w.v[k] = _mm_add_epi8(w.v[k], _mm_load_si128(q + k));
    _mm_store_si128(q + k, _mm_setzero_si128());
  }
}
inline std::uint64_t non_zero(const Windings& w) {
  std::uint64_t zeros = 0;
  for (int k = 0; k < 4; ++k) {
    const auto bits = static_cast<unsigned>(_mm_movemask_epi8(_mm_cmpeq_epi8(w.v[k], _mm_setzero_si128())));
    zeros |= static_cast<std::uint64_t>(bits) << (16 * k);
  }
  return ~zeros;
}
#else
struct Windings {
  std::uint8_t v[64];
};
inline Windings zero_windings() {
  return {};
}
inline void add_and_clear(Windings& w, std::uint8_t* p) {
  for (int k = 0; k < 64; ++k) {
    w.v[k] = static_cast<std::uint8_t>(w.v[k] + p[k]);
    p[k] = 0;
  }
}
inline std::uint64_t non_zero(const Windings& w) {
  std::uint64_t bits = 0;
  for (int k = 0; k < 64; ++k) bits |= static_cast<std::uint64_t>(w.v[k] != 0) << k;
  return bits;
}
#endif

inline Floats side(const float* nx, const float* ny, const float* nz, const float* d, Floats cx, Floats cy, Floats cz) {
  return fma(load(nz), cz, fma(load(ny), cy, fma(load(nx), cx, splat(0.0f) - load(d))));
}

std::int32_t find(const EdgeRun& run, const float c[3], std::uint32_t* out) {
  const Floats cx = splat(c[0]);
  const Floats cy = splat(c[1]);
  const Floats cz = splat(c[2]);
  std::uint32_t* const begin = out;
  if (run.always) {
    for (std::int32_t b = 0; b < run.block_count; ++b) {
      const EdgeBlock& block = run.blocks[b];
      const unsigned front =
          greater(side(block.left_nx, block.left_ny, block.left_nz, block.left_d, cx, cy, cz), splat(0.0f));
      const std::int32_t left = run.edge_count - b * kLanes;
      append(left >= kLanes ? 0xFFu : (1u << left) - 1u, front, static_cast<std::uint32_t>(b * kLanes), out);
    }
    return static_cast<std::int32_t>(out - begin);
  }
  const Floats distance = splat(__builtin_sqrtf(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]));
  // Blocks that may hold contour edges are listed first and looked into afterwards: two loops that
  // the processor predicts, instead of one that it does not.
  constexpr std::int32_t kGroups = 32;
  std::uint32_t open[kGroups * kLanes + kLanes];
  const std::int32_t groups = (run.block_count + kLanes - 1) / kLanes;
  for (std::int32_t first = 0; first < groups; first += kGroups) {
    std::uint32_t* open_end = open;
    const std::int32_t last = first + kGroups < groups ? first + kGroups : groups;
    for (std::int32_t g = first; g < last; ++g) {
      const BlockBounds& bounds = run.bounds[g];
      const Floats middle = abs(side(bounds.nx, bounds.ny, bounds.nz, bounds.d, cx, cy, cz));
      const Floats reach = fma(load(bounds.spread), distance, load(bounds.slack));
      append(~greater(middle, reach) & 0xFFu, 0, static_cast<std::uint32_t>(g * kLanes), open_end);
    }
    for (const std::uint32_t* entry = open; entry != open_end; ++entry) {
      const std::uint32_t b = *entry >> 1;
      const EdgeBlock& block = run.blocks[b];
      const unsigned left =
          greater(side(block.left_nx, block.left_ny, block.left_nz, block.left_d, cx, cy, cz), splat(0.0f));
      const unsigned right =
          greater(side(block.right_nx, block.right_ny, block.right_nz, block.right_d, cx, cy, cz), splat(0.0f));
      append(left ^ right, left, b * kLanes, out);
    }
  }
  return static_cast<std::int32_t>(out - begin);
}

inline Floats row_times(const float P[4], const Floats p[3]) {
  return fma(splat(P[2]), p[2], fma(splat(P[1]), p[1], fma(splat(P[0]), p[0], splat(P[3]))));
}

inline Floats clamp(Floats a, float high) {
  return min(max(a, splat(0.0f)), splat(high));
}

// Projected edges that cross the centre of a column, left end first.
constexpr std::int32_t kPacked = 256;
struct PackedEdges {
  alignas(32) float u0[kPacked + kLanes];
  alignas(32) float v0[kPacked + kLanes];
  alignas(32) float u1[kPacked + kLanes];
  alignas(32) float v1[kPacked + kLanes];
  alignas(32) float direction[kPacked + kLanes];
  std::int32_t count = 0;

  void put(Packing packing, Floats left_u, Floats left_v, Floats right_u, Floats right_v, Floats directed) {
    packing.store(u0 + count, left_u);
    packing.store(v0 + count, left_v);
    packing.store(u1 + count, right_u);
    packing.store(v1 + count, right_v);
    packing.store(direction + count, directed);
  }
};

// Adds the crossings of packed edges, a column of eight edges at a time.
inline void scatter(PackedEdges& edges, std::int32_t weight, const DeltaImage& image) {
  const auto width = static_cast<float>(image.width);
  const auto height = static_cast<float>(image.height);
  const std::uint8_t step[2] = {static_cast<std::uint8_t>(-weight), static_cast<std::uint8_t>(weight)};
  const std::int32_t count = edges.count;
  edges.put(Packing(0xFFu), splat(0.0f), splat(0.0f), splat(0.0f), splat(0.0f), splat(0.0f));
  for (std::int32_t first = 0; first < count; first += kLanes) {
    const Floats u0 = load(edges.u0 + first), v0 = load(edges.v0 + first);
    const Floats u1 = load(edges.u1 + first), v1 = load(edges.v1 + first);
    const unsigned positive = signs(load(edges.direction + first));
    Floats column = ceil(clamp(u0, width));
    const Floats end = ceil(clamp(u1, width));
    const Floats slope = (v1 - v0) / (u1 - u0);
    // Rounding must not carry a crossing beyond the bounds that resolve() clears; an overflow that
    // made a NaN ends at `low`.
    const Floats low = clamp(min(v0, v1), height);
    const Floats high = clamp(max(v0, v1), height);
    unsigned left = greater(end, column);
    while (left != 0) {
      const Floats v = min(max(fma(column - u0, slope, v0), low), high);
      alignas(32) std::int32_t offset[kLanes];
      store_offsets(offset, ceil(v), image.stride, column);
      for (unsigned todo = left; todo != 0; todo &= todo - 1) {
        const int k = __builtin_ctz(todo);
        std::uint8_t& delta = image.deltas[offset[k]];
        delta = static_cast<std::uint8_t>(delta + step[(positive >> k) & 1u]);
      }
      column = column + splat(1.0f);
      left &= greater(end, column);
    }
  }
  edges.count = 0;
}

void accumulate(const EdgeRun& run, std::uint32_t* found, std::int32_t count, const float P[12],
                const DeltaImage& image, PixelBounds& pixel_bounds) {
  if (count == 0) return;
  for (std::int32_t k = count; k % kLanes != 0; ++k) found[k] = found[count - 1];
  Floats u_min = splat(pixel_bounds.u_min), u_max = splat(pixel_bounds.u_max);
  Floats v_min = splat(pixel_bounds.v_min), v_max = splat(pixel_bounds.v_max);
  const auto width = static_cast<float>(image.width);
  PackedEdges packed;
  for (std::int32_t first = 0; first < count; first += kLanes) {
    const std::uint32_t* const edges = found + first;
    Floats from[3], to[3];
    gather_ends(run.ends, edges, from, to);
    const Floats z0 = splat(1.0f) / row_times(P + 8, from);
    const Floats z1 = splat(1.0f) / row_times(P + 8, to);
    Floats u0 = row_times(P, from) * z0;
    Floats u1 = row_times(P, to) * z1;
    Floats v0 = row_times(P + 4, from) * z0;
    Floats v1 = row_times(P + 4, to) * z1;
    const Floats directed = directions(edges, u0, u1);
    order(u0, v0, u1, v1);
    u_min = min(u_min, u0);
    u_max = max(u_max, u1);
    v_min = min(v_min, min(v0, v1));
    v_max = max(v_max, max(v0, v1));
    // Most edges of a fine mesh are shorter than a pixel and cross no centre: they end here.
    const std::int32_t lanes = count - first < kLanes ? count - first : kLanes;
    const unsigned crossing = greater(ceil(clamp(u1, width)), ceil(clamp(u0, width))) & (0xFFu >> (kLanes - lanes));
    packed.put(Packing(crossing), u0, v0, u1, v1, directed);
    packed.count += __builtin_popcount(crossing);
    if (packed.count > kPacked - kLanes) scatter(packed, run.weight, image);
  }
  scatter(packed, run.weight, image);
  alignas(32) float lane[4][kLanes];
  store(lane[0], u_min);
  store(lane[1], u_max);
  store(lane[2], v_min);
  store(lane[3], v_max);
  for (int k = 0; k < kLanes; ++k) {
    if (lane[0][k] < pixel_bounds.u_min) pixel_bounds.u_min = lane[0][k];
    if (lane[1][k] > pixel_bounds.u_max) pixel_bounds.u_max = lane[1][k];
    if (lane[2][k] < pixel_bounds.v_min) pixel_bounds.v_min = lane[2][k];
    if (lane[3][k] > pixel_bounds.v_max) pixel_bounds.v_max = lane[3][k];
  }
}

// The float clamped to [low, high], as an integer rounded down; NaN gives low.
inline std::int32_t clamped(float x, std::int32_t low, std::int32_t high) {
  if (!(x > static_cast<float>(low))) return low;
  if (x >= static_cast<float>(high)) return high;
  return static_cast<std::int32_t>(x);
}

Counts resolve(const DeltaImage& image, const PixelBounds& bounds, const MaskWords& masks) {
  Counts counts;
  if (!(bounds.u_min <= bounds.u_max)) return counts;
  const std::int32_t first_word = clamped(bounds.u_min, 0, image.width - 1) / 64;
  const std::int32_t last_word = clamped(bounds.u_max, 0, image.width - 1) / 64;
  const std::int32_t first_row = clamped(bounds.v_min, 0, image.height);
  // The row after the lowest point holds the last deltas.
  const std::int32_t last_row = clamped(bounds.v_max + 1.0f, 0, image.height);
  for (std::int32_t word = first_word; word <= last_word; ++word) {
    Windings windings = zero_windings();
    std::uint8_t* delta =
        image.deltas + static_cast<std::ptrdiff_t>(first_row) * image.stride + static_cast<std::ptrdiff_t>(word) * 64;
    std::ptrdiff_t at = static_cast<std::ptrdiff_t>(first_row) * masks.words_per_row + word;
    for (std::int32_t row = first_row; row <= last_row; ++row) {
      add_and_clear(windings, delta);
      delta += image.stride;
      if (row == image.height) break;  // crossings below the picture
      const std::uint64_t bits = non_zero(windings);
      counts.predicted += static_cast<std::uint32_t>(__builtin_popcountll(bits & masks.valid[at]));
      counts.intersection += static_cast<std::uint32_t>(__builtin_popcountll(bits & masks.observed[at]));
      if (masks.rendered != nullptr) masks.rendered[at] = bits;
      at += masks.words_per_row;
    }
  }
  return counts;
}

}  // namespace
}  // namespace bodyschema::contour
