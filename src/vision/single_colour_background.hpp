#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bodyschema/geometry/image.hpp"
#include "bodyschema/vision/background_model.hpp"
#include "bodyschema/vision/vision_setup.hpp"

namespace bodyschema {

/// A background of one colour under slowly varying light: one quadratic surface per channel,
/// fitted robustly to the means of 4x4 blocks and followed from frame to frame.
class SingleColourBackground {
 public:
  SingleColourBackground(const VisionSetup& setup, int width, int height);
  /// Blocks near the present surface pull it along; the first frame finds the surface.
  void update(const Image& frame);
  [[nodiscard]] const BackgroundModel& model() const { return model_; }

 private:
  static constexpr int kBlock = 4;
  static constexpr std::size_t kTerms = 6;  // 1, x, y, x^2, xy, y^2
  using Terms = std::array<double, kTerms>;
  struct Moments {
    std::array<double, kTerms * kTerms> normal{};
    std::array<Terms, 3> right{};
    double weight = 0.0;
  };

  void measure_blocks(const Image& frame);
  void find_colour();
  void accumulate(double gate, Moments& moments) const;
  void solve(const Moments& moments, std::size_t terms);
  [[nodiscard]] double residual(std::size_t block) const;
  void render();

  VisionSetup setup_;
  int columns_ = 0;
  int rows_ = 0;
  bool ready_ = false;
  int frames_ = 0;
  std::array<std::vector<float>, 3> block_mean_;
  std::vector<float> block_variance_;  // of one channel, mean over channels
  std::vector<float> scratch_;
  std::array<Terms, 3> surface_{};
  Moments history_;
  BackgroundModel model_;
};

}  // namespace bodyschema
