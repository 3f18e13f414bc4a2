#pragma once

#include <unistd.h>

#include <filesystem>
#include <functional>
#include <string>
#include <utility>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/diagnosis/log_diagnosis.hpp"
#include "bodyschema/simulator/recording.hpp"

namespace bodyschema::test {

/// A log of rendered pictures, or of masks where the plan has silhouettes, 25 s at 4 Hz, in a file that goes with this.
class RenderedLog {
 public:
  using Change = std::function<void(simulator::SimulatorSettings&, simulator::SimulationPlan&)>;
  using Edit = std::function<void(simulator::SimulatedFrame&, double share)>;  ///< of the log that is over

  explicit RenderedLog(const Change& change, const Edit& edit = {})
      : file_(std::filesystem::temp_directory_path() /
              ("bodyschema_rendered_" + std::to_string(getpid()) + ".lcmlog")) {
    const auto c =
        Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/evaluation.yaml");
    const auto setup = RobotSetup::from(c.section("robot"));
    auto settings = simulator::SimulatorSettings::from(c.section("simulator"));
    settings.supersampling = 1;
    settings.camera_rate_hz = 4.0;
    simulator::SimulationPlan plan;
    plan.seed = 5;
    plan.motion = simulator::Motion::kBabble;
    plan.seconds = 25.0;
    change(settings, plan);
    simulator::Simulator simulator(setup.load(), setup, StereoRig::from(c.section("cameras")), settings, plan);
    begin_s_ = static_cast<double>(simulator.first_motion_frame()) / settings.camera_rate_hz;
    LogWriter log(file_);
    simulator::FramePublisher::Options format;
    if (plan.output == simulator::Output::kSilhouettes) format.format = simulator::PictureFormat::kMasks;
    simulator::FramePublisher publisher(simulator.joint_names(), format);
    for (int i = 0; auto frame = simulator.next(); ++i) {
      if (edit) edit(*frame, static_cast<double>(i) / simulator.frame_count());
      publisher.publish(*frame, log);
    }
  }
  ~RenderedLog() {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }
  RenderedLog(const RenderedLog&) = delete;
  RenderedLog& operator=(const RenderedLog&) = delete;

  /// When the motion begins, s from the first picture.
  [[nodiscard]] double begin_s() const { return begin_s_; }

  [[nodiscard]] DiagnosisReport diagnosis(const std::string& method = "learned_background",
                                          const std::vector<std::string>& more = {}) const {
    LogDiagnosisOptions options;
    options.log = file_;
    options.quiet = true;
    std::vector<std::string> overrides = {"silhouette.engine=contour", "filter.particles=50",
                                          "bus.max_image_gap_ms=1000", "bus.max_encoder_gap_ms=1000",
                                          "vision.method=" + method};
    overrides.insert(overrides.end(), more.begin(), more.end());
    return diagnose_log(
        Configuration::load(std::filesystem::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml",
                            overrides),
        options);
  }

 private:
  std::filesystem::path file_;
  double begin_s_ = 0.0;
};

}  // namespace bodyschema::test
