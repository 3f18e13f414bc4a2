#include "bodyschema/simulator/rasterizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace bodyschema::simulator {
namespace {

constexpr float kNear_m = 0.02f;
/// Faces that meet at a sharper angle than this keep their edge; others are shaded smoothly.
constexpr float kCreaseCosine = 0.64f;  // 50 degrees

std::vector<Eigen::Vector3f> smooth_corner_normals(const TriangleMesh& mesh) {
  const std::size_t triangles = mesh.triangles.size();
  std::vector<Eigen::Vector3f> face(triangles);  // not normalised: weighs by area
  std::vector<std::vector<std::uint32_t>> at_vertex(mesh.vertices.size());
  for (std::size_t f = 0; f < triangles; ++f) {
    const auto& t = mesh.triangles[f];
    const auto& a = mesh.vertices[t[0]];
    face[f] = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (const auto v : t) at_vertex[v].push_back(static_cast<std::uint32_t>(f));
  }
  std::vector<Eigen::Vector3f> corners(3 * triangles, Eigen::Vector3f::UnitZ());
  for (std::size_t f = 0; f < triangles; ++f) {
    const float length = face[f].norm();
    if (!(length > 0.0f)) continue;
    const Eigen::Vector3f own = face[f] / length;
    for (std::size_t k = 0; k < 3; ++k) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (const auto g : at_vertex[mesh.triangles[f][k]]) {
        if (face[g].dot(own) >= kCreaseCosine * face[g].norm()) sum += face[g];
      }
      const float n = sum.norm();
      corners[3 * f + k] = n > 0.0f ? Eigen::Vector3f(sum / n) : own;
    }
  }
  return corners;
}

}  // namespace

Rasterizer::Rasterizer(std::vector<PaintedPart> parts, int width, int height, int supersampling)
    : parts_(std::move(parts)), width_(width), height_(height), samples_(supersampling),
      sample_width_(width * supersampling), sample_height_(height * supersampling) {
  if (width < 1 || height < 1 || supersampling < 1 || supersampling > 8) {
    throw std::invalid_argument("Rasterizer: picture size and supersampling (1 to 8) must be positive");
  }
  if (parts_.size() > 255) throw std::invalid_argument("Rasterizer: at most 255 parts");
  std::size_t most_vertices = 0;
  for (auto& part : parts_) {
    corner_normals_.push_back(smooth_corner_normals(part.mesh));
    most_vertices = std::max(most_vertices, part.mesh.vertices.size());
    Eigen::Vector3f low = Eigen::Vector3f::Zero(), high = low;
    if (!part.mesh.vertices.empty()) low = high = part.mesh.vertices.front();
    for (const auto& p : part.mesh.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    balls_.push_back({0.5f * (low + high), 0.5f * (high - low).norm()});
    if (part.paints.empty()) {
      part.paints = {Paint{.albedo = part.albedo}};
      part.paint_of_triangle.assign(part.mesh.triangles.size(), 0);
    }
    if (part.paint_of_triangle.size() != part.mesh.triangles.size()) {
      throw std::invalid_argument("Rasterizer: every triangle needs a paint");
    }
    first_paint_.push_back(paints_.size());
    for (const auto& paint : part.paints) {
      paints_.push_back(paint);
      part_of_paint_.push_back(static_cast<std::uint8_t>(corner_normals_.size() - 1));
      any_gloss_ |= paint.gloss > 0.0f;
    }
  }
  if (paints_.size() > 65535) throw std::invalid_argument("Rasterizer: at most 65535 paints");
  const auto samples = static_cast<std::size_t>(sample_width_) * static_cast<std::size_t>(sample_height_);
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  inverse_depth_.assign(samples, 0.0f);
  paint_.assign(samples, 0);
  shade_.assign(samples, 0.0f);
  if (any_gloss_) shine_.assign(samples, 0.0f);
  points_C_.resize(most_vertices);
  projected_.resize(most_vertices);
  coverage_.assign(pixels, 0.0f);
  colour_.assign(3 * pixels, 0.0f);
}

Rasterizer::Corner Rasterizer::project(const Eigen::Vector3f& p_C, const CameraModel& camera) const {
  // The lens on the normalised coordinates, then pixels, then samples: sample s of a row sits at pixel coordinate
  // (s + 0.5) / samples - 0.5.
  const float w = 1.0f / p_C.z();
  float x = p_C.x() * w;
  float y = p_C.y() * w;
  if (camera.has_distortion()) {
    const Eigen::Vector2d bent = bend(camera.distortion, x, y);
    x = static_cast<float>(bent.x());
    y = static_cast<float>(bent.y());
  }
  const auto& k = camera.intrinsics;
  const auto n = static_cast<float>(samples_);
  return {(static_cast<float>(k.fx) * x + static_cast<float>(k.cx) + 0.5f) * n - 0.5f,
          (static_cast<float>(k.fy) * y + static_cast<float>(k.cy) + 0.5f) * n - 0.5f, w};
}

bool Rasterizer::out_of_sight(std::size_t part, const Eigen::Isometry3f& X_CB, const Lens::Extent& e) const {
  const Eigen::Vector3f c = X_CB * balls_[part].centre_B;
  const float r = balls_[part].radius;
  if (c.z() + r < kNear_m) return true;
  const auto beyond = [&](float across, float bound) {  // of the plane across = bound * z, on its far side
    return across - bound * c.z() > r * std::sqrt(1.0f + bound * bound);
  };
  return beyond(c.x(), e.x_max) || beyond(-c.x(), -e.x_min) || beyond(c.y(), e.y_max) || beyond(-c.y(), -e.y_min);
}

template <class Light>
void Rasterizer::draw_triangle(const Corner& a, const Corner& b, const Corner& c, bool cull, std::uint16_t paint,
                               bool glossy, const Light& light) {
  // Image y runs down, so counter-clockwise outside faces have negative area here.
  const float area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(std::abs(area) > 1e-9f) || !std::isfinite(area)) return;
  if (cull && area > 0.0f) return;

  const float y_min = std::min({a.y, b.y, c.y});
  const float y_max = std::max({a.y, b.y, c.y});
  const auto first_row = static_cast<float>(band_t0_);
  const auto last_row = static_cast<float>(band_t1_ - 1);
  if (!(y_max >= first_row && y_min <= last_row)) return;
  const int row0 = static_cast<int>(std::ceil(std::max(y_min, first_row)));
  const int row1 = static_cast<int>(std::floor(std::min(y_max, last_row)));

  // Attributes are affine in the picture: 1 / depth exactly, the shade near enough. Worked out when a sample is found
  // within: small triangles mostly fall between samples.
  using Plane = std::array<float, 3>;
  Plane gw{}, gs{}, gh{};
  bool ready = false;
  const auto prepare = [&] {
    ready = true;
    const float inverse_area = 1.0f / area;
    const auto gradient = [&](float va, float vb, float vc) {
      const float gx = ((vb - va) * (c.y - a.y) - (vc - va) * (b.y - a.y)) * inverse_area;
      const float gy = ((vc - va) * (b.x - a.x) - (vb - va) * (c.x - a.x)) * inverse_area;
      return Plane{gx, gy, va - gx * a.x - gy * a.y};
    };
    const std::array<Lit, 3> lit = light();
    gw = gradient(a.w, b.w, c.w);
    gs = gradient(lit[0].shade, lit[1].shade, lit[2].shade);
    if (glossy) gh = gradient(lit[0].shine, lit[1].shine, lit[2].shine);
  };

  // Each edge bounds x on one side; both triangles of an edge find the same crossing, so no
  // sample falls between them.
  struct Edge {
    float y0, y1, x0, slope;
  };
  std::array<Edge, 3> edges;
  int count = 0;
  const auto add = [&](const Corner& p, const Corner& q) {
    const Corner& top = (p.y < q.y || (p.y == q.y && p.x < q.x)) ? p : q;
    const Corner& bottom = &top == &p ? q : p;
    if (top.y == bottom.y) return;
    edges[static_cast<std::size_t>(count++)] = {top.y, bottom.y, top.x, (bottom.x - top.x) / (bottom.y - top.y)};
  };
  add(a, b);
  add(b, c);
  add(c, a);

  const auto last_column = static_cast<float>(sample_width_ - 1);
  for (int row = row0; row <= row1; ++row) {
    const auto y = static_cast<float>(row);
    float left = std::numeric_limits<float>::max();
    float right = std::numeric_limits<float>::lowest();
    for (int k = 0; k < count; ++k) {
      const Edge& e = edges[static_cast<std::size_t>(k)];
      if (y < e.y0 || y > e.y1) continue;
      const float x = e.x0 + (y - e.y0) * e.slope;
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (!(right >= 0.0f && left <= last_column)) continue;
    const int begin = static_cast<int>(std::ceil(std::max(left, 0.0f)));
    const int end = static_cast<int>(std::floor(std::min(right, last_column)));
    if (begin > end) continue;
    if (!ready) prepare();
    const auto base = static_cast<std::size_t>(row) * static_cast<std::size_t>(sample_width_);
    float* depth = inverse_depth_.data() + base;
    float* shade = shade_.data() + base;
    std::uint16_t* owner = paint_.data() + base;
    const float w_row = gw[1] * y + gw[2];
    const float s_row = gs[1] * y + gs[2];
    for (int s = begin; s <= end; ++s) {
      const float w = gw[0] * static_cast<float>(s) + w_row;
      if (w > depth[s]) {
        depth[s] = w;
        shade[s] = gs[0] * static_cast<float>(s) + s_row;
        owner[s] = paint;
        if (glossy) shine_[base + static_cast<std::size_t>(s)] = gh[0] * static_cast<float>(s) + gh[1] * y + gh[2];
      }
    }
    s0_ = std::min(s0_, begin);
    s1_ = std::max(s1_, end + 1);
    t0_ = std::min(t0_, row);
    t1_ = std::max(t1_, row + 1);
  }
}

void Rasterizer::clear() {
  for (const Change& change : changes_) weight_[change.to] = 1.0f;
  changes_.clear();
  if (!box_.empty()) {
    for (int t = t0_; t < t1_; ++t) {
      const auto base = static_cast<std::size_t>(t) * static_cast<std::size_t>(sample_width_);
      std::fill(inverse_depth_.begin() + static_cast<std::ptrdiff_t>(base) + s0_,
                inverse_depth_.begin() + static_cast<std::ptrdiff_t>(base) + s1_, 0.0f);
    }
    for (int v = box_.v0; v < box_.v1; ++v) {
      const auto base = static_cast<std::ptrdiff_t>(v) * width_;
      std::fill(coverage_.begin() + base + box_.u0, coverage_.begin() + base + box_.u1, 0.0f);
      std::fill(colour_.begin() + 3 * (base + box_.u0), colour_.begin() + 3 * (base + box_.u1), 0.0f);
    }
  }
  s0_ = sample_width_;
  t0_ = sample_height_;
  s1_ = 0;
  t1_ = 0;
  box_ = {};
}

void Rasterizer::draw(std::span<const Eigen::Isometry3f> X_CB, const CameraModel& camera, const Lighting& light,
                      float dilation_px) {
  draw_samples(X_CB, camera, light, dilation_px, {0, height_, nullptr, {}});
  if (s1_ > s0_) resolve();
}

void Rasterizer::draw_samples(std::span<const Eigen::Isometry3f> X_CB, const CameraModel& camera, const Lighting& light,
                              float dilation_px, const Cut& cut) {
  if (X_CB.size() != parts_.size()) throw std::invalid_argument("Rasterizer: one pose per part");
  clear();
  // A dilated outline comes from beside the rows asked for.
  const int margin = dilation_px == 0.0f ? 0 : static_cast<int>(std::ceil(std::abs(dilation_px))) + 2;
  band_t0_ = std::max(0, cut.v0 - margin) * samples_;
  band_t1_ = std::min(height_, cut.v1 + margin) * samples_;
  for (std::size_t p = 0; p < parts_.size(); ++p) {
    const PaintedPart& part = parts_[p];
    if (!cut.hidden.empty() && cut.hidden[p] != 0) continue;
    if (margin == 0 && cut.extent != nullptr && out_of_sight(p, X_CB[p], *cut.extent)) continue;
    const auto& vertices = part.mesh.vertices;
    bool any_in_front = false;
    bool all_in_front = true;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      points_C_[i] = X_CB[p] * vertices[i];
      const bool in_front = points_C_[i].z() >= kNear_m;
      any_in_front |= in_front;
      all_in_front &= in_front;
      if (in_front) projected_[i] = project(points_C_[i], camera);
    }
    if (!any_in_front) continue;
    const Eigen::Vector3f to_lamp_B = X_CB[p].linear().transpose() * light.to_lamp_C;
    const Eigen::Vector3f eye_B = X_CB[p].linear().transpose() * -X_CB[p].translation();
    const auto& normals = corner_normals_[p];
    const std::size_t first_paint = first_paint_[p];
    for (std::size_t f = 0; f < part.mesh.triangles.size(); ++f) {
      const auto& t = part.mesh.triangles[f];
      const std::size_t paint = first_paint + part.paint_of_triangle[f];
      const bool glossy = paints_[paint].gloss > 0.0f;
      const auto lit = [&](std::size_t k) {
        Lit result;
        const Eigen::Vector3f& normal = normals[3 * f + k];
        result.shade = light.ambient + light.diffuse * std::max(0.0f, normal.dot(to_lamp_B));
        if (glossy) {
          const Eigen::Vector3f to_eye_B = (eye_B - vertices[t[k]]).normalized();
          result.shine = normal.dot((to_lamp_B + to_eye_B).normalized());
        }
        return result;
      };
      if (all_in_front ||
          (points_C_[t[0]].z() >= kNear_m && points_C_[t[1]].z() >= kNear_m && points_C_[t[2]].z() >= kNear_m)) {
        // Most triangles face away or fall between samples: out before anything is worked out.
        const Corner& a = projected_[t[0]];
        const Corner& b = projected_[t[1]];
        const Corner& c = projected_[t[2]];
        if (part.cull_back && (b.x - a.x) * (c.y - a.y) > (c.x - a.x) * (b.y - a.y)) continue;
        if (std::ceil(std::min({a.x, b.x, c.x})) > std::floor(std::max({a.x, b.x, c.x})) ||
            std::ceil(std::min({a.y, b.y, c.y})) > std::floor(std::max({a.y, b.y, c.y}))) {
          continue;
        }
        draw_triangle(a, b, c, part.cull_back, static_cast<std::uint16_t>(paint), glossy, [&] {
          return std::array<Lit, 3>{lit(0), lit(1), lit(2)};
        });
        continue;
      }
      // Cut at the near plane (Sutherland-Hodgman): three or four corners remain.
      std::array<ClipVertex, 4> polygon;
      std::size_t count = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t next = (k + 1) % 3;
        const Eigen::Vector3f& p0 = points_C_[t[k]];
        const Eigen::Vector3f& p1 = points_C_[t[next]];
        const bool in0 = p0.z() >= kNear_m;
        const bool in1 = p1.z() >= kNear_m;
        const Lit lit0 = lit(k);
        if (in0) polygon[count++] = {p0, lit0};
        if (in0 != in1) {
          const float x = (kNear_m - p0.z()) / (p1.z() - p0.z());
          const Lit lit1 = lit(next);
          polygon[count++] = {p0 + x * (p1 - p0),
                              {lit0.shade + x * (lit1.shade - lit0.shade), lit0.shine + x * (lit1.shine - lit0.shine)}};
        }
      }
      if (count < 3) continue;
      std::array<Corner, 4> corner;
      for (std::size_t k = 0; k < count; ++k) corner[k] = project(polygon[k].p_C, camera);
      for (std::size_t k = 2; k < count; ++k) {
        draw_triangle(corner[0], corner[k - 1], corner[k], part.cull_back, static_cast<std::uint16_t>(paint), glossy,
                      [&] {
                        return std::array<Lit, 3>{polygon[0].lit, polygon[k - 1].lit, polygon[k].lit};
                      });
      }
    }
  }
  if (s1_ > s0_ && dilation_px != 0.0f) dilate(dilation_px);
  if (s1_ > s0_)
    box_ = {s0_ / samples_, t0_ / samples_, (s1_ + samples_ - 1) / samples_, (t1_ + samples_ - 1) / samples_};
}

/// Grows or shrinks the covered samples by an exact Euclidean distance (two passes of lower
/// envelopes, Felzenszwalb and Huttenlocher 2012). New samples take the paint of the nearest one.
void Rasterizer::dilate(float dilation_px) {
  const float radius = std::abs(dilation_px) * static_cast<float>(samples_);
  const int margin = static_cast<int>(std::ceil(radius)) + 2;
  const int x0 = std::max(0, s0_ - margin);
  const int x1 = std::min(sample_width_, s1_ + margin);
  const int y0 = std::max(0, t0_ - margin);
  const int y1 = std::min(sample_height_, t1_ + margin);
  const int columns = x1 - x0;
  const int rows = y1 - y0;
  const auto cells = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const bool grow = dilation_px > 0.0f;
  constexpr float kFar = 1e12f;
  distance_.assign(cells, kFar);
  nearest_.assign(cells, -1);
  const auto sample = [&](int x, int y) {
    return static_cast<std::size_t>(y + y0) * static_cast<std::size_t>(sample_width_) +
           static_cast<std::size_t>(x + x0);
  };
  // Columns: distance to the nearest source sample of the column. Sources are covered samples when
  // growing and free ones when shrinking.
  for (int x = 0; x < columns; ++x) {
    int last = -1;
    const auto visit = [&](int y) {
      if ((inverse_depth_[sample(x, y)] > 0.0f) == grow) last = y;
      const auto cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
      if (last >= 0) {
        const auto d = static_cast<float>((y - last) * (y - last));
        if (d < distance_[cell]) {
          distance_[cell] = d;
          nearest_[cell] = last;
        }
      }
    };
    for (int y = 0; y < rows; ++y) visit(y);
    last = -1;
    for (int y = rows - 1; y >= 0; --y) visit(y);
  }
  // Rows: only samples within the radius matter, so a window replaces the full envelope. A sample
  // as far away as the new outline gets a share of it, so that the outline is placed finer than the
  // samples lie. From the outline to the nearest source sample it is half a sample where the outline
  // runs along the grid and less elsewhere; less still from farther away, where more samples compete to be
  // the nearest. Measured on discs of 6 to 30 px: within 0.015 px from 0.4 to 2 px of dilation.
  const float to_outline = std::max(0.2f, 0.39f - 0.021f * radius);
  const int reach = static_cast<int>(std::ceil(radius)) + 1;
  changes_.clear();
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      const std::size_t to = sample(x, y);
      if ((inverse_depth_[to] > 0.0f) == grow) continue;
      float best = kFar;
      int best_x = -1;
      for (int dx = -reach; dx <= reach; ++dx) {
        const int xx = x + dx;
        if (xx < 0 || xx >= columns) continue;
        const auto cell =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(xx);
        const float d = distance_[cell] + static_cast<float>(dx * dx);
        if (d < best) {
          best = d;
          best_x = xx;
        }
      }
      const float share = std::clamp(radius + to_outline + 0.5f - std::sqrt(best), 0.0f, 1.0f);
      if (share <= 0.0f || best_x < 0) continue;
      const auto cell =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(best_x);
      changes_.push_back({to, sample(best_x, nearest_[cell]), grow ? share : 1.0f - share});
    }
  }
  if (weight_.empty()) weight_.assign(inverse_depth_.size(), 1.0f);
  for (const Change& change : changes_) {
    weight_[change.to] = change.weight;
    if (!grow) continue;
    inverse_depth_[change.to] = inverse_depth_[change.from];
    shade_[change.to] = shade_[change.from];
    paint_[change.to] = paint_[change.from];
    if (any_gloss_) shine_[change.to] = shine_[change.from];
  }
  if (grow) {
    s0_ = x0;
    s1_ = x1;
    t0_ = y0;
    t1_ = y1;
  }
}

void Rasterizer::resolve() {
  const float share = 1.0f / static_cast<float>(samples_ * samples_);
  const bool dilated = !changes_.empty();
  std::vector<Eigen::Vector3f>& paint = resolved_paint_;
  paint.resize(paints_.size());
  for (std::size_t p = 0; p < paints_.size(); ++p) paint[p] = 255.0f * share * paints_[p].albedo;
  for (int v = box_.v0; v < box_.v1; ++v) {
    for (int u = box_.u0; u < box_.u1; ++u) {
      float covered = 0.0f;
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int t = v * samples_; t < (v + 1) * samples_; ++t) {
        const auto base = static_cast<std::size_t>(t) * static_cast<std::size_t>(sample_width_);
        for (int s = u * samples_; s < (u + 1) * samples_; ++s) {
          const auto i = base + static_cast<std::size_t>(s);
          if (inverse_depth_[i] > 0.0f) {
            const float weight = dilated ? weight_[i] : 1.0f;
            covered += weight;
            sum += weight * shade_[i] * paint[paint_[i]];
          }
        }
      }
      const auto pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u);
      coverage_[pixel] = covered * share;
      for (int k = 0; k < 3; ++k) colour_[3 * pixel + static_cast<std::size_t>(k)] = sum[k];
    }
  }
}

BinaryMask Rasterizer::mask() const {
  BinaryMask mask(width_, height_);
  for (int v = box_.v0; v < box_.v1; ++v) {
    for (int u = box_.u0; u < box_.u1; ++u) {
      bool covered = false;
      if (samples_ % 2 == 1) {
        covered = part_at(u, v) >= 0;
      } else {
        covered =
            coverage_[static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(u)] >=
            0.5f;
      }
      if (covered) mask.set(u, v);
    }
  }
  return mask;
}

int Rasterizer::part_at(int u, int v) const {
  const int s = u * samples_ + samples_ / 2;
  const int t = v * samples_ + samples_ / 2;
  const auto i = static_cast<std::size_t>(t) * static_cast<std::size_t>(sample_width_) + static_cast<std::size_t>(s);
  const bool covered = inverse_depth_[i] > 0.0f && (changes_.empty() || weight_[i] >= 0.5f);
  return covered ? static_cast<int>(part_of_paint_[paint_[i]]) : -1;
}

}  // namespace bodyschema::simulator
