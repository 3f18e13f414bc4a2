#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/geometry/pinhole.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"

namespace bodyschema {

/// The observed masks of all cameras in the form the engines count with: a valid mask always there,
/// the observed mask restricted to it. Before the first observation everything is empty and valid.
class ObservationMasks {
 public:
  explicit ObservationMasks(std::span<const PinholeIntrinsics> cameras) {
    for (const auto& camera : cameras) {
      observed_.emplace_back(camera.width, camera.height);
      valid_.emplace_back(camera.width, camera.height);
      valid_.back().fill(true);
      counts_.push_back(0);
    }
  }

  /// Throws std::invalid_argument for a number of cameras or a size that does not fit; nothing is
  /// changed then.
  void set(std::span<const ObservedSilhouette> observations) {
    if (observations.size() != observed_.size()) {
      throw std::invalid_argument("observation of " + std::to_string(observations.size()) + " cameras, expected " +
                                  std::to_string(observed_.size()));
    }
    for (std::size_t c = 0; c < observations.size(); ++c) {
      check("mask", observations[c].mask, c);
      if (!observations[c].valid.empty()) check("valid mask", observations[c].valid, c);
    }
    for (std::size_t c = 0; c < observations.size(); ++c) {
      BinaryMask& observed = observed_[c];
      BinaryMask& valid = valid_[c];
      if (observations[c].valid.empty()) {
        valid.fill(true);
      } else {
        valid = observations[c].valid;
      }
      observed = observations[c].mask;
      observed &= valid;
      counts_[c] = static_cast<std::uint32_t>(observed.count());
    }
  }

  [[nodiscard]] const BinaryMask& observed(std::size_t camera) const { return observed_[camera]; }
  [[nodiscard]] const BinaryMask& valid(std::size_t camera) const { return valid_[camera]; }
  [[nodiscard]] std::uint32_t count(std::size_t camera) const { return counts_[camera]; }

 private:
  void check(const char* what, const BinaryMask& mask, std::size_t camera) const {
    const BinaryMask& expected = observed_[camera];
    if (mask.width() != expected.width() || mask.height() != expected.height()) {
      throw std::invalid_argument("camera " + std::to_string(camera) + ": observed " + what + " is " +
                                  std::to_string(mask.width()) + "x" + std::to_string(mask.height()) + ", expected " +
                                  std::to_string(expected.width()) + "x" + std::to_string(expected.height()));
    }
  }

  std::vector<BinaryMask> observed_;
  std::vector<BinaryMask> valid_;
  std::vector<std::uint32_t> counts_;
};

}  // namespace bodyschema
