#pragma once

namespace bodyschema::atlas {

// Shader storage buffers (std430):
//  0 placements  raster pass: per tile and part four rows, see below
//  1 windows     per tile: corner in the atlas x, y; corner in the picture u, v
//  2 jobs        per workgroup: tile, first column, first row, camera; columns, rows, 0, 0
//  4 counts      per tile: intersection, predicted
//  5 rendered    32 pixels a word, one picture, only where a picture is asked for
//  6 parts       per part: one beyond its last edge
// Buffer textures, which llvmpipe reads several times faster than storage buffers:
//  0 atlas       (a plain texture) the framebuffer
//  1 masks       per camera and 32 pixels: observed, valid
//  2 placements  per tile and part: three rows of P (centred part frame to homogeneous pixels) and
//                (camera centre in the centred part frame, 1 if the part is wholly in front)
//  3 planes      per edge: plane of the left triangle, plane of the right one
//  4 ends        per edge: from, and 0 for counts once, 1 for counts twice, 2 for open; to, and the part

// ---- raster pass -----------------------------------------------------------------------------

// Pixel centres: OpenCV's (u, v) is (u + 0.5, v + 0.5) in window coordinates; rows run upwards in the
// atlas, so the picture stands on its head there and triangles wind the other way round.
inline constexpr const char* kRasterVertex = R"(#version 430 core
layout(location = 0) in vec3 position;
layout(location = 1) in uint part;
layout(std430, binding = 0) readonly buffer Placements { vec4 placements[]; };
layout(std430, binding = 1) readonly buffer Windows { ivec4 windows[]; };
uniform int parts;
uniform int first_tile;
uniform float near_m;
uniform vec2 tile_size;
uniform vec2 atlas_size;
out gl_PerVertex { vec4 gl_Position; float gl_ClipDistance[4]; };
void main() {
  int tile = first_tile + gl_InstanceID;
  int row = (tile * parts + int(part)) * 4;
  vec4 p = vec4(position, 1.0);
  vec3 h = vec3(dot(placements[row], p), dot(placements[row + 1], p), dot(placements[row + 2], p));
  vec4 window = vec4(windows[tile]);
  vec2 in_tile = h.xy + (0.5 - window.zw) * h.z;  // times depth, like all that follows
  gl_ClipDistance[0] = in_tile.x;
  gl_ClipDistance[1] = tile_size.x * h.z - in_tile.x;
  gl_ClipDistance[2] = in_tile.y;
  gl_ClipDistance[3] = tile_size.y * h.z - in_tile.y;
  vec2 in_atlas = in_tile + window.xy * h.z;
  gl_Position = vec4(2.0 * in_atlas / atlas_size - h.z, h.z - 2.0 * near_m, h.z);
}
)";

inline constexpr const char* kRasterFragment = R"(#version 430 core
layout(location = 0) out float covered;
void main() { covered = 1.0; }
)";

// One workgroup a tile; each invocation takes words of 32 pixels.
inline constexpr const char* kReduce = R"(#version 430 core
layout(local_size_x = 64) in;
layout(std430, binding = 1) readonly buffer Windows { ivec4 windows[]; };
struct Job { ivec4 where; ivec4 size; };
layout(std430, binding = 2) readonly buffer Jobs { Job jobs[]; };
layout(std430, binding = 4) buffer Counts { uvec2 counts[]; };
layout(std430, binding = 5) buffer Rendered { uint rendered[]; };
layout(binding = 0) uniform sampler2D atlas;
layout(binding = 1) uniform usamplerBuffer masks;
uniform ivec2 cameras[32];  // words a row, first word
uniform int first_job;
uniform int keep_picture;
shared uint intersection;
shared uint predicted;
void main() {
  Job job = jobs[first_job + int(gl_WorkGroupID.x)];
  ivec4 window = windows[job.where.x];
  ivec2 camera = cameras[job.where.w];
  if (gl_LocalInvocationIndex == 0u) { intersection = 0u; predicted = 0u; }
  barrier();
  int words = (job.size.x + 31) / 32;
  uint in_both = 0u;
  uint in_one = 0u;
  for (int i = int(gl_LocalInvocationIndex); i < words * job.size.y; i += 64) {
    int word = i % words;
    int row = i / words;
    int columns = min(32, job.size.x - word * 32);
    ivec2 at = window.xy + ivec2(word * 32, row);
    uint bits = 0u;
    for (int k = 0; k < columns; ++k) {
      if (texelFetch(atlas, at + ivec2(k, 0), 0).r > 0.5) bits |= 1u << k;
    }
    int v = window.w + row;
    int index = v * camera.x + window.z / 32 + word;
    uvec2 mask = texelFetch(masks, camera.y + index).xy;
    in_both += uint(bitCount(bits & mask.x));
    in_one += uint(bitCount(bits & mask.y));
    if (keep_picture != 0) rendered[index] = bits;
  }
  atomicAdd(intersection, in_both);
  atomicAdd(predicted, in_one);
  barrier();
  if (gl_LocalInvocationIndex == 0u) counts[job.where.x] = uvec2(intersection, predicted);
}
)";

// ---- compute pass ----------------------------------------------------------------------------

// One workgroup a strip of a tile. Contour edges add the change of the winding number where they
// cross the centre of a column, four columns a word, a byte each; sums of such words are exact as
// integers, so a borrow between bytes on the way disappears again in the sum down the column. A bias
// of 16 a byte keeps sums non-negative where rounding makes a winding number slip below zero.
//
// Few edges lie on the contour (one in seven of a CAD model's), and drawing one takes many times as
// long as finding that it does not: on a GPU they wait in a queue until there are enough for all
// invocations, which would stand idle beside the one that draws otherwise. Columns are summed in
// pieces, one an invocation, for the same reason.
// kLocal, kDeltaWords, kQueue (0: no queue), kTestsBetween (two emptyings) are set in front of this text.
inline constexpr const char* kContour = R"(
layout(local_size_x = kLocal) in;
struct Job { ivec4 where; ivec4 size; };
layout(std430, binding = 2) readonly buffer Jobs { Job jobs[]; };
layout(std430, binding = 4) buffer Counts { uint counts[]; };
layout(std430, binding = 5) buffer Rendered { uint rendered[]; };
layout(std430, binding = 6) readonly buffer Parts { int edge_ends[]; };
layout(binding = 1) uniform usamplerBuffer masks;
layout(binding = 2) uniform samplerBuffer placements;
layout(binding = 3) uniform samplerBuffer planes;
layout(binding = 4) uniform samplerBuffer ends;
uniform ivec2 cameras[32];  // words a row, first word
uniform int parts;
uniform int first_job;
uniform int keep_picture;
shared uint deltas[kDeltaWords];
#if kQueue > 0
shared uint sums[kLocal];
shared uint queue[kQueue];
shared uint queued;
#endif
shared uint intersection;
shared uint predicted;

// `precise`: a corner or a triangle met in two edges must come out the same.
float side(vec4 plane, vec3 c) {
  precise float s = plane.x * c.x;
  s = s + plane.y * c.y;
  s = s + plane.z * c.z;
  s = s - plane.w;
  return s;
}
float row_times(vec4 row, vec3 p) {
  precise float s = row.x * p.x;
  s = s + row.y * p.y;
  s = s + row.z * p.z;
  s = s + row.w;
  return s;
}

bool on_contour(int e, vec3 camera_B, out bool left) {
  left = side(texelFetch(planes, 2 * e), camera_B) > 0.0;
  vec4 other = texelFetch(planes, 2 * e + 1);
  bool right = side(other, camera_B) > 0.0;
  if (left != right) return true;
  return other == vec4(0.0, 0.0, 0.0, 1.0) && texelFetch(ends, 2 * e).w == 2.0;
}

// Adds an edge of the contour to the deltas of a strip. `drawn` is the edge times two, plus one where its left triangle
// faces the camera.
void draw(Job job, int stride, uint drawn, vec4 P0, vec4 P1, vec4 P2) {
  int e = int(drawn >> 1);
  vec4 from = texelFetch(ends, 2 * e);
  vec3 to = texelFetch(ends, 2 * e + 1).xyz;
  float u_origin = float(job.where.y);
  float v_origin = float(job.where.z);
  float width = float(job.size.x);
  float height = float(job.size.y);
  int step = (drawn & 1u) != 0u ? -1 : 1;
  if (from.w == 1.0) step *= 2;
  precise float z0 = row_times(P2, from.xyz);
  precise float z1 = row_times(P2, to);
  precise float u0 = row_times(P0, from.xyz) / z0 - u_origin;
  precise float u1 = row_times(P0, to) / z1 - u_origin;
  precise float v0 = row_times(P1, from.xyz) / z0 - v_origin;
  precise float v1 = row_times(P1, to) / z1 - v_origin;
  int first = int(ceil(clamp(min(u0, u1), 0.0, width)));
  int end = int(ceil(clamp(max(u0, u1), 0.0, width)));
  if (u0 > u1) step = -step;
  float slope = (v1 - v0) / (u1 - u0);
  for (int u = first; u < end; ++u) {
    float v = clamp(v0 + (float(u) - u0) * slope, 0.0, height);
    int row = int(ceil(v));
    atomicAdd(deltas[row * stride + (u >> 2)], uint(step) << ((u & 3) * 8));
  }
}

#if kQueue > 0
void draw(Job job, int stride, uint drawn) {
  int placement = (job.where.x * parts + int(texelFetch(ends, int(drawn | 1u)).w)) * 4;
  draw(job, stride, drawn, texelFetch(placements, placement), texelFetch(placements, placement + 1),
       texelFetch(placements, placement + 2));
}

// Draws what waits, with all invocations.
void draw_queue(Job job, int stride) {
  barrier();
  int waiting = int(min(queued, uint(kQueue)));
  for (int i = int(gl_LocalInvocationIndex); i < waiting; i += kLocal) draw(job, stride, queue[i]);
  barrier();
  if (gl_LocalInvocationIndex == 0u) queued = 0u;
  barrier();
}
#endif

void main() {
  int me = int(gl_LocalInvocationIndex);
  Job job = jobs[first_job + int(gl_WorkGroupID.x)];
  int tile = job.where.x;
  ivec2 camera = cameras[job.where.w];
  int rows = job.size.y;
  int stride = job.size.x / 4;
  for (int i = me; i < stride * (rows + 1); i += kLocal) deltas[i] = 0u;
  if (me == 0) {
    intersection = 0u;
    predicted = 0u;
#if kQueue > 0
    queued = 0u;
#endif
  }
  barrier();

  int next_edge = 0;
  int tested = 0;
  for (int part = 0; part < parts; ++part) {
    vec4 c = texelFetch(placements, (tile * parts + part) * 4 + 3);
    int first_edge = next_edge;
    next_edge = edge_ends[part];
    if (c.w == 0.0) continue;
#if kQueue == 0
    vec4 P0 = texelFetch(placements, (tile * parts + part) * 4);
    vec4 P1 = texelFetch(placements, (tile * parts + part) * 4 + 1);
    vec4 P2 = texelFetch(placements, (tile * parts + part) * 4 + 2);
    for (int e = first_edge + me; e < next_edge; e += kLocal) {
      bool left;
      if (on_contour(e, c.xyz, left)) draw(job, stride, uint(e) * 2u + (left ? 1u : 0u), P0, P1, P2);
    }
#else
    for (int base = first_edge; base < next_edge; base += kLocal) {
      int e = base + me;
      bool left;
      if (e < next_edge && on_contour(e, c.xyz, left)) {
        uint drawn = uint(e) * 2u + (left ? 1u : 0u);
        uint place = atomicAdd(queued, 1u);
        if (place < uint(kQueue)) {
          queue[place] = drawn;
        } else {
          draw(job, stride, drawn);
        }
      }
      if (++tested == kTestsBetween) {
        draw_queue(job, stride);
        tested = 0;
      }
    }
#endif
  }
#if kQueue > 0
  draw_queue(job, stride);
#endif
  barrier();

  // A column's pieces: their sums, and with them every piece's beginning.
#if kQueue == 0
  const int pieces = 1;
  int piece_rows = rows;
#else
  int pieces = max(1, kLocal / stride);
  int piece_rows = (rows + pieces - 1) / pieces;
  if (pieces > 1) {
    if (me < stride * pieces) {
      int first_row = me / stride * piece_rows;
      int end_row = min(first_row + piece_rows, rows);
      uint sum = 0u;
      for (int row = first_row; row < end_row; ++row) sum += deltas[row * stride + me % stride];
      sums[me] = sum;
    }
    barrier();
  }
#endif
  uint in_both = 0u;
  uint in_one = 0u;
  for (int i = me; i < stride * pieces; i += kLocal) {
    int word = i % stride;
    int first_row = i / stride * piece_rows;
    int end_row = min(first_row + piece_rows, rows);
    uint sum = 0x10101010u;
#if kQueue > 0
    for (int above = word; above < i; above += stride) sum += sums[above];
#endif
    int u = job.where.y + word * 4;
    int index = (job.where.z + first_row) * camera.x + (u >> 5);
    int shift = u & 31;
    for (int row = first_row; row < end_row; ++row) {
      sum += deltas[row * stride + word];
      uint other = sum ^ 0x10101010u;
      uint high = (((other & 0x7f7f7f7fu) + 0x7f7f7f7fu) | other) & 0x80808080u;
      uint bits = ((high * 0x00204081u) >> 28) << shift;
      uvec2 mask = texelFetch(masks, camera.y + index).xy;
      in_both += uint(bitCount(bits & mask.x));
      in_one += uint(bitCount(bits & mask.y));
      if (keep_picture != 0) atomicOr(rendered[index], bits);
      index += camera.x;
    }
  }
  atomicAdd(intersection, in_both);
  atomicAdd(predicted, in_one);
  barrier();
  if (me == 0) {
    atomicAdd(counts[2 * tile], intersection);
    atomicAdd(counts[2 * tile + 1], predicted);
  }
}
)";

}  // namespace bodyschema::atlas
