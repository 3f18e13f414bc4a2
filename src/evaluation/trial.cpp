#include "bodyschema/evaluation/trial.hpp"

#include <mutex>

#include "bodyschema/evaluation/statistics.hpp"
#include "bodyschema/pipeline/hand_errors.hpp"
#include "bodyschema/pipeline/pipeline.hpp"

namespace bodyschema {
namespace {

/// @param estimator  whose last estimate this is
/// @param seen  what it was made of
FrameRecord record_of(const Estimate& estimate, Estimator& estimator, const Observation& seen,
                      const simulator::SimulatedFrame& frame) {
  FrameRecord record;
  record.state = estimate.state;
  record.offset_deg = estimate.offset_rad * (180.0 / kPi);
  record.covariance_deg2 = estimate.covariance_rad2 * (180.0 / kPi) * (180.0 / kPi);
  record.effects = estimate.effects;
  record.hand_sd_mm = 1e3 * estimate.hand_sd_m;
  for (const auto& truth : frame.truth) record.visible_share = std::max(record.visible_share, truth.visible_share);
  for (std::size_t c = 0; c < estimate.X_CP.size() && c < 2; ++c) {
    if (!frame.cameras[c]) continue;
    const Pose& truth = frame.truth[c].X_CP;
    const Eigen::Vector3d error_m = estimate.X_CP[c].translation() - truth.translation();
    record.position_mm[c] = 1e3 * error_m.norm();
    if (seen.cameras[c]) {
      record.position_sd[c] = distance_sd(error_m, estimator.hand_covariance_m2(estimator.exposure(c)));
    }
    record.rotation_deg[c] = degrees(rotation_distance(truth.linear(), estimate.X_CP[c].linear()));
    record.nominal_mm[c] = 1e3 * (estimate.X_CP_nominal[c].translation() - truth.translation()).norm();
  }
  return record;
}

}  // namespace

TrialRecord run_trial(const TrialSetting& setting, const std::vector<Contestant>& contestants, std::uint64_t seed,
                      const std::function<void(double)>& progress) {
  auto pipeline_of = [&] {
    // Trials run side by side, and their configurations are views of one document: reading notes which keys are known.
    static std::mutex reading;
    const std::lock_guard lock(reading);
    return Pipeline(setting.estimator);
  };
  Pipeline pipeline = pipeline_of();
  std::vector<Estimator> estimators;
  for (const auto& contestant : contestants) {
    EstimatorOptions options = contestant.options;
    options.filter.seed = seed * 1000003u + 17u;
    options.silhouette.threads = 1;
    auto beliefs = contestant.beliefs.value_or(pipeline.beliefs());
    if (contestant.offsets_only || options.mode == EstimatorMode::kPaper) {
      std::erase_if(beliefs.state, [](const Belief& b) { return b.effect != "joint_offset"; });
    }
    estimators.emplace_back(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), beliefs, options);
  }
  simulator::SimulationPlan plan = setting.plan;
  plan.seed = seed;
  simulator::Simulator simulator(pipeline.shared_robot(), pipeline.setup(), pipeline.rig(), setting.simulator, plan);
  TrialRecord trial;
  trial.seed = seed;
  trial.contestants.resize(contestants.size());
  trial.true_offset_deg = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(pipeline.setup().estimated_joints.size()));
  for (std::size_t k = 0; k < pipeline.setup().estimated_joints.size(); ++k) {
    const auto found = plan.offsets_deg.find(pipeline.setup().estimated_joints[k]);
    if (found != plan.offsets_deg.end()) {
      trial.true_offset_deg(static_cast<Eigen::Index>(k)) = found->second;
    }
  }

  std::vector<JointSample> history;
  Eigen::VectorXd last_q;
  int motion_frame = 0;
  int frames = 0;
  while (auto frame = simulator.next()) {
    if (progress) progress(static_cast<double>(frames++) / simulator.frame_count());
    history.insert(history.end(), frame->encoders.begin(), frame->encoders.end());
    if (history.size() > 400) history.erase(history.begin(), history.end() - 200);
    Observation observation = simulator::to_observation(*frame, history);
    observation.encoders = frame->encoders;
    // Masks that are looked for near an estimate take one of their own, the same for all contestants.
    bool ready = true;
    if (pipeline.masks_need_estimates()) {
      pipeline.process(observation);
    } else {
      ready = pipeline.segment(observation);
    }
    if (frame->phase != simulator::Phase::kMotion || !ready) continue;
    if (setting.on_masks) setting.on_masks(observation);
    if (observation.cameras[0]) last_q = observation.cameras[0]->joints.q;
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      Observation one_eye;
      if (contestants[i].mono) {
        one_eye = observation;
        one_eye.cameras[1].reset();
      }
      const Observation& seen = contestants[i].mono ? one_eye : observation;
      const Estimate estimate = estimators[i].step(seen);
      trial.contestants[i].frames.push_back(record_of(estimate, estimators[i], seen, *frame));
      trial.contestants[i].weakest = estimate.weakest;
      if (setting.on_frame) setting.on_frame(estimators[i], seen, trial, motion_frame);
    }
    ++motion_frame;
  }
  if (setting.on_end && last_q.size() > 0) {
    for (std::size_t i = 0; i < contestants.size(); ++i) {
      setting.on_end(estimators[i], pipeline.robot(), last_q, trial, i);
    }
  }
  return trial;
}

}  // namespace bodyschema
