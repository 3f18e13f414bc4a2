#include "bodyschema/estimator/estimator.hpp"

#include <spdlog/fmt/fmt.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "bodyschema/camera/bent_silhouette.hpp"
#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/evidence/distributions.hpp"
#include "bodyschema/filter/hammoude.hpp"
#include "bodyschema/filter/particle_filter.hpp"
#include "bodyschema/search/search_level.hpp"
#include "explanations.hpp"
#include "eye_order.hpp"
#include "frame_model.hpp"
#include "hypothesis_scorer.hpp"
#include "limits.hpp"
#include "occlusion.hpp"
#include "outline_fitter.hpp"
#include "search_renders.hpp"
#include "stalled_encoders.hpp"

namespace bodyschema {
namespace {

using Clock = std::chrono::steady_clock;

double elapsed_ms(Clock::time_point since) {
  return std::chrono::duration<double, std::milli>(Clock::now() - since).count();
}

/// What is known of the robot, joint offsets left out: these are found anew.
ErrorModel without_offsets(const ErrorModel& known) {
  ErrorModel model(known.roles());
  for (std::size_t e = 0; e < known.size(); ++e) {
    if (known[e].name() != "joint_offset") model.add(known[e].clone());
  }
  model.set_uncertainty(known.uncertainty());
  return model;
}

/// Both eyes, each with what the other one saw of the robot; without the pictures.
Observation with_eyes_exchanged(const Observation& observation) {
  Observation result;
  result.utime = observation.utime;
  result.cameras.resize(2);
  for (std::size_t c = 0; c < 2; ++c) {
    const CameraObservation &own = *observation.cameras[c], &other = *observation.cameras[1 - c];
    auto& seen = result.cameras[c].emplace();
    seen.utime = own.utime;
    seen.joints = own.joints;
    seen.mask = other.mask;
    seen.valid = other.valid;
    seen.coverage = other.coverage;
  }
  return result;
}

/// Smallest first.
std::vector<Eigen::Index> in_order(const Eigen::VectorXd& values) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(values.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(), [&](Eigen::Index a, Eigen::Index b) { return values(a) < values(b); });
  return order;
}

}  // namespace

const char* to_string(EstimatorState state) {
  switch (state) {
    case EstimatorState::kLearningBackground: return "learning_background";
    case EstimatorState::kHandNotInView: return "hand_not_in_view";
    case EstimatorState::kConverging: return "converging";
    case EstimatorState::kConverged: return "converged";
    case EstimatorState::kDiverged: return "diverged";
    case EstimatorState::kModelMisfit: return "model_misfit";
    case EstimatorState::kOccluded: return "occluded";
  }
  return "unknown";
}

const char* to_string(FrameVerdict verdict) {
  switch (verdict) {
    case FrameVerdict::kNothingKnown: return "nothing_known";
    case FrameVerdict::kAgrees: return "agrees";
    case FrameVerdict::kDoubtful: return "doubtful";
    case FrameVerdict::kContradicts: return "contradicts";
  }
  return "unknown";
}

std::string HiddenShare::text() const {
  constexpr double kWorthAWord = 0.15;
  std::string text;
  if (hand >= kWorthAWord) text = fmt::format("{:.0f} % of the hand is hidden", 100.0 * hand);
  if (hand < kWorthAWord && robot >= kWorthAWord) text = fmt::format("{:.0f} % of the arm is hidden", 100.0 * robot);
  if (holds) text += text.empty() ? "the hand holds something" : ", it holds something";
  return text;
}

std::string Finding::text() const {
  std::string text = effect;
  if (effect == "unexplained") return fmt::format("something that follows the {} of {}", source, joint);
  if (!joint.empty()) text += " of " + joint;
  if (!source.empty()) text += (joint.empty() ? " " : " with ") + source;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto& p = parameters[i];
    text += fmt::format("{} {:.3g} {}", i > 0 ? "," : "", p.value, p.unit);
  }
  for (std::size_t i = 0; i < alike.size(); ++i) text += (i == 0 ? ", or " : " or ") + alike[i];
  return text;
}

bool Estimate::told(std::size_t joint) const {
  constexpr double kTold_rad = 0.5 * kPi / 180.0;
  const auto k = static_cast<Eigen::Index>(joint);
  const double sd = std::sqrt(std::max(0.0, covariance_rad2(k, k)));
  return sd < kTold_rad && (prior_sd_rad.size() <= k || sd < prior_sd_rad(k) / 3.0);
}

struct Estimator::Impl {
  Impl(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& robot_setup, const StereoRig& stereo_rig,
       const Beliefs& beliefs, const EstimatorOptions& estimator_options, const ErrorModel& known)
      : options(estimator_options), setup(robot_setup), rig(stereo_rig),
        state_at_first(without_offsets(known), beliefs.state),
        considered(Considered::beside(state_at_first, beliefs.tolerances)),
        outlines(particles_only() ? silhouette_model(*robot, setup)
                                  : outline_level(silhouette_model(*robot, setup), rig.intrinsics())),
        model(robot, setup, rig, known.roles(), state_at_first, considered.effects, &outlines),
        joints(model.state().joints()),
        scorer(model, silhouette_model(*robot, setup), particles_only() ? nullptr : &outlines, rig.intrinsics(),
               options.silhouette, options.filter.particles),
        filter(joints, options.filter), memory(memory_layout(model.state(), considered), options.memory),
        fitter(model, scorer, options, rig.cameras.size(), search_renders(options, rig.intrinsics())),
        occlusion(model, scorer, rig, setup.hand_link), state(model.state().prior_mean()), in_frame(memory.estimate()),
        stalled(joints) {
    first_guesses = filter.states();
    cloud_covariance = filter.covariance();
    distance.resize(static_cast<Eigen::Index>(options.filter.particles));
    weights.resize(static_cast<Eigen::Index>(options.filter.particles));
    reading.resize(joints);
    usual_before = Eigen::VectorXd::Ones(joints);
    for (Eigen::Index k = 0; k < joints; ++k) {
      joint_names.push_back(model.state().parameters()[static_cast<std::size_t>(k)].name);
    }
    shape = Eigen::MatrixXd::Zero(state.size(), state.size());
  }

  // --- one step -------------------------------------------------------------------------------

  Estimate step(const Observation& observation) {
    const auto start = Clock::now();
    times = {};
    now_s = seconds(observation.utime);
    frame = model.take(observation, state);
    fitter.begin_frame();
    changed.clear();
    resumed_now.clear();
    cameras_swapped = contradicted = near = hidden_only = false;
    hidden = {};
    if (!particles_only()) occlusion.cover(frame, state, hand_sd_m);
    best_likelihood = effective_size = rms_px = 0.0;
    verdict = FrameVerdict::kNothingKnown;
    innovation = {};
    if (!scorer.observe(observation, frame, options.min_mask_share)) {
      in_frame = particles_only() ? cloud() : memory.in_posture();
      if (memory.empty()) in_frame.x = state;
      if (!memory.loose().empty()) in_frame.x = where_it_was(memory);
      current = EstimatorState::kHandNotInView;
      put_off_searches();
    } else if (const auto swapped = starts_swapped(observation); swapped.value_or(false)) {
      begin_again();
      doubt(state);
      cameras_swapped = true;
    } else if (!swapped && memory.empty()) {
      doubt(state);  // until it is known whose pictures these are
      current = EstimatorState::kConverging;
    } else {
      score_particles();
      if (options.mode == EstimatorMode::kPaper) {
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
    Estimate estimate = report();
    estimate.utime = observation.utime;
    times.scoring_ms = scorer.take_scoring_ms();
    estimate.times = times;
    estimate.times.total_ms = elapsed_ms(start);
    return estimate;
  }

  void score_particles() {
    const auto start = Clock::now();
    Eigen::VectorXd x = state;
    model.settle(frame, state);
    for (std::size_t i = 0; i < options.filter.particles; ++i) {
      x.head(joints) = filter.states().col(static_cast<Eigen::Index>(i));
      scorer.place(x, i);
    }
    times.kinematics_ms += elapsed_ms(start);
    distance = scorer.score(options.filter.particles);
  }

  /// The estimate is one of the particles, as in the paper.
  [[nodiscard]] bool particles_only() const { return options.mode == EstimatorMode::kPaper || !options.refine_outline; }

  [[nodiscard]] MemoryEstimate cloud() const {
    MemoryEstimate estimate = memory.estimate();
    estimate.x = state;
    estimate.own.topLeftCorner(joints, joints) = cloud_covariance;
    estimate.covariance = estimate.own;
    return estimate;
  }

  void particle_step() {
    const auto start = Clock::now();
    if (weights.maxCoeff() <= 0.0) weights.setConstant(1.0);
    filter.update(weights);
    state.head(joints) = filter.estimate();
    best_likelihood = hammoude_likelihood(distance(filter.estimate_index()));
    effective_size = filter.effective_sample_size();
    cloud_covariance = filter.covariance();
    in_frame = cloud();
    filter.resample_and_spread();
    // Says that the spread is at its smallest, no more: the published filter knows no better of itself.
    current = EstimatorState::kConverging;
    if (filter.spread_rad() <= options.filter.spread_min_rad) current = EstimatorState::kConverged;
    times.filter_ms += elapsed_ms(start);
  }

  Eigen::VectorXd likelihood(const Observation& observation, const Eigen::MatrixXd& offsets) {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(offsets.cols());
    Eigen::VectorXd x = model.state().prior_mean();
    frame = model.take(observation, x);
    if (!scorer.observe(observation, frame, options.min_mask_share, true)) return result;
    model.settle(frame, x);
    const auto batch = static_cast<Eigen::Index>(options.filter.particles);
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
    const Eigen::VectorXd known = where_it_was(memory);
    const Observation exchanged = with_eyes_exchanged(observation);
    scorer.observe(exchanged, frame, options.min_mask_share);
    const double other_distance = scorer.distance(known);
    scorer.observe(observation, frame, options.min_mask_share);
    return EyeOrder::clearly_exchanged(scorer.distance(known), other_distance);
  }

  /// Without one: by how near the arm can be brought to them from the guesses that the search began with, which
  /// no wrong minimum has led astray. Searched for on as many frames as that takes; meanwhile as it was last found, or
  /// nothing.
  std::optional<bool> starts_swapped(const Observation& observation) {
    if (particles_only() || eye_order.settled() || !scorer.can_be_exchanged()) return false;
    const Observation exchanged = with_eyes_exchanged(observation);
    if (!eyes) {
      const Eigen::VectorXd distances = score_first_guesses();
      scorer.observe(exchanged, frame, options.min_mask_share);
      const Eigen::VectorXd other_distances = scorer.score(static_cast<std::size_t>(distances.size()));
      if (!EyeOrder::worth_searches(distances.minCoeff(), other_distances.minCoeff())) {
        scorer.observe(observation, frame, options.min_mask_share);
        return found_swapped = eye_order.exchanged(distances.minCoeff(), other_distances.minCoeff());
      }
      constexpr std::size_t kStarts = 12;  // from three, one arm in 300 that began far off was not found
      const Eigen::VectorXd rest = model.state().prior_mean();
      eyes.emplace();
      eyes->as_they_are.starts = starts_from(first_guesses, distances, rest, kStarts);
      eyes->exchanged.starts = starts_from(first_guesses, other_distances, rest, kStarts);
    }
    // In turn where a frame has not room for both, so that both are searched for in the same pictures, nearly.
    const bool exchanged_first = eyes->exchanged.next <= eyes->as_they_are.next;
    bool through = exchanged_first ? search_as(exchanged, eyes->exchanged) : search_as(observation, eyes->as_they_are);
    through &= exchanged_first ? search_as(observation, eyes->as_they_are) : search_as(exchanged, eyes->exchanged);
    scorer.observe(observation, frame, options.min_mask_share);
    if (!through) return found_swapped;
    found_swapped = eye_order.exchanged(eyes->as_they_are.least, eyes->exchanged.least);
    eyes.reset();
    return found_swapped;
  }

  /// Goes on with one of both searches, in this frame with these pictures.
  bool search_as(const Observation& shown, StartSearch& search) {
    scorer.observe(shown, frame, options.min_mask_share);
    Frame pictures = frame;
    for (std::size_t c = 0; c < pictures.seen.size(); ++c) pictures.seen[c] = &*shown.cameras[c];
    // What is known, however little, is looked after in every frame.
    const int room = memory.empty() ? 0 : 1;
    return fitter.go_on(pictures, memory.beliefs(), search, room);
  }

  /// Distances of the arms that the search began with, in the frame that the scorer has.
  Eigen::VectorXd score_first_guesses() {
    Eigen::VectorXd x = model.state().prior_mean();
    model.settle(frame, x);
    const auto n = static_cast<std::size_t>(first_guesses.cols());
    for (std::size_t i = 0; i < n; ++i) {
      x.head(joints) = first_guesses.col(static_cast<Eigen::Index>(i));
      scorer.place(x, i);
    }
    return scorer.score(n);
  }

  // --- mode best: what the frame says, and what may have happened ------------------------------

  /// The first `count` of some offsets, nearest first, with the nuisances of `rest`.
  [[nodiscard]] std::vector<Eigen::VectorXd> starts_from(const Eigen::MatrixXd& offsets,
                                                         const Eigen::VectorXd& distances, const Eigen::VectorXd& rest,
                                                         std::size_t count) const {
    const auto order = in_order(distances);
    std::vector<Eigen::VectorXd> starts(std::min(count, order.size()), rest);
    for (std::size_t i = 0; i < starts.size(); ++i) starts[i].head(joints) = offsets.col(order[i]);
    return starts;
  }

  void best_step(const Observation& observation) {
    auto start = Clock::now();
    filter.update(weights);
    effective_size = filter.effective_sample_size();
    times.filter_ms += elapsed_ms(start);

    start = Clock::now();
    if (!options.remember) memory.forget_all();
    read_encoders();
    for (const auto& resumed : stalled.look(reading, now_s)) believe_again(resumed);
    memory.loosen(stalled.suspects());
    for (Eigen::Index k = 0; k < joints; ++k) {
      if (stalled.standing_since_s(k) == now_s) usual_before(k) = usual();
    }
    fitter.count_still_parts_once(std::max(memory.postures(), options.least_postures));
    if (memory.empty()) {
      find_anew();
    } else {
      OutlineFit fit = fitter.follow(frame, memory, where_it_was(memory));
      judge(fit);
      if (verdict == FrameVerdict::kAgrees && !young()) {
        // A change that only some pictures show is searched for on these.
        if (round && now_s - round_since_s > limits::kPatience_s) round.reset();
        unexplained = false;
        learn(fit);
      } else {
        explain_frame(observation, std::move(fit));
      }
    }
    times.refinement_ms += elapsed_ms(start);

    start = Clock::now();
    // A young memory that pictures contradict may be the wrong arm's: the search goes on beside it.
    spread(!memory.empty() && !(young() && verdict != FrameVerdict::kAgrees));
    times.filter_ms += elapsed_ms(start);
  }

  /// A reading that stood while its joint may have moved: believed again from here on, or, where all was one slip,
  /// since that.
  void believe_again(const StalledEncoders::Resumed& resumed) {
    if (resumed.went_on) {
      memory.release(std::vector{resumed.joint}, now_s);
      state[resumed.joint] = resumed.before_rad;  // most encoders that stalled go on as they were
      resumed_now.push_back(resumed.joint);
    } else {
      memory.tighten_since(resumed.joint, resumed.stepped_s);
    }
  }

  /// The fused state with joints that may be anywhere, or of which nothing is known any more, where they were last.
  [[nodiscard]] Eigen::VectorXd where_it_was(const PostureMemory& known) const {
    Eigen::VectorXd x = known.estimate().x;
    for (const auto joint : known.loose()) x[joint] = state[joint];
    for (const auto joint : resumed_now) x[joint] = state[joint];
    return x;
  }

  /// What innovations of these degrees of freedom hardly ever exceed, in this log.
  [[nodiscard]] double doubtful(double dof) const {
    return chi_square_quantile(limits::kDoubt_tail, std::max(1.0, dof)) * usual();
  }
  /// How the frame agrees with the memory that its fit was held by.
  void judge(const OutlineFit& fit) {
    near = fitter.lies_near(frame, fit.evidence);
    // Few postures say little, of a step as of all else.
    const auto standing = young() ? std::vector<Eigen::Index>() : stalled.standing_while_others_move();
    const auto agreement = memory.agreement(fit.quadratic, standing);
    innovation = agreement.innovation;
    const double ratio = innovation.dof > 0.0 ? innovation.nis / innovation.dof : 0.0;
    const double limit = doubtful(innovation.dof);
    verdict = !near                                                             ? FrameVerdict::kContradicts
              : innovation.nis > limit || stalls(standing, agreement.step_gain) ? FrameVerdict::kDoubtful
                                                                                : FrameVerdict::kAgrees;
    if (verdict != FrameVerdict::kAgrees || innovation.dof <= 0.0) return;
    usual_sum += (ratio - usual_sum) / limits::kUsualFrames;
  }
  /// Whether a frame looks as if a joint had moved under its reading, by more than hardly ever happens by chance. What
  /// is usual counts as it was before the reading stood: a joint that moves slowly makes its own deviations usual.
  [[nodiscard]] bool stalls(const std::vector<Eigen::Index>& standing, const Eigen::VectorXd& step_gain) const {
    if (standing.empty()) return false;
    const double limit = chi_square_quantile(limits::kDoubt_tail / static_cast<double>(joints), 1.0);
    return (step_gain.array() > limit * usual_before(standing).array()).any();
  }
  /// What innovations are times what is believed of them, in this log.
  [[nodiscard]] double usual() const { return std::max(1.0, usual_sum); }

  void learn(const OutlineFit& fit) {
    doubted_since_s = -1.0;
    if (!fitter.fits(frame, fit.evidence)) {  // too little of the hand to say much
      settle_on(fit);
      return;
    }
    fitter.learn_noise(fit);
    if (const auto block =
            memory.add(now_s, posture_of(frame.exposures[0].at.encoder, model.roles()), fit.seen.quadratic, fit.x)) {
      fitter.learn_shape(fit);
      keep_frame(*block, fit);
    }
    look_again();
    settle_on(fit);
    if (!young()) occlusion.learn(frame, in_frame.x, hand_sd_m);
  }

  /// Nothing happened to the robot, and what is seen of it agrees with what is known: something hides the rest. The
  /// memory stays, nothing is learned.
  bool take_for_hidden(const OutlineFit& fit) {
    if (young()) return false;
    hidden = occlusion.hidden(fit.seen.evidence);
    const bool rest = fitter.rest_fits(fit.seen);
    if (rest) {
      const Innovation of_rest = memory.innovation(fit.seen.quadratic);
      if (of_rest.nis > doubtful(of_rest.dof)) return false;
      innovation = of_rest;
    } else if (hidden.robot < limits::kMostHidden) {
      return false;
    }
    hidden_only = true;
    doubted_since_s = -1.0;
    verdict = rest ? FrameVerdict::kAgrees : FrameVerdict::kDoubtful;
    state = where_it_was(memory);
    in_frame = rest ? memory.in_posture(fit.seen.quadratic) : memory.in_posture();
    if (rest) {
      see_loose_joints();
    } else {
      in_frame.x = state;
    }
    rms_px = fit.seen.evidence.rms_px();
    near = rest;
    best_likelihood = hammoude_likelihood(scorer.distance(in_frame.x));
    current = EstimatorState::kConverging;
    return true;
  }

  /// The first frame of every posture is kept, to be looked at again where the estimate has moved on.
  void keep_frame(std::uint64_t block, const OutlineFit& fit) {
    const auto kept = memory.blocks();
    std::erase_if(keyframes,
                  [&](const auto& item) { return std::find(kept.begin(), kept.end(), item.first) == kept.end(); });
    auto& keyframe = keyframes[block];
    keyframe.frame = frame;
    keyframe.frame.shown = fitter.pictures_show(frame, fit.evidence);
    keyframe.pictures.resize(frame.seen.size());
    for (std::size_t c = 0; c < frame.seen.size(); ++c) {
      if (frame.seen[c] == nullptr) continue;
      auto& picture = keyframe.pictures[c];
      picture.mask = frame.seen[c]->mask;
      picture.valid = frame.seen[c]->valid;
      picture.coverage = frame.seen[c]->coverage;
      keyframe.frame.seen[c] = &picture;
    }
  }

  /// Linearises anew what was linearised far from where the estimate is by now, a little in every frame.
  void look_again() {
    constexpr int kAtOnce = 2;
    for (int i = 0; i < kAtOnce; ++i) {
      const auto stale = memory.most_stale();
      const auto keyframe = stale ? keyframes.find(stale->block) : keyframes.end();
      if (keyframe == keyframes.end()) return;
      const auto first = fitter.about(keyframe->second.frame, stale->x);
      if (!first) return;
      memory.relinearise(stale->block, *first, stale->x);
    }
  }

  /// The frame and what is known of it, as it is reported.
  void settle_on(const OutlineFit& fit) {
    state = memory.empty() ? fit.x : where_it_was(memory);
    const PostureMemory held = contradicted || memory.empty() ? memory.beliefs() : memory;
    if (fitter.lies_near(frame, fit.evidence)) {
      in_frame = held.in_posture(contradicted ? fit.quadratic : fit.seen.quadratic);
    } else {  // an arm that is not where outlines are has nothing to learn from how these run
      in_frame = held.in_posture();
      in_frame.x = fit.x;
    }
    see_loose_joints();
    rms_px = fit.seen.evidence.rms_px();
    near = fitter.fits(frame, fit.evidence);
    hidden = occlusion.hidden(fit.seen.evidence);
    best_likelihood = hammoude_likelihood(scorer.distance(in_frame.x));
    current = EstimatorState::kConverging;
  }

  /// Joints that may be anywhere are where this frame shows them.
  void see_loose_joints() {
    if (memory.loose().empty()) return;
    for (const auto joint : memory.loose()) state[joint] = in_frame.x[joint];
    stalled.seen(in_frame.x.head(joints), in_frame.covariance.diagonal().head(joints).cwiseMax(0.0).cwiseSqrt());
  }

  /// The frame contradicts the memory, or the memory is so young that it may be wrong.
  void explain_frame(const Observation& observation, OutlineFit fit) {
    if (verdict != FrameVerdict::kAgrees && turned_swapped(observation)) {
      put_off_searches();
      doubt(where_it_was(memory));
      cameras_swapped = true;
      return;
    }
    if (!round) {
      if (verdict != FrameVerdict::kAgrees && !young()) suspect_slips();
      round.emplace();
      round_since_s = now_s;
      round->hypotheses = hypotheses(fit);
    }
    // There is no hurry where the frame agrees and the memory is only young.
    const int room = verdict == FrameVerdict::kAgrees && !eyes ? 1 : 0;
    const bool through = go_on(*round, memory, fit, now_s, frame, fitter, room);
    if (through) {
      auto better = std::move(round->best);
      round.reset();
      if (better) {
        take(std::move(*better));
        return;
      }
      unexplained = true;
    }
    if (verdict == FrameVerdict::kAgrees) {
      learn(fit);
      return;
    }
    // Before all has been tried nothing is taken for hidden, but what was tried in vain on the pictures before.
    if (unexplained && take_for_hidden(fit)) return;
    // Nothing explains it better so far: the memory stays, the frame is not learned from.
    if (doubted_since_s < 0.0) doubted_since_s = now_s;
    contradicted = true;
    settle_on(fit);
    state = where_it_was(memory);
    if (now_s - doubted_since_s > limits::kPatience_s) {
      verdict = FrameVerdict::kContradicts;
      current = EstimatorState::kDiverged;
      if (young()) begin_anew();
    }
  }

  /// Too few postures for what is remembered to be relied on.
  [[nodiscard]] bool young() const { return memory.postures() < options.least_postures; }

  [[nodiscard]] std::vector<Hypothesis> hypotheses(const OutlineFit& fit) {
    std::vector<Hypothesis> list;
    auto anew = starts_from(filter.states(), distance, state, 3);
    if (young() && verdict != FrameVerdict::kAgrees) {
      // What the first pictures were taken for has drawn the particles to itself, and may have been wrong.
      const auto guesses = starts_from(first_guesses, score_first_guesses(), model.state().prior_mean(), 3);
      anew.insert(anew.end(), guesses.begin(), guesses.end());
    }
    std::vector<Eigen::Index> everything(static_cast<std::size_t>(state.size()));
    std::iota(everything.begin(), everything.end(), Eigen::Index{0});
    if (!young()) {
      for (Eigen::Index joint = 0; joint < joints; ++joint) list.push_back(slip(joint, fit));
      if (const auto camera = camera_parameters(); !camera.empty()) {
        // From afar: knocked by more than is looked for about a memory.
        list.push_back({"the cameras were moved", camera, {where_it_was(memory)}});
      }
    }
    if (alternative && now_s - alternative_s < limits::kAlternative_s && !stalled.suspected()) {
      list.push_back({"what was known before holds", {}, {}, &*alternative});
      // One picture that is wrong may look like an arm elsewhere; the next ones are as the better memory foresees.
      if (young()) list.back().known_instead = everything.size();
    }
    list.push_back({"the arm was found elsewhere", everything, anew, nullptr, young()});
    return list;
  }

  /// A joint slipped: from where the outline's slopes point to, or where silhouettes say.
  [[nodiscard]] Hypothesis slip(Eigen::Index joint, const OutlineFit& fit) {
    Hypothesis result{"", {joint}, {}};
    result.doubted_since_s = stalled.standing_since_s(joint);
    Eigen::VectorXd start = where_it_was(memory);
    const auto order = in_order(distance);
    double step = memory.step(fit.quadratic, result.released).size[0];
    for (const auto particle : order) {
      if (slip_of_particle.empty() || slip_of_particle[static_cast<std::size_t>(particle)] != joint) continue;
      // Outlines further off than they are looked for say nothing: then the silhouettes do.
      if (!near) step = filter.states()(joint, particle) - start[joint];
      break;
    }
    start[joint] += step;
    result.starts = {start};
    return result;
  }

  [[nodiscard]] std::vector<Eigen::Index> camera_parameters() const {
    std::vector<Eigen::Index> list;
    for (Eigen::Index k = joints; k < state.size(); ++k) {
      const auto& effect = model.state().model()[model.state().parameters()[static_cast<std::size_t>(k)].ref.effect];
      if (effect.name() == "camera_pose" || effect.name() == "head_offset") list.push_back(k);
    }
    return list;
  }

  /// Pictures that came between say nothing of what was searched for, or all there is to say: it would begin anew.
  void put_off_searches() {
    round.reset();
    lost.reset();
    unexplained = false;
  }

  /// What happened instead becomes what is known.
  void take(Explanation better) {
    put_off_searches();
    const auto& released = better.hypothesis.released;
    if (released.size() == 1 && released[0] < joints) {
      const double step = better.fit.x[released[0]] - state[released[0]];
      stalled.stepped(released[0], step, better.fit.x[released[0]], now_s);
      changed =
          fmt::format("{} slipped by {:.1f} deg", joint_names[static_cast<std::size_t>(released[0])], degrees(step));
    } else if (!young()) {
      changed = better.hypothesis.what;
    }
    if (better.hypothesis.instead == nullptr && !young()) {
      alternative = std::move(memory);
      alternative_s = now_s;
    } else if (better.hypothesis.instead != nullptr) {
      alternative.reset();
    }
    memory = std::move(better.memory);
    memory.loosen(stalled.suspects());
    usual_sum = 1.0;
    innovation = {};
    verdict = FrameVerdict::kContradicts;
    if (fitter.fits(frame, better.fit.evidence)) {
      learn(better.fit);
    } else {
      settle_on(better.fit);
    }
  }

  /// What a few pictures taught is contradicted by all that follow: it was theirs, the next frame is searched.
  void begin_anew() {
    put_off_searches();
    memory.forget_all();
    fitter.forget_shape();
    keyframes.clear();
    doubted_since_s = -1.0;
    usual_sum = 1.0;
  }

  /// Nothing is known: the best of what the particles found becomes the memory if it fits.
  void find_anew() {
    if (!lost) {
      lost.emplace();
      lost->by_pictures = true;
      lost->starts = starts_from(filter.states(), distance, state, 3);
      // What was found last, and not believed, may be right: masks that are made near another arm would lose it again.
      if (found_in_doubt) lost->starts.back() = state;
    }
    if (!fitter.go_on(frame, memory, *lost)) {
      doubt(state);
      current = EstimatorState::kConverging;
      return;
    }
    OutlineFit fit = fitter.found(frame, memory, *lost);
    lost.reset();
    found_in_doubt = false;
    if (fitter.is_shown(frame, fit)) {
      learn(fit);
      return;
    }
    if (strayed(fit.x.head(joints))) {
      begin_again();
      doubt(state);
      current = EstimatorState::kConverging;
      return;
    }
    found_in_doubt = true;
    settle_on(fit);
  }

  /// Whether a search has run off from masks that are not the arm's: further than any arm whose joints are all
  /// within three standard deviations.
  [[nodiscard]] bool strayed(const Eigen::VectorXd& offsets) const {
    return offsets.norm() > 3.0 * std::sqrt(static_cast<double>(joints)) * options.filter.initial_sd_rad;
  }

  /// A frame that said nothing of the offsets: reports `x` in doubt.
  void doubt(const Eigen::VectorXd& x) {
    contradicted = !memory.empty();
    current = EstimatorState::kDiverged;
    state = x;
    in_frame = memory.beliefs().in_posture();
    in_frame.x = state;
    best_likelihood = hammoude_likelihood(scorer.distance(state));
  }

  /// The worse half of the particles makes way for slips of each joint, both ways and of all sizes up to the largest.
  void suspect_slips() {
    const auto order = in_order(distance);
    const Eigen::Index slips = filter.states().cols() / 2;
    const Eigen::Index sizes = std::max<Eigen::Index>(1, slips / (2 * joints));  // each way
    slip_of_particle.assign(static_cast<std::size_t>(filter.states().cols()), -1);
    Eigen::VectorXd x(joints);
    for (Eigen::Index i = 0; i < std::min(slips, 2 * sizes * joints); ++i) {
      const Eigen::Index step = i / joints;
      const double size = limits::kLargestSlip_rad * static_cast<double>(step / 2 + 1) / static_cast<double>(sizes);
      x = state.head(joints);
      x(i % joints) += step % 2 == 0 ? size : -size;
      const auto particle = order[order.size() - 1 - static_cast<std::size_t>(i)];
      filter.set_state(particle, x);
      slip_of_particle[static_cast<std::size_t>(particle)] = i % joints;
    }
    score_particles();
  }

  /// Next frame's particles: resampled survivors, and half of them around the estimate.
  void spread(bool locked) {
    slip_of_particle.clear();
    filter.resample_and_spread();
    if (!locked && filter.spread_rad() < limits::kSearchSpread_rad) filter.set_spread(limits::kSearchSpread_rad);
    const Eigen::Index n = filter.states().cols();
    Eigen::VectorXd sd(joints);
    if (locked) {
      sd = memory.estimate().covariance.diagonal().head(joints).cwiseMax(0.0).cwiseSqrt();
      sd = sd.cwiseMax(options.filter.spread_min_rad);
    } else {
      sd.setConstant(filter.spread_rad());
    }
    std::normal_distribution<double> normal(0.0, 1.0);
    Eigen::VectorXd x(joints);
    for (Eigen::Index i = 0; i < n / 2; ++i) {
      for (Eigen::Index k = 0; k < joints; ++k) x(k) = state(k) + sd(k) * normal(filter.random());
      filter.set_state(i, x);
    }
  }

  // --- results --------------------------------------------------------------------------------

  Estimate report() {
    Estimate estimate;
    shape = shape_covariance();
    estimate.joint_names = joint_names;
    estimate.offset_rad = state.head(joints);
    estimate.prior_sd_rad = model.state().prior_sd().head(joints);
    estimate.effective_sample_size = effective_size;
    estimate.best_likelihood = best_likelihood;
    estimate.contour_rms_px = rms_px;
    estimate.cameras_swapped = cameras_swapped;
    if (particles_only()) {
      estimate.covariance_rad2 = cloud_covariance;
    } else {
      report_memory(estimate);
    }
    for (std::size_t c = 0; c < rig.cameras.size() && frame.exposed(); ++c) {
      const Exposure& exposure = frame.exposures[c];
      estimate.X_CP.push_back(model.hand_pose(exposure, in_frame.x));
      estimate.X_CP_nominal.push_back(model.nominal_hand_pose(exposure));
      if (c == 0) estimate.hand_sd_m = std::sqrt(std::max(0.0, hand_covariance_m2(exposure).trace()));
    }
    hand_sd_m = estimate.hand_sd_m;
    estimate.hidden = hidden;
    estimate.weakest = weakest_direction(estimate.covariance_rad2, joint_names);
    if (!particles_only()) conclude(estimate);
    estimate.state = current;
    return estimate;
  }

  void report_memory(Estimate& estimate) {
    const MemoryEstimate& known = contradicted || !memory.loose().empty() ? in_frame : memory.estimate();
    const Eigen::MatrixXd covariance = known.covariance + (disagreement() - 1.0) * known.own + shape;
    estimate.covariance_rad2 = covariance.topLeftCorner(joints, joints);
    for (Eigen::Index k = joints; k < state.size(); ++k) {
      const auto& p = model.state().parameters()[static_cast<std::size_t>(k)];
      const Effect& effect = model.state().model()[p.ref.effect];
      estimate.effects.push_back({effect.name(), effect.target().joint, effect.target().source,
                                  effect.parameters()[p.ref.parameter].name, p.name, p.unit, p.si_per_unit, state(k),
                                  std::sqrt(std::max(0.0, covariance(k, k))), p.prior_sd});
    }
    estimate.verdict = verdict;
    estimate.innovation = innovation.nis;
    estimate.innovation_dof = innovation.dof;
    estimate.innovation_usual = usual();
    estimate.postures = memory.postures();
    estimate.posture_sd_rad = memory.posture_sd_rad();
    estimate.outline_sd_px = fitter.noise().front().sd_px();
    estimate.outline_alike = fitter.noise().front().correlated_points();
    estimate.changed = changed;
    if (const auto joint = stalled.joint(); joint >= 0) {
      estimate.stalled_joint = joint_names[static_cast<std::size_t>(joint)];
      estimate.stalled_motion_rad = stalled.moved_rad();
    }
  }

  /// Whether the estimate may be relied on.
  void conclude(Estimate& estimate) {
    estimate.hand_sd_limit_m = hand_sd_limit_m(estimate);
    if (current != EstimatorState::kConverging || young()) return;
    estimate.misfit = misfit();
    if (!estimate.misfit.empty()) {
      current = EstimatorState::kModelMisfit;
    } else if (!contradicted && near && verdict == FrameVerdict::kAgrees && !stalled.suspected() &&
               fitter.knows_shape() && estimate.hand_sd_m < estimate.hand_sd_limit_m) {
      current = EstimatorState::kConverged;
    }
    // Known by the memory alone, whatever it claims: nobody sees whether it still holds.
    if (hidden.hand > limits::kMostHidden || (hidden_only && !near)) current = EstimatorState::kOccluded;
  }

  /// How well the hand is to be known: as configured, or as well as this distance and these tolerances allow.
  [[nodiscard]] double hand_sd_limit_m(const Estimate& estimate) {
    if (options.converged_hand_sd_m > 0.0) return options.converged_hand_sd_m;
    if (estimate.X_CP.empty()) return 0.0;
    constexpr double kMore = 1.5;
    const double tolerated =
        std::sqrt(std::max(0.0, (hand_covariance_m2(frame.exposures[0]) - own_hand_covariance_m2()).trace()));
    const double near_m = limits::kHandPerDistance * estimate.X_CP.front().translation().norm();
    const double own_m =
        std::min(limits::kMostPerDistance * near_m, std::hypot(near_m, limits::kOfDescription * described_hand_sd_m()));
    return std::hypot(own_m, kMore * tolerated);
  }

  /// How well the robot's description puts the hand before any picture, offsets left out: what may be wrong with links
  /// and cameras, and is estimated. Of the last `hand_covariance_m2`.
  [[nodiscard]] double described_hand_sd_m() const {
    double square = 0.0;
    for (Eigen::Index k = joints; k < state.size(); ++k) {
      const auto& p = model.state().parameters()[static_cast<std::size_t>(k)];
      if (model.state().model()[p.ref.effect].name() == "head_offset") continue;
      square += (hand_J.col(k) * p.prior_sd).squaredNorm();
    }
    return std::sqrt(square);
  }

  /// What postures disagree by, times what is claimed of them: no estimate is better than the postures that it is made
  /// of.
  [[nodiscard]] double disagreement() const { return std::max(1.0, memory.dispersion()); }

  /// What is wrong by more than is believed possible; empty: nothing.
  [[nodiscard]] std::string misfit() {
    const auto& known = memory.estimate();
    const Eigen::VectorXd prior_sd = memory.layout().prior_sd;
    const Eigen::VectorXd away = (known.x - memory.layout().prior_mean).cwiseQuotient(prior_sd);
    Eigen::Index worst = -1;
    for (Eigen::Index k = joints; k < away.size(); ++k) {
      if (std::abs(away[k]) > limits::kBeyondBelief_sd && (worst < 0 || std::abs(away[k]) > std::abs(away[worst]))) {
        worst = k;
      }
    }
    if (worst >= 0) {
      const auto& p = model.state().parameters()[static_cast<std::size_t>(worst)];
      return fmt::format(
          "the pictures ask for {} {:.3g} {}, {:.0f} times what is believed possible (estimator.state); something else "
          "is wrong with the model: run bodyschema diagnose on a log",
          p.name, known.x[worst] / p.si_per_unit, p.unit, std::abs(away[worst]));
    }
    if (memory.dispersion() > limits::kDisagreement) {
      return fmt::format(
          "postures disagree by {:.1f} times what is claimed; the model of the robot is wrong in a way that offsets do "
          "not explain: run bodyschema diagnose on a log",
          std::sqrt(memory.dispersion()));
    }
    return {};
  }

  /// Encoders of the estimated joints at the exposure of the first camera.
  void read_encoders() {
    const Instant& at = frame.exposures[0].at;
    for (Eigen::Index k = 0; k < joints; ++k) {
      reading(k) = at.encoder(model.state().parameters()[static_cast<std::size_t>(k)].joint);
    }
  }

  /// The silhouette of parts placed by a state, as the lens shows it.
  [[nodiscard]] BinaryMask drawn(std::span<const Eigen::Isometry3f> X_CB, std::size_t camera, const Exposure& exposure,
                                 const Eigen::VectorXd& x) {
    Corrections corrections = model.roles().no_corrections();
    model.corrections(exposure, x, corrections);
    return bent_silhouette(scorer.render(X_CB, camera), rig.cameras[camera].intrinsics, corrections.camera.k1);
  }

  /// The state that an estimate reports.
  [[nodiscard]] Eigen::VectorXd state_of(const Estimate& estimate) const {
    Eigen::VectorXd x = model.state().prior_mean();
    x.head(joints) = estimate.offset_rad;
    for (std::size_t k = 0; k < estimate.effects.size(); ++k) {
      x(joints + static_cast<Eigen::Index>(k)) = estimate.effects[k].value;
    }
    return x;
  }

  /// How well the hand is known in a camera, by this frame's covariance.
  Eigen::Matrix3d hand_covariance_m2(const Exposure& exposure) {
    hand_J = model.hand_jacobian(exposure, in_frame.x);
    const Eigen::MatrixXd& J = hand_J;
    const auto n = state.size();
    hand_own = disagreement() * J.leftCols(n) * in_frame.own * J.leftCols(n).transpose();
    hand_own += J.leftCols(n) * shape * J.leftCols(n).transpose();
    if (J.cols() == n) return hand_own;
    const Eigen::MatrixXd T =
        (J.leftCols(n) * in_frame.sensitivity + J.rightCols(J.cols() - n)) * memory.layout().considered_root;
    return hand_own + T * T.transpose();
  }
  /// What outlines that are wrong alike in all postures do to the state: as if one average posture alone were known,
  /// for the others err with it. No more than what was believed before any.
  [[nodiscard]] Eigen::MatrixXd shape_covariance() {
    if (particles_only() || memory.empty()) return Eigen::MatrixXd::Zero(state.size(), state.size());
    const auto& own = memory.estimate().own;
    const Eigen::VectorXd prior = memory.layout().prior_sd.array().square().inverse();
    const double told = static_cast<double>(state.size()) - own.diagonal().dot(prior);
    const double share = fitter.shape_variance_share(told);
    if (share <= 0.0) return Eigen::MatrixXd::Zero(state.size(), state.size());
    const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(state.size(), state.size());
    Eigen::MatrixXd precision = own.ldlt().solve(identity);
    precision.diagonal() -= prior;
    precision /= share * static_cast<double>(memory.postures());
    precision.diagonal() += prior;
    return precision.ldlt().solve(identity);
  }
  /// Of the last `hand_covariance_m2`, the share that tolerances have no part in.
  [[nodiscard]] Eigen::Matrix3d own_hand_covariance_m2() const { return hand_own; }

  void reset() {
    begin_again();
    filter = ParticleFilter(joints, options.filter);
    in_frame = memory.in_posture();
    current = EstimatorState::kHandNotInView;
    cloud_covariance = filter.covariance();
    contradicted = false;
    eye_order = {};
    eyes.reset();
    found_swapped.reset();
    fitter.forget();
    model.forget();
  }

  /// Nothing that was learned holds.
  void begin_again() {
    put_off_searches();
    filter.reset(Eigen::VectorXd::Zero(joints));
    memory.forget_all();
    fitter.forget_shape();
    occlusion.forget();
    keyframes.clear();
    alternative.reset();
    found_in_doubt = false;
    state = model.state().prior_mean();
    stalled = StalledEncoders(joints);
    memory.loosen({});
    usual_sum = 1.0;
    usual_before.setOnes();
    doubted_since_s = -1.0;
  }

  EstimatorOptions options;
  RobotSetup setup;
  StereoRig rig;
  State state_at_first;
  Considered considered;
  SilhouetteModel outlines;  ///< what outlines and pictures to look at are drawn from
  FrameModel model;
  Frame frame;                           ///< the last one; its observation is gone once `step` has returned
  Eigen::Index joints;                   ///< estimated ones; the first entries of a state
  std::vector<std::string> joint_names;  ///< of these, in the state's order: the configuration may list them in another
  HypothesisScorer scorer;
  ParticleFilter filter;
  PostureMemory memory;
  struct Keyframe {
    Frame frame;
    std::vector<CameraObservation> pictures;  ///< per camera: masks, not the pictures themselves
  };
  std::map<std::uint64_t, Keyframe> keyframes;  ///< by the memory's blocks
  std::optional<PostureMemory> alternative;     ///< the memory that the last change of mind cost
  double alternative_s = 0.0;
  OutlineFitter fitter;
  Occlusion occlusion;
  HiddenShare hidden;        ///< in the last frame
  bool hidden_only = false;  ///< the last frame contradicts by what is hidden alone
  double hand_sd_m = 1.0;    ///< as last reported

  Eigen::VectorXd state;    ///< fused over postures
  MemoryEstimate in_frame;  ///< the same with this frame's own error
  Eigen::Matrix3d hand_own = Eigen::Matrix3d::Zero();
  Eigen::MatrixXd shape;   ///< covariance of the state by what outlines get wrong alike in all postures
  Eigen::MatrixXd hand_J;  ///< of the last covariance of the hand
  EstimatorState current = EstimatorState::kHandNotInView;
  FrameVerdict verdict = FrameVerdict::kNothingKnown;
  Innovation innovation;
  double usual_sum = 1.0;
  Eigen::VectorXd usual_before;  ///< what was usual when each joint's reading last changed
  double now_s = 0.0, doubted_since_s = -1.0;
  double best_likelihood = 0.0, effective_size = 0.0, rms_px = 0.0;
  bool contradicted = false;  ///< the memory does not explain the last frame
  bool near = false;          ///< the last frame's outlines lie near what is reported
  bool cameras_swapped = false;
  std::string changed;
  Eigen::MatrixXd first_guesses;  ///< of the joint offsets: the first particles
  EyeOrder eye_order;
  struct EyeSearch {
    StartSearch as_they_are, exchanged;
  };
  std::optional<EyeSearch> eyes;          ///< goes on with the next frame
  std::optional<bool> found_swapped;      ///< by the last search for whose pictures these are
  bool found_in_doubt = false;            ///< the state is what a search found last, and nothing was learned from
  std::optional<StartSearch> lost;        ///< for an arm of which nothing is known; goes on with the next frame
  std::optional<ExplanationRound> round;  ///< goes on with the next frame
  double round_since_s = 0.0;
  bool unexplained = false;  ///< the pictures before, by all that was tried
  StalledEncoders stalled;
  std::vector<Eigen::Index> resumed_now;  ///< joints whose stall ended with this frame
  Eigen::VectorXd reading;                ///< encoders of the estimated joints
  Eigen::MatrixXd cloud_covariance;       ///< of the particles as they were last weighed
  StageTimes times;
  Eigen::VectorXd distance;  ///< Hammoude, of the particles
  Eigen::VectorXd weights;
  std::vector<Eigen::Index> slip_of_particle;  ///< which joint's slip a particle stands for; -1: none
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
  return impl_->step(observation);
}
void Estimator::reset() {
  impl_->reset();
}

const Exposure& Estimator::exposure(std::size_t camera) const {
  return impl_->frame.exposures.at(camera);
}

Exposure Estimator::at_rest(const Eigen::VectorXd& q, std::size_t camera) const {
  return impl_->model.at_rest(q, camera);
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera, bool corrected) {
  std::vector<Eigen::Isometry3f> X_CB(impl_->model.part_count());
  const Exposure exposure = impl_->model.preview(observation.cameras[camera]->joints, camera);
  (corrected ? impl_->model.project(exposure, impl_->state) : impl_->model.project_nominal(exposure)).parts(X_CB);
  return corrected ? impl_->drawn(X_CB, camera, exposure, impl_->state) : impl_->scorer.render(X_CB, camera);
}

BinaryMask Estimator::predicted_silhouette(const Observation& observation, std::size_t camera,
                                           const Estimate& estimate) {
  std::vector<Eigen::Isometry3f> X_CB(impl_->model.part_count());
  const Exposure exposure = impl_->model.preview(observation.cameras[camera]->joints, camera);
  const Eigen::VectorXd x = impl_->state_of(estimate);
  impl_->model.project(exposure, x).parts(X_CB);
  return impl_->drawn(X_CB, camera, exposure, x);
}

Pose Estimator::hand_pose(const Exposure& exposure, bool corrected) {
  return corrected ? impl_->model.hand_pose(exposure, impl_->state) : impl_->model.nominal_hand_pose(exposure);
}

Pose Estimator::hand_pose(const Exposure& exposure, const Estimate& estimate) {
  return impl_->model.hand_pose(exposure, impl_->state_of(estimate));
}

Eigen::Matrix3d Estimator::hand_covariance_m2(const Exposure& exposure) {
  return impl_->hand_covariance_m2(exposure);
}

std::vector<Eigen::Vector3d> Estimator::fingertips(const Exposure& exposure, bool corrected) {
  auto& projection = corrected ? impl_->model.project(exposure, impl_->state) : impl_->model.project_nominal(exposure);
  std::vector<Eigen::Vector3d> tips;
  for (const auto& X_CT : projection.fingertips()) tips.push_back(X_CT.translation());
  return tips;
}

std::string Estimator::engine_description() const {
  return impl_->scorer.description();
}

}  // namespace bodyschema
