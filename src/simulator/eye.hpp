#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "bodyschema/simulator/background.hpp"
#include "bodyschema/simulator/image_sensor.hpp"
#include "bodyschema/simulator/kitchen.hpp"
#include "bodyschema/simulator/outline_noise.hpp"
#include "bodyschema/simulator/rasterizer.hpp"
#include "bodyschema/simulator/shadow_map.hpp"
#include "bodyschema/simulator/simulator.hpp"
#include "bodyschema/simulator/things.hpp"

namespace bodyschema::simulator {

/// What all cameras look at; constant while they do.
struct Studio {
  std::shared_ptr<const RobotModel> model;
  RobotSetup setup;
  StereoRig rig;
  SimulatorSettings settings;
  SimulationPlan plan;
  double motion_begin_s = 0.0, motion_end_s = 0.0;
  std::unique_ptr<TrueRobot> robot;
  std::vector<PaintedPart> arm;  ///< as RobotModel::meshes; empty when nothing is drawn
  std::unique_ptr<Background> background;
  std::unique_ptr<Kitchen> kitchen;
  std::unique_ptr<Things> things;

  [[nodiscard]] Microseconds utime(double t_s) const { return settings.start_utime + microseconds(t_s); }
};

/// The arm's covers as built and painted.
std::vector<PaintedPart> painted_arm(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup,
                                     const SimulatorSettings& settings, const TrueBody& body);

/// One camera and all it needs to take pictures. Used by one thread at a time.
class Eye {
 public:
  /// @param studio  outlives the eye
  Eye(const Studio& studio, std::size_t camera);

  /// @param index  number of the picture; @param exposure_s  time of the log that its stamp is of, were it in time
  /// @param frame  null for a dead camera: only the truth is worked out
  void shoot(int index, double exposure_s, CameraTruth& truth, CameraFrame* frame);
  /// The room with its furniture, without robot and noise.
  [[nodiscard]] Image room();

 private:
  /// Rows [v0, v1) as they are at one moment, for a picture put together from several.
  struct Slice {
    double t_s;
    double begin_s, end_s;
    int v0, v1;
  };
  /// The exposure of the picture: the middle of row v is at middle_s + (v / (rows - 1) - 0.5) * readout_s.
  struct Shutter {
    double middle_s, exposure_s, readout_s;
    int rows;
    [[nodiscard]] double row_middle_s(int v) const;
    /// How much of row v's light falls between two times.
    [[nodiscard]] float share(int v, double begin_s, double end_s) const;
  };
  [[nodiscard]] bool plain(const Shutter& shutter) const;
  void pose(double t_s);
  [[nodiscard]] std::vector<Slice> slices(const Shutter& shutter);
  void paint_room(int v0, int v1);
  void draw(const Slice& slice, bool robot_too, bool new_shadow);
  void compose(const Slice& slice, const Shutter& shutter);
  void shoot_plain(CameraTruth& truth, CameraFrame& frame);
  void shoot_scene(const Shutter& shutter, CameraTruth& truth, CameraFrame& frame);
  void finish(const Shutter& shutter, int index, CameraFrame& frame);

  const Studio& studio_;
  std::size_t index_;
  CameraModel camera_;
  std::size_t covers_ = 0;
  std::unique_ptr<Lens> lens_;
  std::unique_ptr<TrueKinematics> kinematics_;
  std::unique_ptr<Rasterizer> arm_, things_;
  std::vector<TriangleMesh> casting_;
  std::unique_ptr<ShadowMap> shadow_;
  std::unique_ptr<Things::Placer> placer_;
  std::unique_ptr<ImageSensor> sensor_;
  std::unique_ptr<OutlineDisplacer> outlines_;

  // As posed last.
  Eigen::VectorXd q_;
  std::vector<Pose> X_W_;  // covers, hand, fingertips, camera's link
  Pose X_WC_;
  std::vector<Eigen::Isometry3f> X_CA_;  // covers
  std::vector<Pose> X_WT_;               // things
  std::vector<Eigen::Isometry3f> X_CT_;
  std::vector<char> hidden_;

  std::vector<float> room_;  // as painted last
  Pose room_X_WC_ = Pose::Identity();
  bool has_room_ = false;
  std::vector<float> light_;                  // three a pixel, levels
  std::vector<float> seen_, there_, middle_;  // share of each pixel: robot seen; robot, hidden or not; middle sample
  std::vector<Eigen::Isometry3f> casters_;
  std::vector<char> casters_hidden_;
};

}  // namespace bodyschema::simulator
