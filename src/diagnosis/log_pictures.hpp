#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bodyschema/diagnosis/diagnosis_report.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema::diagnosis {

/// A few of a log's pictures, kept while it is read, for the page about it.
class LogPictures {
 public:
  /// Keeps one observation in so many that at most `kMost` stay, spread over the log.
  void offer(const Observation& observation);

  /// When each picture of the report was taken and where the hand is in it: `utime`,
  /// `image_radius_px` and `depth_m` of its samples.
  static void place_hand(const Pipeline& pipeline, std::span<const ViewInput> views, DiagnosisReport& report);
  /// The hand enlarged with the outlines of the fit before and after the extension, where the extension
  /// helps most; with the outline of the encoders as they are where nothing was found.
  [[nodiscard]] std::vector<std::pair<Image, std::string>> draw(const Pipeline& pipeline,
                                                                std::span<const JointSample> stream,
                                                                const DiagnosisReport& report) const;

 private:
  static constexpr std::size_t kMost = 32;
  std::vector<Observation> kept_;
  std::size_t every_ = 1;
  std::size_t offered_ = 0;
};

}  // namespace bodyschema::diagnosis
