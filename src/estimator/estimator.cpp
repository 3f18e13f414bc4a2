#include "bodyschema/estimator/estimator.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <optional>

#include "bodyschema/estimator/body_pose_model.hpp"
#include "bodyschema/estimator/offset_fusion.hpp"
#include "bodyschema/estimator/stalled_encoders.hpp"
#include "bodyschema/filter/hammoude.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "eye_order.hpp"
#include "hypothesis_scorer.hpp"
#include "offset_memory.hpp"
#include "outline_fitter.hpp"

namespace bodyschema {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_ms(Clock::time_point since) {
  return std::chrono::duration<double, std::milli>(Clock::now() - since).count();
}

SilhouetteModel make_silhouette_model(const RobotModel& robot, const RobotSetup& setup) {
  SilhouetteModel model;
  model.culling = setup.culling;
  for (const auto& part : robot.meshes()) model.parts.push_back(part.mesh);
  return model;
}

Eigen::VectorXd prior_sds(const std::vector<Parameter>& parameters) {
  Eigen::VectorXd sd(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    sd(static_cast<Eigen::Index>(k)) = parameters[k].prior_sd;
  }
  return sd;
}

/// Encoder errors of one frame: those of the arm's joints.
Eigen::VectorXd encoder_sds(const std::vector<Parameter>& parameters, std::size_t arm_joints, double sd_rad) {
  Eigen::VectorXd sd = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  sd.head(static_cast<Eigen::Index>(arm_joints)).setConstant(sd_rad);
  return sd;
}

/// Both eyes, each with what the other one saw of the robot.
Observation with_eyes_exchanged(Observation observation) {
  CameraObservation &one = *observation.cameras[0], &other = *observation.cameras[1];
  std::swap(one.mask, other.mask);
  std::swap(one.valid, other.valid);
  std::swap(one.coverage, other.coverage);
  return observation;
}

}  // namespace

const char* to_string(EstimatorState state) {
  switch (state) {
    case EstimatorState::kLearningBackground: return "learning_background";
    case EstimatorState::kHandNotInView: return "hand_not_in_view";
    case EstimatorState::kConverging: return "converging";
    case EstimatorState::kConverged: return "converged";
    case EstimatorState::kDiverged: return "diverged";
  }
  return "unknown";
}

struct Estimator::Impl {
  Impl(std::shared_ptr<const RobotModel> robot_model, const RobotSetup& robot_setup, const StereoRig& stereo_rig,
       const EstimatorOptions& estimator_options)
      : options(estimator_options), setup(robot_setup), rig(stereo_rig), own_correction(rig.cameras.size()),
        parameters(estimated_parameters(robot_model, setup, rig, options)),
        silhouettes(make_silhouette_model(*robot_model, setup)), intrinsics(rig.intrinsics()),
        body(robot_model, setup, rig, parameters), alignment(body, silhouettes, intrinsics, options.contour),
        scorer(body, silhouettes, intrinsics, options.silhouette, options.filter.particles),
        filter(static_cast<Eigen::Index>(setup.estimated_joints.size()), options.filter),
        first_look(prior_sds(parameters),
                   encoder_sds(parameters, setup.estimated_joints.size(), options.encoder_sd_rad)),
        memory(first_look, options.memory_frames, options.correlated_frames),
        fitter(alignment, scorer, first_look, static_cast<Eigen::Index>(setup.estimated_joints.size()), options) {
    for (const auto& name : setup.estimated_joints) joint_index.push_back(robot_model->joint_index(name));
    joints = static_cast<Eigen::Index>(setup.estimated_joints.size());
    state = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
    reading.resize(joints);
    first_guesses = filter.states();
    stalled = StalledEncoders(joints);
    cloud_covariance = filter.covariance();
    frame_state = memory.fusion().frame_state();
    distance.resize(static_cast<Eigen::Index>(options.filter.particles));
    weights.resize(static_cast<Eigen::Index>(options.filter.particles));
  }

  // --- one step -------------------------------------------------------------------------------

  Estimate step(const Observation& observation) {
    const auto start = Clock::now();
    times = {};
    Estimate estimate;
    estimate.utime = observation.utime;
    estimate.joint_names = setup.estimated_joints;

    const bool in_view = scorer.observe(observation, options.min_mask_px);
    explained = false;
    cameras_swapped = false;
    best_likelihood = effective_size = contour_rms_px = 0.0;
    if (!in_view) {
      frame_state =
          particles_only() ? OffsetFusion::FrameState{state, cloud_covariance} : memory.fusion().frame_state();
      if (memory.empty()) frame_state.x = state;
      current = EstimatorState::kHandNotInView;
      contradicted = false;
    } else {
      const bool swapped = starts_swapped(observation);
      if (!swapped) score_particles();
      if (swapped) {
        begin_again();
        learn_nothing();
      } else if (options.mode == EstimatorMode::kPaper) {
        weights = distance.unaryExpr(&hammoude_likelihood);
        particle_step();
      } else {
        weights = (-(distance.array() - distance.minCoeff()) / options.temperature).exp();
        if (options.refine_outline) {
          best_step(observation);
        } else {
          particle_step();
        }
      }
    }
    report(observation, estimate);
    times.scoring_ms = scorer.take_scoring_ms();
    estimate.times = times;
    estimate.times.total_ms = elapsed_ms(start);
    return estimate;
  }

  void score_particles() {
    const auto start = Clock::now();
    Eigen::VectorXd x = state;
    for (std::size_t i = 0; i < options.filter.particles; ++i) {
      x.head(joints) = filter.states().col(static_cast<Eigen::Index>(i));
      scorer.place(x, i);
    }
    times.kinematics_ms += elapsed_ms(start);
    distance = scorer.score(options.filter.particles);
  }

  /// The estimate is one of the particles, as in the paper.
  [[nodiscard]] bool particles_only() const { return options.mode == EstimatorMode::kPaper || !options.refine_outline; }

  void particle_step() {
    const auto start = Clock::now();
    if (weights.maxCoeff() <= 0.0) weights.setConstant(1.0);
    filter.update(weights);
    state.head(joints) = filter.estimate();
    best_likelihood = hammoude_likelihood(distance(filter.estimate_index()));
    effective_size = filter.effective_sample_size();
    cloud_covariance = filter.covariance();
    frame_state = {state, cloud_covariance};
    filter.resample_and_spread();
    // Says that the spread is at its smallest, no more: the published filter knows no better of itself.
    current = EstimatorState::kConverging;
    if (filter.spread_rad() <= options.filter.spread_min_rad) current = EstimatorState::kConverged;
    times.filter_ms += elapsed_ms(start);
  }

  Eigen::VectorXd likelihood(const Observation& observation, const Eigen::MatrixXd& offsets) {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(offsets.cols());
    if (!scorer.observe(observation, options.min_mask_px)) return result;
    const auto batch = static_cast<Eigen::Index>(options.filter.particles);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(state.size());
    for (Eigen::Index begin = 0; begin < offsets.cols(); begin += batch) {
      const Eigen::Index n = std::min(batch, offsets.cols() - begin);
      for (Eigen::Index i = 0; i < n; ++i) {
        x.head(joints) = offsets.col(begin + i);
        scorer.place(x, static_cast<std::size_t>(i));
      }
      result.segment(begin, n) = scorer.score(static_cast<std::size_t>(n)).head(n).unaryExpr(&hammoude_likelihood);
    }
    return result;
  }

  // --- mode best: pictures of the wrong eye ---------------------------------------------------

  /// With a memory: whether it explains the pictures once they are exchanged, and only then.
  bool turned_swapped(const Observation& observation) {
    if (!scorer.can_be_exchanged()) return false;
    const Eigen::VectorXd known = memory.fusion().mean();
    const Observation exchanged = with_eyes_exchanged(observation);
    scorer.observe(exchanged, options.min_mask_px);
    const double other_distance = scorer.distance(known);
    scorer.observe(observation, options.min_mask_px);
    return other_distance < 2.0 * options.lock_distance &&
           EyeOrder::clearly_exchanged(scorer.distance(known), other_distance);
  }

  /// Without one: by how near the arm can be brought to them from the guesses that the search began with, which
  /// no wrong minimum has led astray.
  bool starts_swapped(const Observation& observation) {
    if (particles_only() || eye_order.settled() || !scorer.can_be_exchanged()) return false;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(state.size());
    const auto n = static_cast<std::size_t>(first_guesses.cols());
    for (std::size_t i = 0; i < n; ++i) {
      x.head(joints) = first_guesses.col(static_cast<Eigen::Index>(i));
      scorer.place(x, i);
    }
    const Eigen::VectorXd distances = scorer.score(n);
    const Observation exchanged = with_eyes_exchanged(observation);
    scorer.observe(exchanged, options.min_mask_px);
    const Eigen::VectorXd other_distances = scorer.score(n);

    double as_they_are = distances.minCoeff(), other_distance = other_distances.minCoeff();
    const bool worth_searches = EyeOrder::worth_searches(as_they_are, other_distance);
    if (worth_searches) other_distance = nearest_distance(exchanged, other_distances);
    scorer.observe(observation, options.min_mask_px);
    if (worth_searches) as_they_are = nearest_distance(observation, distances);
    return eye_order.exchanged(as_they_are, other_distance);
  }

  /// Of the arm that is found from the first guesses, with these distances, in a frame that the scorer has.
  double nearest_distance(const Observation& observation, const Eigen::VectorXd& distances) {
    constexpr std::size_t kStarts = 12;  // from three, one arm in 300 that began far off was not found
    return search(observation, first_guesses, distances, Eigen::VectorXd::Zero(state.size()), kStarts).distance;
  }

  /// From pictures that seem to be exchanged.
  void learn_nothing() {
    cameras_swapped = true;
    contradicted = !memory.empty();
    fall_back_on(memory.empty() ? state : memory.fusion().mean(), EstimatorState::kDiverged);
  }

  /// A frame that said nothing of the offsets: reports `x` in doubt.
  void fall_back_on(const Eigen::VectorXd& x, EstimatorState doubt) {
    current = doubt;
    state = x;
    frame_state = first_look.frame_state();
    frame_state.x = state;
    best_likelihood = hammoude_likelihood(scorer.distance(state));
  }

  /// Whether a search has run off from masks that are not the arm's: further than any arm whose joints are all
  /// within three standard deviations.
  [[nodiscard]] bool strayed(const Eigen::VectorXd& offsets) const {
    return offsets.norm() > 3.0 * std::sqrt(static_cast<double>(joints)) * options.filter.initial_sd_rad;
  }

  // --- mode best: memory and search -----------------------------------------------------------

  using Verdict = OffsetMemory::Verdict;

  /// Takes a memory back from the shelf once a frame agrees with it.
  void reconsider(const Observation& observation) {
    if (stalled.suspected()) memory.clear_shelf();  // what was learned then may be wrong itself
    if (memory.shelved() == nullptr) return;
    const OutlineFit fit = fitter.follow(observation, *memory.shelved());
    memory.reconsider(fitter.pull_of(fit), fitter.fits(fit.evidence));
  }

  void best_step(const Observation& observation) {
    auto start = Clock::now();
    filter.update(weights);
    effective_size = filter.effective_sample_size();
    times.filter_ms += elapsed_ms(start);

    start = Clock::now();
    const double variance = fitter.variance_px2();
    forget_a_stall(observation);
    reconsider(observation);
    OutlineFit best;
    std::optional<OutlineFit> found;
    double pull = 0.0;
    Verdict verdict = Verdict::kNothingKnown;
    if (!memory.empty()) {
      best = fitter.follow(observation, memory.fusion());
      pull = fitter.pull_of(best);
      verdict = memory.judge(pull, fitter.fits(best.evidence));
      if (verdict != Verdict::kContradicts && memory.young()) {
        // So few frames must not fit worse than what a new search finds.
        found = search(observation);
        const bool holds = found->distance > kClearlyBetter * scorer.distance(best.x) || !fitter.fits(found->evidence);
        if (!holds) verdict = Verdict::kContradicts;
      }
    }
    if (verdict == Verdict::kContradicts && turned_swapped(observation)) {
      times.refinement_ms += elapsed_ms(start);
      learn_nothing();
      return;
    }
    switch (verdict) {
      case Verdict::kAgrees: memory.learn(best.evidence, best.x, variance, pull); break;
      case Verdict::kDoubtful: break;
      case Verdict::kContradicts:
        if (!found) suspect_slips();
        [[fallthrough]];
      case Verdict::kNothingKnown:
        if (!found) found = search(observation);
        if (!begin_with(*found)) {
          times.refinement_ms += elapsed_ms(start);
          return;
        }
        best = std::move(*found);
    }
    state = memory.empty() ? best.x : memory.fusion().mean();
    // A frame that the memory contradicts speaks for itself alone, with the uncertainty that has.
    contradicted = memory.doubted();
    frame_state = (contradicted ? first_look : memory.fusion()).frame_state(best.evidence, best.x, variance);
    contour_rms_px = best.evidence.rms_px();
    best_likelihood = hammoude_likelihood(scorer.distance(frame_state.x));
    explained = fitter.fits(best.evidence) && 1.0 - best_likelihood < options.lock_distance;
    times.refinement_ms += elapsed_ms(start);

    start = Clock::now();
    const bool lost = memory.empty() && memory.surprised();
    current = lost ? EstimatorState::kDiverged : EstimatorState::kConverging;
    spread(!memory.empty());
    times.filter_ms += elapsed_ms(start);
  }

  /// What a search found where nothing is known, or where the frame contradicts what is: becomes the memory if it
  /// fits. False when the search has run off; then everything begins again.
  bool begin_with(const OutlineFit& found) {
    const bool good = fitter.fits(found.evidence) && found.distance < options.lock_distance;
    const bool given_up = memory.contradict(good, !stalled.suspected());
    if (good) {
      memory.begin(found.evidence, found.x, fitter.variance_px2());
      return true;
    }
    if (given_up) filter.reset(state.head(joints));
    if (!memory.empty() || !strayed(found.x.head(joints))) return true;
    const bool lost = memory.surprised();
    begin_again();
    contradicted = false;
    fall_back_on(state, lost ? EstimatorState::kDiverged : EstimatorState::kConverging);
    return false;
  }

  /// What was known until now no longer fits: most likely one joint slipped. The worse half of the
  /// particles makes way for slips of each joint, both ways and of all sizes up to the largest.
  void suspect_slips() {
    const std::vector<Eigen::Index> order = in_order(distance);
    const Eigen::Index slips = filter.states().cols() / 2;
    const Eigen::Index sizes = std::max<Eigen::Index>(1, slips / (2 * joints));  // each way
    Eigen::VectorXd x(joints);
    for (Eigen::Index i = 0; i < std::min(slips, 2 * sizes * joints); ++i) {
      const Eigen::Index step = i / joints;
      const double size = kLargestSlip_rad * static_cast<double>(step / 2 + 1) / static_cast<double>(sizes);
      x = state.head(joints);
      x(i % joints) += step % 2 == 0 ? size : -size;
      filter.set_state(order[order.size() - 1 - static_cast<std::size_t>(i)], x);
    }
    score_particles();
  }

  /// Smallest distance first.
  [[nodiscard]] static std::vector<Eigen::Index> in_order(const Eigen::VectorXd& distances) {
    std::vector<Eigen::Index> order(static_cast<std::size_t>(distances.size()));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](Eigen::Index a, Eigen::Index b) { return distances(a) < distances(b); });
    return order;
  }

  /// The best of the three most likely particles once they are moved onto the outline.
  OutlineFit search(const Observation& observation) { return search(observation, filter.states(), distance, state, 3); }
  /// The same of the first `count` of any offsets.
  /// @param rest  its nuisances go with them
  OutlineFit search(const Observation& observation, const Eigen::MatrixXd& offsets, const Eigen::VectorXd& distances,
                    const Eigen::VectorXd& rest, std::size_t count) {
    const std::vector<Eigen::Index> order = in_order(distances);
    std::vector<Eigen::VectorXd> starts(std::min(count, order.size()), rest);
    for (std::size_t i = 0; i < starts.size(); ++i) starts[i].head(joints) = offsets.col(order[i]);
    return fitter.search(observation, starts);
  }

  /// Next frame's particles: resampled survivors, and half of them around the estimate.
  void spread(bool locked) {
    filter.resample_and_spread();
    if (!locked && filter.spread_rad() < kSearchSpread_rad) filter.set_spread(kSearchSpread_rad);
    const Eigen::Index n = filter.states().cols();
    Eigen::VectorXd sd(joints);
    if (locked) {
      sd = memory.fusion().covariance().diagonal().head(joints).cwiseSqrt();
      sd = sd.cwiseMax(options.filter.spread_min_rad);
    } else {
      sd.setConstant(filter.spread_rad());
    }
    std::normal_distribution<double> normal(0.0, 1.0);
    Eigen::VectorXd x(joints);
    for (Eigen::Index i = 0; i < n / 2; ++i) {
      for (Eigen::Index k = 0; k < joints; ++k) {
        x(k) = state(k) + sd(k) * normal(filter.random());
      }
      filter.set_state(i, x);
    }
  }

  // --- results --------------------------------------------------------------------------------

  void report(const Observation& observation, Estimate& estimate) {
    estimate.offset_rad = state.head(joints);
    estimate.effective_sample_size = effective_size;
    estimate.best_likelihood = best_likelihood;
    estimate.contour_rms_px = contour_rms_px;
    if (particles_only()) {
      estimate.covariance_rad2 = cloud_covariance;
    } else {
      const Eigen::MatrixXd covariance = contradicted ? frame_state.covariance : memory.fusion().covariance();
      estimate.covariance_rad2 = covariance.topLeftCorner(joints, joints);
      for (std::size_t k = static_cast<std::size_t>(joints); k < parameters.size(); ++k) {
        estimate.nuisance_names.push_back(parameters[k].name);
        estimate.head_joints += parameters[k].kind == ParameterKind::kJointOffset ? 1 : 0;
        estimate.nuisance_units.push_back(unit_of(parameters[k].kind));
      }
      estimate.nuisance = state.tail(state.size() - joints);
      estimate.nuisance_sd = covariance.diagonal().tail(state.size() - joints).cwiseMax(0.0).cwiseSqrt();
    }
    estimate.cameras_swapped = cameras_swapped;
    look_for_stalls(observation, estimate);
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      const std::optional<Exposure> at = exposure(observation, c);
      if (!at) continue;
      estimate.X_CP.push_back(body.hand_pose(*at, frame_state.x, c));
      estimate.X_CP_nominal.push_back(body.hand_pose(at->q, uncorrected(), c));
      if (c == 0 || estimate.hand_sd_m == 0.0) {
        estimate.hand_sd_m = std::sqrt(std::max(0.0, hand_covariance_m2(*at, c).trace()));
      }
    }
    estimate.weakest = weakest_direction(estimate.covariance_rad2, setup.estimated_joints);
    if (!particles_only() && !contradicted && current == EstimatorState::kConverging && memory.settled() &&
        !stalled.suspected() && !stalled.dropped_while_standing() && estimate.hand_sd_m < options.converged_hand_sd_m) {
      current = EstimatorState::kConverged;
    }
    estimate.state = current;
  }

  /// The first camera that saw something; null: none did.
  static const CameraObservation* first_seen(const Observation& observation) {
    const auto seen = std::find_if(observation.cameras.begin(), observation.cameras.end(),
                                   [](const auto& camera) { return camera.has_value(); });
    return seen == observation.cameras.end() ? nullptr : &**seen;
  }

  /// What the hand's pose in a camera is predicted from; none where no camera saw anything. A camera that is absent
  /// borrows the arm of one that is not, but where it sits itself only its own pictures have told.
  std::optional<Exposure> exposure(const Observation& observation, std::size_t camera) {
    const bool present = camera < observation.cameras.size() && observation.cameras[camera];
    const CameraObservation* seen = present ? &*observation.cameras[camera] : first_seen(observation);
    if (seen == nullptr) return std::nullopt;
    if (present) own_correction[camera] = seen->corrections ? seen->corrections->camera : CameraCorrection{};
    if (present || !seen->corrections) return Exposure(*seen);
    borrowed = *seen->corrections;
    borrowed.camera = own_correction[camera];
    return Exposure(seen->joints.q, &borrowed);
  }

  /// Encoders of the estimated joints at the exposure of the first camera that saw something.
  bool read_encoders(const Observation& observation) {
    const CameraObservation* seen = first_seen(observation);
    if (seen == nullptr) return false;
    for (Eigen::Index k = 0; k < joints; ++k) reading(k) = seen->joints.q(joint_index[static_cast<std::size_t>(k)]);
    return true;
  }

  /// An encoder that stalled reads on: nothing that its dead reading taught may outlive it.
  void forget_a_stall(const Observation& observation) {
    if (!read_encoders(observation) || !stalled.ends(reading)) return;
    memory.forget_all();
  }

  /// An encoder that stands while its joint moves: what the estimate lags behind is added to its
  /// uncertainty, and once it is certain, nothing is called converged.
  void look_for_stalls(const Observation& observation, Estimate& estimate) {
    if (particles_only() || !read_encoders(observation)) return;
    const bool remembers = memory.settled();
    const bool settled = remembers && !contradicted;
    stalled.look(1e-6 * static_cast<double>(observation.utime), reading, estimate.offset_rad,
                 estimate.covariance_rad2.diagonal().cwiseMax(0.0).cwiseSqrt(), explained, settled, remembers);
    const auto drift = stalled.drift_rad().array().square();
    estimate.covariance_rad2.diagonal().array() += drift;
    frame_state.covariance.diagonal().head(joints).array() += drift;
    if (stalled.joint() < 0) return;
    estimate.stalled_joint = setup.estimated_joints[static_cast<std::size_t>(stalled.joint())];
    estimate.stalled_motion_rad = stalled.moved_rad();
  }

  /// The state of a robot that is as its encoders and model say.
  [[nodiscard]] Eigen::VectorXd uncorrected() const { return Eigen::VectorXd::Zero(state.size()); }

  /// The state that an estimate reports.
  [[nodiscard]] Eigen::VectorXd state_of(const Estimate& estimate) const {
    Eigen::VectorXd x = uncorrected();
    x.head(joints) = estimate.offset_rad;
    x.segment(joints, estimate.nuisance.size()) = estimate.nuisance;
    return x;
  }

  /// How well the hand is known in a camera, by this frame's covariance.
  Eigen::Matrix3d hand_covariance_m2(const Exposure& at, std::size_t camera) {
    constexpr double kStep = 1e-4;
    const Eigen::Index n = std::min<Eigen::Index>(state.size(), frame_state.covariance.rows());
    Eigen::Matrix<double, 3, Eigen::Dynamic> J(3, n);
    Eigen::VectorXd x = frame_state.x;
    for (Eigen::Index k = 0; k < n; ++k) {
      const double value = x(k);
      x(k) = value + kStep;
      const Eigen::Vector3d plus = body.hand_pose(at, x, camera).translation();
      x(k) = value - kStep;
      J.col(k) = (plus - body.hand_pose(at, x, camera).translation()) / (2.0 * kStep);
      x(k) = value;
    }
    return J * frame_state.covariance * J.transpose();
  }

  void reset() {
    begin_again();
    filter = ParticleFilter(joints, options.filter);
    frame_state = memory.fusion().frame_state();
    current = EstimatorState::kHandNotInView;
    cloud_covariance = filter.covariance();
    contradicted = false;
    eye_order = {};
    own_correction.assign(rig.cameras.size(), {});
  }

  /// Nothing that was learned holds.
  void begin_again() {
    filter.reset(Eigen::VectorXd::Zero(joints));
    memory.forget_all();
    state.setZero();
    stalled = StalledEncoders(joints);
  }

  static constexpr double kSearchSpread_rad = 0.0349066;  ///< 2 deg
  static constexpr double kLargestSlip_rad = 0.2094395;   ///< 12 deg; larger ones take more frames
  static constexpr double kClearlyBetter = 0.8;           ///< Hammoude distance against that of the memory

  EstimatorOptions options;
  RobotSetup setup;
  StereoRig rig;
  std::vector<CameraCorrection> own_correction;  ///< of each camera, when it was last seen
  Corrections borrowed;                          ///< what `exposure` last made for a camera that is absent
  std::vector<Parameter> parameters;
  SilhouetteModel silhouettes;
  std::vector<PinholeIntrinsics> intrinsics;
  BodyPoseModel body;
  ContourAlignment alignment;
  HypothesisScorer scorer;
  ParticleFilter filter;
  const OffsetFusion first_look;  ///< the prior alone
  OffsetMemory memory;
  OutlineFitter fitter;

  Eigen::Index joints = 0;
  std::vector<Eigen::Index> joint_index;  ///< of the estimated joints in the RobotModel
  Eigen::VectorXd reading;                ///< their encoders
  Eigen::VectorXd state;                  ///< one value per parameter, fused over frames
  OffsetFusion::FrameState frame_state;   ///< the same with the last frame's own encoder error
  EstimatorState current = EstimatorState::kHandNotInView;
  double best_likelihood = 0.0;
  double effective_size = 0.0;
  double contour_rms_px = 0.0;
  bool contradicted = false;
  bool cameras_swapped = false;   ///< the last frame's pictures
  Eigen::MatrixXd first_guesses;  ///< of the joint offsets: the first particles
  EyeOrder eye_order;
  StalledEncoders stalled{0};
  bool explained = false;            ///< the last frame's pictures, by its estimate
  Eigen::MatrixXd cloud_covariance;  ///< of the particles as they were last weighed
  StageTimes times;

  Eigen::VectorXd distance;  ///< Hammoude, of the particles
  Eigen::VectorXd weights;
};

Estimator::Estimator(std::shared_ptr<const RobotModel> robot, const RobotSetup& setup, const StereoRig& rig,
                     const EstimatorOptions& options)
    : impl_(std::make_unique<Impl>(std::move(robot), setup, rig, options)) {}
Estimator::~Estimator() = default;
Estimator::Estimator(Estimator&&) noexcept = default;

Eigen::VectorXd Estimator::likelihood(const Observation& observation, const Eigen::MatrixXd& offsets_rad) {
  return impl_->likelihood(observation, offsets_rad);
}

Estimate Estimator::step(const Observation& observation) {
  return impl_->step(observation);
}
void Estimator::reset() {
  impl_->reset();
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera, bool corrected) {
  std::vector<Eigen::Isometry3f> X_CB(impl_->body.part_count());
  const CameraObservation& seen = *observation.cameras[camera];
  if (corrected) {
    impl_->body.compute(seen, impl_->state, camera, X_CB);
  } else {
    impl_->body.compute(seen.joints.q, impl_->uncorrected(), camera, X_CB);
  }
  return impl_->scorer.render(X_CB, camera);
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera,
                                           const Estimate& estimate) {
  std::vector<Eigen::Isometry3f> X_CB(impl_->body.part_count());
  impl_->body.compute(*observation.cameras[camera], impl_->state_of(estimate), camera, X_CB);
  return impl_->scorer.render(X_CB, camera);
}

Pose Estimator::hand_pose(const Exposure& at, std::size_t camera, bool corrected) {
  return corrected ? impl_->body.hand_pose(at, impl_->state, camera)
                   : impl_->body.hand_pose(at.q, impl_->uncorrected(), camera);
}

Pose Estimator::hand_pose(const Exposure& at, std::size_t camera, const Estimate& estimate) {
  return impl_->body.hand_pose(at, impl_->state_of(estimate), camera);
}

Eigen::Matrix3d Estimator::hand_covariance_m2(const Exposure& at, std::size_t camera) {
  return impl_->hand_covariance_m2(at, camera);
}

std::vector<Eigen::Vector3d> Estimator::fingertips(const Exposure& at, std::size_t camera, bool corrected) {
  std::vector<Eigen::Vector3d> tips;
  if (corrected) {
    impl_->body.fingertips(at, impl_->state, camera, tips);
  } else {
    impl_->body.fingertips(at.q, impl_->uncorrected(), camera, tips);
  }
  return tips;
}

std::string Estimator::engine_description() const {
  return impl_->scorer.description();
}

}  // namespace bodyschema
