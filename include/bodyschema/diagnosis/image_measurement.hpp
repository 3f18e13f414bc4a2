#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bodyschema/camera/stereo_rig.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/observation/observation.hpp"
#include "bodyschema/robot/robot_setup.hpp"
#include "bodyschema/silhouette/contour_points.hpp"

namespace bodyschema {

/// Residuals of a recorded log: the predicted outline of the robot against the observed one, along
/// the outline's normals, to a fraction of a pixel.
///
/// Keeps the coverage of every picture (one byte a pixel), not the pictures. Predictions run on
/// `threads` threads; results do not depend on their number.
class ImageMeasurement final : public MeasurementSource {
 public:
  ImageMeasurement(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
                   int threads = 2);
  ~ImageMeasurement() override;

  /// Adds both pictures of an observation whose masks and coverage have been filled in. In order
  /// of time. One that repeats the last, with the same outlines at the same encoder readings, says
  /// nothing new and is left out: a simulator at rest, a driver that publishes twice.
  void add(const Observation& observation);
  /// The encoder log at full rate, in order of time.
  void set_stream(std::vector<JointSample> stream);
  bool set_search(double search_px, std::size_t every = 1) override {
    search_px_ = search_px;
    every_ = every;
    return true;
  }

  const JointRoles& roles() const override { return roles_; }
  std::span<const ViewInput> views() const override { return views_; }
  std::span<const JointSample> stream() const override { return stream_; }
  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override;
  void compress(std::span<const Corrections> corrections, std::vector<CompressedView>& out) override;
  Eigen::MatrixXd hand_jacobian(std::size_t view, const Corrections& corrections) override;

 private:
  struct Seen {
    std::vector<std::uint8_t> coverage;
    BinaryMask valid;
    friend bool operator==(const Seen&, const Seen&) = default;
  };
  struct Worker;
  static Seen seen_of(const CameraObservation& camera, const PinholeIntrinsics& intrinsics);
  [[nodiscard]] bool repeats_the_last(const std::vector<std::pair<ViewInput, Seen>>& pictures) const;

  RobotSetup setup_;
  StereoRig rig_;
  JointRoles roles_;
  InstantBuilder instants_;
  std::vector<ViewInput> views_;
  std::vector<Seen> seen_;
  std::vector<JointSample> stream_;
  std::vector<std::unique_ptr<Worker>> workers_;
  double search_px_ = 6.0;
  std::size_t every_ = 1;
};

}  // namespace bodyschema
