#include "bodyschema/simulator/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <thread>

#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/motion_planner.hpp"
#include "eye.hpp"

namespace bodyschema::simulator {
namespace {

/// The first picture is taken this long after the log's time 0, so that encoders lie around it.
constexpr double kFirstFrame_s = 0.05;
/// The arm's way into view when the cameras pause meanwhile.
constexpr double kPause_s = 1.5;
constexpr double kVelocityWindow_s = 0.05;

struct Schedule {
  Trajectory trajectory;
  double motion_begin_s;
  double motion_end_s;
  Eigen::VectorXd usual;  // how head and fingers usually stand
  struct Slot {
    double t_s;
    Phase phase;
  };
  std::vector<Slot> slots;
};

Schedule schedule(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup, const StereoRig& rig,
                  const SimulatorSettings& settings, const SimulationPlan& plan) {
  if (rig.cameras.empty()) throw ConfigurationError("the simulator needs at least one camera");
  const double period = 1.0 / settings.camera_rate_hz;
  const Head head = settings.gaze ? Head::kGaze : settings.head_moves ? Head::kMoving : Head::kStill;
  MotionPlanner planner(model, setup, rig, settings.motion, plan.seed, head, plan.frozen_joints);
  int motion_frames = 0;
  const auto motion = [&]() -> Trajectory {
    switch (plan.motion) {
      case Motion::kReach: motion_frames = plan.frames; return planner.reach(std::max(1, plan.frames - 1) * period);
      case Motion::kOneWay:
        motion_frames = static_cast<int>(std::lround(plan.seconds * settings.camera_rate_hz));
        return planner.reach(plan.seconds);
      case Motion::kBabble:
        motion_frames = static_cast<int>(std::lround(plan.seconds * settings.camera_rate_hz));
        return planner.babble(plan.seconds);
      case Motion::kPoses: {
        auto poses = planner.poses(plan.poses);
        motion_frames = static_cast<int>(std::lround(poses.duration_s() * settings.camera_rate_hz));
        return poses;
      }
      case Motion::kGiven:
        if (!plan.given) throw std::invalid_argument("SimulationPlan: no trajectory given");
        motion_frames = static_cast<int>(std::floor(plan.given->duration_s() * settings.camera_rate_hz + 1e-9)) + 1;
        return *plan.given;
    }
    throw std::invalid_argument("SimulationPlan: unknown motion");
  }();

  Schedule result{Trajectory(motion.first()), 0.0, 0.0, planner.usual_posture(), {}};
  double t = kFirstFrame_s;
  if (settings.background_frames > 0) {
    const double entry_s = settings.entry_frames > 0 ? settings.entry_frames * period : kPause_s;
    result.trajectory = Trajectory(planner.rest_posture(motion.first()));
    result.trajectory.hold(t + settings.background_frames * period - period);
    result.trajectory.move_to(motion.first(), entry_s);
    for (int i = 0; i < settings.background_frames; ++i, t += period) result.slots.push_back({t, Phase::kBackground});
    t = result.trajectory.duration_s() - entry_s + period;
    for (int i = 0; i < settings.entry_frames; ++i, t += period) result.slots.push_back({t, Phase::kEntry});
    if (settings.entry_frames > 0) result.trajectory.hold(period);
    t = result.trajectory.duration_s();
  } else {
    result.trajectory.hold(t);
  }
  result.motion_begin_s = result.trajectory.duration_s();
  result.trajectory.append(motion);
  for (int i = 0; i < motion_frames; ++i, t += period) result.slots.push_back({t, Phase::kMotion});
  result.motion_end_s = result.motion_begin_s + std::max(period, (motion_frames - 1) * period);
  return result;
}

FaultSite site_of(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup, const StereoRig& rig,
                  const SimulationPlan& plan, const Schedule& when) {
  FaultSite site(model, setup, rig);
  site.begin_s = when.motion_begin_s;
  site.end_s = when.motion_end_s;
  site.seed = plan.seed;
  return site;
}

/// The plan's, and what the settings say of a lens that no configuration knows.
std::vector<FaultSpec> all_faults(const SimulationPlan& plan, const SimulatorSettings& settings) {
  std::vector<FaultSpec> faults;
  if (settings.lens_k1 != 0.0) faults.push_back(FaultSpec::of("distortion", "", settings.lens_k1));
  for (const auto& [joint, offset] : plan.offsets_deg) faults.push_back(FaultSpec::of("joint_offset", joint, offset));
  faults.insert(faults.end(), plan.faults.begin(), plan.faults.end());
  return faults;
}

bool wants_things(const SimulatorSettings& settings, const TrueBody& body) {
  return settings.kitchen || settings.table || settings.held.kind != HeldKind::kNone ||
         body.held.kind != HeldKind::kNone || settings.second_arm || settings.person_every_s > 0.0;
}

}  // namespace

const char* name_of(Phase phase) {
  switch (phase) {
    case Phase::kBackground: return "background";
    case Phase::kEntry: return "entry";
    case Phase::kMotion: return "motion";
  }
  return "unknown";
}

FaultSite fault_site(const std::shared_ptr<const RobotModel>& model, const RobotSetup& setup, const StereoRig& rig,
                     const SimulatorSettings& settings, const SimulationPlan& plan) {
  return site_of(model, setup, rig, plan, schedule(model, setup, rig, settings, plan));
}

struct Simulator::Impl {
  Studio studio;
  Schedule when;
  std::vector<Eye> eyes;

  Random encoder_random;
  Random jitter_random;
  std::size_t next_slot = 0;
  std::int64_t next_sample = 0;
  std::deque<JointSample> recent;  // for velocities

  Impl(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
       SimulatorSettings settings, SimulationPlan plan)
      : when(schedule(model, setup, rig, settings, plan)), encoder_random(plan.seed, "encoder noise"),
        jitter_random(plan.seed, "shutter jitter") {
    studio.motion_begin_s = when.motion_begin_s;
    studio.motion_end_s = when.motion_end_s;
    studio.robot = std::make_unique<TrueRobot>(site_of(model, setup, rig, plan, when), rig, when.trajectory,
                                               all_faults(plan, settings));
    if (plan.output != Output::kJoints) {
      studio.arm = painted_arm(model, setup, settings, studio.robot->body());
      if (wants_things(settings, studio.robot->body())) {
        studio.things =
            std::make_unique<Things>(*studio.robot, setup, rig, settings, studio.arm, when.usual, plan.seed);
      }
    }
    if (plan.output == Output::kPictures) {
      std::vector<Eigen::Vector3f> near_colours;
      for (const auto& part : studio.arm) {
        if (part.paints.empty()) near_colours.push_back(255.0f * part.albedo);
        for (const auto& paint : part.paints) near_colours.push_back(255.0f * paint.albedo);
      }
      if (settings.kitchen) {
        studio.kitchen = std::make_unique<Kitchen>(studio.things->room(), near_colours, plan.seed);
      } else if (settings.clutter) {
        studio.background = std::make_unique<Background>(Background::clutter(near_colours, plan.seed));
      } else {
        studio.background = std::make_unique<Background>(Background::single_colour(
            settings.background_colour.cast<float>(), static_cast<float>(settings.background_unevenness), plan.seed));
      }
    }
    studio.model = std::move(model);
    studio.setup = setup;
    studio.rig = rig;
    studio.settings = std::move(settings);
    studio.plan = std::move(plan);
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) eyes.emplace_back(studio, c);
  }
  Impl(const Impl&) = delete;  // eyes refer to the studio
  Impl& operator=(const Impl&) = delete;

  void read_encoders(double until_s, std::vector<JointSample>& samples) {
    // One sample beyond `until_s`, so that everything up to it lies between two.
    const SimulatorSettings& settings = studio.settings;
    const double rate = settings.encoder_rate_hz;
    const double step = 2.0 * kPi / std::ldexp(1.0, settings.encoder_bits);
    const double noise = radians(settings.encoder_noise_deg);
    while (static_cast<double>(next_sample - 1) / rate < until_s) {
      const double t = static_cast<double>(next_sample) / rate;
      JointSample sample;
      sample.utime = studio.utime(t);
      studio.robot->encoders(t, sample.q);
      for (Eigen::Index j = 0; j < sample.q.size(); ++j) {
        double& angle = sample.q[j];
        angle += noise * encoder_random.normal();
        if (settings.encoder_bits > 0) angle = std::round(angle / step) * step;
        // A stalled encoder repeats itself to the bit, noise included.
        if (!recent.empty() && studio.robot->stalled_since(j, t)) angle = recent.back().q[j];
      }
      const auto window = static_cast<std::size_t>(std::max(1.0, std::round(kVelocityWindow_s * rate)));
      while (recent.size() > window) recent.pop_front();
      sample.qdot = recent.empty()
                        ? Eigen::VectorXd::Zero(sample.q.size()).eval()
                        : ((sample.q - recent.front().q) / seconds(sample.utime - recent.front().utime)).eval();
      recent.push_back(sample);
      samples.push_back(std::move(sample));
      ++next_sample;
    }
  }
};

Simulator::Simulator(std::shared_ptr<const RobotModel> model, const RobotSetup& setup, const StereoRig& rig,
                     SimulatorSettings settings, SimulationPlan plan)
    : impl_(std::make_unique<Impl>(std::move(model), setup, rig, std::move(settings), std::move(plan))) {}
Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;

std::optional<SimulatedFrame> Simulator::next() {
  Impl& s = *impl_;
  if (s.next_slot >= s.when.slots.size()) return std::nullopt;
  const auto& slot = s.when.slots[s.next_slot];
  SimulatedFrame frame;
  frame.index = static_cast<int>(s.next_slot);
  frame.phase = slot.phase;
  const std::size_t cameras = s.studio.rig.cameras.size();
  frame.cameras.resize(cameras);
  frame.truth.resize(cameras);
  std::vector<double> exposures(cameras);
  double latest_s = 0.0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    double stamp_s =
        slot.t_s + 1e-3 * s.studio.settings.stamp_jitter_ms * std::clamp(s.jitter_random.normal(), -3.0, 3.0);
    if (c == 1) stamp_s += 1e-3 * s.studio.settings.right_camera_delay_ms;
    stamp_s = std::max(0.0, stamp_s);
    latest_s = std::max(latest_s, stamp_s);
    const auto& timing = s.studio.robot->timing();
    exposures[c] = stamp_s - timing.latency_s + (c == 1 ? timing.right_skew_s : 0.0);
    const auto& dies = s.studio.plan.camera_dies;
    if (dies && dies->first == c && stamp_s >= s.when.motion_begin_s + dies->second) continue;
    frame.cameras[c].emplace();
    frame.cameras[c]->name = s.studio.rig.cameras[c].name;
    frame.cameras[c]->number = s.studio.rig.cameras[c].number();
    frame.cameras[c]->utime = s.studio.utime(stamp_s);
  }
  const auto shoot = [&](std::size_t c) {
    s.eyes[c].shoot(frame.index, exposures[c], frame.truth[c], frame.cameras[c] ? &*frame.cameras[c] : nullptr);
  };
  if (s.studio.plan.threads > 1 && frame.cameras.size() > 1) {
    std::thread other([&] { shoot(1); });
    shoot(0);
    other.join();
  } else {
    for (std::size_t c = 0; c < frame.cameras.size(); ++c) shoot(c);
  }
  for (const auto& camera : frame.cameras) {
    if (camera) {
      frame.utime = camera->utime;
      break;
    }
  }
  if (frame.utime == 0) frame.utime = s.studio.utime(slot.t_s);
  ++s.next_slot;
  const bool last = s.next_slot == s.when.slots.size();
  s.read_encoders(latest_s + (last ? 0.05 : 0.0), frame.encoders);
  return frame;
}

int Simulator::frame_count() const {
  return static_cast<int>(impl_->when.slots.size());
}

int Simulator::first_motion_frame() const {
  const auto& slots = impl_->when.slots;
  const auto found =
      std::find_if(slots.begin(), slots.end(), [](const auto& slot) { return slot.phase == Phase::kMotion; });
  return static_cast<int>(found - slots.begin());
}

bool Simulator::has_things() const {
  return wants_things(impl_->studio.settings, impl_->studio.robot->body());
}

const TrueRobot& Simulator::robot() const {
  return *impl_->studio.robot;
}
const SimulationPlan& Simulator::plan() const {
  return impl_->studio.plan;
}
const SimulatorSettings& Simulator::settings() const {
  return impl_->studio.settings;
}
const RobotModel& Simulator::model() const {
  return *impl_->studio.model;
}

std::vector<std::string> Simulator::joint_names() const {
  std::vector<std::string> names;
  for (const auto& joint : impl_->studio.model->joints()) names.push_back(joint.name);
  return names;
}

double Simulator::duration_s() const {
  return impl_->when.slots.empty() ? 0.0 : impl_->when.slots.back().t_s;
}

Image Simulator::room(std::size_t camera) const {
  if (impl_->studio.plan.output != Output::kPictures) {
    throw std::invalid_argument("Simulator::room: this run makes no pictures");
  }
  return Eye(impl_->studio, camera).room();
}

Observation to_observation(const SimulatedFrame& frame, std::span<const JointSample> history) {
  Observation observation;
  observation.utime = frame.utime;
  observation.cameras.resize(frame.cameras.size());
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (!frame.cameras[c]) continue;
    const CameraFrame& camera = *frame.cameras[c];
    const auto after = std::lower_bound(history.begin(), history.end(), camera.utime,
                                        [](const JointSample& sample, Microseconds t) { return sample.utime < t; });
    if (after == history.end()) throw DataError("encoder history ends before the picture");
    auto& out = observation.cameras[c].emplace();
    out.utime = camera.utime;
    out.joints = *after;
    if (after != history.begin() && after->utime != camera.utime) {
      const auto before = std::prev(after);
      const double share = seconds(camera.utime - before->utime) / seconds(after->utime - before->utime);
      out.joints.q = (1.0 - share) * before->q + share * after->q;
      out.joints.qdot = (1.0 - share) * before->qdot + share * after->qdot;
    }
    out.joints.utime = camera.utime;
    out.image = camera.image;
    out.mask = camera.silhouette;
    out.coverage = camera.coverage;
  }
  return observation;
}

}  // namespace bodyschema::simulator
