#include "bodyschema/diagnosis/trials.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>

#include "bodyschema/effects/catalogue.hpp"

namespace bodyschema {
namespace {

/// Smallest sizes found 90 % of the time in a 50 s log, from the design, shoulder to wrist; 0: not
/// visible there.
std::array<double, 7> detectable_by_joint(const std::string& name) {
  if (name == "compliance") return {0.1, 0.1, 0.3, 0.6, 0, 0, 0};
  if (name == "backlash") return {0.1, 0.15, 0.2, 0.2, 0.4, 0.3, 0.3};
  if (name == "encoder_gain") return {0.5, 0.6, 0.8, 0.8, 1.2, 2.0, 2.0};
  if (name == "eccentricity") return {0.3, 0.35, 0.45, 0.45, 0.7, 1.15, 1.15};
  if (name == "joint_coupling") return {0.5, 0.6, 0.7, 0.7, 1.2, 1.8, 1.8};
  if (name == "link_length") return {0, 0, 1.0, 0, 1.0, 0, 0};
  if (name == "axis_tilt") return {0.3, 0.35, 0.4, 0.4, 0.7, 1.0, 1.0};
  if (name == "drift") return {0.2, 0.2, 0.25, 0.25, 0.4, 0.35, 0.35};
  if (name == "slip") return {0.2, 0.2, 0.3, 0.3, 0.8, 0.6, 0.6};
  if (name == "wobble") return {0.2, 0.2, 0.2, 0.2, 0.4, 0.35, 0.35};
  if (name == "velocity_lag") return {10, 10, 12, 12, 25, 20, 20};
  if (name == "acceleration_lag") return {0.2, 0.2, 0.25, 0.25, 0.5, 0.4, 0.4};
  if (name == "local_kink" || name == "random_walk") return {0.3, 0.3, 0.3, 0.3, 0.6, 0.5, 0.5};
  return {};
}

double detectable_of_robot(const std::string& name) {
  if (name == "payload") return 0.25;
  if (name == "latency") return 5.0;
  if (name == "camera_skew") return 5.6;
  if (name == "vergence") return 0.09;
  if (name == "baseline") return 0.4;
  if (name == "focal_length") return 0.55;
  if (name == "principal_point") return 0.4;
  if (name == "distortion") return 0.026;
  if (name == "silhouette_bias") return 0.23;
  if (name == "mesh_scale") return 0.6;
  if (name == "finger_posture") return 0.1;
  return 0.0;
}

bool one_sided(const std::string& name) {
  return name == "compliance" || name == "payload" || name == "backlash" || name == "wobble" ||
         name == "velocity_lag" || name == "acceleration_lag" || name == "random_walk";
}

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_() >> 11) * 0x1.0p-53);
  }
  std::size_t index(std::size_t n) { return static_cast<std::size_t>(random_() % n); }

  /// Every kind of cause equally often, then any of its places.
  TrialFault fault(const std::vector<TrialFault>& places, double low, double high) {
    std::vector<std::string> names;
    for (const auto& p : places) {
      if (std::find(names.begin(), names.end(), p.cause.name) == names.end()) {
        names.push_back(p.cause.name);
      }
    }
    const auto name = names[index(names.size())];
    std::vector<TrialFault> of_kind;
    for (const auto& p : places) {
      if (p.cause.name == name) of_kind.push_back(p);
    }
    return sized(of_kind[index(of_kind.size())], low, high);
  }

  TrialFault sized(TrialFault fault, double low, double high) {
    const auto& name = fault.cause.name;
    const double sign = one_sided(name) || uniform(0, 1) < 0.5 ? 1.0 : -1.0;
    fault.value = sign * fault.detectable * uniform(low, high);
    if (name == "slip") fault.second = uniform(0.1, 0.9);
    if (name == "wobble") fault.second = std::exp(uniform(std::log(4.0), std::log(15.0)));
    if (name == "axis_tilt" && uniform(0, 1) < 0.5) std::swap(fault.value, fault.second);
    if (name == "principal_point" && uniform(0, 1) < 0.5) std::swap(fault.value, fault.second);
    return fault;
  }

 private:
  std::mt19937_64 random_;
};

std::uint64_t mix(std::uint64_t seed, std::uint64_t n) {
  std::uint64_t z = seed * 0x9E3779B97F4A7C15ull + n + 0x632BE59BD9B4E019ull;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

bool same(const CauseName& a, const CauseName& b) { return a == b; }

/// Gain and eccentricity of one joint count as one.
bool equivalent(const CauseName& a, const CauseName& b) {
  if (same(a, b)) return true;
  const auto is_scale = [](const CauseName& c) {
    return c.name == "encoder_gain" || c.name == "eccentricity";
  };
  return is_scale(a) && is_scale(b) && a.joint == b.joint;
}

bool holds(const DiagnosedCause& cause, const TrialFault& truth) {
  return std::any_of(cause.same.begin(), cause.same.end(),
                     [&](const auto& c) { return equivalent(c, truth.cause); });
}

double rms(const Eigen::MatrixXd& m) {
  return std::sqrt(m.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, m.size())));
}

double share(std::size_t part, std::size_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1) + 0.5)];
}

TrialOutcome run_trial(const TrialRobot& robot, const std::string& setting, std::uint64_t seed,
                       std::size_t number) {
  const auto start = std::chrono::steady_clock::now();
  Draw draw(seed);
  const auto inside = trial_faults(robot, false), outside = trial_faults(robot, true);
  TrialOutcome outcome;
  outcome.setting = setting;
  outcome.seed = seed;
  TrialOptions options;
  if (setting == "null") options.noise_burst = number % 2 == 1;
  if (setting == "background") {
    while (options.faults.size() < 15) {
      auto fault = draw.fault(inside, 0.1, 0.5);
      const bool drawn = std::any_of(options.faults.begin(), options.faults.end(),
                                     [&](const auto& f) { return f.cause.name == fault.cause.name; });
      if (!drawn) options.faults.push_back(std::move(fault));
    }
  } else if (setting == "single") {
    options.faults = {draw.fault(inside, 3.0, 6.0)};
  } else if (setting == "limit") {
    options.faults = {draw.fault(inside, 1.0, 1.0)};
  } else if (setting == "two") {
    options.faults = {draw.fault(inside, 3.0, 6.0)};
    do {
      auto second = draw.fault(inside, 3.0, 6.0);
      if (second.cause.name == options.faults[0].cause.name) continue;
      options.faults.push_back(second);
    } while (options.faults.size() < 2);
  } else if (setting == "outside" || setting == "outside_hard") {
    std::vector<TrialFault> places;
    for (const auto& place : outside) {
      const bool hard = place.cause.name == "local_kink" || place.cause.name == "random_walk";
      if (hard == (setting == "outside_hard")) places.push_back(place);
    }
    options.faults = {draw.fault(places, 3.0, 6.0)};
  }
  outcome.truth = options.faults;
  const auto log = make_synthetic_log(robot, options, mix(seed, 1));
  DiagnosisOptions diagnosis;
  diagnosis.nuisances = usual_nuisances(log->roles());
  outcome.report = diagnose(*log, diagnosis);
  const auto& report = outcome.report;
  const auto& truth = log->true_corrections();
  outcome.offset_error_before_deg = degrees(rms(report.joint_corrections_before - truth));
  outcome.offset_error_after_deg = degrees(rms(report.joint_corrections_after - truth));
  if (setting == "single" && options.faults[0].cause.name != "slip") {
    diagnosis.fixed_causes = {options.faults[0].cause};
    const auto ideal = diagnose(*log, diagnosis);
    const double before = std::pow(report.before.rms_px, 2);
    const double removable = before - std::pow(ideal.after.rms_px, 2);
    if (removable > 1e-4 * before) {
      outcome.removable_excess = (before - std::pow(report.after.rms_px, 2)) / removable;
    }
  }
  outcome.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

}  // namespace

std::vector<TrialFault> trial_faults(const TrialRobot& robot, bool outside_catalogue) {
  const auto roles = JointRoles::of(robot.model, robot.setup);
  const auto joint = [&](std::size_t i) { return roles.names[static_cast<std::size_t>(roles.arm[i])]; };
  std::vector<TrialFault> list;
  const auto by_joint = [&](const std::string& name) {
    const auto sizes = detectable_by_joint(name);
    for (std::size_t i = 0; i < roles.arm.size() && i < sizes.size(); ++i) {
      if (sizes[i] > 0.0) list.push_back({{name, joint(i), ""}, 0.0, 0.0, sizes[i]});
    }
  };
  if (outside_catalogue) {
    for (const char* name : {"wobble", "velocity_lag", "acceleration_lag", "local_kink", "random_walk"}) {
      by_joint(name);
    }
    return list;
  }
  for (const auto& name : effect_names()) {
    if (name == "joint_offset") continue;
    if (name == "joint_coupling") {
      const auto sizes = detectable_by_joint(name);
      for (std::size_t i = 0; i < roles.arm.size() && i < sizes.size(); ++i) {
        if (i > 0) list.push_back({{name, joint(i), joint(i - 1)}, 0.0, 0.0, sizes[i]});
        if (i + 1 < roles.arm.size()) list.push_back({{name, joint(i), joint(i + 1)}, 0.0, 0.0, sizes[i]});
      }
    } else if (name == "head_offset") {
      constexpr std::array<double, 4> kSizes = {0.3, 0.2, 0.3, 0.4};
      const auto targets = effect_targets(name, roles);
      for (std::size_t i = 0; i < targets.size(); ++i) {
        list.push_back({{name, targets[i].joint, ""}, 0.0, 0.0, kSizes[i]});
      }
    } else if (name == "principal_point") {
      for (const char* where : {"difference", "left", "right"}) {
        list.push_back({{name, "", where}, 0.0, 0.0, detectable_of_robot(name)});
      }
    } else if (detectable_of_robot(name) > 0.0) {
      if (!effect_targets(name, roles).empty()) {
        list.push_back({{name, "", ""}, 0.0, 0.0, detectable_of_robot(name)});
      }
    } else {
      by_joint(name);
    }
  }
  return list;
}

bool in_class(const DiagnosisReport& report, const TrialFault& truth) {
  return std::any_of(report.causes.begin(), report.causes.end(),
                     [&](const auto& cause) { return holds(cause, truth); });
}

bool named_exactly(const DiagnosisReport& report, const TrialFault& truth) {
  return std::any_of(report.causes.begin(), report.causes.end(),
                     [&](const auto& cause) { return equivalent(cause.cause, truth.cause); });
}

TrialRates rates(const std::vector<TrialOutcome>& outcomes) {
  TrialRates r;
  std::size_t null_alarms = 0, background_named = 0, in = 0, exact = 0, wrong = 0, classes = 0,
              limit_wrong = 0, both = 0, spurious = 0, unexplained = 0, hard_joint = 0,
              hard_soft = 0, signs = 0, parameters = 0, covered = 0;
  double class_size = 0.0;
  std::vector<double> errors, excess, improvement;
  const auto score_parameters = [&](const TrialOutcome& o, const TrialFault& truth) {
    for (const auto& cause : o.report.causes) {
      if (!same(cause.cause, truth.cause)) continue;
      // The parameter that carries the fault: the second where the first is zero.
      const std::size_t i = truth.value == 0.0 && cause.parameters.size() > 1 ? 1 : 0;
      if (cause.parameters.empty()) continue;
      const double value = i == 1 ? truth.second : truth.value;
      const auto& p = cause.parameters[i];
      ++parameters;
      signs += p.estimate * value > 0.0;
      errors.push_back(std::abs(p.estimate - value) / std::abs(value));
      covered += p.ci95[0] <= value && value <= p.ci95[1];
    }
  };
  for (const auto& o : outcomes) {
    const auto& causes = o.report.causes;
    if (o.setting == "null") {
      ++r.null_trials;
      null_alarms += !causes.empty();
    } else if (o.setting == "background") {
      ++r.background_trials;
      background_named += std::any_of(causes.begin(), causes.end(),
                                      [](const auto& c) { return c.heldout_gain > 0.05; });
    } else if (o.setting == "single" || o.setting == "limit") {
      const auto& truth = o.truth.front();
      const bool found = in_class(o.report, truth);
      if (o.setting == "limit") {
        ++r.limit_trials;
        limit_wrong += !causes.empty() && !found;
        continue;
      }
      ++r.single_trials;
      in += found;
      exact += named_exactly(o.report, truth);
      wrong += !causes.empty() && !found;
      for (const auto& cause : causes) {
        if (!holds(cause, truth)) continue;
        class_size += static_cast<double>(cause.same.size());
        ++classes;
        break;
      }
      score_parameters(o, truth);
      if (found && o.removable_excess != 0.0) excess.push_back(o.removable_excess);
      if (found && o.offset_error_after_deg > 0.0) {
        improvement.push_back(o.offset_error_before_deg / o.offset_error_after_deg);
      }
    } else if (o.setting == "two") {
      ++r.two_trials;
      both += in_class(o.report, o.truth[0]) && in_class(o.report, o.truth[1]);
      spurious += std::any_of(causes.begin(), causes.end(), [&](const auto& c) {
        return !holds(c, o.truth[0]) && !holds(c, o.truth[1]);
      });
      for (const auto& truth : o.truth) score_parameters(o, truth);
    } else if (o.setting == "outside" || o.setting == "outside_hard") {
      const auto& truth = o.truth.front();
      const bool says_so = std::any_of(causes.begin(), causes.end(), [](const auto& c) {
        return c.cause.name == "unexplained";
      });
      if (o.setting == "outside") {
        ++r.outside_trials;
        unexplained += says_so;
        continue;
      }
      ++r.outside_hard_trials;
      const std::string variable = truth.cause.name == "local_kink" ? "angle" : "time";
      hard_joint += std::any_of(causes.begin(), causes.end(), [&](const auto& c) {
        if (c.cause.joint != truth.cause.joint) return false;
        if (c.cause.name == "unexplained") return c.variable == variable;
        const auto& n = c.cause.name;
        return variable == "time" ? n == "slip" || n == "drift"
                                  : n == "encoder_gain" || n == "eccentricity";
      });
      hard_soft += says_so || std::any_of(causes.begin(), causes.end(),
                                          [](const auto& c) { return c.same.size() > 1; });
    }
  }
  r.null_false_alarm = share(null_alarms, r.null_trials);
  r.background_named = share(background_named, r.background_trials);
  r.single_in_class = share(in, r.single_trials);
  r.single_exact = share(exact, r.single_trials);
  r.single_wrong = share(wrong, r.single_trials);
  r.single_mean_class = classes > 0 ? class_size / static_cast<double>(classes) : 0.0;
  r.limit_wrong = share(limit_wrong, r.limit_trials);
  r.two_both = share(both, r.two_trials);
  r.two_spurious = share(spurious, r.two_trials);
  r.outside_unexplained = share(unexplained, r.outside_trials);
  r.outside_hard_joint = share(hard_joint, r.outside_hard_trials);
  r.outside_hard_class_or_unexplained = share(hard_soft, r.outside_hard_trials);
  r.sign = share(signs, parameters);
  r.error_median = quantile(errors, 0.5);
  r.error_p90 = quantile(errors, 0.9);
  r.coverage95 = share(covered, parameters);
  r.removable_excess_median = quantile(excess, 0.5);
  r.offset_improvement_median = quantile(improvement, 0.5);
  return r;
}

std::vector<TrialOutcome> run_diagnosis_trials(
    const TrialRobot& robot, int singles, std::uint64_t seed, int threads,
    const std::function<void(const TrialOutcome&, std::size_t, std::size_t)>& each) {
  struct Job {
    std::string setting;
    std::size_t number;
  };
  const std::pair<const char*, int> rows[] = {{"null", 200},  {"background", 60}, {"single", 300},
                                              {"limit", 100}, {"two", 150},       {"outside", 90},
                                              {"outside_hard", 84}};
  std::vector<Job> jobs;
  for (const auto& [setting, count] : rows) {
    const int scaled = std::max(1, static_cast<int>(std::lround(count * singles / 300.0)));
    for (int i = 0; i < scaled; ++i) jobs.push_back({setting, static_cast<std::size_t>(i)});
  }
  std::vector<TrialOutcome> outcomes(jobs.size());
  std::vector<char> done(jobs.size(), 0);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::condition_variable changed;
  std::exception_ptr failure;
  const auto work = [&] {
    for (std::size_t i; (i = next++) < jobs.size();) {
      try {
        auto outcome = run_trial(robot, jobs[i].setting, mix(seed, i), jobs[i].number);
        const std::lock_guard lock(mutex);
        outcomes[i] = std::move(outcome);
        done[i] = 1;
      } catch (...) {
        const std::lock_guard lock(mutex);
        failure = std::current_exception();
        next = jobs.size();
      }
      changed.notify_one();
    }
  };
  std::vector<std::thread> workers;
  for (int t = 0; t < std::max(1, threads); ++t) workers.emplace_back(work);
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return done[i] != 0 || failure; });
    if (failure) break;
    // Charts of a thousand trials are not kept.
    outcomes[i].report.samples.clear();
    lock.unlock();
    if (each) each(outcomes[i], i + 1, jobs.size());
  }
  for (auto& worker : workers) worker.join();
  if (failure) std::rethrow_exception(failure);
  return outcomes;
}

}  // namespace bodyschema
