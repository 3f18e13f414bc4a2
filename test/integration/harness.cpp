#include "harness.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "bodyschema/bus/bus_options.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/service/start_up_checks.hpp"

namespace bodyschema::integration {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::string contents(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

bool eventually(const std::function<bool()>& condition, Seconds limit) {
  const auto end = Clock::now() + limit * patience();
  while (!condition()) {
    if (Clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace

double patience() {
  const char* text = std::getenv("BODYSCHEMA_TEST_PATIENCE");
  return text != nullptr ? std::max(1.0, std::atof(text)) : 1.0;
}

// --- Process -------------------------------------------------------------------------------------

Process::Process(std::vector<std::string> arguments, const fs::path& scratch,
                 const std::map<std::string, std::string>& environment) {
  const fs::path built = fs::path(BODYSCHEMA_BINARY_DIR) / "bin" / arguments.front();
  if (fs::exists(built)) arguments.front() = built.string();
  static std::atomic<int> count = 0;
  const std::string name = std::to_string(++count) + "-" + fs::path(arguments.front()).filename().string();
  out_ = scratch / (name + ".out");
  err_ = scratch / (name + ".err");
  std::vector<char*> argv;
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  // Made before the fork: a child of a program with several threads may not allocate memory.
  std::vector<std::string> variables;
  for (const auto& [key, value] : environment) variables.push_back(key + "=" + value);
  for (char** inherited = environ; *inherited != nullptr; ++inherited) {
    const std::string variable = *inherited;
    if (!environment.contains(variable.substr(0, variable.find('=')))) variables.push_back(variable);
  }
  std::vector<char*> envp;
  for (auto& variable : variables) envp.push_back(variable.data());
  envp.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) throw std::runtime_error("fork failed");
  if (pid_ == 0) {
    const int in = open("/dev/null", O_RDONLY);
    const int out = open(out_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644);
    const int err = open(err_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644);
    dup2(in, 0);
    dup2(out, 1);
    dup2(err, 2);
    execvpe(argv[0], argv.data(), envp.data());
    _exit(127);
  }
}

Process::~Process() {
  if (!status_ && running()) {
    signal(SIGKILL);
    wait(Seconds(5));
  }
  if (testing::Test::HasFailure()) std::fprintf(stderr, "--- %s\n%s", err_.filename().c_str(), err().c_str());
}

void Process::signal(int number) const {
  if (!status_) kill(pid_, number);
}

std::optional<int> Process::wait(Seconds limit) {
  eventually([this] { return !running(); }, limit);
  return status_;
}

bool Process::running() {
  if (status_) return false;
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return true;
  status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return false;
}

std::string Process::out() const {
  return contents(out_);
}
std::string Process::err() const {
  return contents(err_);
}

bool Process::said(const std::string& words, Seconds limit) {
  return eventually([&] { return err().find(words) != std::string::npos || !running(); }, limit) &&
         err().find(words) != std::string::npos;
}

// --- Scratch ---------------------------------------------------------------------------------------

double ProcessorWait::waited_s() const {
  double sum_ns = 0.0;
  std::error_code gone;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(pid_) + "/task", gone)) {
    double ran_ns = 0.0, waited_ns = 0.0;
    if (std::ifstream(task.path() / "schedstat") >> ran_ns >> waited_ns) sum_ns += waited_ns;
  }
  return 1e-9 * sum_ns;
}

double ProcessorWait::share() const {
  const double passed_s = Seconds(std::chrono::steady_clock::now() - begin_).count();
  return passed_s > 0.0 ? std::max(0.0, waited_s() - begin_s_) / passed_s : 0.0;
}

Scratch::Scratch() {
  std::string pattern = (fs::temp_directory_path() / "bodyschema-test-XXXXXX").string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no scratch folder can be made");
  folder_ = pattern;
}

Scratch::~Scratch() {
  if (testing::Test::HasFailure()) {
    std::fprintf(stderr, "files are kept in %s\n", folder_.c_str());
    return;
  }
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

// --- network ---------------------------------------------------------------------------------------

std::string why_no_lcm() {
  try {
    LcmLink link(own_lcm_url());
    bool heard = false;
    link.subscribe("PROBE", 8, [&](const std::string&, Bytes, std::int64_t) { heard = true; });
    const std::vector<std::uint8_t> message(10, 1);
    for (int i = 0; i < 20 && !heard; ++i) {
      link.publish("PROBE", 0, message);
      link.handle(50);
    }
    return heard ? "" : "no multicast packet comes back on this machine; scripts/multicast adds the route";
  } catch (const Error& e) {
    return e.what();
  }
}

// Every picture of the network passes through its socket: one of a hundred offsets was lost in the 200 KiB that a
// socket has by default.
Listener::Listener(const std::string& lcm_url) : link_(with_receive_buffer(lcm_url)) {
  const Channels channels = Channels::with_prefix("ICUB");
  link_.subscribe(channels.joint_offsets, 1000, [this](const std::string&, Bytes message, std::int64_t) {
    joint_offsets_t decoded;
    if (!decode(message, decoded).ok()) return;
    const std::lock_guard lock(mutex_);
    offsets_.push_back(std::move(decoded));
    arrived_.notify_all();
  });
  link_.subscribe(channels.offsets_status, 1000, [this](const std::string&, Bytes message, std::int64_t) {
    offsets_status_t decoded;
    if (!decode(message, decoded).ok()) return;
    const std::lock_guard lock(mutex_);
    statuses_.push_back(std::move(decoded));
    arrived_.notify_all();
  });
  link_.subscribe(channels.findings, 1000, [this](const std::string&, Bytes message, std::int64_t) {
    findings_t decoded;
    if (!decode(message, decoded).ok()) return;
    const std::lock_guard lock(mutex_);
    findings_.push_back(std::move(decoded));
    arrived_.notify_all();
  });
  thread_ = std::jthread([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) link_.handle(20);
  });
}

Listener::~Listener() = default;

std::vector<joint_offsets_t> Listener::offsets() const {
  const std::lock_guard lock(mutex_);
  return offsets_;
}

std::vector<offsets_status_t> Listener::statuses() const {
  const std::lock_guard lock(mutex_);
  return statuses_;
}

std::vector<findings_t> Listener::findings() const {
  const std::lock_guard lock(mutex_);
  return findings_;
}

std::vector<joint_offsets_t> Listener::take_offsets() {
  const std::lock_guard lock(mutex_);
  return std::exchange(offsets_, {});
}

std::optional<offsets_status_t> Listener::wait_status(const std::function<bool(const offsets_status_t&)>& wanted,
                                                      Seconds limit) {
  std::unique_lock lock(mutex_);
  std::size_t next = statuses_.size();
  std::optional<offsets_status_t> found;
  arrived_.wait_for(lock, limit * patience(), [&] {
    for (; next < statuses_.size(); ++next) {
      if (!wanted(statuses_[next])) continue;
      found = statuses_[next];
      return true;
    }
    return false;
  });
  return found;
}

bool Listener::wait_offsets(std::size_t count, Seconds limit) {
  std::unique_lock lock(mutex_);
  return arrived_.wait_for(lock, limit * patience(), [&] { return offsets_.size() >= count; });
}

std::int64_t counter(const offsets_status_t& status, const std::string& name) {
  for (std::size_t i = 0; i < status.counter_name.size(); ++i) {
    if (status.counter_name[i] == name) return status.counter_value[i];
  }
  ADD_FAILURE() << "the status has no counter " << name;
  return 0;
}

std::int64_t counters_with(const offsets_status_t& status, const std::string& prefix) {
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < status.counter_name.size(); ++i) {
    if (status.counter_name[i].starts_with(prefix)) sum += status.counter_value[i];
  }
  return sum;
}

std::int64_t pictures_unaccounted_for(const offsets_status_t& status) {
  const std::int64_t frames =
      status.frames_estimated + counter(status, "shed.queue") + counter(status, "failed") + counter(status, "left");
  return counter(status, "pictures.used") + counter(status, "mono") - 2 * frames;
}

Player::Player(const std::string& lcm_url, fs::path log, double speed, Change change)
    : link_(lcm_url), log_(std::move(log)), speed_(speed), change_(std::move(change)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

Player::~Player() = default;

void Player::wait() {
  if (thread_.joinable()) thread_.join();
}

void Player::work(const std::stop_token& stop) {
  LogReader log(log_);
  LogEvent event;
  const auto start = Clock::now();
  Microseconds first = -1;
  while (!stop.stop_requested() && log.next(event)) {
    if (first < 0) first = event.time_us;
    std::this_thread::sleep_until(
        start + std::chrono::duration_cast<Clock::duration>(Seconds(seconds(event.time_us - first) / speed_)));
    if (change_ && !change_(event, link_)) continue;
    link_.publish(event.channel, event.time_us, event.data);
  }
}

Robot::Robot(const std::string& lcm_url, const fs::path& log, double speed, std::size_t every)
    : link_(lcm_url), speed_(speed) {
  LogReader reader(log);
  std::size_t pictures = 0;
  for (LogEvent event; reader.next(event);) {
    Message message;
    message.time_us = event.time_us;
    const int size = static_cast<int>(event.data.size());
    if (event.channel == "ICUB_CAMERAS") {
      if (pictures++ % every != 0) continue;
      message.pictures.emplace().decode(event.data.data(), 0, size);
    } else if (event.channel == "ICUB_JOINT_STATE") {
      message.joints.emplace().decode(event.data.data(), 0, size);
    } else {
      continue;
    }
    messages_.push_back(std::move(message));
  }
  first_us_ = messages_.front().time_us;
  length_us_ = messages_.back().time_us - first_us_;
  for (std::size_t i = 0; i < messages_.size(); ++i) {
    const Message& m = messages_[i];
    orders_[0].push_back({m.time_us - first_us_, i});
    // Backwards it is the stamps that turn round; a message still comes out after what it tells of.
    const Microseconds stamp = m.pictures ? m.pictures->images.back().utime : m.joints->utime;
    orders_[1].push_back({length_us_ - (stamp - first_us_) + (m.time_us - stamp), i});
  }
  std::stable_sort(orders_[1].begin(), orders_[1].end());
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
}

Robot::~Robot() = default;

void Robot::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Robot::set_faults(Faults faults) {
  const std::lock_guard lock(mutex_);
  faults_ = std::move(faults);
}

void Robot::work(const std::stop_token& stop) {
  constexpr Microseconds kBetweenLaps = 10'000;
  const auto start = Clock::now();
  for (Microseconds lap = 0; !stop.stop_requested(); ++lap) {
    const Microseconds begin = lap * (length_us_ + kBetweenLaps);
    for (const auto& [due, index] : orders_[static_cast<std::size_t>(lap % 2)]) {
      if (stop.stop_requested()) return;
      std::this_thread::sleep_until(
          start + std::chrono::duration_cast<Clock::duration>(Seconds(seconds(begin + due) / speed_)));
      publish(messages_[index], lap % 2 == 0, first_us_ + begin);
    }
  }
}

void Robot::publish(const Message& message, bool forwards, Microseconds lap_begin) {
  const auto moved = [&](Microseconds stamp) {
    const Microseconds along = stamp - first_us_;
    return lap_begin + (forwards ? along : length_us_ - along);
  };
  const std::lock_guard lock(mutex_);
  if (message.pictures) {
    bot_core::images_t pictures = *message.pictures;
    pictures.utime = moved(pictures.utime);
    for (auto& image : pictures.images) image.utime = moved(image.utime);
    if (faults_.pictures && !faults_.pictures(pictures, link_)) return;
    link_.publish_message("ICUB_CAMERAS", pictures.utime, pictures);
  } else {
    bot_core::joint_state_t joints = *message.joints;
    joints.utime = moved(joints.utime);
    if (!forwards) {
      for (auto& velocity : joints.joint_velocity) velocity = -velocity;
    }
    if (faults_.joints && !faults_.joints(joints, link_)) return;
    link_.publish_message("ICUB_JOINT_STATE", joints.utime, joints);
  }
}

// --- logs ------------------------------------------------------------------------------------------

std::string reach_configuration() {
  return (fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/estimator.yaml").string();
}

fs::path reach_log() {
  const fs::path file = fs::path(BODYSCHEMA_BINARY_DIR) / "test-logs" / "reach.lcmlog";
  if (fs::exists(file) && fs::exists(reach_truth())) return file;
  fs::create_directories(file.parent_path());
  // Tests run side by side: each writes under a name of its own, the last rename wins.
  const fs::path mine = file.string() + "." + std::to_string(getpid());
  const fs::path truth = mine.string() + ".truth";
  const fs::path simulator = fs::path(BODYSCHEMA_SOURCE_DIR) / "config/icub_right/simulator.yaml";
  {
    Scratch scratch;
    Process sim({"bodyschema-sim", "--config", simulator.string(), "--frames", "60", "--seed", "7", "--log",
                 mine.string(), "--truth", truth.string()},
                scratch.folder());
    const auto status = sim.wait(Seconds(120));
    if (status != 0) throw std::runtime_error("bodyschema-sim failed: " + sim.err());
  }
  fs::rename(truth, reach_truth());
  fs::rename(mine, file);
  return file;
}

fs::path reach_truth() {
  return fs::path(BODYSCHEMA_BINARY_DIR) / "test-logs" / "reach_truth.json";
}

std::map<Microseconds, std::string> estimates_by_utime(const fs::path& file) {
  std::map<Microseconds, std::string> lines;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    lines[nlohmann::json::parse(line).at("utime").get<Microseconds>()] = line;
  }
  return lines;
}

std::map<Microseconds, std::string> replay_estimates(const fs::path& log, const fs::path& out,
                                                     const std::vector<std::string>& more) {
  fs::create_directories(out);
  std::vector<std::string> command = {"bodyschema", "replay", log.string()};
  command.insert(command.end(), {"--config", reach_configuration(), "--out", out.string()});
  command.insert(command.end(), {"--overlays", "0", "--learn-background-online"});
  command.insert(command.end(), more.begin(), more.end());
  Process replay(command, out);
  const auto status = replay.wait(Seconds(200));
  if (status != 0) throw std::runtime_error("bodyschema replay failed: " + replay.err());
  return estimates_by_utime(out / "estimates.jsonl");
}

}  // namespace bodyschema::integration
