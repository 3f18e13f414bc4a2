#include "bodyschema/simulator/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>
#include <thread>

#include "bodyschema/core/error.hpp"
#include "bodyschema/simulator/background.hpp"
#include "bodyschema/simulator/image_sensor.hpp"
#include "bodyschema/simulator/motion_planner.hpp"
#include "bodyschema/simulator/rasterizer.hpp"

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
  MotionPlanner planner(model, setup, rig, settings.motion, plan.seed, settings.head_moves, plan.frozen_joints);
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

  Schedule result{Trajectory(motion.first()), 0.0, 0.0, {}};
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

std::vector<FaultSpec> all_faults(const SimulationPlan& plan) {
  std::vector<FaultSpec> faults;
  for (const auto& [joint, offset] : plan.offsets_deg) faults.push_back(FaultSpec::of("joint_offset", joint, offset));
  faults.insert(faults.end(), plan.faults.begin(), plan.faults.end());
  return faults;
}

/// Greys from dark metal to white plastic, the same for a link on every run.
Eigen::Vector3f paint_of(const std::string& link, const SimulatorSettings& settings) {
  const auto found = settings.albedo.find(link);
  if (found != settings.albedo.end()) return found->second.cast<float>();
  Random random(7, link);
  const auto level = static_cast<float>(random.uniform(0.55, 0.85));
  Eigen::Vector3f colour(level, level, level);
  for (int k = 0; k < 3; ++k) colour[k] += static_cast<float>(random.uniform(-0.04, 0.04));
  return colour;
}

std::vector<PaintedPart> painted_parts(const RobotModel& model, const RobotSetup& setup,
                                       const SimulatorSettings& settings, double mesh_scale) {
  std::vector<PaintedPart> parts;
  for (const auto& link : model.meshes()) {
    PaintedPart part;
    part.mesh = link.mesh;
    for (auto& vertex : part.mesh.vertices) vertex *= static_cast<float>(mesh_scale);
    part.albedo = paint_of(link.link, settings);
    part.cull_back = setup.culling == FaceCulling::kBack || (link.closed && link.consistent_winding);
    parts.push_back(std::move(part));
  }
  return parts;
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
  /// Everything one camera needs to draw: used by one thread at a time.
  struct Eye {
    CameraModel camera;
    std::unique_ptr<TrueKinematics> kinematics;
    std::unique_ptr<Rasterizer> rasterizer;
    std::unique_ptr<ImageSensor> sensor;
    std::vector<Pose> X_W;
    std::vector<Eigen::Isometry3f> X_CB;
    std::vector<float> room;  // as painted last
    Pose room_X_WC;
    bool has_room = false;
    std::vector<float> light;
    Eigen::VectorXd q;
  };

  std::shared_ptr<const RobotModel> model;
  RobotSetup setup;
  StereoRig rig;
  SimulatorSettings settings;
  SimulationPlan plan;
  Schedule when;
  std::unique_ptr<TrueRobot> robot;
  std::unique_ptr<Background> background;
  mutable std::vector<Eye> eyes;
  std::size_t parts = 0;

  Random encoder_random;
  Random jitter_random;
  std::size_t next_slot = 0;
  std::int64_t next_sample = 0;
  std::deque<JointSample> recent;  // for velocities

  Impl(std::shared_ptr<const RobotModel> robot_model, const RobotSetup& robot_setup, const StereoRig& stereo_rig,
       SimulatorSettings simulator_settings, SimulationPlan simulation_plan)
      : model(std::move(robot_model)), setup(robot_setup), rig(stereo_rig), settings(std::move(simulator_settings)),
        plan(std::move(simulation_plan)), when(schedule(model, setup, rig, settings, plan)),
        encoder_random(plan.seed, "encoder noise"), jitter_random(plan.seed, "shutter jitter") {
    robot = std::make_unique<TrueRobot>(site_of(model, setup, rig, plan, when), rig, when.trajectory, all_faults(plan));
    const TrueBody& body = robot->body();

    std::vector<std::string> links;
    for (const auto& mesh : model->meshes()) links.push_back(mesh.link);
    parts = links.size();
    links.push_back(setup.hand_link);
    links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
    std::vector<PaintedPart> painted;
    if (plan.output != Output::kJoints) painted = painted_parts(*model, setup, settings, body.mesh_scale);
    if (plan.output == Output::kPictures) {
      if (settings.clutter) {
        std::vector<Eigen::Vector3f> near_colours;
        for (const auto& part : painted) near_colours.push_back(255.0f * part.albedo);
        background = std::make_unique<Background>(Background::clutter(near_colours, plan.seed));
      } else {
        background = std::make_unique<Background>(Background::single_colour(
            settings.background_colour.cast<float>(), static_cast<float>(settings.background_unevenness), plan.seed));
      }
    }
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      Eye eye;
      eye.camera = body.cameras[c];
      auto own = links;
      own.push_back(eye.camera.link);
      eye.X_W.resize(own.size());
      eye.X_CB.resize(parts);
      eye.kinematics = std::make_unique<TrueKinematics>(model, body, std::move(own));
      const int width = eye.camera.intrinsics.width;
      const int height = eye.camera.intrinsics.height;
      if (plan.output != Output::kJoints) {
        eye.rasterizer = std::make_unique<Rasterizer>(painted, width, height, settings.supersampling);
      }
      if (plan.output == Output::kPictures) {
        eye.sensor = std::make_unique<ImageSensor>(width, height, settings.blur_px, settings.noise_levels);
      }
      eyes.push_back(std::move(eye));
    }
  }

  [[nodiscard]] Microseconds utime(double t_s) const { return settings.start_utime + microseconds(t_s); }

  void paint_room(Eye& eye, const Pose& X_WC) const {
    if (eye.has_room && (eye.room_X_WC.matrix() - X_WC.matrix()).cwiseAbs().maxCoeff() < 1e-9) return;
    background->paint(eye.camera, X_WC, eye.room);
    eye.room_X_WC = X_WC;
    eye.has_room = true;
  }

  /// @param frame  null for a dead camera: only the truth is worked out
  void shoot(std::size_t c, int index, double exposure_s, CameraTruth& truth, CameraFrame* frame) const {
    Eye& eye = eyes[c];
    robot->joints(exposure_s, eye.q);
    eye.kinematics->compute(eye.q, eye.X_W);
    const Pose X_WC = eye.kinematics->camera(c, eye.X_W.back());
    const Pose X_CW = X_WC.inverse(Eigen::Isometry);
    truth.exposure_utime = utime(exposure_s);
    truth.q = eye.q;
    truth.X_WC = X_WC;
    truth.X_CP = X_CW * eye.X_W[parts];
    for (std::size_t i = 0; i < setup.fingertip_links.size(); ++i) {
      const Eigen::Vector3d tip_C = X_CW * eye.X_W[parts + 1 + i].translation();
      truth.fingertips_C.push_back(tip_C);
      truth.fingertips_px.push_back(project(eye.camera, tip_C));
    }
    if (plan.output == Output::kJoints || frame == nullptr) return;

    for (std::size_t p = 0; p < parts; ++p) eye.X_CB[p] = (X_CW * eye.X_W[p]).cast<float>();
    Lighting lighting;
    lighting.to_lamp_C = (X_CW.linear() * settings.lamp_direction_W.normalized()).cast<float>();
    lighting.ambient = static_cast<float>(settings.ambient);
    lighting.diffuse = static_cast<float>(settings.diffuse);
    eye.rasterizer->draw(eye.X_CB, eye.camera, lighting, static_cast<float>(robot->body().dilation_px));
    frame->silhouette = eye.rasterizer->mask();
    const auto& coverage = eye.rasterizer->coverage();
    frame->coverage.resize(coverage.size());
    double covered = 0.0;
    for (std::size_t i = 0; i < coverage.size(); ++i) {
      frame->coverage[i] = static_cast<std::uint8_t>(255.0f * coverage[i] + 0.5f);
      covered += coverage[i];
    }
    truth.visible_share = covered / static_cast<double>(coverage.size());
    if (plan.output == Output::kSilhouettes) return;

    paint_room(eye, X_WC);
    eye.light = eye.room;
    const auto& colour = eye.rasterizer->colour();
    const auto box = eye.rasterizer->box();
    const int width = eye.camera.intrinsics.width;
    for (int v = box.v0; v < box.v1; ++v) {
      for (int u = box.u0; u < box.u1; ++u) {
        const auto i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
        if (coverage[i] <= 0.0f) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          eye.light[3 * i + k] = colour[3 * i + k] + (1.0f - coverage[i]) * eye.light[3 * i + k];
        }
      }
    }
    const double exposure =
        1.0 + settings.exposure_swing * std::sin(2.0 * kPi * exposure_s / settings.exposure_period_s);
    Random noise(plan.seed, c == 0 ? "left image noise" : "right image noise", static_cast<std::uint64_t>(index));
    eye.sensor->expose(eye.light, exposure, noise, frame->image);
  }

  static Eigen::Vector2d project(const CameraModel& camera, const Eigen::Vector3d& p_C) {
    if (p_C.z() < 1e-3) return {-1e6, -1e6};
    double x = p_C.x() / p_C.z();
    double y = p_C.y() / p_C.z();
    if (camera.has_distortion()) {
      const auto& d = camera.distortion;
      const double r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
      const double dx = 2.0 * d[2] * x * y + d[3] * (r2 + 2.0 * x * x);
      const double dy = d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * x * y;
      x = x * radial + dx;
      y = y * radial + dy;
    }
    const auto& k = camera.intrinsics;
    return {k.fx * x + k.cx, k.fy * y + k.cy};
  }

  void read_encoders(double until_s, std::vector<JointSample>& samples) {
    // One sample beyond `until_s`, so that everything up to it lies between two.
    const double rate = settings.encoder_rate_hz;
    const double step = 2.0 * kPi / std::ldexp(1.0, settings.encoder_bits);
    const double noise = radians(settings.encoder_noise_deg);
    while (static_cast<double>(next_sample - 1) / rate < until_s) {
      const double t = static_cast<double>(next_sample) / rate;
      JointSample sample;
      sample.utime = utime(t);
      robot->encoders(t, sample.q);
      for (auto& angle : sample.q) {
        angle += noise * encoder_random.normal();
        if (settings.encoder_bits > 0) angle = std::round(angle / step) * step;
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
  frame.cameras.resize(s.rig.cameras.size());
  frame.truth.resize(s.rig.cameras.size());
  std::vector<double> exposures(s.rig.cameras.size());
  double latest_s = 0.0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    double stamp_s = slot.t_s + 1e-3 * s.settings.stamp_jitter_ms * std::clamp(s.jitter_random.normal(), -3.0, 3.0);
    if (c == 1) stamp_s += 1e-3 * s.settings.right_camera_delay_ms;
    stamp_s = std::max(0.0, stamp_s);
    latest_s = std::max(latest_s, stamp_s);
    const auto& timing = s.robot->timing();
    exposures[c] = stamp_s - timing.latency_s + (c == 1 ? timing.right_skew_s : 0.0);
    const auto& dies = s.plan.camera_dies;
    if (dies && dies->first == c && stamp_s >= s.when.motion_begin_s + dies->second) continue;
    frame.cameras[c].emplace();
    frame.cameras[c]->name = s.rig.cameras[c].name;
    frame.cameras[c]->utime = s.utime(stamp_s);
  }
  const auto shoot = [&](std::size_t c) {
    s.shoot(c, frame.index, exposures[c], frame.truth[c], frame.cameras[c] ? &*frame.cameras[c] : nullptr);
  };
  if (s.plan.threads > 1 && frame.cameras.size() > 1) {
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
  if (frame.utime == 0) frame.utime = s.utime(slot.t_s);
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

const TrueRobot& Simulator::robot() const {
  return *impl_->robot;
}
const SimulationPlan& Simulator::plan() const {
  return impl_->plan;
}
const SimulatorSettings& Simulator::settings() const {
  return impl_->settings;
}
const RobotModel& Simulator::model() const {
  return *impl_->model;
}

std::vector<std::string> Simulator::joint_names() const {
  std::vector<std::string> names;
  for (const auto& joint : impl_->model->joints()) names.push_back(joint.name);
  return names;
}

double Simulator::duration_s() const {
  return impl_->when.slots.empty() ? 0.0 : impl_->when.slots.back().t_s;
}

Image Simulator::room(std::size_t camera) const {
  const Impl& s = *impl_;
  if (!s.background) throw std::invalid_argument("Simulator::room: this run makes no pictures");
  Impl::Eye& eye = s.eyes.at(camera);
  std::vector<Pose> X_W(eye.X_W.size());
  eye.kinematics->compute(s.robot->joints(0.0), X_W);
  std::vector<float> light;
  s.background->paint(eye.camera, eye.kinematics->camera(camera, X_W.back()), light);
  Image image;
  Random unused(0, "");
  ImageSensor(eye.camera.intrinsics.width, eye.camera.intrinsics.height, s.settings.blur_px, 0.0)
      .expose(light, 1.0, unused, image);
  return image;
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
