#pragma once

#include <span>
#include <vector>

#include "bodyschema/observation/corrections.hpp"
#include "bodyschema/evidence/picture_log.hpp"
#include "bodyschema/vision/segmenter.hpp"

namespace bodyschema {

/// Of each observation, in order of time, which recording it is of: after a pause that is long by itself and beside
/// what is usual between them another begins, in which camera and room may stand otherwise.
std::vector<std::size_t> recordings_of(const std::vector<Observation>& kept);

/// Masks of pictures that come without, made anew each time the robot is known better. What stands still before a still
/// camera is known from the other postures, be they ten; what is left is judged by the colours on both sides of the
/// predicted outline, and where these do not differ it says nothing (Segmenter, `auto`).
class RawPictures {
 public:
  /// @param log  its outlines are replaced
  /// @param kept  its pictures, as the lens's distortion leaves them; must outlive this
  RawPictures(PictureLog& log, const VisionSetup& vision, const std::vector<Observation>& kept);

  /// Whether most of the pictures show what other pictures show at the same place: the cameras stood still.
  bool cameras_stood_still();
  /// Masks of what moves, by what most pictures agree about, without knowing where the robot is; after
  /// `cameras_stood_still`. What never moved has no say then (PictureLog::learned_background).
  void by_what_moved();
  /// Masks about a prediction.
  /// @param corrections  of every picture of the log, as LinearLog::corrections
  /// @param reach_px  how far off the outlines may be, px of a 320x240 picture
  /// @return the log as it was
  PictureLog about(std::span<const Corrections> corrections, double reach_px);

 private:
  PictureLog replace(const std::vector<Observation>& seen, bool learned);

  PictureLog& log_;
  VisionSetup vision_;
  const std::vector<Observation>& kept_;
  /// Masks of one picture; what lies beyond the edge of a straightened picture does not count.
  /// @param i  of `kept`
  void segment(std::size_t camera, std::size_t i, const PredictedRobot& predicted, CameraObservation& out);

  std::vector<std::size_t> recording_;              ///< of each observation: backgrounds hold within one
  std::vector<std::vector<Segmenter>> segmenters_;  ///< by camera and recording
  std::vector<BinaryMask> shown_;                   ///< by camera, where its lens shows something; empty: everywhere
  std::vector<Observation> moved_;                  ///< masks of what moves
};

}  // namespace bodyschema
