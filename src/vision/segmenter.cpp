#include "bodyschema/vision/segmenter.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "bodyschema/core/error.hpp"
#include "bodyschema/vision/mask_operations.hpp"
#include "bodyschema/vision/mask_picture.hpp"
#include "coverage.hpp"
#include "learned_background.hpp"
#include "single_colour_background.hpp"

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
    for (std::size_t c = 0; c < static_cast<std::size_t>(background.channels); ++c) {
      const float d = std::abs(
          static_cast<float>(frame.data[i * static_cast<std::size_t>(frame.channels) + c]) -
          background.mean[c][i]);
      ++histogram[static_cast<std::size_t>(std::min(d + 0.5f, 255.0f))];
    }
  }
  return noise_from_differences(histogram);
}

BackgroundModel load_background(const VisionSetup& setup, const std::string& camera, int width,
                                int height) {
  const auto found = setup.background_pictures.find(camera);
  if (found == setup.background_pictures.end()) {
    throw ConfigurationError("vision.background_pictures: no picture for camera '" + camera + "'");
  }
  const Image picture = read_picture(found->second);
  if (picture.width != width || picture.height != height) {
    throw FileError(found->second.string() + ": background picture is " +
                    std::to_string(picture.width) + "x" + std::to_string(picture.height) +
                    ", camera '" + camera + "' is " + std::to_string(width) + "x" +
                    std::to_string(height));
  }
  BackgroundModel model(width, height, picture.channels);
  model.noise_sd = std::max(static_cast<float>(setup.noise_levels), kLeastNoiseSd);
  for (std::size_t i = 0; i < model.pixels(); ++i) {
    int sum = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(picture.channels); ++c) {
      const auto level = picture.data[i * static_cast<std::size_t>(picture.channels) + c];
      model.mean[c][i] = level;
      sum += level;
    }
    const bool known = !setup.black_is_unknown || sum > 0;
    model.precision[i] = known ? 1.0f / (model.noise_sd * model.noise_sd) : 0.0f;
  }
  return model;
}

}  // namespace

struct Segmenter::Impl {
  Impl(const VisionSetup& s, std::string name, int w, int h)
      : setup(s), camera(std::move(name)), width(w), height(h), single_colour(s, w, h),
        learned(s, w, h), detected(w, h), sure(w, h), uncertain(w, h), robot(w, h) {}

  void check(const Image& image);
  [[nodiscard]] const BackgroundModel& background() const;
  void detect(const Image& image, const BackgroundModel& model);
  void detect_hard(const Image& image, const BackgroundModel& model);
  void mark_valid(const BackgroundModel& model, BinaryMask& valid) const;

  VisionSetup setup;
  std::string camera;
  int width;
  int height;
  int channels = 0;  // of the first frame

  SingleColourBackground single_colour;
  LearnedBackground learned;
  BackgroundModel given;
  bool given_noise_known = false;
  FrameSelection selection;
  bool learned_offline = false;
  int frames = 0;

  CoverageEstimator coverage_estimator;
  ComponentFilter components;
  MaskMorphology morphology;
  BinaryMask detected, sure, uncertain, robot;
  std::vector<float> rows;  // see detect()
};

void Segmenter::Impl::check(const Image& image) {
  const auto expected = static_cast<std::size_t>(image.width) *
                        static_cast<std::size_t>(image.height) *
                        static_cast<std::size_t>(std::max(image.channels, 0));
  if (image.empty() || image.width != width || image.height != height ||
      (image.channels != 1 && image.channels != 3) || image.data.size() != expected) {
    throw DataError("camera '" + camera + "': picture of " +
                    size_text(image.width, image.height, image.channels) + " with " +
                    std::to_string(image.data.size()) + " bytes, expected " +
                    std::to_string(width) + "x" + std::to_string(height) + ", 1 or 3 channels");
  }
  if (channels == 0) channels = given.channels;
  if (channels == 0) channels = image.channels;
  if (image.channels != channels) {
    throw DataError("camera '" + camera + "': picture with " + std::to_string(image.channels) +
                    " channels, expected " + std::to_string(channels) + " as in the background");
  }
}

const BackgroundModel& Segmenter::Impl::background() const {
  switch (setup.method) {
    case SegmentationMethod::kSingleColour: return single_colour.model();
    case SegmentationMethod::kBackgroundPicture: return given;
    case SegmentationMethod::kLearnedBackground:
    case SegmentationMethod::kStatistics: break;
  }
  return learned.model();
}

/// `sure`: the pixel itself differs from the background. `detected`: the mean of its 3x3 square
/// does, which sees a third of that contrast; it reaches one pixel farther out.
void Segmenter::Impl::detect(const Image& image, const BackgroundModel& model) {
  const auto w = static_cast<std::size_t>(width);
  const auto n = static_cast<std::size_t>(channels);
  // Per channel three rows of differences summed over three columns, then one row of plain
  // differences; at the end two rows of scores.
  rows.resize(w * (4 * n + 2));
  const auto summed = [&](std::size_t c, int v) {
    return rows.data() + w * (4 * c + static_cast<std::size_t>(v % 3));
  };
  float* pixel_score = rows.data() + w * 4 * n;
  float* square_score = pixel_score + w;

  const auto sigma = static_cast<float>(setup.threshold_sigma);
  const auto levels = static_cast<float>(setup.threshold_levels);
  const float pixel_limit = sigma * sigma;
  // The sum of nine has nine times the variance of one; expressed in units of one pixel's.
  const float square_limit = 9.0f * sigma * sigma;
  const float square_levels = 81.0f * levels * levels;
  const float pixel_levels = levels * levels;

  const auto sum_rows = [&](int v) {
    for (std::size_t c = 0; c < n; ++c) {
      float* plain = rows.data() + w * (4 * c + 3);
      float* out = summed(c, v);
      const std::uint8_t* in = image.pixel(0, v) + c;
      const float* mean = model.mean[c].data() + static_cast<std::size_t>(v) * w;
      for (std::size_t u = 0; u < w; ++u) plain[u] = static_cast<float>(in[u * n]) - mean[u];
      for (std::size_t u = 1; u + 1 < w; ++u) out[u] = plain[u - 1] + plain[u] + plain[u + 1];
      out[0] = 2.0f * plain[0] + plain[w > 1 ? 1 : 0];
      out[w - 1] = 2.0f * plain[w - 1] + plain[w > 1 ? w - 2 : 0];
      for (std::size_t u = 0; u < w; ++u) {
        pixel_score[u] = (c == 0 ? 0.0f : pixel_score[u]) + plain[u] * plain[u];
      }
    }
  };
  const auto pack = [&](const float* score, const float* precision, float limit, float least,
                        std::uint64_t* out) {
    for (std::size_t u = 0; u < w;) {
      std::uint64_t word = 0;
      const std::size_t end = std::min(w, u + 64);
      for (std::size_t bit = 0; u < end; ++u, ++bit) {
        const bool set = score[u] * precision[u] > limit && score[u] > least;
        word |= static_cast<std::uint64_t>(set) << bit;
      }
      *out++ = word;
    }
  };
  for (int v = 0; v <= height; ++v) {
    if (v < height) {
      sum_rows(v);
      pack(pixel_score, model.precision.data() + static_cast<std::size_t>(v) * w, pixel_limit,
           pixel_levels, sure.row(v));
    }
    if (v == 0) continue;
    const int here = v - 1;
    for (std::size_t c = 0; c < n; ++c) {
      const float* a = summed(c, std::max(here - 1, 0));
      const float* b = summed(c, here);
      const float* d = summed(c, std::min(here + 1, height - 1));
      for (std::size_t u = 0; u < w; ++u) {
        const float sum = a[u] + b[u] + d[u];
        square_score[u] = (c == 0 ? 0.0f : square_score[u]) + sum * sum;
      }
    }
    pack(square_score, model.precision.data() + static_cast<std::size_t>(here) * w, square_limit,
         square_levels, detected.row(here));
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
          worst = std::max(worst, std::abs(static_cast<float>(in[c]) - model.mean[c][i]));
        }
        word |= static_cast<std::uint64_t>(worst > limit && model.precision[i] > 0.0f) << bit;
      }
      *out++ = word;
    }
  }
}

void Segmenter::Impl::mark_valid(const BackgroundModel& model, BinaryMask& valid) const {
  for (int v = 0; v < height; ++v) {
    const float* precision =
        model.precision.data() + static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    auto* out = valid.row(v);
    for (int u = 0; u < width;) {
      std::uint64_t word = 0;
      const int end = std::min(width, u + 64);
      for (int bit = 0; u < end; ++u, ++bit) {
        word |= static_cast<std::uint64_t>(precision[u] > 0.0f) << bit;
      }
      *out++ = word;
    }
  }
}

Segmenter::Segmenter(const VisionSetup& setup, const std::string& camera, int width, int height)
    : impl_(std::make_unique<Impl>(setup, camera, std::max(width, 0), std::max(height, 0))) {
  if (width <= 0 || height <= 0) {
    throw ConfigurationError("camera '" + camera + "': a picture of " + std::to_string(width) + "x" +
                             std::to_string(height) + " pixels cannot be segmented");
  }
  if (setup.method == SegmentationMethod::kBackgroundPicture) {
    impl_->given = load_background(setup, camera, width, height);
    impl_->given_noise_known = setup.noise_levels > 0.0 || setup.edges == EdgeKind::kHard;
  }
}

Segmenter::~Segmenter() = default;
Segmenter::Segmenter(Segmenter&&) noexcept = default;
Segmenter& Segmenter::operator=(Segmenter&&) noexcept = default;

void Segmenter::learn_from(const Image& frame) {
  impl_->check(frame);
  if (impl_->setup.method == SegmentationMethod::kLearnedBackground) impl_->selection.add(frame);
  if (impl_->setup.method == SegmentationMethod::kSingleColour) impl_->single_colour.update(frame);
}

void Segmenter::finish_learning() {
  auto& self = *impl_;
  if (self.setup.method != SegmentationMethod::kLearnedBackground) return;
  self.learned.learn(self.selection.frames(), self.selection.noise_sd());
  self.learned_offline = !self.selection.frames().empty();
  self.selection.clear();
}

void Segmenter::learn(std::span<const Image> frames) {
  for (const auto& frame : frames) learn_from(frame);
  finish_learning();
}

bool Segmenter::ready() const {
  if (impl_->setup.method != SegmentationMethod::kLearnedBackground) return true;
  return impl_->learned_offline || impl_->learned.frames_seen() >= impl_->setup.learning_frames;
}

const BackgroundModel& Segmenter::background() const { return impl_->background(); }

void Segmenter::segment(const Image& image, BinaryMask& mask, BinaryMask& valid,
                        std::vector<std::uint8_t>& coverage, const BinaryMask* predicted) {
  auto& self = *impl_;
  self.check(image);
  if (predicted != nullptr &&
      (predicted->width() != self.width || predicted->height() != self.height)) {
    predicted = nullptr;
  }
  const auto fit = [&](BinaryMask& m) {
    if (m.width() != self.width || m.height() != self.height) m = BinaryMask(self.width, self.height);
  };
  fit(mask);
  fit(valid);
  const bool learning = self.setup.method == SegmentationMethod::kLearnedBackground;
  if (!ready()) {
    self.learned.update(image, nullptr, true);
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
  const auto& model = self.background();
  self.mark_valid(model, valid);

  if (self.setup.edges == EdgeKind::kHard) {
    self.detect_hard(image, model);
    self.components.remove_small(self.detected, self.setup.min_component_px);
    self.components.fill_small_holes(self.detected, self.setup.max_hole_px);
    mask = self.detected;
    coverage.resize(image.data.size() / static_cast<std::size_t>(self.channels));
    std::size_t i = 0;
    for (int v = 0; v < self.height; ++v) {
      for (int u = 0; u < self.width; ++u, ++i) coverage[i] = mask.at(u, v) ? 255 : 0;
    }
  } else {
    self.detect(image, model);
    self.components.remove_small(self.detected, self.setup.min_component_px);
    self.components.fill_small_holes(self.detected, self.setup.max_hole_px);
    for (int v = 0; v < self.height; ++v) {
      for (int w = 0; w < self.detected.words_per_row(); ++w) {
        self.sure.row(v)[w] &= self.detected.row(v)[w];
      }
    }
    self.components.fill_small_holes(self.sure, std::max(self.setup.max_hole_px, 4));
    self.coverage_estimator.estimate(image, model, self.detected, self.sure,
                                     static_cast<float>(self.setup.least_contrast_sigma), mask,
                                     self.uncertain, coverage);
    for (int v = 0; v < self.height; ++v) {
      for (int w = 0; w < valid.words_per_row(); ++w) valid.row(v)[w] &= ~self.uncertain.row(v)[w];
    }
    self.components.remove_small(mask, self.setup.min_component_px);
    self.components.fill_small_holes(mask, self.setup.max_hole_px);
    // What the clean-up changed, it changed wholly.
    std::size_t i = 0;
    for (int v = 0; v < self.height; ++v) {
      for (int u = 0; u < self.width; ++u, ++i) {
        if (mask.at(u, v) != (coverage[i] >= 128)) coverage[i] = mask.at(u, v) ? 255 : 0;
      }
    }
  }

  if (learning) {
    // Where the robot is, nothing is learned: as predicted, or else as seen.
    self.robot = predicted != nullptr ? *predicted : mask;
    self.morphology.dilate(self.robot, predicted != nullptr ? 6 : 3);
    self.learned.update(image, &self.robot, false);
  }
  ++self.frames;
}

}  // namespace bodyschema
