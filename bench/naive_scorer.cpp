#include "naive_scorer.hpp"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <vector>

#include "bodyschema/gl/functions.hpp"
#include "bodyschema/gl/program.hpp"

namespace bodyschema {
namespace {

constexpr const char* kVertex = R"(#version 430 core
layout(location = 0) in vec3 position;
uniform mat4 clip_from_part;
void main() { gl_Position = clip_from_part * vec4(position, 1.0); }
)";
constexpr const char* kFragment = R"(#version 430 core
layout(location = 0) out vec4 colour;
void main() { colour = vec4(1.0); }
)";
constexpr double kNear_m = 0.01;
constexpr double kFar_m = 10.0;

struct PartBuffers {
  GLuint vertex_array = 0;
  GLuint buffers[2] = {0, 0};
  GLsizei indices = 0;
};

class NaiveScorer final : public SilhouetteScorer {
 public:
  NaiveScorer(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras,
              std::unique_ptr<gl::Context> context)
      : cameras_(cameras.begin(), cameras.end()), context_(std::move(context)) {
    const gl::Context::Current current(*context_);
    const auto& gl = context_->functions();
    program_ = std::make_unique<gl::Program>(
        gl, "naive",
        std::initializer_list<gl::Program::Stage>{{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, kFragment}});
    for (const auto& mesh : model.parts) {
      PartBuffers part;
      part.indices = static_cast<GLsizei>(3 * mesh.triangles.size());
      gl.GenVertexArrays(1, &part.vertex_array);
      gl.BindVertexArray(part.vertex_array);
      gl.GenBuffers(2, part.buffers);
      gl.BindBuffer(GL_ARRAY_BUFFER, part.buffers[0]);
      gl.BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.vertices.size() * 12), mesh.vertices.data(),
                    GL_STATIC_DRAW);
      gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, part.buffers[1]);
      gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(mesh.triangles.size() * 12), mesh.triangles.data(),
                    GL_STATIC_DRAW);
      gl.EnableVertexAttribArray(0);
      gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 12, nullptr);
      parts_.push_back(part);
    }
    tile_width_ = tile_height_ = 0;
    for (const auto& k : cameras_) {
      tile_width_ = std::max(tile_width_, k.width);
      tile_height_ = std::max(tile_height_, k.height);
      observed_.emplace_back(static_cast<std::size_t>(k.width * k.height));
    }
    GLint side = 0;
    gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
    columns_ = std::min(20, side / tile_width_);
    rows_ = std::min(20, side / tile_height_);
    gl.GenRenderbuffers(2, renderbuffers_);
    gl.GenFramebuffers(1, &framebuffer_);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    const GLenum formats[] = {GL_RGBA8, GL_DEPTH_COMPONENT24};
    const GLenum points[] = {GL_COLOR_ATTACHMENT0, GL_DEPTH_ATTACHMENT};
    for (int i = 0; i < 2; ++i) {
      gl.BindRenderbuffer(GL_RENDERBUFFER, renderbuffers_[i]);
      gl.RenderbufferStorage(GL_RENDERBUFFER, formats[i], columns_ * tile_width_, rows_ * tile_height_);
      gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, points[i], GL_RENDERBUFFER, renderbuffers_[i]);
    }
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
      throw gl::ContextError("naive: the framebuffer is incomplete");
    }
    pixels_.resize(static_cast<std::size_t>(columns_ * tile_width_ * rows_ * tile_height_));
  }

  ~NaiveScorer() override {
    const gl::Context::Current current(*context_);
    const auto& gl = context_->functions();
    for (auto& part : parts_) {
      gl.DeleteVertexArrays(1, &part.vertex_array);
      gl.DeleteBuffers(2, part.buffers);
    }
    gl.DeleteFramebuffers(1, &framebuffer_);
    gl.DeleteRenderbuffers(2, renderbuffers_);
    program_.reset();
  }

  void set_observation(std::span<const ObservedSilhouette> observed) override {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      for (int v = 0; v < cameras_[c].height; ++v) {
        for (int u = 0; u < cameras_[c].width; ++u) {
          observed_[c][static_cast<std::size_t>(v * cameras_[c].width + u)] = observed[c].mask.at(u, v) ? 255 : 0;
        }
      }
    }
  }

  void score(std::span<const Eigen::Isometry3f> X_CB, std::span<SilhouetteCounts> counts, std::uint32_t) override {
    const gl::Context::Current current(*context_);
    const auto& gl = context_->functions();
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_SCISSOR_TEST);
    gl.ClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    program_->use();
    const GLint uniform = program_->uniform("clip_from_part");
    const auto tiles = static_cast<std::size_t>(columns_ * rows_);
    for (std::size_t first = 0; first < counts.size(); first += tiles) {
      const std::size_t last = std::min(first + tiles, counts.size());
      gl.Scissor(0, 0, columns_ * tile_width_, rows_ * tile_height_);
      gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
      for (std::size_t i = first; i < last; ++i) {
        const auto& k = cameras_[i % cameras_.size()];
        const int x = static_cast<int>(i - first) % columns_ * tile_width_;
        const int y = static_cast<int>(i - first) / columns_ * tile_height_;
        gl.Viewport(x, y, k.width, k.height);
        gl.Scissor(x, y, k.width, k.height);
        // OpenCV's pixel centres to window coordinates, rows upwards in the tile.
        Eigen::Matrix4d projection = Eigen::Matrix4d::Zero();
        projection(0, 0) = 2.0 * k.fx / k.width;
        projection(0, 2) = 2.0 * (k.cx + 0.5) / k.width - 1.0;
        projection(1, 1) = 2.0 * k.fy / k.height;
        projection(1, 2) = 2.0 * (k.cy + 0.5) / k.height - 1.0;
        projection(2, 2) = (kFar_m + kNear_m) / (kFar_m - kNear_m);
        projection(2, 3) = -2.0 * kFar_m * kNear_m / (kFar_m - kNear_m);
        projection(3, 2) = 1.0;
        for (std::size_t p = 0; p < parts_.size(); ++p) {
          const Eigen::Matrix4f m = (projection * X_CB[i * parts_.size() + p].matrix().cast<double>()).cast<float>();
          gl.UniformMatrix4fv(uniform, 1, GL_FALSE, m.data());
          gl.BindVertexArray(parts_[p].vertex_array);
          gl.DrawElements(GL_TRIANGLES, parts_[p].indices, GL_UNSIGNED_INT, nullptr);
        }
      }
      const int width = columns_ * tile_width_;
      gl.ReadPixels(0, 0, width, rows_ * tile_height_, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
      for (std::size_t i = first; i < last; ++i) {
        const std::size_t camera = i % cameras_.size();
        const auto& k = cameras_[camera];
        const int x = static_cast<int>(i - first) % columns_ * tile_width_;
        const int y = static_cast<int>(i - first) / columns_ * tile_height_;
        SilhouetteCounts count;
        for (int v = 0; v < k.height; ++v) {
          const std::uint32_t* drawn = pixels_.data() + static_cast<std::ptrdiff_t>(y + v) * width + x;
          const std::uint8_t* seen = observed_[camera].data() + static_cast<std::ptrdiff_t>(v) * k.width;
          for (int u = 0; u < k.width; ++u) {
            const bool a = drawn[u] != 0;
            const bool b = seen[u] != 0;
            count.predicted += a ? 1u : 0u;
            count.observed += b ? 1u : 0u;
            count.intersection += a && b ? 1u : 0u;
          }
        }
        counts[i] = count;
      }
    }
  }

  BinaryMask render(std::span<const Eigen::Isometry3f>, std::size_t) override {
    throw std::logic_error("naive: only counts are needed");
  }
  [[nodiscard]] std::string description() const override { return "naive on " + context_->description(); }

 private:
  std::vector<PinholeIntrinsics> cameras_;
  std::unique_ptr<gl::Context> context_;
  std::unique_ptr<gl::Program> program_;
  std::vector<PartBuffers> parts_;
  std::vector<std::vector<std::uint8_t>> observed_;
  std::vector<std::uint32_t> pixels_;
  GLuint renderbuffers_[2] = {0, 0};
  GLuint framebuffer_ = 0;
  int tile_width_ = 0, tile_height_ = 0, columns_ = 0, rows_ = 0;
};

}  // namespace

std::unique_ptr<SilhouetteScorer> make_naive_scorer(const SilhouetteModel& model,
                                                    std::span<const PinholeIntrinsics> cameras,
                                                    std::unique_ptr<gl::Context> context) {
  return std::make_unique<NaiveScorer>(model, cameras, std::move(context));
}

}  // namespace bodyschema
