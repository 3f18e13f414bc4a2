#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "bodyschema/calibration/calibrate.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/effects/error_model.hpp"
#include "bodyschema/geometry/binary_mask.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/simulator/rasterizer.hpp"
#include "drawn_outlines.hpp"

namespace bodyschema {

/// What a calibration says of a humanoid.
struct HumanoidModel {
  std::optional<ErrorModel> found;         ///< nothing: joints and links are as configured
  Pose X_link_optical = Pose::Identity();  ///< of the camera in the link that carries it
  PinholeIntrinsics intrinsics;
  double lag_s = 0.0;  ///< of pictures against encoders
  void take(const Calibration& calibration);
};

/// Where a humanoid's arms and hand are in its head camera's picture by such a model. Fingers are left out: nobody
/// knows them well.
class HumanoidView {
 public:
  /// @param configuration  of the robot; its first camera looks
  explicit HumanoidView(const Configuration& configuration);

  /// As configured.
  [[nodiscard]] const HumanoidModel& nominal() const { return nominal_; }
  /// @param encoders  joint angles as recorded, rad; others are at their defaults
  /// @param side  "left" or "right"
  BinaryMask silhouette(const HumanoidModel& model, const std::map<std::string, double>& encoders,
                        const std::string& side);
  /// The hand (robot.hand_link) in the camera's frame.
  [[nodiscard]] Pose hand(const HumanoidModel& model, const std::map<std::string, double>& encoders) const;
  /// Drawn edges (black), both arms as configured (red) and by a model (green), on white. Throws FileError.
  void write_figure(const DrawnPicture& drawn, const std::map<std::string, double>& encoders,
                    const HumanoidModel& model, const std::filesystem::path& png);

 private:
  [[nodiscard]] Eigen::VectorXd readings(const std::map<std::string, double>& encoders) const;
  /// Of links in the camera.
  [[nodiscard]] std::vector<Pose> places(const HumanoidModel& model, const std::map<std::string, double>& encoders,
                                         const std::vector<std::string>& links) const;

  Pipeline pipeline_;
  HumanoidModel nominal_;
  std::string carrier_;
};

}  // namespace bodyschema
