#include "atlas_scorer.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>

#include "atlas_shaders.hpp"
#include "bodyschema/gl/functions.hpp"
#include "bodyschema/gl/program.hpp"
#include "contour_model.hpp"
#include "near_plane.hpp"
#include "observation_masks.hpp"
#include "worker_pool.hpp"

namespace bodyschema {
namespace {

using contour::View;

// How the compute pass divides its work.
struct Division {
  int local;          ///< invocations of a workgroup
  int shared_bytes;   ///< that it takes
  int queue;          ///< contour edges that may wait; 0: each is drawn by whoever finds it
  int tests_between;  ///< two emptyings of the queue, an invocation
  /// Words of the deltas: what the queue, a sum an invocation and three counters leave.
  [[nodiscard]] int delta_words() const { return shared_bytes / 4 - queue - local - 4; }
};
// The most invocations that every OpenGL 4.3 gives: what bounds a GPU is how fast it reads edges, all of them for each
// workgroup, and two such fill a multiprocessor.
constexpr Division kOnGpu{1024, 48 << 10, 1024, 4};
constexpr int kLeastSharedBytes = 32 << 10;  // what every OpenGL 4.3 gives

// One vector of llvmpipe's, and more for more edges: llvmpipe leaves a loop after 65,535 rounds, those of inner loops
// counted, whatever has been done by then. A quarter of them for the edges leaves three columns a contour edge.
Division on_software(std::size_t edges) {
  constexpr std::size_t kVector = 8, kRounds = 65535 / 4;
  const std::size_t vectors = std::clamp<std::size_t>((edges / kRounds + kVector - 1) / kVector, 1, 128);
  return {static_cast<int>(vectors * kVector), kLeastSharedBytes, 0, 0};
}

constexpr int kMaxCameras = 32;

// A GL buffer that grows and never shrinks.
class Buffer {
 public:
  explicit Buffer(const gl::Functions& gl) : gl_(gl) { gl_.GenBuffers(1, &id_); }
  ~Buffer() { gl_.DeleteBuffers(1, &id_); }
  Buffer(const Buffer&) = delete;
  Buffer& operator=(const Buffer&) = delete;

  [[nodiscard]] GLuint id() const { return id_; }
  void bind(GLuint index) const { gl_.BindBufferBase(GL_SHADER_STORAGE_BUFFER, index, id_); }
  void reserve(std::size_t bytes) {
    gl_.BindBuffer(GL_SHADER_STORAGE_BUFFER, id_);
    if (bytes <= capacity_) return;
    capacity_ = bytes;
    gl_.BufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(bytes), nullptr, GL_DYNAMIC_DRAW);
  }
  template <typename T>
  void write(std::span<const T> data) {
    reserve(std::max<std::size_t>(data.size_bytes(), 16));
    if (data.empty()) return;
    gl_.BufferSubData(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>(data.size_bytes()), data.data());
  }
  template <typename T>
  void read(std::span<T> data) const {
    gl_.BindBuffer(GL_SHADER_STORAGE_BUFFER, id_);
    gl_.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>(data.size_bytes()), data.data());
  }

 private:
  const gl::Functions& gl_;
  GLuint id_ = 0;
  std::size_t capacity_ = 0;
};

// The layouts of atlas_shaders.hpp.
struct Placement {
  float P[12];
  float camera[3];
  float in_front;
};
struct Window {
  std::int32_t x, y, u, v;
};
struct Job {
  std::int32_t tile, u, v, camera;
  std::int32_t columns, rows, unused[2];
};
struct TileCounts {
  std::uint32_t intersection, predicted;
};
struct CameraLayout {
  std::int32_t words_per_row, first;
};
struct MaskPair {
  std::uint32_t observed, valid;
};

// Units of the buffer textures.
enum TextureUnit : GLuint { kAtlasUnit, kMasksUnit, kPlacementsUnit, kPlanesUnit, kEndsUnit };

// A buffer seen through a texture.
class BufferTexture {
 public:
  BufferTexture(const gl::Functions& gl, GLenum format) : gl_(gl), format_(format) { gl_.GenTextures(1, &id_); }
  ~BufferTexture() { gl_.DeleteTextures(1, &id_); }
  BufferTexture(const BufferTexture&) = delete;
  BufferTexture& operator=(const BufferTexture&) = delete;
  void bind(TextureUnit unit, const Buffer& buffer) const {
    gl_.ActiveTexture(GL_TEXTURE0 + unit);
    gl_.BindTexture(GL_TEXTURE_BUFFER, id_);
    gl_.TexBuffer(GL_TEXTURE_BUFFER, format_, buffer.id());
    gl_.ActiveTexture(GL_TEXTURE0);
  }

 private:
  const gl::Functions& gl_;
  GLenum format_;
  GLuint id_ = 0;
};

// Pixels a tile may cover: [u_begin, u_end) x [v_begin, v_end).
struct Crop {
  int u_begin = 0, v_begin = 0, u_end = 0, v_end = 0;
  [[nodiscard]] bool empty() const { return u_begin >= u_end || v_begin >= v_end; }
  [[nodiscard]] int width() const { return u_end - u_begin; }
  [[nodiscard]] int height() const { return v_end - v_begin; }
};

struct Tile {
  std::size_t image = 0;  // particle * cameras + camera
  Crop crop;
  bool raster = false;
};

class AtlasScorer final : public SilhouetteScorer {
 public:
  AtlasScorer(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
              std::unique_ptr<gl::Context> context, const AtlasOptions& options)
      : model_(model), masks_(cameras), options_(options), context_(std::move(context)), pool_(options.threads) {
    for (const auto& intrinsics : cameras) cameras_.emplace_back(intrinsics);
    const gl::Context::Current current(*context_);
    if (!current.ok()) throw gl::ContextError("cannot make " + context_->description() + " current");
    read_limits();
    gl_ = std::make_unique<Objects>(context_->functions(), division_);
    upload_model(model);
    upload_masks();
    max_tiles_ = std::clamp<std::size_t>(max_texels_ / (4 * model_.parts().size()), 1,
                                         static_cast<std::size_t>(options_.max_tiles));
    warm_up();
  }

  ~AtlasScorer() override {
    const gl::Context::Current current(*context_);
    gl_.reset();
  }

  void set_observation(std::span<const ObservedSilhouette> observed) override {
    masks_.set(observed);
    masks_changed_ = true;
  }

  void score(std::span<const Eigen::Isometry3f> X_CB, std::span<SilhouetteCounts> counts,
             std::uint32_t camera_mask) override {
    assert(counts.size() % cameras_.size() == 0 && X_CB.size() == counts.size() * model_.parts().size());
    const gl::Context::Current current(*context_);
    if (!current.ok()) lost();
    if (masks_changed_) upload_masks();
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const std::size_t camera = i % cameras_.size();
      counts[i] = {};
      if (((camera_mask >> camera) & 1u) != 0) counts[i].observed = masks_.count(camera);
    }
    for (std::size_t next = 0; next < counts.size();) {
      tiles_.clear();
      for (; next < counts.size() && tiles_.size() < max_tiles_; ++next) {
        if (((camera_mask >> (next % cameras_.size())) & 1u) != 0) tiles_.push_back({next, {}, false});
      }
      place_tiles(X_CB);
      draw_tiles(false);
      for (std::size_t t = 0; t < tiles_.size(); ++t) {
        counts[tiles_[t].image].intersection = tile_counts_[t].intersection;
        counts[tiles_[t].image].predicted = tile_counts_[t].predicted;
      }
    }
    check_alive();
  }

  BinaryMask render(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) override {
    const auto& k = cameras_.at(camera).intrinsics;
    BinaryMask mask(k.width, k.height);
    const gl::Context::Current current(*context_);
    if (!current.ok()) lost();
    if (masks_changed_) upload_masks();
    place_one(X_CB, camera);
    std::vector<std::uint32_t> words(static_cast<std::size_t>(2 * mask.words_per_row() * k.height));
    gl_->rendered.write<std::uint32_t>(words);
    draw_tiles(true);
    gl_->rendered.read<std::uint32_t>(words);
    check_alive();
    // Tiles are cut to whole words: restrict to the picture.
    BinaryMask inside(k.width, k.height);
    inside.fill(true);
    for (int v = 0; v < k.height; ++v) {
      for (int w = 0; w < mask.words_per_row(); ++w) {
        const auto at = static_cast<std::size_t>(2 * (v * mask.words_per_row() + w));
        const std::uint64_t bits = words[at] | (static_cast<std::uint64_t>(words[at + 1]) << 32);
        mask.row(v)[w] = bits & inside.row(v)[w];
      }
    }
    return mask;
  }

  [[nodiscard]] std::string description() const override {
    return "atlas on " + context_->description() +
           (options_.pass == AtlasPass::kCompute ? ", compute pass" : ", raster pass");
  }

 private:
  struct Objects {
    Objects(const gl::Functions& functions, const Division& division)
        : gl(functions), placements(gl), windows(gl), jobs(gl), masks(gl), counts(gl), rendered(gl), planes(gl),
          ends(gl), edge_ends(gl), vertices(gl), indices(gl), masks_texture(gl, GL_RG32UI),
          placements_texture(gl, GL_RGBA32F), planes_texture(gl, GL_RGBA32F), ends_texture(gl, GL_RGBA32F),
          raster(gl, "atlas raster",
                 {{GL_VERTEX_SHADER, atlas::kRasterVertex}, {GL_FRAGMENT_SHADER, atlas::kRasterFragment}}),
          reduce(gl, "atlas reduce", {{GL_COMPUTE_SHADER, atlas::kReduce}}),
          contour(gl, "atlas contour", {{GL_COMPUTE_SHADER, contour_source(division)}}) {
      gl.GenVertexArrays(1, &vertex_array);
      gl.GenFramebuffers(1, &framebuffer);
    }
    ~Objects() {
      gl.DeleteVertexArrays(1, &vertex_array);
      gl.DeleteFramebuffers(1, &framebuffer);
      if (texture != 0) gl.DeleteTextures(1, &texture);
    }
    Objects(const Objects&) = delete;
    Objects& operator=(const Objects&) = delete;

    static std::string contour_source(const Division& division) {
      const auto define = [](const char* name, int value) {
        return std::string("#define ") + name + " " + std::to_string(value) + "\n";
      };
      return "#version 430 core\n" + define("kLocal", division.local) + define("kDeltaWords", division.delta_words()) +
             define("kQueue", division.queue) + define("kTestsBetween", division.tests_between) + atlas::kContour;
    }

    const gl::Functions& gl;
    Buffer placements, windows, jobs, masks, counts, rendered, planes, ends, edge_ends;
    Buffer vertices, indices;
    BufferTexture masks_texture, placements_texture, planes_texture, ends_texture;
    gl::Program raster, reduce, contour;
    GLuint vertex_array = 0;
    GLuint framebuffer = 0;
    GLuint texture = 0;
    int texture_width = 0;
    int texture_height = 0;
  };

  void read_limits() {
    const auto& gl = context_->functions();
    GLint texture = 0, viewport[2] = {0, 0}, distances = 0, shared = 0;
    gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &texture);
    gl.GetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
    gl.GetIntegerv(GL_MAX_CLIP_DISTANCES, &distances);
    gl.GetIntegerv(GL_MAX_COMPUTE_SHARED_MEMORY_SIZE, &shared);
    if (distances < 4) throw gl::ContextError("the driver has fewer than 4 clip distances");
    if (shared < kLeastSharedBytes) {
      throw gl::ContextError("the driver gives compute shaders less than 32 KiB of shared memory");
    }
    std::size_t edges = 0;
    for (const auto& part : model_.parts()) edges += part.ends.size();
    division_ = context_->is_software() && !options_.as_on_gpu ? on_software(edges) : kOnGpu;
    division_.shared_bytes = std::min(division_.shared_bytes, static_cast<int>(shared));
    max_side_ = std::min({options_.max_side_px, texture, viewport[0], viewport[1]});
    for (const auto& camera : cameras_) {
      const int needed = std::max((camera.intrinsics.width + 31) / 32 * 32, camera.intrinsics.height);
      if (needed > max_side_) {
        throw gl::ContextError("a picture of " + std::to_string(camera.intrinsics.width) + "x" +
                               std::to_string(camera.intrinsics.height) + " px exceeds the framebuffer limit of " +
                               std::to_string(max_side_));
      }
    }
  }

  void upload_model(const SilhouetteModel& model) {
    const auto& gl = gl_->gl;
    struct Vertex {
      float position[3];
      std::uint32_t part;
    };
    std::vector<Vertex> vertices;
    std::vector<std::uint32_t> closed, open;
    struct Four {
      float v[4];
    };
    std::vector<Four> planes, ends;
    std::vector<std::int32_t> edge_ends;
    for (std::size_t p = 0; p < model_.parts().size(); ++p) {
      const contour::Part& part = model_.parts()[p];
      const auto first = static_cast<std::uint32_t>(vertices.size());
      for (const auto& v : part.vertices) {
        vertices.push_back({{v.x(), v.y(), v.z()}, static_cast<std::uint32_t>(p)});
      }
      for (std::size_t t = 0; t < part.triangles.size(); ++t) {
        auto& indices = part.closed[t] ? closed : open;
        for (const auto v : part.triangles[t]) indices.push_back(first + v);
      }
      for (const auto& run : part.runs) {
        const float kind = run.always ? 2.0f : run.weight == 2 ? 1.0f : 0.0f;
        for (std::int32_t e = 0; e < run.edge_count; ++e) {
          const contour::EdgeBlock& b = run.blocks[e / contour::kLanes];
          const int k = e % contour::kLanes;
          planes.push_back({{b.left_nx[k], b.left_ny[k], b.left_nz[k], b.left_d[k]}});
          planes.push_back({{b.right_nx[k], b.right_ny[k], b.right_nz[k], b.right_d[k]}});
          const contour::EdgeEnds& edge = run.ends[e];
          ends.push_back({{edge.from[0], edge.from[1], edge.from[2], kind}});
          ends.push_back({{edge.to[0], edge.to[1], edge.to[2], static_cast<float>(p)}});
        }
      }
      edge_ends.push_back(static_cast<std::int32_t>(planes.size() / 2));
    }
    closed_indices_ = static_cast<GLsizei>(closed.size());
    open_indices_ = static_cast<GLsizei>(open.size());
    closed.insert(closed.end(), open.begin(), open.end());
    cull_ = model.culling == FaceCulling::kBack;

    gl_->vertices.write<Vertex>(vertices);
    gl_->indices.write<std::uint32_t>(closed);
    gl_->planes.write<Four>(planes);
    gl_->ends.write<Four>(ends);
    gl_->edge_ends.write<std::int32_t>(edge_ends);
    GLint texels = 0;
    gl.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels);
    max_texels_ = static_cast<std::size_t>(texels);
    if (planes.size() > max_texels_) options_.pass = AtlasPass::kRaster;  // too many edges for it
    gl.BindVertexArray(gl_->vertex_array);
    gl.BindBuffer(GL_ARRAY_BUFFER, gl_->vertices.id());
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, gl_->indices.id());
    gl.EnableVertexAttribArray(0);
    gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vertex), nullptr);
    gl.EnableVertexAttribArray(1);
    gl.VertexAttribIPointer(1, 1, GL_UNSIGNED_INT, sizeof(Vertex),
                            reinterpret_cast<const void*>(offsetof(Vertex, part)));
    gl.BindVertexArray(0);
  }

  // Masks of all cameras one after the other, and where each begins.
  void upload_masks() {
    const auto& gl = gl_->gl;
    mask_words_.clear();
    std::array<CameraLayout, kMaxCameras> layout{};
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const BinaryMask& observed = masks_.observed(c);
      const BinaryMask& valid = masks_.valid(c);
      layout[c] = {2 * observed.words_per_row(), static_cast<std::int32_t>(mask_words_.size())};
      for (int v = 0; v < observed.height(); ++v) {
        for (int w = 0; w < observed.words_per_row(); ++w) {
          for (const int shift : {0, 32}) {
            mask_words_.push_back({static_cast<std::uint32_t>(observed.row(v)[w] >> shift),
                                   static_cast<std::uint32_t>(valid.row(v)[w] >> shift)});
          }
        }
      }
    }
    gl_->masks.write<MaskPair>(mask_words_);
    for (const gl::Program* program : {&gl_->reduce, &gl_->contour}) {
      program->use();
      gl.Uniform2iv(program->uniform("cameras"), static_cast<GLsizei>(cameras_.size()), &layout[0].words_per_row);
    }
    masks_changed_ = false;
  }

  // Places the parts of every tile's picture, with all threads: on a GPU that takes as long as drawing them.
  void place_tiles(std::span<const Eigen::Isometry3f> X_CB) {
    const std::size_t parts = model_.parts().size();
    placements_.resize(tiles_.size() * parts);
    auto body = [&](int, std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        place(X_CB.subspan(tiles_[t].image * parts, parts), tiles_[t],
              std::span(placements_).subspan(t * parts, parts));
      }
    };
    constexpr std::size_t kGrain = 16;
    pool_.run(tiles_.size(), kGrain, body);
  }

  // One picture of one camera as the only tile.
  void place_one(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) {
    tiles_.assign(1, Tile{camera, {}, false});
    placements_.resize(model_.parts().size());
    place(X_CB, tiles_[0], placements_);
  }

  // Places the parts of one picture. The crop stays empty where nothing can be seen.
  void place(std::span<const Eigen::Isometry3f> X_CB, Tile& tile, std::span<Placement> placements) const {
    const contour::Camera& camera = cameras_[tile.image % cameras_.size()];
    const auto& k = camera.intrinsics;
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    float u_min = kInfinity, v_min = kInfinity, u_max = -kInfinity, v_max = -kInfinity;
    tile.raster = options_.pass == AtlasPass::kRaster;
    bool seen = false;
    for (std::size_t p = 0; p < model_.parts().size(); ++p) {
      const contour::Part& part = model_.parts()[p];
      const contour::PlacedPart placed = contour::place(part, camera, X_CB[p]);
      Placement& placement = placements[p];
      placement = {};
      if (placed.view == View::kInvisible) {
        placement.P[11] = -1.0f;  // behind the camera, wherever the vertex is
        continue;
      }
      seen = true;
      std::copy_n(placed.P, 12, placement.P);
      std::copy_n(placed.camera_B, 3, placement.camera);
      placement.in_front = placed.view == View::kInFront ? 1.0f : 0.0f;
      if (placed.view == View::kCut) {
        tile.raster = true;
        u_min = v_min = -1.0f;
        u_max = static_cast<float>(k.width);
        v_max = static_cast<float>(k.height);
        continue;
      }
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3f& e = part.half_extent;
        const float x = (corner & 1) != 0 ? e.x() : -e.x();
        const float y = (corner & 2) != 0 ? e.y() : -e.y();
        const float z = (corner & 4) != 0 ? e.z() : -e.z();
        const float* P = placed.P;
        // A corner of the box may lie nearer than the part's sphere, never behind the camera by
        // much: anything close makes the crop the whole picture.
        const float depth = std::max(P[8] * x + P[9] * y + P[10] * z + P[11], 0.1f * kNearPlane_m);
        const float u = (P[0] * x + P[1] * y + P[2] * z + P[3]) / depth;
        const float v = (P[4] * x + P[5] * y + P[6] * z + P[7]) / depth;
        if (depth <= kNearPlane_m) {
          u_min = v_min = -1.0f;
          u_max = static_cast<float>(k.width);
          v_max = static_cast<float>(k.height);
        }
        u_min = std::min(u_min, u);
        u_max = std::max(u_max, u);
        v_min = std::min(v_min, v);
        v_max = std::max(v_max, v);
      }
    }
    // A pixel of margin, and whole words of the masks.
    const auto pixel = [](float x, int size) {
      return static_cast<int>(std::clamp(x, 0.0f, static_cast<float>(size)));
    };
    if (!seen) return;
    Crop& crop = tile.crop;
    crop.u_begin = pixel(std::floor(u_min) - 1.0f, k.width) / 32 * 32;
    crop.v_begin = pixel(std::floor(v_min) - 1.0f, k.height);
    crop.u_end = (pixel(std::ceil(u_max) + 2.0f, k.width) + 31) / 32 * 32;
    crop.v_end = pixel(std::ceil(v_max) + 2.0f, k.height);
  }

  // Scores tiles_ into tile_counts_.
  void draw_tiles(bool keep_picture) {
    tile_counts_.assign(tiles_.size(), TileCounts{0, 0});
    if (tiles_.empty()) return;
    const auto& gl = gl_->gl;
    gl_->placements.write<Placement>(placements_);
    gl_->counts.write<TileCounts>(tile_counts_);
    if (!keep_picture) gl_->rendered.reserve(16);
    gl_->masks_texture.bind(kMasksUnit, gl_->masks);
    gl_->counts.bind(4);
    gl_->rendered.bind(5);

    // Rasterised tiles first in line, each kind in the order of the particles.
    windows_.assign(tiles_.size(), Window{0, 0, 0, 0});
    raster_tiles_.clear();
    jobs_.clear();
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      const Tile& tile = tiles_[t];
      if (tile.crop.empty()) continue;
      if (tile.raster) {
        raster_tiles_.push_back(t);
        continue;
      }
      const auto camera = static_cast<std::int32_t>(tile.image % cameras_.size());
      const int strip = std::max(4, division_.delta_words() / (tile.crop.height() + 1) * 4);
      const int strips = (tile.crop.width() + strip - 1) / strip;
      const int columns = ((tile.crop.width() + strips - 1) / strips + 3) / 4 * 4;
      for (int u = tile.crop.u_begin; u < tile.crop.u_end; u += columns) {
        jobs_.push_back({static_cast<std::int32_t>(t),
                         u,
                         tile.crop.v_begin,
                         camera,
                         std::min(columns, tile.crop.u_end - u),
                         tile.crop.height(),
                         {0, 0}});
      }
    }
    if (!jobs_.empty()) {
      gl_->jobs.write<Job>(jobs_);
      gl_->jobs.bind(2);
      gl_->edge_ends.bind(6);
      gl_->placements_texture.bind(kPlacementsUnit, gl_->placements);
      gl_->planes_texture.bind(kPlanesUnit, gl_->planes);
      gl_->ends_texture.bind(kEndsUnit, gl_->ends);
      gl_->contour.use();
      gl.Uniform1i(gl_->contour.uniform("parts"), static_cast<GLint>(model_.parts().size()));
      gl.Uniform1i(gl_->contour.uniform("keep_picture"), keep_picture ? 1 : 0);
      constexpr std::size_t kMostGroups = 65535;
      for (std::size_t first = 0; first < jobs_.size(); first += kMostGroups) {
        gl.Uniform1i(gl_->contour.uniform("first_job"), static_cast<GLint>(first));
        gl.DispatchCompute(static_cast<GLuint>(std::min(kMostGroups, jobs_.size() - first)), 1, 1);
      }
    }
    if (!raster_tiles_.empty()) draw_raster_tiles(keep_picture);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl_->counts.read<TileCounts>(tile_counts_);
  }

  // The rasteriser draws consecutive tiles: placements are packed for it.
  void draw_raster_tiles(bool keep_picture) {
    const auto& gl = gl_->gl;
    const std::size_t parts = model_.parts().size();
    int width = 0, height = 0;
    bool cut = false;
    raster_placements_.clear();
    for (const std::size_t t : raster_tiles_) {
      width = std::max(width, tiles_[t].crop.width());
      height = std::max(height, tiles_[t].crop.height());
      for (std::size_t p = 0; p < parts; ++p) {
        const Placement& placement = placements_[t * parts + p];
        raster_placements_.push_back(placement);
        cut = cut || (placement.in_front == 0.0f && placement.P[11] != -1.0f);
      }
    }
    const int columns = std::min(max_side_ / width, static_cast<int>(raster_tiles_.size()));
    const int rows_needed = (static_cast<int>(raster_tiles_.size()) + columns - 1) / columns;
    const int rows = std::min(max_side_ / height, rows_needed);
    const std::size_t per_pass = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    reserve_texture(columns * width, rows * height);

    jobs_.clear();
    windows_.resize(raster_tiles_.size());
    // The reduction writes counts where the job says; windows go by position in line.
    reduce_windows_.assign(tiles_.size(), Window{0, 0, 0, 0});
    for (std::size_t i = 0; i < raster_tiles_.size(); ++i) {
      const std::size_t t = raster_tiles_[i];
      const Crop& crop = tiles_[t].crop;
      const auto place = static_cast<int>(i % per_pass);
      windows_[i] = {place % columns * width, place / columns * height, crop.u_begin, crop.v_begin};
      reduce_windows_[t] = windows_[i];
      jobs_.push_back({static_cast<std::int32_t>(t),
                       crop.u_begin,
                       crop.v_begin,
                       static_cast<std::int32_t>(tiles_[t].image % cameras_.size()),
                       crop.width(),
                       crop.height(),
                       {0, 0}});
    }
    gl_->jobs.write<Job>(jobs_);
    gl_->jobs.bind(2);
    gl_->placements.write<Placement>(raster_placements_);
    gl_->placements.bind(0);

    gl.BindFramebuffer(GL_FRAMEBUFFER, gl_->framebuffer);
    gl.Viewport(0, 0, columns * width, rows * height);
    gl.Scissor(0, 0, columns * width, rows * height);
    gl.Enable(GL_SCISSOR_TEST);
    for (GLenum plane = 0; plane < 4; ++plane) gl.Enable(GL_CLIP_DISTANCE0 + plane);
    gl.FrontFace(GL_CW);
    gl.CullFace(GL_BACK);
    gl.BindVertexArray(gl_->vertex_array);
    for (std::size_t first = 0; first < raster_tiles_.size(); first += per_pass) {
      const std::size_t count = std::min(per_pass, raster_tiles_.size() - first);
      gl_->windows.write<Window>(windows_);
      gl_->windows.bind(1);
      gl_->raster.use();
      gl.Uniform1i(gl_->raster.uniform("parts"), static_cast<GLint>(parts));
      gl.Uniform1i(gl_->raster.uniform("first_tile"), static_cast<GLint>(first));
      gl.Uniform1f(gl_->raster.uniform("near_m"), kNearPlane_m);
      gl.Uniform2f(gl_->raster.uniform("tile_size"), static_cast<float>(width), static_cast<float>(height));
      gl.Uniform2f(gl_->raster.uniform("atlas_size"), static_cast<float>(columns * width),
                   static_cast<float>(rows * height));
      gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
      gl.Clear(GL_COLOR_BUFFER_BIT);
      // Back faces of a closed surface hide behind its front, unless the near plane opens it.
      draw_indices(0, closed_indices_, cull_ || !cut, count);
      draw_indices(closed_indices_, open_indices_, cull_, count);
      gl.MemoryBarrier(GL_FRAMEBUFFER_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT);

      gl_->windows.write<Window>(reduce_windows_);
      gl_->reduce.use();
      gl.BindTexture(GL_TEXTURE_2D, gl_->texture);
      gl.Uniform1i(gl_->reduce.uniform("first_job"), static_cast<GLint>(first));
      gl.Uniform1i(gl_->reduce.uniform("keep_picture"), keep_picture ? 1 : 0);
      gl.DispatchCompute(static_cast<GLuint>(count), 1, 1);
      gl.MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_FRAMEBUFFER_BARRIER_BIT);
    }
    gl.BindVertexArray(0);
    gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
  }

  void draw_indices(GLsizei first, GLsizei count, bool cull, std::size_t instances) const {
    if (count == 0) return;
    const auto& gl = gl_->gl;
    if (cull) {
      gl.Enable(GL_CULL_FACE);
    } else {
      gl.Disable(GL_CULL_FACE);
    }
    gl.DrawElementsInstanced(GL_TRIANGLES, count, GL_UNSIGNED_INT,
                             reinterpret_cast<const void*>(static_cast<std::uintptr_t>(first) * sizeof(std::uint32_t)),
                             static_cast<GLsizei>(instances));
  }

  // Grows the atlas by doubling, so that a wandering crop does not make a new one each frame.
  void reserve_texture(int width, int height) {
    if (width <= gl_->texture_width && height <= gl_->texture_height) return;
    const auto& gl = gl_->gl;
    const auto grown = [&](int have, int need) {
      int side = std::max(have, 256);
      while (side < need) side *= 2;
      return std::min(side, std::max(max_side_, need));
    };
    gl_->texture_width = grown(gl_->texture_width, width);
    gl_->texture_height = grown(gl_->texture_height, height);
    if (gl_->texture != 0) gl.DeleteTextures(1, &gl_->texture);
    gl.GenTextures(1, &gl_->texture);
    gl.BindTexture(GL_TEXTURE_2D, gl_->texture);
    gl.TexStorage2D(GL_TEXTURE_2D, 1, GL_R8, gl_->texture_width, gl_->texture_height);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    gl.BindFramebuffer(GL_FRAMEBUFFER, gl_->framebuffer);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, gl_->texture, 0);
  }

  // Drivers compile a shader when it first runs, and that takes longer than a frame: run all once.
  void warm_up() {
    const auto pass = options_.pass;
    std::vector<Eigen::Isometry3f> X_CB(model_.parts().size(),
                                        Eigen::Isometry3f(Eigen::Translation3f(0.0f, 0.0f, 1.0f)));
    for (const auto warmed : {AtlasPass::kRaster, pass}) {
      options_.pass = warmed;
      place_one(X_CB, 0);
      draw_tiles(false);
    }
    options_.pass = pass;
    check_alive();
  }

  // After a reset of the driver calls fail and counts mean nothing.
  void check_alive() const {
    if (const GLenum error = gl_->gl.GetError(); error != GL_NO_ERROR) {
      throw gl::ContextError(context_->description() + " fails to draw silhouettes, OpenGL error " +
                             std::to_string(error));
    }
  }
  [[noreturn]] void lost() const { throw gl::ContextError(context_->description() + " cannot be made current"); }

  contour::Model model_;
  std::vector<contour::Camera> cameras_;
  ObservationMasks masks_;
  AtlasOptions options_;
  std::unique_ptr<gl::Context> context_;
  std::unique_ptr<Objects> gl_;
  WorkerPool pool_;
  Division division_{};
  int max_side_ = 0;
  std::size_t max_texels_ = 0;  // of a buffer texture
  std::size_t max_tiles_ = 0;   // in flight at once
  GLsizei closed_indices_ = 0;
  GLsizei open_indices_ = 0;
  bool cull_ = false;
  bool masks_changed_ = true;

  // Filled anew for each batch; their memory stays.
  std::vector<Tile> tiles_;
  std::vector<Placement> placements_;
  std::vector<Placement> raster_placements_;
  std::vector<std::size_t> raster_tiles_;
  std::vector<Window> windows_;
  std::vector<Window> reduce_windows_;
  std::vector<Job> jobs_;
  std::vector<TileCounts> tile_counts_;
  std::vector<MaskPair> mask_words_;
};

}  // namespace

std::unique_ptr<SilhouetteScorer> make_atlas_scorer(const SilhouetteModel& model,
                                                    std::span<const PinholeIntrinsics> cameras,
                                                    std::unique_ptr<gl::Context> context, const AtlasOptions& options) {
  contour::check(model, cameras);
  return std::make_unique<AtlasScorer>(model, cameras, std::move(context), options);
}

}  // namespace bodyschema
