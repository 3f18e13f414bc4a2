#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/bus/lcm_link.hpp"
#include "bodyschema/bus/log.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/installation.hpp"
#include "bodyschema/core/logging.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/robot/motion_file.hpp"
#include "bodyschema/simulator/contact_sheet.hpp"
#include "bodyschema/simulator/random.hpp"
#include "bodyschema/simulator/recording.hpp"
#include "bodyschema/simulator/scenes.hpp"
#include "bodyschema/simulator/simulator.hpp"
#include "common_options.hpp"

namespace bodyschema::apps {
namespace {

namespace sim = bodyschema::simulator;

std::atomic<bool> g_stop{false};

struct Arguments {
  std::string config;
  std::vector<std::string> overrides;
  std::string log_level = "info";
  bool print_config = false;
  bool list_faults = false;
  bool list_scenes = false;
  std::vector<std::string> scenes;
  std::optional<int> postures;
  std::string contact_sheet;
  std::uint64_t seed = 1;
  bool reach = false;
  double babble_s = 0.0;
  double one_way_s = 0.0;
  int poses = 0;
  std::string motion;
  int frames = 100;
  std::optional<int> background_frames;
  bool head_moves = false;
  bool clutter = false;
  std::vector<std::string> frozen;
  std::string offsets = "paper";
  std::vector<std::string> faults;
  std::vector<std::uint64_t> hidden;
  std::optional<double> hidden_size;
  bool hidden_outside = false;
  std::string truth;
  std::string log;
  std::string pictures;  // empty: see picture_format()
  std::optional<std::string> lcm_url;
  double rate = 1.0;
};

void print_faults() {
  std::printf("Faults for --fault NAME:key=value,... (value in the unit shown):\n\n");
  for (const auto& kind : sim::fault_kinds()) {
    std::string keys;
    for (const auto& key : kind.keys) keys += key + ", ";
    std::printf("  %-17s %svalue [%s]%s\n    %s\n", kind.name.c_str(), keys.c_str(), kind.unit.c_str(),
                kind.in_catalogue ? "" : "   (outside the catalogue of diagnosis)", kind.meaning.c_str());
  }
}

void print_scenes() {
  std::printf("Scenes for --scene NAME, and the settings that make them:\n\n");
  for (const auto& scene : sim::scenes()) {
    std::printf("  %-15s %s\n", scene.name.c_str(), scene.meaning.c_str());
    for (const auto& assignment : scene.overrides) std::printf("    --set %s\n", assignment.c_str());
  }
}

std::map<std::string, double> read_offsets(const std::string& text, std::uint64_t seed,
                                           const std::vector<std::string>& joints) {
  std::vector<double> values;
  if (text == "none") return {};
  if (text == "paper") {
    values = {5, 4, 3, -2, 3, -7, 3};
    values.resize(joints.size(), 0.0);
  } else if (text == "random") {
    sim::Random random(seed, "joint offsets");
    for (std::size_t i = 0; i < joints.size(); ++i) values.push_back(std::clamp(4.0 * random.normal(), -10.0, 10.0));
  } else {
    for (const auto& item : CLI::detail::split(text, ',')) {
      double value = 0.0;
      if (!CLI::detail::lexical_cast(item, value) || !std::isfinite(value)) {
        throw ConfigurationError("--offsets: '" + item + "' is not a number; expected paper, random, none or " +
                                 std::to_string(joints.size()) + " numbers in deg");
      }
      values.push_back(value);
    }
    if (values.size() != joints.size()) {
      throw ConfigurationError("--offsets: found " + std::to_string(values.size()) + " numbers, expected " +
                               std::to_string(joints.size()) + " (the order of robot.estimated_joints)");
    }
  }
  std::map<std::string, double> offsets;
  for (std::size_t i = 0; i < joints.size(); ++i) offsets[joints[i]] = values[i];
  return offsets;
}

/// Publishes at `rate` times real time; tells how far behind the machine fell.
class RealTime {
 public:
  RealTime(double rate, Microseconds begin) : rate_(rate), begin_(begin), start_(Clock::now()) {}
  bool operator()(Microseconds due) {
    const auto target =
        start_ + std::chrono::microseconds(static_cast<std::int64_t>(static_cast<double>(due - begin_) / rate_));
    while (!g_stop) {
      const auto now = Clock::now();
      if (now >= target) {
        worst_ = std::max(worst_, now - target);
        return true;
      }
      std::this_thread::sleep_for(std::min<Clock::duration>(target - now, std::chrono::milliseconds(50)));
    }
    return false;
  }
  [[nodiscard]] double worst_s() const { return std::chrono::duration<double>(worst_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  double rate_;
  Microseconds begin_;
  Clock::time_point start_;
  Clock::duration worst_{0};
};

/// What is asked for; by itself raw, and JPEG where a log would grow by more than 55 MB a second of a pair at 30 Hz.
sim::PictureFormat picture_format(const Arguments& a, const StereoRig& rig) {
  constexpr int kLargestRaw_px = 640 * 480;
  if (a.pictures == "gray") return sim::PictureFormat::kGray;
  if (a.pictures == "jpeg") return sim::PictureFormat::kJpeg;
  if (a.pictures == "masks") return sim::PictureFormat::kMasks;
  const bool large = std::any_of(rig.cameras.begin(), rig.cameras.end(), [](const CameraModel& camera) {
    return camera.intrinsics.width * camera.intrinsics.height > kLargestRaw_px;
  });
  if (!a.pictures.empty() || a.log.empty() || !large) return sim::PictureFormat::kRgb;
  std::fputs("bodyschema-sim: large pictures are written as JPEG (--pictures rgb writes them as they are)\n", stderr);
  return sim::PictureFormat::kJpeg;
}

sim::Trajectory given_motion(const std::string& file, const RobotModel& model, const RobotSetup& setup) {
  const auto motion = MotionFile::read(file, [&](const std::string& joint) {
    return model.joints()[static_cast<std::size_t>(model.joint_index(joint))].slides;
  });
  const auto posture = [&](std::size_t i) {
    Eigen::VectorXd q = setup.default_joints(model);
    for (std::size_t j = 0; j < motion.joints.size(); ++j) {
      q[model.joint_index(motion.joints[j])] = motion.postures[i].q[static_cast<Eigen::Index>(j)];
    }
    return q;
  };
  sim::Trajectory trajectory(posture(0));
  for (std::size_t i = 1; i < motion.postures.size(); ++i) {
    trajectory.move_to(posture(i), motion.postures[i].time_s - motion.postures[i - 1].time_s);
  }
  return trajectory;
}

void run(const Arguments& a) {
  set_up_logging(a.log_level);
  if (!a.contact_sheet.empty() && !a.contact_sheet.ends_with(".png")) {
    throw ConfigurationError("--contact-sheet " + a.contact_sheet + ": expected a file that ends in .png");
  }
  // Scenes first: single keys may be set on top of them.
  std::vector<std::string> overrides;
  for (const auto& name : a.scenes) {
    const auto& more = sim::scene(name).overrides;
    overrides.insert(overrides.end(), more.begin(), more.end());
  }
  overrides.insert(overrides.end(), a.overrides.begin(), a.overrides.end());
  if (a.background_frames) {
    overrides.push_back("simulator.motion.background_frames=" + std::to_string(*a.background_frames));
  }
  if (a.postures) overrides.push_back("simulator.motion.postures=" + std::to_string(*a.postures));
  if (a.head_moves) overrides.push_back("simulator.motion.head=moving");
  if (a.clutter) overrides.push_back("simulator.room.background=clutter");
  const Configuration configuration = Configuration::load(find_data_file(a.config), overrides);
  (void)configuration.integer("version", 1, 1);
  const RobotSetup setup = RobotSetup::from(configuration.section("robot"));
  const StereoRig rig = StereoRig::from(configuration.section("cameras"));
  const BusOptions bus = BusOptions::from(configuration.section("bus"));
  auto settings = sim::SimulatorSettings::from(configuration.section("simulator"));
  if (a.print_config) {
    configuration.reject_unknown_keys();
    std::fputs(configuration.print().c_str(), stdout);
    return;
  }
  configuration.reject_unknown_keys();
  const auto model = load_robot(setup, rig);
  for (const auto& warning : model->warnings()) std::fprintf(stderr, "bodyschema-sim: %s\n", warning.c_str());

  sim::SimulationPlan plan;
  plan.seed = a.seed;
  plan.frames = a.frames;
  plan.threads = 2;
  if (a.babble_s > 0.0) {
    plan.motion = sim::Motion::kBabble;
    plan.seconds = a.babble_s;
  } else if (a.one_way_s > 0.0) {
    plan.motion = sim::Motion::kOneWay;
    plan.seconds = a.one_way_s;
  } else if (a.poses > 0) {
    plan.motion = sim::Motion::kPoses;
    plan.poses = a.poses;
  }
  if (!a.motion.empty()) {
    plan.motion = sim::Motion::kGiven;
    plan.given = given_motion(a.motion, *model, setup);
  }
  plan.frozen_joints = a.frozen;
  plan.offsets_deg = read_offsets(a.offsets, a.seed, setup.estimated_joints);
  for (const auto& text : a.faults) plan.faults.push_back(sim::FaultSpec::parse(text));
  if (!a.hidden.empty()) {
    if (a.truth.empty()) throw ConfigurationError("--hidden-fault needs --truth FILE: it is written nowhere else");
    const sim::FaultSite site = sim::fault_site(model, setup, rig, settings, plan);
    sim::DrawOptions draw;
    draw.multiple_of_detectable = a.hidden_size;
    draw.outside_catalogue = a.hidden_outside;
    for (const auto hidden_seed : a.hidden) {
      plan.faults.push_back(sim::draw_fault(hidden_seed, site, draw));
      draw.exclude.push_back(plan.faults.back().name);
    }
  }

  sim::FramePublisher::Options publishing;
  publishing.channels = bus.channels();
  publishing.format = picture_format(a, rig);
  if (publishing.format == sim::PictureFormat::kMasks) plan.output = sim::Output::kSilhouettes;

  sim::Simulator simulator(model, setup, rig, settings, plan);
  std::unique_ptr<MessageSink> sink;
  std::optional<RealTime> clock;
  const bool live = a.log.empty();
  if (live) {
    auto link = std::make_unique<LcmLink>(resolve_lcm_url(a.lcm_url));
    std::fprintf(stderr, "bodyschema-sim: %d frames on %s, %s times real time\n", simulator.frame_count(),
                 link->url().c_str(), CLI::detail::to_string(a.rate).c_str());
    sink = std::move(link);
    const auto now =
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
            .count();
    publishing.utime_shift = now - settings.start_utime;
    clock.emplace(a.rate, settings.start_utime);
  } else {
    sink = std::make_unique<LogWriter>(a.log);
  }
  std::optional<sim::TruthWriter> truth;
  if (!a.truth.empty()) truth.emplace(a.truth, simulator, setup, publishing.utime_shift);
  sim::FramePublisher publisher(simulator.joint_names(), publishing);

  std::optional<ProgressBar> bar(std::in_place, live ? "playing" : "simulating",
                                 static_cast<std::uint64_t>(simulator.frame_count()));
  std::optional<sim::ContactSheet> sheet;
  if (!a.contact_sheet.empty()) {
    sheet.emplace(simulator.first_motion_frame(), simulator.frame_count() - simulator.first_motion_frame());
  }
  int frames = 0;
  while (!g_stop) {
    const auto frame = simulator.next();
    if (!frame) break;
    const bool sent = publisher.publish(*frame, *sink, [&](Microseconds due) { return !clock || (*clock)(due); });
    if (!sent) break;
    if (truth) truth->add(*frame);
    if (sheet) sheet->add(*frame);
    bar->advance();
    ++frames;
  }
  bar.reset();
  if (truth) truth->close();
  if (sheet) sheet->write(a.contact_sheet);
  if (clock && clock->worst_s() > 0.5) {
    std::fprintf(stderr, "bodyschema-sim: up to %.1f s behind; a smaller --rate suits this machine\n",
                 clock->worst_s());
  }
  std::fprintf(stderr, "bodyschema-sim: %d of %d frames %s%s\n", frames, simulator.frame_count(),
               live ? "published" : "written to ", a.log.c_str());
}

}  // namespace
}  // namespace bodyschema::apps

int main(int argc, char** argv) {
  using namespace bodyschema::apps;
  Arguments a;
  CLI::App app{"Plays a robot with wrong encoders: joint states and stereo pictures over LCM, or into a log"};
  app.formatter(help_formatter());
  app.set_version_flag("--version", BODYSCHEMA_VERSION);
  app.footer(
      "Examples:\n"
      "  bodyschema-sim --config config/icub_right/simulator.yaml --reach --log reach.log --truth truth.json\n"
      "  bodyschema-sim --config config/icub_right/simulator.yaml --babble 60 --offsets random --seed 4 \\\n"
      "                 --fault backlash:joint=r_elbow,value=0.8 --log babble.log --truth truth.json\n"
      "Exit status: 0 done, 2 wrong command line, configuration or file, 3 data that cannot be used\n"
      "(no posture with the hand in view), 1 any other failure.");
  auto* config = app.add_option("-c,--config", a.config, "Configuration file, e.g. config/icub_right/simulator.yaml");
  app.add_option("--set", a.overrides, "Override one key: --set simulator.cameras.rate_hz=10 (repeatable)");
  app.add_flag("--print-config", a.print_config, "Print the configuration in force and stop");
  app.add_option("--log-level", a.log_level, "trace, debug, info, warn, error or off")
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  app.add_option("--seed", a.seed, "Same seed, same run (default 1)")->check(whole_number());

  auto* reach = app.add_flag("--reach", a.reach, "Reach once across the view (default)")->group("Motion");
  auto* babble = app.add_option("--babble", a.babble_s, "Move at random for this many seconds, hand in view")
                     ->check(number_in(1.0, 3600.0))
                     ->group("Motion");
  auto* one_way = app.add_option("--one-way", a.one_way_s, "One slow reach of this many seconds, never turning back")
                      ->check(number_in(1.0, 3600.0))
                      ->group("Motion");
  auto* poses = app.add_option("--poses", a.poses, "Stop and go: this many postures, each held still for a second")
                    ->check(number_in(2, 3600))
                    ->group("Motion");
  app.add_option("--motion", a.motion,
                 "Play this motion: CSV with time_s and joints in deg, as `bodyschema diagnose` writes it")
      ->excludes(reach)
      ->excludes(babble)
      ->excludes(one_way)
      ->excludes(poses)
      ->group("Motion");
  reach->excludes(babble)->excludes(one_way)->excludes(poses);
  babble->excludes(one_way)->excludes(poses);
  one_way->excludes(poses);
  app.add_option("--frames", a.frames, "Frames of a reach (default 100)")->check(number_in(2, 100000))->group("Motion");
  app.add_option("--background-frames", a.background_frames, "Empty frames before the arm comes in")
      ->check(number_in(0, 10000))
      ->group("Motion");
  app.add_flag("--head-moves", a.head_moves, "The head moves too")->group("Motion");
  app.add_option("--freeze", a.frozen, "Arm joint that never moves (repeatable)")->group("Motion");
  app.add_option("--postures", a.postures, "--babble holds at least this many distinct postures for a second")
      ->check(number_in(0, 1000))
      ->group("Motion");
  app.add_flag("--clutter", a.clutter, "Cluttered background")->group("Motion");
  app.add_option("--scene", a.scenes,
                 "Everyday conditions by name, e.g. kitchen for all of them (repeatable); see --list-scenes")
      ->group("Scene");
  app.add_flag("--list-scenes", a.list_scenes, "Print all scenes and stop")->group("Scene");

  app.add_option("--offsets", a.offsets,
                 "encoder - true in deg, by robot.estimated_joints: paper (5,4,3,-2,3,-7,3, default), random, none, "
                 "or a list a,b,c,...")
      ->group("Truth");
  app.add_option("--fault", a.faults, "NAME:key=value,... (repeatable); see --list-faults")->group("Truth");
  app.add_option("--hidden-fault", a.hidden, "Draw a fault from this seed; it goes to --truth only (repeatable)")
      ->check(whole_number())
      ->group("Truth");
  app.add_option("--hidden-size", a.hidden_size,
                 "Size of hidden faults, times the smallest detectable (default: drawn from 3 to 6)")
      ->check(number_in(0.01, 100.0))
      ->group("Truth");
  app.add_flag("--hidden-outside", a.hidden_outside, "Draw hidden faults that no diagnosis can name")->group("Truth");
  app.add_flag("--list-faults", a.list_faults, "Print all faults and stop")->group("Truth");
  app.add_option("--truth", a.truth, "Write what was true to this file (JSON)")->group("Truth");

  auto* log =
      app.add_option("--log", a.log, "Write an LCM log as fast as possible, without the network")->group("Output");
  app.add_option("-l,--lcm-url", a.lcm_url, "LCM network (default: LCM_DEFAULT_URL, else this machine only)")
      ->group("Output")
      ->excludes(log);
  app.add_option("--rate", a.rate, "Speed over the network, times real time (default 1)")
      ->check(number_in(0.001, 100.0))
      ->group("Output")
      ->excludes(log);
  app.add_option("--pictures", a.pictures,
                 "rgb, gray, jpeg, or masks: white where the robot is, without room and light. Default: rgb; jpeg in a "
                 "log of pictures larger than 640x480, which would be gigabytes a minute")
      ->check(CLI::IsMember({"rgb", "gray", "jpeg", "masks"}))
      ->group("Output");
  app.add_option("--contact-sheet", a.contact_sheet, "Write pictures of the motion side by side to this PNG")
      ->group("Output");
  return run_and_report("bodyschema-sim", app, [&] {
    app.parse(argc, argv);
    if (a.list_faults) return print_faults();
    if (a.list_scenes) return print_scenes();
    if (config->count() == 0) throw CLI::RequiredError("--config");
    for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { g_stop = true; });
    run(a);
  });
}
