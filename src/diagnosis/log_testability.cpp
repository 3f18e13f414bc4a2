#include "bodyschema/diagnosis/log_testability.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <spdlog/fmt/fmt.h>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/observation_stream.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/diagnosis/diagnoser.hpp"
#include "bodyschema/diagnosis/measurement.hpp"
#include "bodyschema/effects/catalogue.hpp"
#include "candidates.hpp"
#include "joint_stream.hpp"

namespace bodyschema {
namespace {

constexpr Microseconds kPicturePeriod = 100'000;

/// The motion of a log without its pictures.
class Motion final : public MeasurementSource {
 public:
  Motion(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup, const StereoRig& rig)
      : roles_(JointRoles::of(model, setup, rig)), builder_(model, setup.hand_link, setup.gravity_W),
        no_offsets_(Eigen::VectorXd::Zero(model->joint_count())) {}

  void add(const Observation& observation) {
    if (!views_.empty() && observation.utime < due_) return;
    // Keep to the raster, as the diagnosis does.
    due_ = views_.empty() || observation.utime > due_ + kPicturePeriod ? observation.utime + kPicturePeriod
                                                                       : due_ + kPicturePeriod;
    for (std::size_t c = 0; c < observation.cameras.size(); ++c) {
      if (observation.cameras[c]) views_.push_back({observation.cameras[c]->joints, c, {}});
    }
  }
  void set_stream(std::vector<JointSample> stream) {
    stream_ = std::move(stream);
    set_motion(views_, stream_);
  }

  const JointRoles& roles() const override { return roles_; }
  std::span<const ViewInput> views() const override { return views_; }
  std::span<const JointSample> stream() const override { return stream_; }
  void instant(std::size_t view, const Eigen::VectorXd& offsets, Instant& out) override {
    builder_.build(views_[view].joints, views_[view].camera, offsets, out);
    out.qddot = views_[view].qddot;
  }
  void compress(std::span<const Corrections>, std::vector<CompressedView>& out) override { out.clear(); }
  Eigen::MatrixXd hand_jacobian(std::size_t, const Corrections&) override { return {}; }

  [[nodiscard]] diagnosis::Linearisation instants() {
    diagnosis::Linearisation at;
    at.instants.resize(views_.size());
    for (std::size_t v = 0; v < views_.size(); ++v) instant(v, no_offsets_, at.instants[v]);
    return at;
  }

 private:
  JointRoles roles_;
  InstantBuilder builder_;
  Eigen::VectorXd no_offsets_;
  std::vector<ViewInput> views_;
  std::vector<JointSample> stream_;
  Microseconds due_ = 0;
};

std::string joints_text(const std::set<std::string>& joints, const std::vector<std::string>& arm) {
  if (joints.empty()) return "";
  const bool whole = std::all_of(arm.begin(), arm.end(), [&](const auto& name) { return joints.contains(name); });
  return whole && joints.size() == arm.size() ? " of every arm joint" : fmt::format(" of {}", fmt::join(joints, ", "));
}

}  // namespace

LogTestability testability_of(const Configuration& configuration, const std::filesystem::path& log) {
  auto setup = RobotSetup::from(configuration.section("robot"));
  const auto rig = StereoRig::from(configuration.section("cameras"));
  const auto bus = BusOptions::from(configuration.section("bus"));
  configuration.reject_unknown_sections();
  for (const char* read : {"robot", "cameras", "bus"}) configuration.section(read).reject_unknown_keys();
  const auto model = load_robot(setup, rig);
  Motion motion(model, setup, rig);
  diagnosis::JointStream joints(*model, setup, bus);
  ObservationStream stream(model, setup, rig, bus);
  LogReader reader(log);
  ProgressBar bar("motion", reader.size());
  const auto drain = [&] {
    while (const auto arrived = stream.next()) motion.add(arrived->observation);
  };
  LogEvent event;
  while (reader.next(event)) {
    if (event.channel == stream.channels().joint_state) joints.take(event.data);
    if (stream.receive(event.channel, event.data, event.time_us)) drain();
    bar.set(reader.position());
  }
  stream.finish();
  drain();
  motion.set_stream(joints.finish());

  const auto views = motion.views();
  if (views.empty()) {
    throw DataError(fmt::format("{}: no pictures with encoders on {} and {}", log.string(), stream.channels().cameras,
                                stream.channels().joint_state));
  }
  LogTestability result;
  result.duration_s = seconds(views.back().joints.utime - views.front().joints.utime);
  result.shortest_s = DiagnosisOptions{}.shortest_log_s;
  result.pictures = views.size();
  for (const auto joint : motion.roles().arm) {
    result.arm_joints.push_back(motion.roles().names[static_cast<std::size_t>(joint)]);
  }
  result.not_testable = diagnosis::untestable(motion, motion.instants());
  for (const auto& name : effect_names()) {
    if (name == "joint_offset") continue;  // always fitted, never a finding
    for (const auto& target : effect_targets(name, motion.roles())) {
      const CauseName cause{name, target.joint, target.source};
      const bool refused = std::any_of(result.not_testable.begin(), result.not_testable.end(),
                                       [&](const auto& n) { return n.cause == cause; });
      if (!refused) result.testable.push_back(cause);
    }
  }
  return result;
}

std::string LogTestability::text() const {
  if (duration_s < shortest_s) {
    return fmt::format("a diagnosis needs at least {:.0f} s of pictures with encoders; this log has {:.1f} s\n",
                       shortest_s, duration_s);
  }
  std::string out =
      fmt::format("a diagnosis would use {:.1f} s and {} pictures of this log and could test\n", duration_s, pictures);
  std::map<std::string, std::set<std::string>> by_cause;
  for (const auto& cause : testable) {
    auto& on = by_cause[cause.name];
    // A pair or a camera does not help to decide what to move.
    if (!cause.joint.empty() && cause.source.empty()) on.insert(cause.joint);
  }
  for (const auto& [name, on] : by_cause) out += "  " + name + joints_text(on, arm_joints) + '\n';
  std::map<std::string, std::set<std::string>> by_reason;
  for (const auto& item : not_testable) by_reason[item.reason].insert(item.cause.name);
  if (!by_reason.empty()) out += "but not\n";
  for (const auto& [reason, names] : by_reason) out += fmt::format("  {}: {}\n", fmt::join(names, ", "), reason);
  return out;
}

}  // namespace bodyschema
