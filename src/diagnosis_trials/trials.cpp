#include "bodyschema/diagnosis_trials/trials.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/seeded_random.hpp"

namespace bodyschema {
namespace {

/// A seed of its own for every trial and purpose.
std::uint64_t mix(std::uint64_t seed, std::uint64_t n) {
  return mixed_bits(seed * 0x9E3779B97F4A7C15ull + n + 0x632BE59BD9B4E019ull);
}

class SilhouetteLog final : public TrialLog {
 public:
  explicit SilhouetteLog(std::unique_ptr<SyntheticMeasurement> log) : log_(std::move(log)) {}
  DiagnosisReport diagnose(const std::optional<std::vector<CauseName>>& fixed_causes) override {
    DiagnosisOptions options;
    options.nuisances = usual_nuisances(log_->roles());
    options.fixed_causes = fixed_causes;
    return bodyschema::diagnose(*log_, options);
  }
  const Eigen::MatrixXd* true_corrections() const override { return &log_->true_corrections(); }

 private:
  std::unique_ptr<SyntheticMeasurement> log_;
};

double rms(const Eigen::MatrixXd& m) {
  return std::sqrt(m.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, m.size())));
}

/// How much of what the true cause can explain the extension did explain, on held-out blocks.
std::optional<double> removed_share(const DiagnosisReport& report, const DiagnosisReport& ideal) {
  const double before = std::pow(ideal.before.rms_px, 2);
  const double removable = before - std::pow(ideal.after.rms_px, 2);
  if (removable <= 1e-4 * before) return std::nullopt;
  return (before - std::pow(report.after.rms_px, 2)) / removable;
}

TrialOutcome run_trial(const TrialRobot& robot, const TrialLogMaker& make_log, TrialRow row, std::uint64_t seed,
                       std::size_t number) {
  const auto start = std::chrono::steady_clock::now();
  const auto options = draw_trial(robot, row, seed, number);
  TrialOutcome outcome;
  outcome.row = row;
  outcome.seed = seed;
  outcome.truth = options.faults;
  const auto log = make_log(options, mix(seed, 1));
  auto& report = outcome.report;
  try {
    report = log->diagnose(std::nullopt);
  } catch (const DataError& error) {
    outcome.refused = true;
    report.verdict = "refused";
    report.sentence = error.what();
    return outcome;
  }
  if (const auto* truth = log->true_corrections()) {
    outcome.offset_error_before_deg = degrees(rms(report.joint_corrections_before - *truth));
    outcome.offset_error_after_deg = degrees(rms(report.joint_corrections_after - *truth));
  }
  // A slip's time is no parameter of a linear fit, so there is no ideal to compare it with.
  if (row == TrialRow::kSingle && options.faults[0].cause.name != "slip") {
    outcome.removed_share = removed_share(report, log->diagnose({{options.faults[0].cause}}));
  }
  outcome.report.samples = {};  // not kept for a thousand trials
  outcome.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

}  // namespace

TrialCounts trial_counts(int singles) {
  constexpr TrialCounts kOfTheTable = {200, 60, 300, 100, 150, 90, 84};
  TrialCounts counts{};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    counts[i] = std::max(1, static_cast<int>(std::lround(kOfTheTable[i] * singles / 300.0)));
  }
  return counts;
}

TrialLogMaker silhouette_logs(const TrialRobot& robot) {
  return [&robot](const TrialOptions& options, std::uint64_t seed) {
    return std::make_unique<SilhouetteLog>(make_synthetic_log(robot, options, seed));
  };
}

std::vector<TrialOutcome> run_diagnosis_trials(
    const TrialRobot& robot, const TrialCounts& counts, std::uint64_t seed, int threads, const TrialLogMaker& make_log,
    const std::function<void(const TrialOutcome&, std::size_t, std::size_t)>& each) {
  struct Job {
    TrialRow row;
    std::size_t number;
  };
  std::vector<Job> jobs;
  for (std::size_t s = 0; s < counts.size(); ++s) {
    for (int i = 0; i < counts[s]; ++i) {
      jobs.push_back({static_cast<TrialRow>(s), static_cast<std::size_t>(i)});
    }
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
        auto outcome = run_trial(robot, make_log, jobs[i].row, mix(seed, i), jobs[i].number);
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
    lock.unlock();
    if (each) each(outcomes[i], i + 1, jobs.size());
  }
  for (auto& worker : workers) worker.join();
  if (failure) std::rethrow_exception(failure);
  return outcomes;
}

}  // namespace bodyschema
