#include "contour_scorer.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <new>

#include "contour_model.hpp"
#include "observation_masks.hpp"
#include "worker_pool.hpp"

namespace bodyschema {
namespace {

using contour::Camera;
using contour::DeltaImage;
using contour::Kernel;
using contour::MaskWords;
using contour::Model;
using contour::PixelBounds;
using contour::View;

// Pictures that go through the model together: a run of edges is fetched once for all of them.
constexpr std::size_t kBatch = 8;

// What one worker needs for itself.
struct Scratch {
  struct Free {
    void operator()(std::uint8_t* p) const { ::operator delete[](p, std::align_val_t{64}); }
  };
  std::unique_ptr<std::uint8_t[], Free> deltas;    // of kBatch pictures
  std::array<contour::PlacedPart, kBatch> placed;  // of one part
  std::vector<std::uint32_t> found;
  std::vector<Eigen::Vector3f> points;
};

// Column crossings of a segment of a part that the near plane cuts.
void accumulate_segment(const contour::Segment& segment, const PinholeIntrinsics& k, const DeltaImage& image,
                        PixelBounds& bounds) {
  Eigen::Vector2d a = k.project(segment.from_C.cast<double>());
  Eigen::Vector2d b = k.project(segment.to_C.cast<double>());
  int weight = segment.weight;
  if (a.x() > b.x()) {
    std::swap(a, b);
    weight = -weight;
  }
  const double first = std::ceil(std::clamp<double>(a.x(), 0.0, image.width));
  const double end = std::ceil(std::clamp<double>(b.x(), 0.0, image.width));
  const double slope = (b.y() - a.y()) / (b.x() - a.x());
  for (double u = first; u < end; u += 1.0) {
    const double v = std::clamp<double>(a.y() + (u - a.x()) * slope, 0.0, image.height);
    std::uint8_t& delta =
        image.deltas[static_cast<std::ptrdiff_t>(std::ceil(v)) * image.stride + static_cast<std::ptrdiff_t>(u)];
    delta = static_cast<std::uint8_t>(delta + weight);
  }
  if (first < end) {  // a cut part may cover anything: no use in tight bounds
    bounds = {0.0f, static_cast<float>(image.width), 0.0f, static_cast<float>(image.height)};
  }
}

class ContourScorer final : public SilhouetteScorer {
 public:
  ContourScorer(const SilhouetteModel& model, std::span<const PinholeIntrinsics> cameras, int threads)
      : model_(model), masks_(cameras), kernel_(contour::best_kernel()), pool_(threads) {
    for (const auto& intrinsics : cameras) {
      cameras_.emplace_back(intrinsics);
      delta_bytes_ = std::max(
          delta_bytes_, static_cast<std::size_t>(stride(intrinsics)) * static_cast<std::size_t>(intrinsics.height + 1));
    }
    scratch_.resize(static_cast<std::size_t>(pool_.threads()));
    for (auto& scratch : scratch_) {
      scratch.deltas.reset(new (std::align_val_t{64}) std::uint8_t[kBatch * delta_bytes_]());
      scratch.found.resize(model_.max_edges() + contour::kLanes);
      scratch.points.resize(model_.max_vertices());
    }
  }

  void set_observation(std::span<const ObservedSilhouette> observed) override { masks_.set(observed); }

  void score(std::span<const Eigen::Isometry3f> X_CB, std::span<SilhouetteCounts> counts,
             std::uint32_t camera_mask) override {
    const std::size_t parts = model_.parts().size();
    assert(counts.size() % cameras_.size() == 0 && X_CB.size() == counts.size() * parts);
    auto body = [&](int worker, std::size_t begin, std::size_t end) {
      Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
      std::array<Picture, kBatch> batch;
      std::size_t size = 0;
      const auto flush = [&] {
        draw(scratch, std::span(batch).first(size));
        for (const Picture& picture : std::span(batch).first(size)) {
          *picture.out = {picture.counts.intersection, picture.counts.predicted, masks_.count(picture.camera)};
        }
        size = 0;
      };
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t camera = i % cameras_.size();
        counts[i] = {};
        if (((camera_mask >> camera) & 1u) == 0) continue;
        batch[size++] = {X_CB.data() + i * parts, camera, &counts[i], nullptr, {}};
        if (size == kBatch) flush();
      }
      flush();
    };
    pool_.run(counts.size(), kBatch, body);
  }

  BinaryMask render(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera) override {
    const auto& k = cameras_.at(camera).intrinsics;
    BinaryMask mask(k.width, k.height);
    std::array<Picture, 1> picture{Picture{X_CB.data(), camera, nullptr, mask.row(0), {}}};
    draw(scratch_.front(), picture);
    return mask;
  }

  [[nodiscard]] std::string description() const override {
    return std::string("contour (") + kernel_.name + ", " + std::to_string(pool_.threads()) +
           (pool_.threads() == 1 ? " thread)" : " threads)");
  }

 private:
  static std::int32_t stride(const PinholeIntrinsics& k) { return (k.width + 63) / 64 * 64; }

  struct Picture {
    const Eigen::Isometry3f* X_CB = nullptr;  // one per part
    std::size_t camera = 0;
    SilhouetteCounts* out = nullptr;
    std::uint64_t* rendered = nullptr;  // words of a mask, or null
    contour::Counts counts;
  };

  void draw(Scratch& scratch, std::span<Picture> pictures) const {
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    std::array<DeltaImage, kBatch> images;
    std::array<PixelBounds, kBatch> bounds;
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const auto& k = cameras_[pictures[i].camera].intrinsics;
      images[i] = {scratch.deltas.get() + i * delta_bytes_, stride(k), k.width, k.height};
      bounds[i] = {kInfinity, -kInfinity, kInfinity, -kInfinity};
    }
    for (std::size_t p = 0; p < model_.parts().size(); ++p) {
      const contour::Part& part = model_.parts()[p];
      auto& placed = scratch.placed;
      for (std::size_t i = 0; i < pictures.size(); ++i) {
        const Camera& camera = cameras_[pictures[i].camera];
        placed[i] = contour::place(part, camera, pictures[i].X_CB[p]);
        if (placed[i].view == View::kCut) {
          contour::for_each_cut_segment(
              part, model_.culling(), placed[i], scratch.points,
              [&](const contour::Segment& s) { accumulate_segment(s, camera.intrinsics, images[i], bounds[i]); });
        }
      }
      for (const auto& run : part.runs) {
        for (std::size_t i = 0; i < pictures.size(); ++i) {
          if (placed[i].view != View::kInFront) continue;
          const std::int32_t count = kernel_.find(run, placed[i].camera_B, scratch.found.data());
          kernel_.accumulate(run, scratch.found.data(), count, placed[i].P, images[i], bounds[i]);
        }
      }
    }
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const std::size_t camera = pictures[i].camera;
      const BinaryMask& observed = masks_.observed(camera);
      pictures[i].counts = kernel_.resolve(
          images[i], bounds[i],
          MaskWords{observed.row(0), masks_.valid(camera).row(0), pictures[i].rendered, observed.words_per_row()});
    }
  }

  Model model_;
  std::vector<Camera> cameras_;
  ObservationMasks masks_;
  const Kernel& kernel_;
  WorkerPool pool_;
  std::vector<Scratch> scratch_;
  std::size_t delta_bytes_ = 0;  // of the largest camera
};

}  // namespace

std::unique_ptr<SilhouetteScorer> make_contour_scorer(const SilhouetteModel& model,
                                                      std::span<const PinholeIntrinsics> cameras, int threads) {
  contour::check(model, cameras);
  if (threads < 0 || threads > 1024) {
    throw std::invalid_argument("silhouette threads: " + std::to_string(threads) +
                                ", expected 0 (one per core) to 1024");
  }
  return std::make_unique<ContourScorer>(model, cameras, threads);
}

}  // namespace bodyschema
