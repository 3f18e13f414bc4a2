#pragma once

#include <cstddef>
#include <cstdint>

/// The inner loops of the contour engine, compiled once per instruction set and chosen at run time.
///
/// This header and the kernels see plain data only: a translation unit built with wider
/// instructions must not emit inline functions of the standard library or Eigen that the linker
/// could then hand to the rest of the program.
namespace bodyschema::contour {

constexpr int kLanes = 8;  ///< edges per block and clusters tested at once

/// Planes of the two triangles on each of eight edges, in the centred part frame: a camera centre c
/// sees the front of a triangle when n.c > d.
struct alignas(32) EdgeBlock {
  float left_nx[kLanes], left_ny[kLanes], left_nz[kLanes], left_d[kLanes];
  float right_nx[kLanes], right_ny[kLanes], right_nz[kLanes], right_d[kLanes];
};

/// Bounds of eight edge blocks: no edge of block k is on the contour where
/// |n.c - d| > spread |c| + slack, because then all its triangles face the same way.
struct alignas(32) BlockBounds {
  float nx[kLanes], ny[kLanes], nz[kLanes], d[kLanes], spread[kLanes], slack[kLanes];
};

/// End points of an edge in the centred part frame, as the left triangle runs.
struct alignas(32) EdgeEnds {
  float from[3];
  float to[3];
  float unused[2];
};

/// A run of edges of one part that are treated alike.
struct EdgeRun {
  const BlockBounds* bounds = nullptr;  ///< ceil(block_count / 8) entries
  const EdgeBlock* blocks = nullptr;
  const EdgeEnds* ends = nullptr;  ///< 8 per block
  std::int32_t block_count = 0;
  std::int32_t edge_count = 0;
  std::int32_t weight = 1;  ///< what a crossing of such an edge counts
  bool always = false;      ///< on the contour wherever the camera is (open edges)
};

/// Winding numbers in the making: deltas[row * stride + column] is the change of the winding number
/// between pixel (column, row - 1) and pixel (column, row). There are height + 1 rows; winding
/// numbers are taken modulo 256, so a silhouette 256 layers deep would be missed.
struct DeltaImage {
  std::uint8_t* deltas = nullptr;
  std::int32_t stride = 0;  ///< bytes, a multiple of 64
  std::int32_t width = 0;
  std::int32_t height = 0;
};

/// The pixels touched so far: columns and rows with a non-zero delta lie within.
struct PixelBounds {
  float u_min, u_max, v_min, v_max;
};

/// Masks of one camera, 64 pixels a word as in BinaryMask.
struct MaskWords {
  const std::uint64_t* observed = nullptr;  ///< already restricted to valid pixels
  const std::uint64_t* valid = nullptr;
  std::uint64_t* rendered = nullptr;  ///< out, may be null
  std::int32_t words_per_row = 0;
};

struct Counts {
  std::uint32_t intersection = 0;
  std::uint32_t predicted = 0;
};

struct Kernel {
  /// Edges of a run on the contour seen from camera centre c (centred part frame, metres), as
  /// edge * 2 + (left triangle faces the camera). `out` has room for 8 * block_count + 8 entries.
  std::int32_t (*find)(const EdgeRun& run, const float c[3], std::uint32_t* out);

  /// Projects contour edges with the 3x4 matrix P (row-major, centred part frame to homogeneous
  /// pixels) and adds their column crossings. `found` may be read and written up to the next
  /// multiple of eight. All points must lie in front of the camera.
  void (*accumulate)(const EdgeRun& run, std::uint32_t* found, std::int32_t count, const float P[12],
                     const DeltaImage& image, PixelBounds& bounds);

  /// Sums deltas down the columns, turns winding numbers into bits, counts them and leaves the
  /// deltas zero.
  Counts (*resolve)(const DeltaImage& image, const PixelBounds& bounds, const MaskWords& masks);

  const char* name;
};

const Kernel& baseline_kernel();
#if defined(BODYSCHEMA_HAVE_AVX2_KERNEL)
const Kernel& avx2_kernel();
#endif

/// The widest kernel this processor can run. BODYSCHEMA_CONTOUR_KERNEL=baseline in the environment
/// asks for the plain one.
const Kernel& best_kernel();

}  // namespace bodyschema::contour
