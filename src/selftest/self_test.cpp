#include "bodyschema/selftest/self_test.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <chrono>
#include <lcm/lcm.h>
#include <map>
#include <memory>
#include <random>
#include <spdlog/fmt/fmt.h>
#include <sys/utsname.h>
#include <thread>
#include <vector>

#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/core/configuration.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/order_statistics.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/gl/context.hpp"
#include "bodyschema/pipeline/pipeline.hpp"
#include "bodyschema/service/start_up_checks.hpp"
#include "bodyschema/silhouette/silhouette_scorer.hpp"
#include "bodyschema/simulator/simulator.hpp"

namespace bodyschema {
namespace {

using Clock = std::chrono::steady_clock;

/// The hidden offsets, deg, and what is left at most where everything works. The estimator is ten
/// times better; a renderer or compiler that draws wrongly is not.
constexpr std::array kHiddenOffsets_deg = {5.0, 4.0, 3.0, -2.0, 3.0, -7.0, 3.0};
constexpr double kBound_mm = 2.0;
constexpr std::size_t kLastFrames = 10;
constexpr double kCameraPeriod_ms = 1000.0 / 30.0;

constexpr int kLoopbackMessages = 20;
constexpr std::size_t kStereoPair_bytes = 2 * 320 * 240 * 3;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class SelfTest {
 public:
  SelfTest(const SelfTestOptions& options, const std::function<void(const CheckResult&)>& report)
      : options_(options), report_(report) {}

  CheckLevel run() {
    check("version", [this] { return versions(); });
    const bool have_files = check("files", [this] { return files(); }) != CheckLevel::kFail;
    const bool have_robot = have_files && check("robot", [this] { return robot(); }) != CheckLevel::kFail;
    check("opengl", [this] { return opengl(); });
    check("engine", [this] { return engine(); });
    if (have_robot) check("reach", [this] { return reach(); });
    if (!options_.own_config.empty()) check("config", [this] { return own_config(); });
    check("network", [this] { return network(); });
    check("lcm", [this] { return loopback(); });
    return worst_;
  }

 private:
  using Finding = std::pair<CheckLevel, std::string>;

  template <class Look>
  CheckLevel check(const char* name, Look look) {
    Finding finding;
    try {
      finding = look();
    } catch (const std::exception& e) {
      finding = {CheckLevel::kFail, e.what()};
    }
    worst_ = std::max(worst_, finding.first);
    report_({finding.first, name, finding.second});
    return finding.first;
  }

  Finding versions() const {
    utsname system{};
    uname(&system);
    return {CheckLevel::kOk, fmt::format("bodyschema {}, LCM {}.{}.{}, Eigen {}.{}.{}, {} {} on {} with {} processors",
                                         options_.version, LCM_MAJOR_VERSION, LCM_MINOR_VERSION, LCM_MICRO_VERSION,
                                         EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION, system.sysname,
                                         system.release, system.machine, std::thread::hardware_concurrency())};
  }

  static Finding files() {
    const auto directory = data_directory();
    std::error_code ignored;
    if (!std::filesystem::exists(directory / "config", ignored) ||
        !std::filesystem::exists(directory / "meshes", ignored)) {
      return {CheckLevel::kFail,
              fmt::format("configurations and robots are not {}; install the "
                          "package again, or set BODYSCHEMA_SHARE "
                          "to the folder that holds config/ and meshes/",
                          directory.empty() ? "installed beside this program" : "in " + directory.string())};
    }
    return {CheckLevel::kOk, "configurations and robots are read from " + directory.string()};
  }

  Finding robot() {
    configuration_ = std::make_unique<Configuration>(Configuration::load(data_directory() / options_.reach_config));
    const auto setup = RobotSetup::from(configuration_->section("robot"));
    const auto model = setup.load();
    std::size_t triangles = 0;
    for (const auto& part : model->meshes()) triangles += part.mesh.triangles.size();
    if (!model->warnings().empty()) return {CheckLevel::kWarn, model->warnings().front()};
    return {CheckLevel::kOk,
            fmt::format("{}: {} joints, {} parts with {} triangles, from {}", model->name(), model->joints().size(),
                        model->meshes().size(), triangles, setup.model.urdf.lexically_normal().string())};
  }

  static Finding opengl() {
    try {
      const auto context = gl::Context::create("auto");
      return {CheckLevel::kOk,
              context->description() + (context->is_software() ? ", drawn by the processor" : ", drawn by the GPU")};
    } catch (const gl::ContextError& e) {
      return {CheckLevel::kWarn, std::string("none, silhouettes are computed without it: ") + e.what()};
    }
  }

  static Finding engine() {
    SilhouetteModel tetrahedron;
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}, {0, 0, 0.1f}};
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    tetrahedron.parts.push_back(mesh);
    const PinholeIntrinsics camera{64, 48, 50.0, 50.0, 31.5, 23.5};
    std::string reason;
    const auto scorer = make_silhouette_scorer(tetrahedron, std::span(&camera, 1), {}, &reason);
    return {CheckLevel::kOk, scorer->description() + (reason.empty() ? "" : ": " + reason)};
  }

  /// A reach of the simulated robot through the pipeline that the service runs.
  Finding reach() const {
    const auto begin = Clock::now();
    Pipeline pipeline(*configuration_);
    auto settings = simulator::SimulatorSettings::from(configuration_->section("simulator"));
    configuration_->reject_unknown_keys();
    settings.supersampling = 2;
    simulator::SimulationPlan plan;
    plan.frames = options_.frames;
    plan.threads = 2;
    const auto& joints = pipeline.setup().estimated_joints;
    for (std::size_t k = 0; k < joints.size(); ++k) {
      plan.offsets_deg[joints[k]] = kHiddenOffsets_deg[k % kHiddenOffsets_deg.size()];
    }
    simulator::Simulator simulator(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), settings, plan);

    ProgressBar bar("reach", static_cast<std::uint64_t>(simulator.frame_count()));
    std::vector<JointSample> history;
    std::vector<double> before_mm, after_mm, frame_ms;
    while (const auto frame = simulator.next()) {
      history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
      Observation observation = simulator::to_observation(*frame, history);
      const Estimate estimate = pipeline.process(observation);
      bar.advance();
      if (frame->phase != simulator::Phase::kMotion || estimate.X_CP.empty()) continue;
      const Eigen::Vector3d truth = frame->truth[0].X_CP.translation();
      before_mm.push_back(1e3 * (estimate.X_CP_nominal[0].translation() - truth).norm());
      after_mm.push_back(1e3 * (estimate.X_CP[0].translation() - truth).norm());
      frame_ms.push_back(pipeline.segmentation_ms() + estimate.times.total_ms);
    }
    if (after_mm.size() < kLastFrames) {
      return {CheckLevel::kFail,
              fmt::format("only {} of {} frames gave an estimate", after_mm.size(), options_.frames)};
    }
    const std::vector<double> last(after_mm.end() - kLastFrames, after_mm.end());
    const double before = median(before_mm);
    const double after = *std::max_element(last.begin(), last.end());
    const double per_frame = median(frame_ms);
    const std::string found = fmt::format(
        "a simulated reach with wrong encoders: hand off by {:.1f} mm before, at most {:.2f} mm "
        "after correction; {:.0f} ms a frame, {:.1f} s in all",
        before, after, per_frame, seconds_since(begin));
    if (!(after < kBound_mm)) {
      return {CheckLevel::kFail, fmt::format("{}; at most {:.0f} mm was expected", found, kBound_mm)};
    }
    if (per_frame > kCameraPeriod_ms) {
      return {CheckLevel::kWarn, found + "; cameras of 30 Hz are too fast for this machine, frames will be left out"};
    }
    return {CheckLevel::kOk, found};
  }

  Finding own_config() const {
    const Configuration configuration = Configuration::load(find_data_file(options_.own_config));
    Pipeline pipeline(configuration);
    configuration.reject_unknown_keys();
    return {CheckLevel::kOk, fmt::format("{}: robot {}, offsets of {} joints, {} cameras", options_.own_config.string(),
                                         pipeline.robot().name(), pipeline.setup().estimated_joints.size(),
                                         pipeline.rig().cameras.size())};
  }

  Finding network() const {
    const auto complaints = check_network(options_.lcm_url);
    if (complaints.empty()) {
      return {CheckLevel::kOk,
              fmt::format("{}: there is a route, and room for pictures in the receive buffer", options_.lcm_url)};
    }
    return {CheckLevel::kWarn, fmt::format("{}", fmt::join(complaints, "; "))};
  }

  /// Messages as large as a stereo pair, to ourselves and back, as fast as cameras send them.
  static Finding loopback() {
    std::random_device seed;
    const int port = std::uniform_int_distribution(20000, 60000)(seed);
    LcmLink link(with_receive_buffer(fmt::format("udpm://239.255.76.67:{}?ttl=0", port)));
    constexpr const char* kChannel = "BODYSCHEMA_SELFTEST";
    int good = 0;
    std::vector<std::uint8_t> message(kStereoPair_bytes);
    for (std::size_t i = 0; i < message.size(); ++i) message[i] = static_cast<std::uint8_t>(i * 2654435761u >> 24);
    link.subscribe(kChannel, kLoopbackMessages, [&](const std::string&, Bytes bytes, std::int64_t) {
      good += std::equal(bytes.begin(), bytes.end(), message.begin(), message.end()) ? 1 : 0;
    });
    double worst_ms = 0.0;
    for (int i = 0; i < kLoopbackMessages; ++i) {
      const int had = good;
      const auto sent = Clock::now();
      link.publish(kChannel, 0, message);
      while (good == had && seconds_since(sent) < 0.1) link.handle(10);
      if (good > had) worst_ms = std::max(worst_ms, 1e3 * seconds_since(sent));
    }
    const std::string came_back =
        fmt::format("{} of {} messages of {} KiB came back", good, kLoopbackMessages, kStereoPair_bytes / 1024);
    if (good == 0) return {CheckLevel::kFail, came_back + "; does a firewall stop UDP multicast on this machine?"};
    if (good < kLoopbackMessages) {
      return {CheckLevel::kWarn, came_back +
                                     "; the receive buffer is too small or the machine too busy; as root: "
                                     "sysctl -w net.core.rmem_max=8388608"};
    }
    return {CheckLevel::kOk, fmt::format("{}, each within {:.0f} ms", came_back, std::max(1.0, worst_ms))};
  }

  const SelfTestOptions& options_;
  const std::function<void(const CheckResult&)>& report_;
  std::unique_ptr<Configuration> configuration_;
  CheckLevel worst_ = CheckLevel::kOk;
};

}  // namespace

const char* to_string(CheckLevel level) {
  switch (level) {
    case CheckLevel::kOk: return "OK";
    case CheckLevel::kWarn: return "WARN";
    case CheckLevel::kFail: return "FAIL";
  }
  return "FAIL";
}

CheckLevel run_self_test(const SelfTestOptions& options, const std::function<void(const CheckResult&)>& report) {
  return SelfTest(options, report).run();
}

}  // namespace bodyschema
