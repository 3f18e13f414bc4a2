#include "bodyschema/vision/segmenter.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/mask_picture.hpp"
#include "colour_evidence.hpp"
#include "colour_resolution.hpp"
#include "coverage.hpp"
#include "learned_background.hpp"
#include "local_average.hpp"
#include "pack_bits.hpp"
#include "region_statistics.hpp"
#include "single_colour_background.hpp"

// The hottest loop once more for processors with AVX2; without fused products, so that all give the same bits. The
// sanitizers run before the loader has chosen.
#if defined(__x86_64__) && defined(__GLIBC__) && defined(__GNUC__) && !defined(__clang__) && \
    !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define BODYSCHEMA_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#define BODYSCHEMA_PART_OF_ITS_CALLER __attribute__((always_inline))
#else
#define BODYSCHEMA_WIDE_VECTORS
#define BODYSCHEMA_PART_OF_ITS_CALLER
#endif

namespace bodyschema {
namespace {

std::string size_text(int width, int height, int channels) {
  return std::to_string(width) + "x" + std::to_string(height) + "x" + std::to_string(channels);
}

/// The noise that remains between a frame and a background without any, levels.
float noise_against(const Image& frame, const BackgroundModel& background) {
  std::array<std::size_t, 256> histogram{};
  for (std::size_t i = 0; i < background.pixels(); ++i) {
    if (background.precision[i] <= 0.0f) continue;
    const auto channels = static_cast<std::size_t>(background.channels);
    for (std::size_t k = i * channels; k < (i + 1) * channels; ++k) {
      const float d = std::abs(static_cast<float>(frame.data[k]) - background.mean[k]);
      ++histogram[static_cast<std::size_t>(std::min(d + 0.5f, 255.0f))];
    }
  }
  return noise_from_differences(histogram);
}

// Of `auto`. Lengths are those of a 320x240 picture.
// Light and background are compared at every so many pixels along each axis.
constexpr int kLightGrid = 3;
// A gain nearer to one than this is none: rounding to whole levels costs as much.
constexpr float kSameLight = 0.004f;
// A pixel shows its background within so many standard deviations of each channel.
constexpr float kSameSigma = 3.0f;
// Where the camera stands still, robot, people and things that are moved cover less than half of what lies away from
// the predicted robot; where it has turned, all but a plain wall changes.
constexpr double kHolds = 0.6, kSameThoughTurned = 0.97;
constexpr int kMostMisfits = 10;
// The background nobody knows is averaged over squares of this half side, px; twice that where there is none so near.
constexpr double kAverage_px = 3.0;
// So near to the robot pixels are mixtures; where colours bleed, up to there. Pixels of the picture, whatever its size.
constexpr int kMixed_px = 2, kBled_px = 4;
// Beside the robot the background varies more where pictures were compressed: measured between these distances from the
// predicted outline, px, beyond blur and within the blocks that an outline spoils; by the quantile of squared
// differences that nineteen in twenty stay below (chi-square of one and of three channels).
constexpr float kBesideFrom_px = 2.0f, kBesideTo_px = 8.0f;
constexpr double kQuantile = 0.95;
constexpr float kChiSquare1 = 3.84f, kChiSquare3 = 7.81f;
constexpr float kEdgeShare = 0.2f;
// Levels: compression errs by less beside an outline; what differs by more there is something else than the background.
constexpr float kMostSpoilt = 24.0f;
// From this on it is compression: colours bleed over the outline without being mixtures of both sides.
constexpr float kCompressed = 4.0f;
// How much further off than its outline is looked for an arm may be whose prediction is not confirmed, px.
constexpr double kFarOff_px = 24.0;
// Share that one picture has in what is known of the robot's colours.
constexpr float kLookShare = 0.05f;

BackgroundModel load_background(const VisionSetup& setup, const std::string& camera, int width, int height,
                                const Undistorter* lens) {
  const auto found = setup.background_pictures.find(camera);
  if (found == setup.background_pictures.end()) {
    throw ConfigurationError("vision.background_pictures: no picture for camera '" + camera + "'");
  }
  const auto check_size = [&](PictureSize size) {
    if (size == PictureSize{width, height}) return;
    throw FileError(found->second.string() + ": background picture is " + std::to_string(size.width) + "x" +
                    std::to_string(size.height) + ", camera '" + camera + "' is " + std::to_string(width) + "x" +
                    std::to_string(height));
  };
  Image picture = read_picture(found->second, check_size);
  check_size({picture.width, picture.height});  // a JPEG may be turned by what its header says besides
  BackgroundModel model(width, height, picture.channels);
  model.noise_sd = std::max(static_cast<float>(setup.noise_levels), kLeastNoiseSd);
  constexpr std::uint8_t kKnown = 255;
  Image known(width, height, 1);  // as the camera takes it: straightening mixes black with what lies beside it
  for (std::size_t i = 0; i < model.pixels(); ++i) {
    const auto* pixel = picture.data.data() + i * static_cast<std::size_t>(picture.channels);
    const bool black = std::all_of(pixel, pixel + picture.channels, [](std::uint8_t level) { return level == 0; });
    known.data[i] = setup.black_is_unknown && black ? 0 : kKnown;
  }
  if (lens != nullptr) {
    picture = lens->apply(picture);
    known = lens->apply(known);
  }
  model.mean.assign(picture.data.begin(), picture.data.end());
  for (std::size_t i = 0; i < model.pixels(); ++i) {
    model.precision[i] = known.data[i] == kKnown ? 1.0f / (model.noise_sd * model.noise_sd) : 0.0f;
  }
  return model;
}

}  // namespace

struct Segmenter::Impl {
  Impl(const VisionSetup& s, std::string name, int w, int h)
      : configured(s), setup(s.in_pixels_of(w, h)), camera(std::move(name)), width(w), height(h),
        single_colour(s, w, h), learned(s, w, h), detected(w, h), sure(w, h), uncertain(w, h), robot(w, h),
        hits((static_cast<std::size_t>(w) + 63) / 64 * 64, 0) {}

  void check(const Image& image);
  [[nodiscard]] bool fits(const PredictedRobot& predicted) const {
    return predicted.silhouette != nullptr && predicted.silhouette->width() == width &&
           predicted.silhouette->height() == height;
  }
  [[nodiscard]] bool learns() const {
    return setup.method == SegmentationMethod::kLearnedBackground || setup.method == SegmentationMethod::kAuto;
  }
  [[nodiscard]] const BackgroundModel& background() const;
  /// @param variance  of the background, times what the model says
  void detect(const Image& image, const BackgroundModel& model, float variance, const PixelBox& box,
              const BinaryMask* asked);
  void detect_hard(const Image& image, const BackgroundModel& model);
  /// Refines `detected` and `sure` to coverage and cleans up.
  void refine(const Image& image, const BackgroundModel& model, BinaryMask& mask, BinaryMask& valid,
              std::vector<std::uint8_t>& coverage);
  void soften(BinaryMask& mask, std::vector<std::uint8_t>& coverage) const;
  void mark_valid(const BackgroundModel& model, BinaryMask& valid, const PixelBox& box);
  [[nodiscard]] int light_grid() const {
    return std::max(kLightGrid, static_cast<int>(std::lround(kLightGrid * picture_unit(width, height))));
  }
  [[nodiscard]] PixelBox everything() const { return {0, 0, width - 1, height - 1}; }
  /// The whole picture against a background that is known.
  void compare(const Image& image, const BackgroundModel& model, BinaryMask& mask, BinaryMask& valid,
               std::vector<std::uint8_t>& coverage);

  // --- auto ---
  void segment_auto(const Image& image, BinaryMask& mask, BinaryMask& valid, std::vector<std::uint8_t>& coverage,
                    const PredictedRobot& predicted);
  void adapt_auto(const Image& image, const BinaryMask& mask, const PredictedRobot& predicted);
  /// The picture in the light in which the background was learned; the picture itself where that has not changed.
  const Image& in_known_light(const Image& image);
  /// Whether the learned background is what this picture shows away from the robot.
  [[nodiscard]] bool background_holds(const Image& image);
  void forget_background();
  /// Where the background differs, and by its colours is no robot, it is as if nobody knew it.
  void doubt_background();
  void find_background(const Image& image, bool holds);
  /// How much more than elsewhere the background varies beside the robot: what compression makes of an outline.
  void measure_edge_noise(const Image& image);

  VisionSetup configured;
  VisionSetup setup;  ///< in pixels of these pictures
  std::string camera;
  int width;
  int height;
  int channels = 0;  // of the first frame

  SingleColourBackground single_colour;
  LearnedBackground learned;
  BackgroundModel given;
  bool given_noise_known = false;
  RegionStatistics statistics;
  BackgroundModel local;                         // statistics: of the last frame, next to the robot
  ColourEvidence evidence;                       // auto
  RobotLooks looks;                              // auto
  SceneColours colours;                          // auto
  LocalAverage average;                          // auto
  BinaryMask known, beside;                      // auto: pixels with a known background; the robot and all around it
  Image relit;                                   // auto: the last picture in the light of the learned background
  std::array<float, 3> light{1.0f, 1.0f, 1.0f};  // auto: gain of this picture, by channel
  float edge_variance = 1.0f;                    // auto: beside the robot, times that of still areas
  ColourResolution resolution;                   // auto
  bool bleeds = false;                           // auto: colour of the last pictures, over outlines
  bool turned = false;                           // auto: the camera, since the background was learned
  int misfits = 0;                               // auto: pictures in a row that the background does not fit
  std::vector<float> ratios;                     // auto: of squared differences to their variances
  FrameSelection selection;
  bool learned_offline = false;
  bool from_stills = false;   // auto: the background was learned beside predictions that may be far off
  bool just_learned = false;  // the last frame was learned from whole and gave no mask

  CoverageEstimator coverage_estimator;
  ComponentFilter components;
  MaskMorphology morphology;
  BinaryMask detected, sure, uncertain, robot, wanted;
  std::vector<float> rows;           // see detect()
  std::vector<std::uint8_t> hits;    // of one row, 0 or 1, padded to whole words
  std::vector<std::uint64_t> words;  // of one row
};

void Segmenter::Impl::check(const Image& image) {
  const auto expected = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height) *
                        static_cast<std::size_t>(std::max(image.channels, 0));
  if (image.empty() || image.width != width || image.height != height || (image.channels != 1 && image.channels != 3) ||
      image.data.size() != expected) {
    throw DataError("camera '" + camera + "': picture of " + size_text(image.width, image.height, image.channels) +
                    " with " + std::to_string(image.data.size()) + " bytes, expected " + std::to_string(width) + "x" +
                    std::to_string(height) + ", 1 or 3 channels");
  }
  if (image.channels != given.channels && given.channels != 0) {
    throw DataError("camera '" + camera + "': picture with " + std::to_string(image.channels) + " channels, expected " +
                    std::to_string(given.channels) + " as in the background");
  }
}

const BackgroundModel& Segmenter::Impl::background() const {
  switch (setup.method) {
    case SegmentationMethod::kSingleColour: return single_colour.model();
    case SegmentationMethod::kBackgroundPicture: return given;
    case SegmentationMethod::kAuto:
    case SegmentationMethod::kStatistics: return local;
    case SegmentationMethod::kGiven:
    case SegmentationMethod::kLearnedBackground: break;
  }
  return learned.model();
}

/// Calls function(begin, end) for each run of a row's words that are wanted, as pixels of the row.
template <class Wanted, class Function>
BODYSCHEMA_PART_OF_ITS_CALLER inline void for_each_run(int first_word, int last_word, int width, const Wanted& wanted,
                                                       const Function& function) {
  for (int w = first_word; w <= last_word;) {
    if (!wanted(w)) {
      ++w;
      continue;
    }
    const int first = w;
    while (w <= last_word && wanted(w)) ++w;
    function(64 * first, std::min(64 * w, width));
  }
}

/// Within whole words of the box, where `asked` is set in these; null: in all. `sure`: the pixel itself differs from
/// the background. `detected`: the mean of its 3x3 square does, which sees a third of that contrast; it reaches one
/// pixel farther out.
BODYSCHEMA_WIDE_VECTORS
void Segmenter::Impl::detect(const Image& image, const BackgroundModel& model, float variance, const PixelBox& box,
                             const BinaryMask* asked) {
  const auto n = static_cast<std::size_t>(channels);
  const int first_word = box.u0 >> 6, last_word = box.u1 >> 6;
  const std::size_t row_size = static_cast<std::size_t>(width) * n;
  // Plain differences with one pixel more on both sides; their squares; three rows of
  // differences summed over three columns; the score of each pixel.
  rows.resize((row_size + 2 * n) + row_size + 3 * row_size + static_cast<std::size_t>(width));
  float* plain = rows.data() + n;
  float* squares = plain + row_size + n;
  float* summed = squares + row_size;
  float* score = summed + 3 * row_size;

  const auto sigma = static_cast<float>(setup.threshold_sigma);
  const auto levels = static_cast<float>(setup.threshold_levels);
  const auto at = [&](int u, int v) {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
  };
  const auto is_asked = [&](int w, int v) {
    return v >= box.v0 && v <= box.v1 && (asked == nullptr || asked->row(v)[w] != 0);
  };
  // The lambdas are part of this function, or they would be compiled without its wide vectors.
  // The sum of nine has nine times the variance of one pixel, 81 times its square.
  const auto pack = [&](int begin, int end, int v, float variances, float limit,
                        BinaryMask& out) BODYSCHEMA_PART_OF_ITS_CALLER {
    const auto w = static_cast<std::size_t>(end - begin);
    if (n == 3) {
      for (std::size_t u = 0; u < w; ++u) {
        score[u] = squares[3 * u] + squares[3 * u + 1] + squares[3 * u + 2];
      }
    } else {
      std::copy_n(squares, w, score);
    }
    const float* precision = model.precision.data() + at(begin, v);
    const float least_sigma = variances * sigma * sigma;
    std::uint8_t* hit = hits.data();
    std::fill_n(hit, (w + 63) / 64 * 64, std::uint8_t{0});
    for (std::size_t u = 0; u < w; ++u) {
      hit[u] = static_cast<std::uint8_t>((score[u] * (precision[u] / variance) > least_sigma) & (score[u] > limit));
    }
    pack_bits(hit, w, out.row(v) + begin / 64);
  };
  const auto subtract = [&](int u, int v, float* out) BODYSCHEMA_PART_OF_ITS_CALLER {
    const std::uint8_t* in = image.pixel(u, v);
    const float* mean = model.mean.data() + at(u, v) * n;
    for (std::size_t c = 0; c < n; ++c) out[c] = static_cast<float>(in[c]) - mean[c];
  };
  const auto sums_of = [&](int v, int begin) {
    return summed + static_cast<std::size_t>(v % 3) * row_size + static_cast<std::size_t>(begin) * n;
  };
  for (int v = std::max(box.v0 - 1, 0); v <= box.v1 + 1; ++v) {
    if (v < height) {
      const auto needed = [&](int w) { return is_asked(w, v - 1) || is_asked(w, v) || is_asked(w, v + 1); };
      for_each_run(first_word, last_word, width, needed, [&](int begin, int end) BODYSCHEMA_PART_OF_ITS_CALLER {
        const std::size_t size = static_cast<std::size_t>(end - begin) * n;
        const std::uint8_t* in = image.pixel(begin, v);
        const float* mean = model.mean.data() + at(begin, v) * n;
        for (std::size_t i = 0; i < size; ++i) plain[i] = static_cast<float>(in[i]) - mean[i];
        subtract(std::max(begin - 1, 0), v, plain - n);
        subtract(std::min(end, width - 1), v, plain + size);
        float* out = sums_of(v, begin);
        const float* before = plain - n;
        const float* after = plain + n;
        for (std::size_t i = 0; i < size; ++i) out[i] = before[i] + plain[i] + after[i];
        for (std::size_t i = 0; i < size; ++i) squares[i] = plain[i] * plain[i];
        if (v >= box.v0 && v <= box.v1) pack(begin, end, v, 1.0f, levels * levels, sure);
      });
    }
    const int here = v - 1;
    if (here < box.v0) continue;
    const auto judged = [&](int w) { return is_asked(w, here); };
    for_each_run(first_word, last_word, width, judged, [&](int begin, int end) BODYSCHEMA_PART_OF_ITS_CALLER {
      const std::size_t size = static_cast<std::size_t>(end - begin) * n;
      const float* a = sums_of(std::max(here - 1, 0), begin);
      const float* b = sums_of(here, begin);
      const float* c = sums_of(std::min(here + 1, height - 1), begin);
      for (std::size_t i = 0; i < size; ++i) {
        const float sum = a[i] + b[i] + c[i];
        squares[i] = sum * sum;
      }
      pack(begin, end, here, 9.0f, 81.0f * levels * levels, detected);
    });
  }
}

/// Without blur or much noise: any channel that differs makes a pixel robot.
void Segmenter::Impl::detect_hard(const Image& image, const BackgroundModel& model) {
  const auto n = static_cast<std::size_t>(channels);
  const auto levels = static_cast<float>(setup.threshold_levels);
  const auto sigma = static_cast<float>(setup.threshold_sigma);
  const float noise = model.noise_sd > kLeastNoiseSd ? model.noise_sd : 0.0f;
  const float limit = std::max(levels, sigma * noise);
  std::size_t i = 0;
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* in = image.pixel(0, v);
    auto* out = detected.row(v);
    for (int u = 0; u < width;) {
      std::uint64_t word = 0;
      const int end = std::min(width, u + 64);
      for (int bit = 0; u < end; ++u, ++bit, ++i, in += n) {
        float worst = 0.0f;
        for (std::size_t c = 0; c < n; ++c) {
          worst = std::max(worst, std::abs(static_cast<float>(in[c]) - model.mean[i * n + c]));
        }
        word |= static_cast<std::uint64_t>(worst > limit && model.precision[i] > 0.0f) << bit;
      }
      *out++ = word;
    }
  }
}

/// Within whole words of the box.
void Segmenter::Impl::mark_valid(const BackgroundModel& model, BinaryMask& valid, const PixelBox& box) {
  const int begin = box.u0 & ~63, end = std::min((box.u1 | 63) + 1, width);
  const auto w = static_cast<std::size_t>(end - begin);
  std::fill(hits.begin(), hits.end(), std::uint8_t{0});
  for (int v = box.v0; v <= box.v1; ++v) {
    const float* precision = model.precision.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(begin);
    std::uint8_t* hit = hits.data();
    for (std::size_t u = 0; u < w; ++u) hit[u] = static_cast<std::uint8_t>(precision[u] > 0.0f);
    pack_bits(hit, w, valid.row(v) + begin / 64);
  }
}

void Segmenter::Impl::refine(const Image& image, const BackgroundModel& model, BinaryMask& mask, BinaryMask& valid,
                             std::vector<std::uint8_t>& coverage) {
  // Beside a background that nobody knows, its own variety counts as noise: half as much contrast puts outlines half a
  // pixel off at most.
  const double least = (setup.method == SegmentationMethod::kAuto ? 0.5 : 1.0) * setup.least_contrast_sigma;
  constexpr float kBrightest = 255.0f;
  const std::array<float, 3> clipped = {kBrightest / light[0], kBrightest / light[1], kBrightest / light[2]};
  coverage_estimator.estimate(image, model, detected, sure, clipped, static_cast<float>(least),
                              !bleeds && edge_variance < kCompressed, mask, uncertain, coverage);
  if (setup.method == SegmentationMethod::kStatistics) {
    soften(mask, coverage);
  } else {
    valid -= uncertain;
  }
  components.remove_small(mask, setup.min_component_px);
  components.fill_small_holes(mask, setup.max_hole_px);
  // What the clean-up changed, it changed wholly; where nothing was detected there was nothing to be changed.
  const auto w = static_cast<std::size_t>(width);
  std::vector<std::uint64_t>& covered = words;
  covered.resize((w + 63) / 64);
  const PixelBox cleaned = bounding_box(detected).grown(1, width, height);
  for (int v = cleaned.v0; v <= cleaned.v1; ++v) {
    std::uint8_t* row = coverage.data() + static_cast<std::size_t>(v) * w;
    for (std::size_t u = 0; u < w; ++u) hits[u] = static_cast<std::uint8_t>(row[u] >> 7);
    pack_bits(hits.data(), w, covered.data());
    for (std::size_t word = 0; word < covered.size(); ++word) {
      for (std::uint64_t other = covered[word] ^ mask.row(v)[word]; other != 0; other &= other - 1) {
        const std::size_t u = 64 * word + static_cast<std::size_t>(std::countr_zero(other));
        row[u] = mask.at(static_cast<int>(u), v) ? 255 : 0;
      }
    }
  }
}

/// Where colours do not tell how much of a pixel is robot, the decision itself, smoothed.
void Segmenter::Impl::soften(BinaryMask& mask, std::vector<std::uint8_t>& coverage) const {
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      if (!uncertain.at(u, v)) continue;
      int sum = 0;
      for (int dv = -1; dv <= 1; ++dv) {
        for (int du = -1; du <= 1; ++du) {
          const int a = std::clamp(u + du, 0, width - 1), b = std::clamp(v + dv, 0, height - 1);
          sum += sure.at(a, b) ? (2 - std::abs(du)) * (2 - std::abs(dv)) : 0;
        }
      }
      coverage[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>(std::min(sum * 16, 255));
      mask.set(u, v, sum >= 8);
    }
  }
}

Segmenter::Segmenter(const VisionSetup& setup, const std::string& camera, int width, int height,
                     const Undistorter* lens)
    : impl_(std::make_unique<Impl>(setup, camera, std::max(width, 0), std::max(height, 0))) {
  if (width <= 0 || height <= 0) {
    throw ConfigurationError("camera '" + camera + "': a picture of " + std::to_string(width) + "x" +
                             std::to_string(height) + " pixels cannot be segmented");
  }
  if (setup.method == SegmentationMethod::kBackgroundPicture) {
    impl_->given = load_background(setup, camera, width, height, lens);
    impl_->given_noise_known = setup.noise_levels > 0.0 || setup.edges == EdgeKind::kHard;
  }
}

Segmenter::~Segmenter() = default;
Segmenter::Segmenter(Segmenter&&) noexcept = default;
Segmenter& Segmenter::operator=(Segmenter&&) noexcept = default;

/// Throws where the picture cannot be used; one of another kind (gray, colour) starts all learning anew.
void Segmenter::admit(const Image& image) {
  impl_->check(image);
  if (impl_->channels == image.channels) return;
  if (impl_->channels != 0) {
    impl_ = std::make_unique<Impl>(impl_->configured, impl_->camera, impl_->width, impl_->height);
  }
  impl_->channels = image.channels;
}

void Segmenter::learn_from(const Image& frame) {
  admit(frame);
  if (impl_->learns()) impl_->selection.add(frame);
  if (impl_->setup.method == SegmentationMethod::kSingleColour) impl_->single_colour.update(frame);
}

void Segmenter::finish_learning() {
  auto& self = *impl_;
  if (!self.learns()) return;
  self.learned.learn(self.selection.frames(), self.selection.noise_sd());
  self.learned_offline = !self.selection.frames().empty();
  self.selection.clear();
}

void Segmenter::learn(std::span<const Image> frames) {
  for (const auto& frame : frames) learn_from(frame);
  finish_learning();
}

void Segmenter::learn(std::span<const Image> frames, std::span<const BinaryMask> robots) {
  for (const auto& frame : frames) admit(frame);
  auto& self = *impl_;
  if (!self.learns() || frames.empty()) return;
  self.learned.learn_beside(frames, robots);
  self.learned_offline = true;
  self.from_stills = true;
  self.edge_variance = 1.0f;  // until predictions are near
  self.selection.clear();
}

bool Segmenter::ready() const {
  if (impl_->setup.method != SegmentationMethod::kLearnedBackground) return true;
  return impl_->learned_offline || impl_->learned.frames_seen() >= impl_->setup.learning_frames;
}

const BackgroundModel& Segmenter::background() const {
  return impl_->background();
}

void Segmenter::segment(const Image& image, BinaryMask& mask, BinaryMask& valid, std::vector<std::uint8_t>& coverage,
                        const PredictedRobot& predicted) {
  admit(image);
  auto& self = *impl_;
  self.just_learned = false;
  const auto fit = [&](BinaryMask& m) {
    if (m.width() != self.width || m.height() != self.height) m = BinaryMask(self.width, self.height);
  };
  fit(mask);
  fit(valid);
  if (self.setup.method == SegmentationMethod::kAuto) {
    self.segment_auto(image, mask, valid, coverage, self.fits(predicted) ? predicted : PredictedRobot());
    return;
  }
  if (self.setup.method == SegmentationMethod::kStatistics) {
    valid.fill(self.fits(predicted));
    if (!self.fits(predicted)) {
      mask.fill(false);
      coverage.assign(image.data.size() / static_cast<std::size_t>(self.channels), 0);
      return;
    }
    self.statistics.separate(image, *predicted.silhouette, self.setup, self.sure, self.local);
    self.components.remove_small(self.sure, self.setup.min_component_px);
    self.components.fill_small_holes(self.sure, self.setup.max_hole_px);
    self.detected = self.sure;
    self.morphology.dilate(self.detected);
    self.refine(image, self.local, mask, valid, coverage);
    return;
  }
  if (!ready()) {
    self.learned.update(image, nullptr, true);
    self.just_learned = true;
    mask.fill(false);
    valid.fill(false);
    coverage.assign(image.data.size() / static_cast<std::size_t>(self.channels), 0);
    return;
  }
  if (self.setup.method == SegmentationMethod::kSingleColour) self.single_colour.update(image);
  if (self.setup.method == SegmentationMethod::kBackgroundPicture && !self.given_noise_known) {
    self.given.noise_sd = noise_against(image, self.given);
    for (auto& precision : self.given.precision) {
      if (precision > 0.0f) precision = 1.0f / (self.given.noise_sd * self.given.noise_sd);
    }
    self.given_noise_known = true;
  }
  self.compare(image, self.background(), mask, valid, coverage);
}

void Segmenter::Impl::compare(const Image& image, const BackgroundModel& model, BinaryMask& mask, BinaryMask& valid,
                              std::vector<std::uint8_t>& coverage) {
  mark_valid(model, valid, everything());
  if (setup.edges == EdgeKind::kHard) {
    detect_hard(image, model);
    components.remove_small(detected, setup.min_component_px);
    components.fill_small_holes(detected, setup.max_hole_px);
    mask = detected;
    coverage.resize(image.data.size() / static_cast<std::size_t>(channels));
    std::size_t i = 0;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u, ++i) coverage[i] = mask.at(u, v) ? 255 : 0;
    }
    return;
  }
  detect(image, model, 1.0f, everything(), nullptr);
  components.remove_small(detected, setup.min_component_px);
  components.fill_small_holes(detected, setup.max_hole_px);
  sure &= detected;
  components.fill_small_holes(sure, std::max(setup.max_hole_px, 4));
  refine(image, model, mask, valid, coverage);
}

void Segmenter::adapt(const Image& image, const BinaryMask& mask, const PredictedRobot& predicted) {
  auto& self = *impl_;
  if (self.setup.method == SegmentationMethod::kAuto) {
    self.adapt_auto(image, mask, self.fits(predicted) ? predicted : PredictedRobot());
    return;
  }
  if (self.setup.method != SegmentationMethod::kLearnedBackground || self.just_learned) return;
  // Where the robot is, nothing is learned: as predicted, or else as seen.
  const bool foreseen = self.fits(predicted);
  self.robot = foreseen ? *predicted.silhouette : mask;
  self.morphology.dilate(self.robot, foreseen ? 6 : 3);
  self.learned.update(image, &self.robot, false);
}

const RobotLooks& Segmenter::looks() const {
  return impl_->looks;
}

void Segmenter::know_looks(RobotLooks looks) {
  impl_->looks = std::move(looks);
}

void Segmenter::know_colours(SceneColours colours) {
  impl_->colours = std::move(colours);
}

void Segmenter::camera_turned() {
  impl_->turned = true;
}

// --- auto -----------------------------------------------------------------------------------------

/// One gain a channel: the median of what the picture has over what the background had. Found anew in every picture, so
/// that no bad one is remembered.
const Image& Segmenter::Impl::in_known_light(const Image& image) {
  const BackgroundModel& model = learned.model();
  light.fill(1.0f);
  if (model.channels != image.channels) return image;
  constexpr int kSteps = 200;  // of half a percent, from a third to nearly three times
  constexpr float kPerStep = 1.005f;
  constexpr std::size_t kFewest = 300;
  std::array<std::array<std::size_t, 2 * kSteps + 1>, 3> counts{};
  std::size_t all = 0;
  const int step = light_grid();
  for (int v = step / 2; v < height; v += step) {
    for (int u = step / 2; u < width; u += step) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      if (model.precision[i] <= 0.0f || beside.at(u, v)) continue;
      ++all;
      for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
        const float had = std::max(model.mean[i * static_cast<std::size_t>(channels) + c], 1.0f);
        const float has = std::max(static_cast<float>(image.pixel(u, v)[c]), 1.0f);
        const float change = std::log(has / had) / std::log(kPerStep);
        ++counts[c]
                [static_cast<std::size_t>(std::clamp(static_cast<int>(std::lround(change)), -kSteps, kSteps) + kSteps)];
      }
    }
  }
  if (all < kFewest) return image;
  bool changed = false;
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
    std::size_t below = 0, k = 0;
    while (2 * (below + counts[c][k]) < all) below += counts[c][k++];
    // Within the step: as many lie below the median as above.
    const float within = (0.5f * static_cast<float>(all) - static_cast<float>(below)) /
                             std::max(static_cast<float>(counts[c][k]), 1.0f) -
                         0.5f;
    light[c] = std::pow(kPerStep, static_cast<float>(k) - kSteps + within);
    changed = changed || std::abs(light[c] - 1.0f) > kSameLight;
  }
  if (!changed) {
    light.fill(1.0f);
    return image;
  }
  relit = image;
  std::array<std::array<std::uint8_t, 256>, 3> table{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels); ++c) {
    for (std::size_t level = 0; level < 256; ++level) {
      table[c][level] = static_cast<std::uint8_t>(std::min(static_cast<float>(level) / light[c] + 0.5f, 255.0f));
    }
  }
  const auto n = static_cast<std::size_t>(channels);
  for (std::size_t i = 0; i < relit.data.size(); i += n) {
    for (std::size_t c = 0; c < n; ++c) relit.data[i + c] = table[c][relit.data[i + c]];
  }
  return relit;
}

bool Segmenter::Impl::background_holds(const Image& image) {
  const BackgroundModel& model = learned.model();
  if (model.channels != image.channels) return false;
  std::size_t all = 0, same = 0;
  const auto n = static_cast<std::size_t>(channels);
  const int step = light_grid();
  for (int v = step / 2; v < height; v += step) {
    for (int u = step / 2; u < width; u += step) {
      const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
      if (model.precision[i] <= 0.0f || beside.at(u, v)) continue;
      float square = 0.0f;
      for (std::size_t c = 0; c < n; ++c) {
        const float d = static_cast<float>(image.pixel(u, v)[c]) - model.mean[i * n + c];
        square += d * d;
      }
      ++all;
      same += square * model.precision[i] < kSameSigma * kSameSigma * static_cast<float>(n);
    }
  }
  const double share = all == 0 ? 0.0 : static_cast<double>(same) / static_cast<double>(all);
  if (all > 0 && turned && share < kSameThoughTurned) {
    forget_background();
    return false;
  }
  turned = turned && share < kSameThoughTurned;
  const bool holds = share >= kHolds;
  misfits = holds || all == 0 ? 0 : misfits + 1;
  if (misfits >= kMostMisfits) forget_background();
  return holds;
}

void Segmenter::Impl::measure_edge_noise(const Image& image) {
  const BackgroundModel& model = learned.model();
  const auto n = static_cast<std::size_t>(channels);
  const auto unit = static_cast<float>(picture_unit(width, height));
  ratios.clear();
  const int every = evidence.sample_step();
  evidence.for_each_outside(kBesideFrom_px * unit, kBesideTo_px * unit, [&](int u, int v) {
    if (u % every != 0 || v % every != 0) return;
    const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
    if (model.precision[i] <= 0.0f) return;
    float square = 0.0f;
    for (std::size_t c = 0; c < n; ++c) {
      const float d = static_cast<float>(image.pixel(u, v)[c]) - model.mean[i * n + c];
      square += d * d;
    }
    if (square > static_cast<float>(n) * kMostSpoilt * kMostSpoilt) return;  // a held thing, somebody's arm
    ratios.push_back(square * model.precision[i]);
  });
  constexpr std::size_t kFewest = 100;
  if (ratios.size() < kFewest) return;
  const auto at = ratios.begin() + static_cast<std::ptrdiff_t>(kQuantile * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), at, ratios.end());
  const float now = std::max(1.0f, *at / (n == 1 ? kChiSquare1 : kChiSquare3));
  // Of a picture that was compressed the first is as good as any: whatever else it shows, colours bleed.
  edge_variance += (bleeds && edge_variance == 1.0f ? 1.0f : kEdgeShare) * (now - edge_variance);
}

void Segmenter::Impl::forget_background() {
  learned = LearnedBackground(setup, width, height);
  learned_offline = false;
  turned = false;
  misfits = 0;
}

void Segmenter::Impl::doubt_background() {
  known -= evidence.denied();
  detected -= evidence.denied();
}

/// The background about the outline of what is `sure`, where coverage asks for it: as learned, or as it is nearby.
void Segmenter::Impl::find_background(const Image& image, bool holds) {
  const BackgroundModel& model = learned.model();
  if (local.width != width || local.height != height || local.channels != channels) {
    local = BackgroundModel(width, height, channels);
  }
  local.noise_sd = holds                      ? model.noise_sd
                   : setup.noise_levels > 0.0 ? static_cast<float>(setup.noise_levels)
                                              : noise_of(image);
  constexpr int kOut_px = 2, kIn_px = 4;
  uncertain = sure;
  morphology.erode(uncertain, kIn_px);
  wanted = detected;
  morphology.dilate(wanted, kOut_px);
  const auto n = static_cast<std::size_t>(channels);
  for (int v = 0; v < height; ++v) {
    for (int w = 0; w < wanted.words_per_row(); ++w) {
      for (std::uint64_t bits = wanted.row(v)[w] &= ~uncertain.row(v)[w]; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
                       64 * static_cast<std::size_t>(w) + static_cast<std::size_t>(std::countr_zero(bits));
        const bool as_learned = holds && (evidence.denied().row(v)[w] >> std::countr_zero(bits) & 1) == 0;
        local.precision[i] = as_learned ? model.precision[i] / edge_variance : 0.0f;
        for (std::size_t c = i * n; as_learned && c < (i + 1) * n; ++c) local.mean[c] = model.mean[c];
      }
      wanted.row(v)[w] &= ~known.row(v)[w];
    }
  }
  const double unit = picture_unit(width, height);
  const int beside_px = bleeds ? kBled_px : kMixed_px;
  for (const double radius_px : {kAverage_px, 2.0 * kAverage_px}) {
    const int reach_px = static_cast<int>(radius_px * unit) + beside_px - kMixed_px;
    average.around(image, sure, wanted, evidence.box(), beside_px, reach_px, local);
  }
}

void Segmenter::Impl::segment_auto(const Image& image, BinaryMask& mask, BinaryMask& valid,
                                   std::vector<std::uint8_t>& coverage, const PredictedRobot& predicted) {
  const double unit = picture_unit(width, height);
  const double reach_px = predicted.reach_px > 0.0 ? predicted.reach_px : setup.search_px;
  if (beside.width() != width || beside.height() != height) {
    beside = BinaryMask(width, height);
    known = BinaryMask(width, height);
  }
  beside.fill(false);
  if (predicted.silhouette != nullptr) {
    beside = *predicted.silhouette;
    morphology.dilate(beside, static_cast<int>(std::ceil(reach_px)));
  }
  bleeds = resolution.bleeds(image, light_grid());
  const Image& seen = in_known_light(image);
  const bool holds = background_holds(seen);
  if (predicted.silhouette == nullptr) {
    if (holds) {
      compare(seen, learned.model(), mask, valid, coverage);
    } else {
      mask.fill(false);
      valid.fill(false);
      coverage.assign(image.data.size() / static_cast<std::size_t>(channels), 0);
    }
    return;
  }
  const bool everywhere = reach_px >= ColourEvidence::kEverywhere_px * unit;
  evidence.look_at(*predicted.silhouette, reach_px, holds && everywhere);
  // What lies beside a prediction that is far off is the robot.
  const bool beside_it = !from_stills || reach_px < static_cast<double>(kBesideTo_px) * unit;
  if (holds && !everywhere && beside_it) measure_edge_noise(seen);
  detected.fill(false);
  sure.fill(false);
  known.fill(false);
  if (holds && !evidence.box().empty()) {
    mark_valid(learned.model(), known, evidence.box());
    // Only beside the prediction, where alone it is asked for.
    detect(seen, learned.model(), edge_variance, evidence.box(), everywhere ? nullptr : &beside);
    components.remove_small(detected, setup.min_component_px);
    components.fill_small_holes(detected, setup.max_hole_px);
    sure &= detected;
    components.fill_small_holes(sure, std::max(setup.max_hole_px, 4));
  }
  if (looks.channels != channels) looks = {};
  const bool both = colours.known() && colours.robot.channels == channels && colours.rest.channels == channels;
  evidence.separate(seen, looks, both ? &colours : nullptr, known, sure, robot);
  doubt_background();
  components.remove_small(robot, setup.min_component_px);
  components.fill_small_holes(robot, setup.max_hole_px);
  // A pixel beyond what is sure may be robot in part: as the background says, or beside what colours say.
  sure = robot;
  morphology.dilate(robot);
  for (int v = 0; v < height; ++v) {
    for (int w = 0; w < known.words_per_row(); ++w) {
      const auto k = known.row(v)[w];
      const auto near = everywhere ? ~std::uint64_t{0} : beside.row(v)[w];
      detected.row(v)[w] = (detected.row(v)[w] & k & near) | (robot.row(v)[w] & ~k) | sure.row(v)[w];
    }
  }
  find_background(seen, holds);
  valid.fill(true);
  refine(seen, local, mask, valid, coverage);
  evidence.mark_weak(robot);
  robot -= known;
  valid -= robot;
}

void Segmenter::Impl::adapt_auto(const Image& image, const BinaryMask& mask, const PredictedRobot& predicted) {
  const bool relit_is_this = light != std::array<float, 3>{1.0f, 1.0f, 1.0f};
  const Image& seen = relit_is_this ? relit : image;
  robot = mask;
  morphology.dilate(robot, 3);
  robot |= beside;
  // A prediction that nothing has confirmed yet may be far from the arm, whose ghost would stay in the background.
  if (!predicted.trusted) morphology.dilate(robot, static_cast<int>(kFarOff_px * picture_unit(width, height)));
  constexpr int kEager = 20;
  learned.update(seen, &robot, learned.frames_seen() < kEager);
  if (predicted.silhouette != nullptr && predicted.trusted) {
    evidence.learn(seen, kLookShare, looks);
  }
}

}  // namespace bodyschema
