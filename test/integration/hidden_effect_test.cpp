#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <thread>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "diagnosis/binomial.hpp"
#include "integration/harness.hpp"
#include "test_data.hpp"

/// The simulator hides an effect in a log; `bodyschema diagnose`, another process, gets log and
/// configuration alone; only then is the truth opened. Fresh seeds each run.
namespace bodyschema::integration {
namespace {

using Json = nlohmann::json;
using test::attempts_at;
using test::fewest_right;
constexpr double kLog_s = 60.0;
constexpr int kAtOnce = 2;

std::uint64_t seed() {
  static const std::uint64_t value = [] {
    const char* given = std::getenv("BODYSCHEMA_SEED");
    const std::uint64_t s = given != nullptr ? std::strtoull(given, nullptr, 10) : std::random_device{}();
    std::cout << "BODYSCHEMA_SEED=" << s << std::endl;
    return s;
  }();
  return value;
}

/// How many times the default number of logs; BODYSCHEMA_HIDDEN_LOGS=4 is thorough.
int times() {
  const char* given = std::getenv("BODYSCHEMA_HIDDEN_LOGS");
  return given != nullptr ? std::max(1, std::atoi(given)) : 1;
}

Json read(const std::filesystem::path& file) {
  std::ifstream in(file);
  return in ? Json::parse(in) : Json();
}

struct Answer {
  Json truth, report;
  std::string error;  ///< a program failed
};

std::string configuration(const char* name) {
  return std::string(BODYSCHEMA_SOURCE_DIR) + "/config/icub_right/" + name;
}

/// Where a log and its truth lie.
struct Written {
  std::filesystem::path log, truth;
  std::string error;
};

/// Played by one file, known to the other.
struct Robot {
  std::string simulator = configuration("simulator.yaml"), estimator = configuration("estimator.yaml");
};

Written simulate(const Scratch& scratch, const std::string& name, const std::vector<std::string>& arguments,
                 const Robot& robot = {}) {
  Written written{scratch / (name + ".log"), scratch / (name + ".truth.json"), ""};
  std::vector<std::string> command = {
      "bodyschema-sim", "--config", robot.simulator,      "--set",   "simulator.cameras.rate_hz=10", "--offsets",
      "random",         "--log",    written.log.string(), "--truth", written.truth.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::filesystem::create_directories(scratch / name);
  Process simulator(command, scratch / name);
  if (simulator.wait(Seconds(400)) != 0) written.error = simulator.err();
  return written;
}

/// What the tool says about a log; the truth is read last.
Answer diagnose(const Scratch& scratch, const std::string& name, const Written& written,
                const std::vector<std::string>& arguments = {}, const Robot& robot = {}) {
  Answer answer;
  answer.error = written.error;
  if (!answer.error.empty()) return answer;
  const auto out = scratch / (name + ".report");
  std::vector<std::string> command = {"bodyschema", "diagnose",      written.log.string(),
                                      "--config",   robot.estimator, "--threads",
                                      "1",          "--out",         out.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  std::filesystem::create_directories(scratch / name);
  Process diagnose(command, scratch / name);
  if (diagnose.wait(Seconds(400)) != 0) answer.error = diagnose.err();
  answer.report = read(out / "report.json");
  answer.truth = read(written.truth);
  return answer;
}

/// Simulates with these arguments and diagnoses; the log is deleted.
Answer ask(const Scratch& scratch, const std::string& name, const std::vector<std::string>& arguments,
           const Robot& robot = {}) {
  const auto written = simulate(scratch, name, arguments, robot);
  auto answer = diagnose(scratch, name, written, {}, robot);
  std::filesystem::remove(written.log);
  return answer;
}

std::string text_of(const Json& j, const char* key) {
  return j.contains(key) && j[key].is_string() ? j[key].get<std::string>() : "";
}

/// Gain and eccentricity of one joint count as one.
bool same_cause(const Json& named, const Json& fault) {
  const auto scale = [](const std::string& n) { return n == "encoder_gain" || n == "eccentricity"; };
  const auto a = text_of(named, "name"), b = text_of(fault, "name");
  if (text_of(named, "joint") != text_of(fault, "joint")) return false;
  if (scale(a) && scale(b)) return true;
  return a == b && text_of(named, "source") == text_of(fault, "source");
}

const Json* cause_of(const Json& report, const Json& fault) {
  for (const auto& cause : report["causes"]) {
    for (const auto& member : cause["class"]) {
      if (same_cause(member, fault)) return &cause;
    }
  }
  return nullptr;
}

/// The fault itself, not only its like.
bool is_exactly(const Json& cause, const Json& fault) {
  return text_of(cause, "name") == text_of(fault, "name") && same_cause(cause, fault);
}

/// The parameter of a report that the fault's value is.
const Json* parameter_of(const Json& cause, const Json& fault) {
  std::string wanted;
  const auto name = text_of(fault, "name");
  if (name == "axis_tilt") wanted = text_of(fault, "about") == "2" ? "tilt_2" : "tilt_1";
  if (name == "principal_point") wanted = text_of(fault, "axis") == "y" ? "cy" : "cx";
  if (name == "eccentricity") wanted = "sine";
  for (const auto& p : cause["parameters"]) {
    if (wanted.empty() || text_of(p, "parameter") == wanted) return &p;
  }
  return nullptr;
}

/// In the class, and better on blocks that the fit had not seen; where it is named itself, with the right
/// sign and within twice its 95 % interval or 15 % of its size.
bool found(const Json& report, const Json& fault) {
  const Json* cause = cause_of(report, fault);
  if (cause == nullptr || !(*cause)["heldout_gain"].is_number()) return false;
  if (!((*cause)["heldout_gain"].get<double>() > 0.0)) return false;
  if (!is_exactly(*cause, fault)) return true;
  const Json* p = parameter_of(*cause, fault);
  if (p == nullptr || !(*p)["estimate"].is_number() || !(*p)["ci95"][1].is_number()) return false;
  const double value = fault["value"].get<double>(), estimate = (*p)["estimate"].get<double>();
  const double half = (*p)["ci95"][1].get<double>() - estimate;
  return value * estimate > 0.0 && std::abs(value - estimate) <= std::max(2.0 * half, 0.15 * std::abs(value));
}

/// How the parameters of causes that were named rightly compare with the truth.
struct Parameters {
  int known = 0, near = 0, held = 0;

  void add(const Answer& answer) {
    constexpr double kNear = 0.15;
    if (!answer.truth.contains("faults") || !answer.report.contains("causes")) return;
    for (const auto& fault : answer.truth["faults"]) {
      for (const auto& cause : answer.report["causes"]) {
        if (!is_exactly(cause, fault)) continue;
        const Json* p = parameter_of(cause, fault);
        if (p == nullptr) continue;
        const double value = fault["value"].get<double>();
        const auto number = [&](const Json& j) { return j.is_number() ? j.get<double>() : std::nan(""); };
        const double low = number((*p)["ci95"][0]), high = number((*p)["ci95"][1]);
        // An answer that is not explained claims no interval.
        if (std::isnan(low)) continue;
        ++known;
        near += std::abs(number((*p)["estimate"]) - value) <= kNear * std::abs(value);
        held += low <= value && value <= high;
        std::cout << fault["name"] << " " << value << ", estimated " << (*p)["estimate"] << " " << (*p)["ci95"]
                  << (low <= value && value <= high ? "" : ": outside the interval") << std::endl;
      }
    }
  }
};

std::string sentence_of(const Answer& answer) {
  std::string faults;
  if (answer.truth.contains("faults")) {
    for (const auto& f : answer.truth["faults"]) {
      if (text_of(f, "name") != "joint_offset") faults += f.dump() + " ";
    }
  }
  return faults + "-> " + (answer.error.empty() ? text_of(answer.report, "sentence") : answer.error);
}

struct Task {
  std::string name;
  std::vector<std::string> arguments;
  double demanded_rate = 1.0;  ///< of right answers, through pictures
  std::function<bool(const Answer&)> right{};
};

std::vector<Answer> ask_all(const Scratch& scratch, const std::vector<Task>& tasks) {
  std::vector<Answer> answers(tasks.size());
  std::atomic<std::size_t> next{0};
  std::vector<std::jthread> threads;
  for (int t = 0; t < kAtOnce; ++t) {
    threads.emplace_back([&] {
      for (std::size_t i; (i = next++) < tasks.size();) {
        answers[i] = ask(scratch, tasks[i].name, tasks[i].arguments);
      }
    });
  }
  threads.clear();
  return answers;
}

bool all_found(const Answer& answer) {
  const auto& faults = answer.truth["faults"];
  return !faults.empty() &&
         std::all_of(faults.begin(), faults.end(), [&](const Json& f) { return found(answer.report, f); });
}

/// Causes in whose class no fault is.
int spurious(const Answer& answer) {
  int count = 0;
  for (const auto& cause : answer.report["causes"]) {
    count += std::none_of(answer.truth["faults"].begin(), answer.truth["faults"].end(), [&](const Json& fault) {
      return std::any_of(cause["class"].begin(), cause["class"].end(),
                         [&](const Json& member) { return same_cause(member, fault); });
    });
  }
  return count;
}

/// Outside the catalogue: said to be unexplained, or at least a class on the right joint.
bool not_taken_for_another(const Answer& answer) {
  const auto verdict = text_of(answer.report, "verdict");
  if (verdict != "class") return verdict == "unexplained";
  return std::any_of(answer.report["causes"].begin(), answer.report["causes"].end(), [&](const Json& cause) {
    return std::any_of(answer.truth["faults"].begin(), answer.truth["faults"].end(),
                       [&](const Json& fault) { return text_of(cause, "joint") == text_of(fault, "joint"); });
  });
}

/// Runs an experiment on fresh seeds until it goes well, at most so often that one which goes well at
/// this rate fails less than once in a thousand runs. Empty, or what went wrong each time.
std::string once_right(double rate, const std::function<std::string(const std::string& seed)>& experiment) {
  std::string all;
  for (int i = 0; i < attempts_at(rate); ++i) {
    const auto wrong = experiment(std::to_string((seed() + static_cast<std::uint64_t>(i)) % 1'000'000'000));
    if (wrong.empty()) return "";
    std::cout << "attempt " << i << ": " << wrong << std::endl;
    all += wrong + "\n";
  }
  return all;
}

TEST(HiddenEffect, IsFoundBehindFreshSeeds) {
  const Scratch scratch;
  std::mt19937_64 random(seed());
  const auto number = [&] { return std::to_string(random() % 1'000'000'000); };
  const auto babble = [&](std::vector<std::string> more) {
    std::vector<std::string> list = {
        "--babble", std::to_string(static_cast<int>(kLog_s)), "--seed", number(), "--hidden-size", "5"};
    list.insert(list.end(), more.begin(), more.end());
    return list;
  };
  std::vector<Task> tasks;
  for (int i = 0; i < 5 * times(); ++i) {
    tasks.push_back({"single" + std::to_string(i), babble({"--hidden-fault", number()}), 0.90,
                     [](const Answer& a) { return all_found(a) && a.report["causes"].size() == 1; }});
  }
  for (int i = 0; i < times(); ++i) {
    const auto n = std::to_string(i);
    tasks.push_back(
        {"nothing" + n, babble({}), 0.93, [](const Answer& a) { return text_of(a.report, "verdict") == "none"; }});
    tasks.push_back({"two" + n, babble({"--hidden-fault", number(), "--hidden-fault", number()}), 0.80,
                     [](const Answer& a) { return all_found(a) && spurious(a) == 0; }});
    tasks.push_back(
        {"outside" + n, babble({"--hidden-fault", number(), "--hidden-outside"}), 0.80, not_taken_for_another});
  }
  const auto answers = ask_all(scratch, tasks);
  int right = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const bool good = answers[i].error.empty() && tasks[i].right(answers[i]);
    right += good;
    std::cout << tasks[i].name << (good ? ": right: " : ": WRONG: ") << sentence_of(answers[i]) << std::endl;
  }
  Parameters parameters;
  for (const auto& answer : answers) parameters.add(answer);
  std::vector<double> rates;
  for (const auto& task : tasks) rates.push_back(task.demanded_rate);
  EXPECT_GE(right, fewest_right(rates)) << "of " << tasks.size() << "; repeat with BODYSCHEMA_SEED=" << seed();
  // Through pictures: nine errors of ten below 15 %, intervals that hold 90 %, each five points worse.
  const auto least = fewest_right(std::vector<double>(static_cast<std::size_t>(parameters.known), 0.85));
  EXPECT_GE(parameters.near, least) << "of " << parameters.known << "; repeat with BODYSCHEMA_SEED=" << seed();
  EXPECT_GE(parameters.held, least) << "of " << parameters.known << "; repeat with BODYSCHEMA_SEED=" << seed();
}

/// Beside a free curve of the same joint the linear estimate of an eccentricity was hundreds of degrees. Nothing was
/// seen from there, and "0.000 px are left" was what the report said.
TEST(HiddenEffect, AnEstimateThatRunsOffIsTakenBack) {
  const Scratch scratch;
  const auto answer =
      ask(scratch, "kink", {"--babble", "60", "--seed", "21", "--hidden-outside", "--hidden-fault", "21"});
  ASSERT_EQ(answer.error, "");
  const auto& heldout = answer.report["heldout"];
  EXPECT_LT(heldout["after"]["rms_px"].get<double>(), heldout["before"]["rms_px"].get<double>());
  EXPECT_GT(heldout["after"]["rms_px"].get<double>(), 0.2) << "less than masks can tell";
  EXPECT_NEAR(heldout["after"]["outline_where_seen"].get<double>(),
              heldout["before"]["outline_where_seen"].get<double>(), 0.09);
  EXPECT_EQ(text_of(answer.report, "verdict"), "unexplained") << sentence_of(answer);
}

bool not_testable(const Json& report, const std::string& name, const std::string& joint) {
  return std::any_of(report["not_testable"].begin(), report["not_testable"].end(),
                     [&](const Json& n) { return text_of(n, "name") == name && text_of(n, "joint") == joint; });
}

TEST(HiddenEffect, AFrozenJointLeavesTheRestTestable) {
  const Scratch scratch;
  const std::string at = std::to_string(seed() % 1'000'000'000);
  const auto answer = ask(
      scratch, "frozen",
      {"--babble", "60", "--seed", at, "--freeze", "r_wrist_pitch", "--fault", "encoder_gain:joint=r_elbow,value=4"});
  ASSERT_EQ(answer.error, "");
  EXPECT_TRUE(not_testable(answer.report, "encoder_gain", "r_wrist_pitch"));
  EXPECT_TRUE(all_found(answer)) << sentence_of(answer) << "; repeat with BODYSCHEMA_SEED=" << seed();
}

/// What a play that nobody can test may be called: in one-way motion it is a step of its joint where the
/// motion begins (0.8 deg of 1 was measured), or something that nothing in the catalogue explains.
bool blames_another(const Answer& answer, const std::string& joint) {
  const auto& causes = answer.report["causes"];
  return std::any_of(causes.begin(), causes.end(), [&](const Json& cause) {
    const auto name = text_of(cause, "name");
    return name != "unexplained" && !(name == "slip" && text_of(cause, "joint") == joint);
  });
}

TEST(HiddenEffect, OneWayMotionShowsNoBacklashAndBlamesNoOther) {
  const Scratch scratch;
  // What masks and meshes get wrong follows a posture, and time where each comes once: both logs had a cause
  // before, a slip of 0.03 deg or the acceleration of a joint.
  EXPECT_EQ(once_right(0.93,
                       [&](const std::string& at) -> std::string {
                         const auto answer = ask(scratch, "one_way_nothing" + at, {"--one-way", "40", "--seed", at});
                         if (!answer.error.empty()) return answer.error;
                         return text_of(answer.report, "verdict") == "none" ? "" : sentence_of(answer);
                       }),
            "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
  EXPECT_EQ(once_right(0.93,
                       [&](const std::string& at) -> std::string {
                         const auto answer =
                             ask(scratch, "one_way" + at,
                                 {"--one-way", "40", "--seed", at, "--fault", "backlash:joint=r_elbow,value=1"});
                         if (!answer.error.empty()) return answer.error;
                         EXPECT_EQ(cause_of(answer.report, answer.truth["faults"][0]), nullptr) << sentence_of(answer);
                         EXPECT_TRUE(not_testable(answer.report, "backlash", "r_elbow"));
                         return blames_another(answer, "r_elbow") ? sentence_of(answer) : "";
                       }),
            "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
}

/// The official robot, its head looking down as the project's own does.
Robot official_robot(const Scratch& scratch) {
  const std::string configurations = std::string(BODYSCHEMA_SOURCE_DIR) + "/config/";
  Robot official{(scratch / "official.yaml").string(), configurations + "icub_v2_5/estimator.yaml"};
  std::ofstream(official.simulator)
      << "include: [" << configurations << "icub_v2_5/robot.yaml, " << configurations
      << "bus.yaml]\nsimulator: {motion: {posture_deg: {neck_pitch: -22, eyes_tilt: -18}}}\n";
  return official;
}

TEST(HiddenEffect, TheOfficialRobotIsDiagnosedWithItsOwnConfiguration) {
  SKIP_WITHOUT("icub-models");
  const Scratch scratch;
  const auto official = official_robot(scratch);
  EXPECT_EQ(once_right(0.90,
                       [&](const std::string& at) -> std::string {
                         const auto answer =
                             ask(scratch, "official" + at,
                                 {"--babble", "40", "--seed", at, "--fault", "latency:value=40"}, official);
                         if (!answer.error.empty()) return answer.error;
                         return all_found(answer) && answer.report["causes"].size() == 1 ? "" : sentence_of(answer);
                       }),
            "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
}

/// A log as many are recorded: still postures one after another, with jumps between them. What all small errors
/// of masks and meshes have in common shows clearly there; it is no crowd for all that.
TEST(HiddenEffect, StillPosturesOfTheOfficialRobotShowItsGainOrNothing) {
  SKIP_WITHOUT("icub-models");
  const Scratch scratch;
  const auto official = official_robot(scratch);
  const auto postures = [&](const std::string& at, std::vector<std::string> more) {
    more.insert(more.begin(), {"--poses", "70", "--seed", at, "--set", "simulator.cameras.rate_hz=4", "--set",
                               "simulator.motion.fast_deg_s=500"});
    return more;
  };
  EXPECT_EQ(once_right(0.90,
                       [&](const std::string& at) -> std::string {
                         const auto answer =
                             ask(scratch, "postures" + at,
                                 postures(at, {"--fault", "encoder_gain:joint=r_elbow,value=4"}), official);
                         if (!answer.error.empty()) return answer.error;
                         return all_found(answer) && answer.report["causes"].size() == 1 ? "" : sentence_of(answer);
                       }),
            "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
  EXPECT_EQ(once_right(0.93,
                       [&](const std::string& at) -> std::string {
                         const auto answer = ask(scratch, "postures_nothing" + at, postures(at, {}), official);
                         if (!answer.error.empty()) return answer.error;
                         const bool none = text_of(answer.report, "verdict") == "none" &&
                                           text_of(answer.report, "sentence").find("explains the log to its noise") !=
                                               std::string::npos;
                         return none ? "" : sentence_of(answer);
                       }),
            "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
}

/// Every event of a log in order of its time stamp, to be edited.
std::vector<LogEvent> events_of(const std::filesystem::path& log) {
  LogReader reader(log);
  std::vector<LogEvent> events;
  for (LogEvent event; reader.next(event);) events.push_back(event);
  return events;
}

void write_events(const std::filesystem::path& log, const std::vector<LogEvent>& events) {
  LogWriter writer(log);
  for (const auto& event : events) writer.publish(event.channel, event.time_us, event.data);
}

template <class Message>
Message decoded(const LogEvent& event) {
  Message message;
  if (message.decode(event.data.data(), 0, static_cast<int>(event.data.size())) < 0) {
    throw std::runtime_error("cannot be decoded");
  }
  return message;
}

/// Every pair of pictures once more, a millisecond later.
std::vector<LogEvent> doubled(const std::vector<LogEvent>& events) {
  std::vector<LogEvent> twice;
  for (const auto& event : events) {
    twice.push_back(event);
    if (event.channel != "ICUB_CAMERAS") continue;
    auto pictures = decoded<bot_core::images_t>(event);
    constexpr Microseconds kLater = 1000;
    pictures.utime += kLater;
    for (auto& picture : pictures.images) picture.utime += kLater;
    twice.push_back(event);
    twice.back().data = encode(pictures);
  }
  return twice;
}

/// Before every picture the encoders take a detour that sets any play to a random side: what comes
/// from the direction of motion no longer follows it.
std::vector<LogEvent> with_random_directions(std::vector<LogEvent> events, std::uint64_t seed) {
  constexpr Microseconds kBegin = 90'000, kEnd = 45'000;
  constexpr float kDetour_rad = 0.05f;
  std::vector<Microseconds> pictures;
  for (const auto& event : events) {
    if (event.channel == "ICUB_CAMERAS") pictures.push_back(decoded<bot_core::images_t>(event).utime);
  }
  std::sort(pictures.begin(), pictures.end());
  std::mt19937_64 random(seed);
  std::vector<std::uint64_t> sides;
  for (std::size_t i = 0; i < pictures.size(); ++i) sides.push_back(random());
  for (auto& event : events) {
    if (event.channel != "ICUB_JOINT_STATE") continue;
    auto joints = decoded<bot_core::joint_state_t>(event);
    const auto next = std::lower_bound(pictures.begin(), pictures.end(), joints.utime);
    if (next == pictures.end() || *next - joints.utime < kEnd || *next - joints.utime > kBegin) continue;
    const auto side = sides[static_cast<std::size_t>(next - pictures.begin())];
    for (std::size_t j = 0; j < joints.joint_name.size(); ++j) {
      const auto& name = joints.joint_name[j];
      if (name.find("shoulder") == std::string::npos && name.find("elbow") == std::string::npos &&
          name.find("wrist") == std::string::npos) {
        continue;
      }
      joints.joint_position[j] += (side >> j & 1) != 0 ? kDetour_rad : -kDetour_rad;
    }
    event.data = encode(joints);
  }
  return events;
}

/// Empty, or what a tool does wrong with a log of backlash whose frames come twice and whose directions
/// of motion are shuffled.
std::string wrong_with_copies(const Scratch& scratch, const std::string& at) {
  const auto written = simulate(scratch, "plain" + at,
                                {"--babble", "40", "--seed", at, "--set", "simulator.cameras.rate_hz=5", "--fault",
                                 "backlash:joint=r_elbow,value=1.5"});
  if (!written.error.empty()) return written.error;
  const auto events = events_of(written.log);
  auto twice = written, shuffled = written;
  twice.log = scratch / ("twice" + at + ".log");
  shuffled.log = scratch / ("shuffled" + at + ".log");
  write_events(twice.log, doubled(events));
  write_events(shuffled.log, with_random_directions(events, seed()));
  const std::vector<std::string> every = {"--picture-rate", "100"};
  std::vector<Answer> answers(3);
  {
    std::jthread other([&] { answers[1] = diagnose(scratch, "twice" + at, twice, every); });
    answers[0] = diagnose(scratch, "plain" + at, written, every);
    answers[2] = diagnose(scratch, "shuffled" + at, shuffled, every);
  }
  for (const auto& answer : answers) {
    if (!answer.error.empty()) return answer.error;
  }
  const auto& fault = answers[0].truth["faults"][0];
  const Json* one = cause_of(answers[0].report, fault);
  const Json* two = cause_of(answers[1].report, fault);
  if (one == nullptr) return "plain: " + sentence_of(answers[0]);
  if (two == nullptr || answers[1].report["causes"].size() != answers[0].report["causes"].size()) {
    return "twice: " + sentence_of(answers[1]);
  }
  const auto width = [](const Json& cause) {
    const auto& ci = cause["parameters"][0]["ci95"];
    return ci[0].is_number() && ci[1].is_number() ? ci[1].get<double>() - ci[0].get<double>() : std::nan("");
  };
  // Twice the frames would make the interval 0.71 as wide.
  if (!(std::abs(width(*two) - width(*one)) <= 0.15 * width(*one))) {
    return "intervals " + one->dump() + " and, with all frames twice, " + two->dump();
  }
  if (!((*two)["z"].get<double>() < 1.2 * (*one)["z"].get<double>())) return "z of twice the frames: " + two->dump();
  if (cause_of(answers[2].report, fault) != nullptr) return "shuffled: " + sentence_of(answers[2]);
  return "";
}

TEST(HiddenEffect, DuplicatedFramesSharpenNothingAndShuffledDirectionsShowNoBacklash) {
  const Scratch scratch;
  EXPECT_EQ(wrong_with_copies(scratch, std::to_string(seed() % 1'000'000'000)), "")
      << "repeat with BODYSCHEMA_SEED=" << seed();
}

TEST(BinomialBound, IsThatOfTables) {
  EXPECT_EQ(fewest_right(std::vector<double>(8, 0.8)), 2);    // at most 1 of 8: 0.00008, 2: 0.0012
  EXPECT_EQ(fewest_right(std::vector<double>(20, 0.9)), 13);  // at most 12 of 20: 0.0004, 13: 0.0024
  EXPECT_EQ(attempts_at(0.93), 3);                            // 0.07^3 = 0.0003
  EXPECT_EQ(attempts_at(0.5), 10);
}

}  // namespace
}  // namespace bodyschema::integration
