#include "bodyschema/silhouette/contour_points.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contour_model.hpp"

namespace bodyschema {
namespace {

// Background narrower than this between two parts is a crack, not a place where the eye sees an
// outline; cover thinner than this is a rounding error of two nearly edge-on triangles.
constexpr double kNarrowestGap_px = 1.0;
constexpr double kThinnestCover_px = 0.05;

// What every line is asked about, apart from the rest: of a heavy mesh most segments cross none.
struct SegmentEnds {
  Eigen::Vector2d from, to;  // px
};

struct OutlineSegment {
  Eigen::Vector3f from_C, to_C;
  int weight = 0;
  std::uint32_t part = 0;
  bool real = true;
};

// Where a segment meets a line of the grid.
struct Crossing {
  std::int32_t line = 0;
  std::uint32_t segment = 0;
  double at = 0.0;  // along the line, px
  int weight = 0;   // change of the winding number on passing it
};

}  // namespace

// The outline is sampled where it crosses the lines of a grid, `spacing` apart in both directions.
// On such a line the question is one-dimensional and answered without a raster: crossings sorted
// along the line, winding numbers summed from one to the next, and the outline is where the sum
// leaves or reaches zero. A segment is sampled by the family of lines it is steeper to.
struct ContourExtractor::Impl {
  Impl(const SilhouetteModel& silhouette_model, std::span<const PinholeIntrinsics> intrinsics)
      : shared_model(std::make_shared<const contour::Model>(silhouette_model)), model(*shared_model),
        kernel(contour::best_kernel()), found(model.max_edges() + contour::kLanes), vertices(model.max_vertices()) {
    for (const auto& k : intrinsics) cameras.emplace_back(k);
  }
  /// With the same meshes, and room of its own to work in.
  Impl(const Impl& other)
      : shared_model(other.shared_model), model(*shared_model), cameras(other.cameras), kernel(other.kernel),
        found(other.found.size()), vertices(other.vertices.size()) {}

  std::shared_ptr<const contour::Model> shared_model;
  const contour::Model& model;
  std::vector<contour::Camera> cameras;
  const contour::Kernel& kernel;
  std::vector<std::uint32_t> found;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<SegmentEnds> ends;
  std::vector<OutlineSegment> segments;  // in the order of their ends
  std::vector<Crossing> crossings, by_line;
  std::vector<std::size_t> line_ends;  // of the crossings of a line, once they are sorted
  std::vector<ContourPoint> points;

  void collect(std::span<const Eigen::Isometry3f> X_CB, const contour::Camera& camera) {
    ends.clear();
    segments.clear();
    const auto add = [&](const contour::Segment& s, std::uint32_t part) {
      ends.push_back(
          {camera.intrinsics.project(s.from_C.cast<double>()), camera.intrinsics.project(s.to_C.cast<double>())});
      segments.push_back({s.from_C, s.to_C, s.weight, part, s.real});
    };
    for (std::uint32_t p = 0; p < model.parts().size(); ++p) {
      const contour::Part& part = model.parts()[p];
      const contour::PlacedPart placed = contour::place(part, camera, X_CB[p]);
      if (placed.view == contour::View::kInvisible) continue;
      if (placed.view == contour::View::kCut) {
        contour::for_each_cut_segment(part, model.culling(), placed, vertices,
                                      [&](const contour::Segment& s) { add(s, p); });
        continue;
      }
      const auto in_camera = [&](const float* p_B) -> Eigen::Vector3f {
        return placed.R_CB * Eigen::Map<const Eigen::Vector3f>(p_B) + placed.p_CB;
      };
      for (const auto& run : part.runs) {
        const std::int32_t count = kernel.find(run, placed.camera_B, found.data());
        for (std::int32_t i = 0; i < count; ++i) {
          // Edges on the contour lie scattered over the memory of a heavy mesh.
          constexpr std::int32_t kAhead = 12;
          if (i + kAhead < count) __builtin_prefetch(&run.ends[found[static_cast<std::size_t>(i + kAhead)] >> 1]);
          const std::uint32_t entry = found[static_cast<std::size_t>(i)];
          const contour::EdgeEnds& edge = run.ends[entry >> 1];
          const int weight = (entry & 1u) != 0 ? run.weight : -run.weight;
          add({in_camera(edge.from), in_camera(edge.to), weight, true}, p);
        }
      }
    }
  }

  // The first line at or beyond a place in the picture: std::ceil, which is a call where the processor may be an old
  // one.
  static double first_line(double place) {
    if (!(place > 0.0)) return 0.0;
    const auto below = static_cast<double>(static_cast<std::int32_t>(place));
    return below < place ? below + 1.0 : below;
  }

  // axis 0: lines of constant u, crossed by running along v; axis 1 the other way round.
  void sample(int axis, const PinholeIntrinsics& k, double spacing, double margin) {
    const int other = 1 - axis;
    const int size = axis == 0 ? k.width : k.height;
    const double last_line = std::floor((size - 1) / spacing);
    crossings.clear();
    for (std::uint32_t s = 0; s < ends.size(); ++s) {
      const SegmentEnds& segment = ends[s];
      const double a = segment.from[axis];
      const double b = segment.to[axis];
      const double low = std::min(a, b);
      const double high = std::max(a, b);
      if (!(high > 0.0) || !(low < size)) continue;
      for (double line = first_line(low / spacing); line <= last_line && line * spacing < high; line += 1.0) {
        const double t = (line * spacing - a) / (b - a);
        const int weight = segments[s].weight;
        crossings.push_back({static_cast<std::int32_t>(line), s,
                             segment.from[other] + t * (segment.to[other] - segment.from[other]),
                             a < b ? weight : -weight});
      }
    }
    sort_crossings(static_cast<std::size_t>(last_line) + 1);

    // A run of cover on a line: from crossing `begin` to crossing `end`.
    for (std::size_t i = 0; i < crossings.size();) {
      const std::int32_t line = crossings[i].line;
      double covered_until = -1e30;
      while (i < crossings.size() && crossings[i].line == line) {
        const std::size_t begin = i;
        int winding = 0;
        do {
          winding += crossings[i++].weight;
        } while (winding != 0 && i < crossings.size() && crossings[i].line == line);
        const std::size_t end = i - 1;
        if (winding != 0) break;  // cannot happen for outlines that close
        if (crossings[end].at - crossings[begin].at < kThinnestCover_px) continue;
        const bool more = i < crossings.size() && crossings[i].line == line;
        const double next = more ? crossings[i].at : 1e30;
        if (crossings[begin].at - covered_until > kNarrowestGap_px) {
          emit(crossings[begin], axis, -1.0, k, spacing, margin);
        }
        if (next - crossings[end].at > kNarrowestGap_px) {
          emit(crossings[end], axis, 1.0, k, spacing, margin);
        }
        covered_until = crossings[end].at;
      }
    }
  }

  /// By line, then along it. There are many short lines: they are filled first and sorted one by one.
  void sort_crossings(std::size_t lines) {
    line_ends.assign(lines + 1, 0);
    for (const Crossing& c : crossings) ++line_ends[static_cast<std::size_t>(c.line) + 1];
    for (std::size_t line = 1; line <= lines; ++line) line_ends[line] += line_ends[line - 1];
    by_line.resize(crossings.size());
    for (const Crossing& c : crossings) by_line[line_ends[static_cast<std::size_t>(c.line)]++] = c;
    std::size_t begin = 0;
    for (std::size_t line = 0; line < lines; ++line) {
      std::sort(
          by_line.begin() + static_cast<std::ptrdiff_t>(begin),
          by_line.begin() + static_cast<std::ptrdiff_t>(line_ends[line]),
          [](const Crossing& x, const Crossing& y) { return x.at != y.at ? x.at < y.at : x.segment < y.segment; });
      begin = line_ends[line];
    }
    crossings.swap(by_line);
  }

  void emit(const Crossing& crossing, int axis, double outward, const PinholeIntrinsics& k, double spacing,
            double margin) {
    const OutlineSegment& segment = segments[crossing.segment];
    if (!segment.real) return;
    const Eigen::Vector2d& from = ends[crossing.segment].from;
    const Eigen::Vector2d along = ends[crossing.segment].to - from;
    const int other = 1 - axis;
    const double run = std::abs(along[axis]);
    const double rise = std::abs(along[other]);
    if (axis == 0 ? run < rise : run <= rise) return;  // the other family's
    const double t = (crossing.line * spacing - from[axis]) / along[axis];
    Eigen::Vector2d pixel;
    pixel[axis] = crossing.line * spacing;
    pixel[other] = crossing.at;
    if (!(pixel.x() >= margin - 0.5 && pixel.x() <= k.width - 0.5 - margin && pixel.y() >= margin - 0.5 &&
          pixel.y() <= k.height - 0.5 - margin)) {
      return;
    }
    Eigen::Vector2d normal(-along.y(), along.x());
    if (normal[other] * outward < 0.0) normal = -normal;
    // Depth runs linearly in 1/z along a projected segment.
    const double z0 = static_cast<double>(segment.from_C.z());
    const double z1 = static_cast<double>(segment.to_C.z());
    const auto t_C = static_cast<float>(t * z0 / ((1.0 - t) * z1 + t * z0));
    ContourPoint point;
    point.pixel = pixel.cast<float>();
    point.normal = normal.normalized().cast<float>();
    point.p_C = segment.from_C + t_C * (segment.to_C - segment.from_C);
    point.part = segment.part;
    points.push_back(point);
  }
};

ContourExtractor::ContourExtractor(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras) {
  contour::check(model, cameras);
  impl_ = std::make_unique<Impl>(model, cameras);
}

ContourExtractor::ContourExtractor(const ContourExtractor& other) : impl_(std::make_unique<Impl>(*other.impl_)) {}
ContourExtractor::~ContourExtractor() = default;
ContourExtractor::ContourExtractor(ContourExtractor&&) noexcept = default;

std::span<const ContourPoint> ContourExtractor::extract(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera,
                                                        float spacing_px, float margin_px) {
  Impl& impl = *impl_;
  const contour::Camera& view = impl.cameras.at(camera);
  const double spacing = spacing_px >= 0.25f ? static_cast<double>(spacing_px) : 0.25;
  impl.points.clear();
  impl.collect(X_CB, view);
  for (int axis = 0; axis < 2; ++axis) {
    impl.sample(axis, view.intrinsics, spacing, static_cast<double>(margin_px));
  }
  return impl.points;
}

}  // namespace bodyschema
