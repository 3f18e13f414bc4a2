#include "bodyschema/estimator/estimator.hpp"

#include <algorithm>
#include <cmath>

#include "arm_tracker.hpp"
#include "bodyschema/camera/bent_silhouette.hpp"
#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/search/search_level.hpp"
#include "convergence.hpp"
#include "hand_uncertainty.hpp"
#include "search_renders.hpp"
#include "reading_noise.hpp"
#include "stage_timer.hpp"

namespace bodyschema {
namespace {

/// What is known of the robot, joint offsets left out: these are found anew.
ErrorModel without_offsets(const ErrorModel& known) {
  ErrorModel model(known.roles());
  for (std::size_t e = 0; e < known.size(); ++e) {
    if (known[e].name() != "joint_offset") model.add(known[e].clone());
  }
  model.set_uncertainty(known.uncertainty());
  return model;
}

}  // namespace

struct Estimator::Impl {
  Impl(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup, const StereoRig& stereo_rig,
       const Beliefs& beliefs, const EstimatorOptions& estimator_options, const ErrorModel& known_before)
      : options(estimator_options), rig(stereo_rig), state_at_first(without_offsets(known_before), beliefs.state),
        considered(Considered::beside(state_at_first, beliefs.tolerances)),
        outlines(particles_only() ? silhouette_model(*robot, setup)
                                  : outline_level(silhouette_model(*robot, setup), rig.intrinsics())),
        model(robot, setup, rig, known_before.roles(), state_at_first, considered.effects, &outlines),
        scorer(model, silhouette_model(*robot, setup), particles_only() ? nullptr : &outlines, rig.intrinsics(),
               options.silhouette, options.filter.particles),
        particles(model, scorer, options),
        fitter(model, scorer, options, rig.cameras.size(), search_renders(options, rig.intrinsics())),
        occlusion(model, scorer, rig, setup.hand_link),
        known(model.state(), memory_layout(model.state(), considered), options.memory, options.least_postures),
        tracker(model, scorer, particles, fitter, occlusion, known, options), readings(options.memory.encoder_sd_rad),
        shape(Eigen::MatrixXd::Zero(model.state().size(), model.state().size())) {
    for (Eigen::Index k = 0; k < model.state().joints(); ++k) joint_names.push_back(parameter(k).name);
  }

  // --- one step -------------------------------------------------------------------------------

  Estimate step(const Observation& observation) {
    frame = model.take(observation, known.x);
    readings.read(observation.encoders, observation.encoders_begin_anew);
    outcome = {};
    if (!particles_only()) tracker.begin_frame(frame);
    const bool in_view = scorer.observe(frame, options.min_mask_share);
    if (particles_only()) {
      in_view ? estimate_by_particles() : settle_on_cloud();
    } else if (!in_view) {
      tracker.lose_sight();
    } else if (!tracker.shows_wrong_eyes(frame, outcome)) {
      search();
      estimate_by_outlines();
    }
    Estimate estimate = report();
    estimate.utime = observation.utime;
    return estimate;
  }

  void search() {
    particles.score(frame, known.x);
    const StageTimer timer(times.filter_ms);
    outcome.effective_size = particles.weigh();
  }

  void estimate_by_outlines() {
    {
      const StageTimer timer(times.refinement_ms);
      tracker.read_encoders(frame);
      if (known.memory.empty()) {
        tracker.find(frame, outcome);
      } else {
        const OutlineFit fit = tracker.measure(frame);
        tracker.gate(frame, fit, outcome);
        if (outcome.verdict == FrameVerdict::kAgrees && !known.unsure()) {
          tracker.remember(frame, fit, outcome);
        } else {
          tracker.explain(frame, fit, outcome);
        }
      }
    }
    const StageTimer timer(times.filter_ms);
    tracker.spread_particles(outcome);
  }

  /// The estimate is one of the particles, as in the paper.
  [[nodiscard]] bool particles_only() const { return options.mode == EstimatorMode::kPaper || !options.refine_outline; }

  void estimate_by_particles() {
    search();
    const StageTimer timer(times.filter_ms);
    const auto best = particles.take_best();
    known.x.head(best.offsets_rad.size()) = best.offsets_rad;
    outcome.best_likelihood = best.likelihood;
    settle_on_cloud();
    // Says that the spread is at its smallest, no more: the published filter knows no better of itself.
    outcome.state = best.narrowest ? EstimatorState::kConverged : EstimatorState::kConverging;
  }

  void settle_on_cloud() {
    const auto joints = model.state().joints();
    known.in_frame = known.memory.estimate();
    known.in_frame.x = known.x;
    known.in_frame.own.topLeftCorner(joints, joints) = particles.covariance();
    known.in_frame.covariance = known.in_frame.own;
  }

  // --- results --------------------------------------------------------------------------------

  Estimate report() {
    Estimate estimate;
    const auto joints = model.state().joints();
    if (!particles_only()) shape = shape_covariance(known.memory, fitter.shape_variance_share(known.memory.told()));
    estimate.joint_names = joint_names;
    estimate.offset_rad = known.x.head(joints);
    estimate.prior_sd_rad = model.state().prior_sd().head(joints);
    estimate.effective_sample_size = outcome.effective_size;
    estimate.best_likelihood = outcome.best_likelihood;
    estimate.contour_rms_px = outcome.rms_px;
    estimate.cameras_swapped = outcome.cameras_swapped;
    estimate.hidden = outcome.hidden;
    if (particles_only()) {
      estimate.covariance_rad2 = particles.covariance();
    } else {
      report_memory(estimate);
    }
    estimate.weakest = weakest_direction(estimate.covariance_rad2, joint_names);
    report_hand(estimate);
    estimate.state =
        particles_only() ? outcome.state : conclude(outcome, known, model.state(), fitter.knows_shape(), estimate);
    return estimate;
  }

  void report_memory(Estimate& estimate) {
    const auto joints = model.state().joints();
    const MemoryEstimate& now =
        outcome.contradicted || !known.memory.loose().empty() ? known.in_frame : known.memory.estimate();
    const Eigen::MatrixXd covariance = now.covariance + (known.disagreement() - 1.0) * now.own + shape;
    estimate.covariance_rad2 = covariance.topLeftCorner(joints, joints);
    for (Eigen::Index k = joints; k < known.x.size(); ++k) {
      const auto& p = parameter(k);
      const Effect& effect = model.state().model()[p.ref.effect];
      estimate.effects.push_back({effect.name(), effect.target().joint, effect.target().source,
                                  effect.parameters()[p.ref.parameter].name, p.name, p.unit, p.si_per_unit, known.x(k),
                                  std::sqrt(std::max(0.0, covariance(k, k))), p.prior_sd});
    }
    estimate.verdict = outcome.verdict;
    estimate.innovation = outcome.innovation.nis;
    estimate.innovation_dof = outcome.innovation.dof;
    estimate.innovation_usual = tracker.usual();
    estimate.postures = known.memory.postures();
    estimate.posture_sd_rad = known.memory.posture_sd_rad();
    estimate.head_posture_sd_rad = known.memory.head_posture_sd_rad();
    estimate.stamp_sd_s = fitter.stamp_sd_s();
    estimate.outline_sd_px = fitter.noise().front().sd_px();
    estimate.outline_alike = fitter.noise().front().correlated_points();
    estimate.changed = outcome.changed;
    if (const auto joint = known.stalled.joint(); joint >= 0) {
      estimate.stalled_joint = parameter(joint).name;
      estimate.stalled_motion_rad = known.stalled.moved_rad();
    }
  }

  void report_hand(Estimate& estimate) {
    for (std::size_t c = 0; c < rig.cameras.size() && frame.exposed(); ++c) {
      estimate.X_CP.push_back(model.hand_pose(frame.exposures[c], known.in_frame.x));
      estimate.X_CP_nominal.push_back(model.nominal_hand_pose(frame.exposures[c]));
    }
    if (!particles_only()) estimate.hand_sd_limit_m = options.converged_hand_sd_m;
    if (frame.exposed()) {
      const auto hand = hand_uncertainty(model, frame.exposures[0], known, shape_and_readings());
      estimate.hand_sd_m = hand.sd_m();
      if (!particles_only()) {
        const std::size_t camera = frame.exposures[0].at.camera;
        const double px = rig.cameras[camera].intrinsics.fx / model.picture_unit_px(camera);
        estimate.hand_sd_limit_m =
            hand_sd_limit_m(options, model.state(), hand, estimate.X_CP.front().translation().norm() / px);
      }
    }
    tracker.hand_known_to(estimate.hand_sd_m);
  }

  /// What moves the hand of one picture beside what is known of the state: covariance over it.
  [[nodiscard]] Eigen::MatrixXd shape_and_readings() const {
    Eigen::MatrixXd covariance = shape;
    for (Eigen::Index k = 0; k < covariance.rows() && !particles_only(); ++k) {
      const auto& effect = model.state().model()[parameter(k).ref.effect];
      if (effect.name() != "joint_offset" && effect.name() != "head_offset") continue;
      covariance(k, k) += readings.beyond_belief_rad2(model.roles().index(effect.target().joint));
    }
    return covariance;
  }

  [[nodiscard]] const StateParameter& parameter(Eigen::Index k) const {
    return model.state().parameters()[static_cast<std::size_t>(k)];
  }

  // --- what others ask ------------------------------------------------------------------------

  Eigen::VectorXd likelihood(const Observation& observation, const Eigen::MatrixXd& offsets_rad) {
    frame = model.take(observation, model.state().prior_mean());
    if (!scorer.observe(frame, options.min_mask_share, true)) return Eigen::VectorXd::Zero(offsets_rad.cols());
    return particles.likelihood(frame, offsets_rad);
  }

  /// The silhouette of the robot in a state, as the lens shows it; without a state that of the model as it is.
  [[nodiscard]] BinaryMask drawn(const Observation& observation, std::size_t camera, const Eigen::VectorXd* x) {
    std::vector<Eigen::Isometry3f> X_CB(model.part_count());
    const Exposure exposure = model.preview(observation.cameras[camera]->joints, camera);
    (x != nullptr ? model.project(exposure, *x) : model.project_nominal(exposure)).parts(X_CB);
    BinaryMask mask = scorer.render(X_CB, camera);
    if (x == nullptr) return mask;
    Corrections corrections = model.roles().no_corrections();
    model.corrections(exposure, *x, corrections);
    return bent_silhouette(mask, rig.cameras[camera].intrinsics, corrections.camera.k1);
  }

  /// The state that an estimate reports.
  [[nodiscard]] Eigen::VectorXd state_of(const Estimate& estimate) const {
    Eigen::VectorXd x = model.state().prior_mean();
    const auto joints = model.state().joints();
    x.head(joints) = estimate.offset_rad;
    for (std::size_t k = 0; k < estimate.effects.size(); ++k) {
      x(joints + static_cast<Eigen::Index>(k)) = estimate.effects[k].value;
    }
    return x;
  }

  EstimatorOptions options;
  StereoRig rig;
  State state_at_first;
  Considered considered;
  SilhouetteModel outlines;  ///< what outlines and pictures to look at are drawn from
  FrameModel model;
  HypothesisScorer scorer;
  ParticleSearch particles;
  OutlineFitter fitter;
  Occlusion occlusion;
  FusedState known;
  ArmTracker tracker;
  Frame frame;  ///< the last one; its observation is gone once `step` has returned
  FrameOutcome outcome;
  ReadingNoise readings;
  Eigen::MatrixXd shape;                 ///< covariance of the state by what outlines get wrong alike in all postures
  std::vector<std::string> joint_names;  ///< in the state's order: the configuration may list them in another
  StageTimes times;
};

Estimator::Estimator(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const Beliefs& beliefs, const EstimatorOptions& options)
    : Estimator(robot, setup, rig, beliefs, options, ErrorModel(JointRoles::of(robot, setup, rig))) {}
Estimator::Estimator(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const Beliefs& beliefs, const EstimatorOptions& options, const ErrorModel& known)
    : impl_(std::make_unique<Impl>(robot, setup, rig, beliefs, options, known)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;

Eigen::VectorXd Estimator::likelihood(const Observation& observation, const Eigen::MatrixXd& offsets_rad) {
  return impl_->likelihood(observation, offsets_rad);
}

Estimate Estimator::step(const Observation& observation) {
  StageTimes& times = impl_->times = {};
  Estimate estimate;
  {
    const StageTimer timer(times.total_ms);
    estimate = impl_->step(observation);
  }
  times.kinematics_ms = impl_->particles.take_placing_ms();
  times.scoring_ms = impl_->scorer.take_scoring_ms();
  estimate.times = times;
  return estimate;
}

const Exposure& Estimator::exposure(std::size_t camera) const {
  return impl_->frame.exposures.at(camera);
}

Exposure Estimator::at_rest(const Eigen::VectorXd& q, std::size_t camera) const {
  return impl_->model.at_rest(q, camera);
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera, bool corrected) {
  return impl_->drawn(observation, camera, corrected ? &impl_->known.x : nullptr);
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera,
                                           const Estimate& estimate) {
  const Eigen::VectorXd x = impl_->state_of(estimate);
  return impl_->drawn(observation, camera, &x);
}

Pose Estimator::hand_pose(const Exposure& exposure, bool corrected) {
  return corrected ? impl_->model.hand_pose(exposure, impl_->known.x) : impl_->model.nominal_hand_pose(exposure);
}

Pose Estimator::hand_pose(const Exposure& exposure, const Estimate& estimate) {
  return impl_->model.hand_pose(exposure, impl_->state_of(estimate));
}

Eigen::Matrix3d Estimator::hand_covariance_m2(const Exposure& exposure) {
  return hand_uncertainty(impl_->model, exposure, impl_->known, impl_->shape_and_readings()).covariance_m2;
}

std::string Estimator::engine_description() const {
  return impl_->scorer.description();
}

}  // namespace bodyschema
