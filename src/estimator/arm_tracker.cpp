#include "arm_tracker.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "bodyschema/evidence/batch_fit.hpp"
#include "bodyschema/filter/hammoude.hpp"
#include "limits.hpp"

namespace bodyschema {

ArmTracker::ArmTracker(FrameModel& model, HypothesisScorer& scorer, ParticleSearch& particles, OutlineFitter& fitter,
                       Occlusion& occlusion, FusedState& known, const EstimatorOptions& options)
    : model_(model), scorer_(scorer), particles_(particles), fitter_(fitter), occlusion_(occlusion), known_(known),
      options_(options), eyes_(scorer, fitter, particles, options.min_mask_share), gate_(model.state().joints()) {}

// --- the frame as it comes ---------------------------------------------------------------------

void ArmTracker::begin_frame(Frame& frame) {
  fitter_.begin_frame();
  known_.begin_frame();
  occlusion_.cover(frame, known_.x, hand_sd_m_);
}

void ArmTracker::lose_sight() {
  known_.in_frame = known_.memory.in_posture();
  if (known_.memory.empty()) known_.in_frame.x = known_.x;
  if (!known_.memory.loose().empty()) known_.in_frame.x = known_.where_it_was();
  put_off_searches();
}

bool ArmTracker::shows_wrong_eyes(const Frame& frame, FrameOutcome& outcome) {
  const auto swapped = eyes_.from_the_start(frame, known_.memory);
  if (swapped.value_or(false)) {
    forget_everything();
    doubt(known_.x, outcome);
    outcome.cameras_swapped = true;
    return true;
  }
  if (swapped || !known_.memory.empty()) return false;
  doubt(known_.x, outcome);
  outcome.state = EstimatorState::kConverging;
  return true;
}

void ArmTracker::read_encoders(const Frame& frame) {
  if (!options_.remember) known_.memory.forget_all();
  // As they were at the exposure of the first camera.
  Eigen::VectorXd reading(model_.state().joints());
  for (Eigen::Index k = 0; k < reading.size(); ++k) {
    reading(k) = frame.exposures[0].at.encoder(model_.state().parameters()[static_cast<std::size_t>(k)].joint);
  }
  known_.read(reading, frame.time_s);
  for (Eigen::Index k = 0; k < reading.size(); ++k) {
    if (known_.stalled.standing_since_s(k) == frame.time_s) gate_.reading_changed(k);
  }
  fitter_.count_still_parts_once(std::max(known_.memory.postures(), options_.least_postures));
}

// --- what it says ------------------------------------------------------------------------------

void ArmTracker::find(const Frame& frame, FrameOutcome& outcome) {
  if (!lost_) {
    lost_.emplace();
    lost_->by_pictures = true;
    lost_->starts = particles_.nearest(known_.x, 3);
    // What was found last, and not believed, may be right: masks that are made near another arm would lose it again.
    if (found_in_doubt_) lost_->starts.back() = known_.x;
  }
  if (!fitter_.go_on(frame, known_.memory, *lost_)) {
    doubt(known_.x, outcome);
    outcome.state = EstimatorState::kConverging;
    return;
  }
  OutlineFit fit = fitter_.found(frame, known_.memory, *lost_);
  lost_.reset();
  found_in_doubt_ = false;
  if (fitter_.fits(frame, fit.evidence)) {
    learn(frame, fit, outcome);
  } else if (strayed(fit.x)) {
    forget_everything();
    doubt(known_.x, outcome);
    outcome.state = EstimatorState::kConverging;
  } else {
    found_in_doubt_ = true;
    settle_on(frame, fit, outcome);
  }
}

/// Whether a search has run off from masks that are not the arm's: further than any arm whose joints are all
/// within three standard deviations.
bool ArmTracker::strayed(const Eigen::VectorXd& x) const {
  const Eigen::Index joints = model_.state().joints();
  return x.head(joints).norm() > 3.0 * std::sqrt(static_cast<double>(joints)) * options_.filter.initial_sd_rad;
}

OutlineFit ArmTracker::measure(const Frame& frame) {
  return fitter_.follow(frame, known_.memory, known_.where_it_was());
}

void ArmTracker::gate(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  outcome.near = fitter_.lies_near(frame, fit.evidence);
  // Few postures say little, of a step as of all else.
  const auto standing = known_.young() ? std::vector<Eigen::Index>() : known_.stalled.standing_while_others_move();
  const auto judgement = gate_.judge(known_.memory, fit.quadratic, outcome.near, standing);
  outcome.verdict = judgement.verdict;
  outcome.innovation = judgement.innovation;
}

void ArmTracker::remember(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  // A change that only some pictures show is searched for on these.
  if (round_ && frame.time_s - round_since_s_ > limits::kPatience_s) round_.reset();
  unexplained_ = false;
  learn(frame, fit, outcome);
}

void ArmTracker::learn(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  doubted_since_s_ = -1.0;
  if (!fitter_.fits(frame, fit.evidence)) {  // too little of the hand to say much
    settle_on(frame, fit, outcome);
    return;
  }
  fitter_.learn_noise(fit);
  if (outcome.verdict == FrameVerdict::kAgrees && !known_.young()) fitter_.learn_stamps(frame, fit, known_.memory);
  const Eigen::VectorXd posture = posture_of(frame.exposures[0].at.encoder, model_.roles());
  const auto block = known_.memory.add(frame.time_s, posture, fit.seen.quadratic, fit.x);
  if (block) {
    fitter_.learn_shape(fit, known_.memory.told());
    keyframes_.keep(frame, *block, known_.memory, fitter_.pictures_show(frame, fit.evidence));
  }
  keyframes_.look_again(known_.memory, fitter_);
  settle_on(frame, fit, outcome);
  if (block) known_.hand_was_missed(outcome.hidden.hand_missed);
  if (!known_.young()) occlusion_.learn(frame, known_.in_frame.x, hand_sd_m_);
}

/// The frame and what is known of it, as it is reported.
void ArmTracker::settle_on(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  known_.x = known_.memory.empty() ? fit.x : known_.where_it_was();
  std::optional<PostureMemory> beliefs;
  if (outcome.contradicted || known_.memory.empty()) beliefs = known_.memory.beliefs();
  const PostureMemory& held = beliefs ? *beliefs : known_.memory;
  if (fitter_.lies_near(frame, fit.evidence)) {
    known_.in_frame = held.in_posture(outcome.contradicted ? fit.quadratic : fit.seen.quadratic);
  } else {  // an arm that is not where outlines are has nothing to learn from how these run
    known_.in_frame = held.in_posture();
    known_.in_frame.x = fit.x;
  }
  known_.see_loose_joints();
  outcome.rms_px = fit.seen.evidence.rms_px();
  outcome.near = fitter_.fits(frame, fit.evidence);
  outcome.hidden = occlusion_.hidden(frame, fit.seen.evidence);
  outcome.best_likelihood = hammoude_likelihood(scorer_.distance(known_.in_frame.x));
  outcome.state = EstimatorState::kConverging;
}

/// A frame that said nothing of the offsets: reports x in doubt.
void ArmTracker::doubt(const Eigen::VectorXd& x, FrameOutcome& outcome) {
  outcome.contradicted = !known_.memory.empty();
  outcome.state = EstimatorState::kDiverged;
  known_.x = x;
  known_.in_frame = known_.memory.beliefs().in_posture();
  known_.in_frame.x = x;
  outcome.best_likelihood = hammoude_likelihood(scorer_.distance(x));
}

// --- what may have happened --------------------------------------------------------------------

void ArmTracker::explain(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  const bool agrees = outcome.verdict == FrameVerdict::kAgrees;
  if (!agrees && eyes_.turned(frame, known_.where_it_was())) {
    put_off_searches();
    doubt(known_.where_it_was(), outcome);
    outcome.cameras_swapped = true;
    return;
  }
  if (!round_) {
    if (!agrees && !known_.young()) particles_.suspect_slips(frame, known_.x);
    round_.emplace();
    round_since_s_ = frame.time_s;
    round_->hypotheses = hypotheses(known_, model_.state(), fit, outcome, frame, particles_);
  }
  // There is no hurry where the frame agrees and the memory is only young.
  const int room = agrees && !eyes_.searching() ? 1 : 0;
  if (go_on(*round_, known_.memory, fit, frame, fitter_, room)) {
    auto better = std::move(round_->best);
    round_.reset();
    if (better) {
      take(frame, std::move(*better), outcome);
      return;
    }
    unexplained_ = true;
  }
  if (agrees) {
    learn(frame, fit, outcome);
  } else if (!unexplained_ || !take_for_hidden(frame, fit, outcome)) {
    // Before all has been tried nothing is taken for hidden, but what was tried in vain on the pictures before.
    stay(frame, fit, outcome);
  }
}

/// What happened instead becomes what is known.
void ArmTracker::take(const Frame& frame, Explanation better, FrameOutcome& outcome) {
  put_off_searches();
  const auto& released = better.hypothesis.released;
  if (released.size() == 1 && released[0] < model_.state().joints()) {
    const double offset = better.fit.x[released[0]], step = offset - known_.x[released[0]];
    known_.stalled.stepped(released[0], step, offset, frame.time_s);
    outcome.changed =
        fmt::format("{} slipped by {:.1f} deg", model_.state().parameters()[static_cast<std::size_t>(released[0])].name,
                    degrees(step));
  } else if (!known_.young()) {
    outcome.changed = better.hypothesis.what;
  }
  if (better.hypothesis.instead == nullptr && !known_.young()) {
    known_.alternative = std::move(known_.memory);
    known_.alternative_s = frame.time_s;
  } else if (better.hypothesis.instead != nullptr) {
    known_.alternative.reset();
  }
  known_.memory = std::move(better.memory);
  known_.forget_missed();
  known_.memory.loosen(known_.stalled.suspects());
  gate_.forget_usual();
  outcome.innovation = {};
  outcome.verdict = FrameVerdict::kContradicts;
  if (fitter_.fits(frame, better.fit.evidence)) {
    learn(frame, better.fit, outcome);
  } else {
    settle_on(frame, better.fit, outcome);
  }
}

/// Nothing happened to the robot, and what is seen of it agrees with what is known: something hides the rest. The
/// memory stays, nothing is learned.
bool ArmTracker::take_for_hidden(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  if (known_.young()) return false;
  outcome.hidden = occlusion_.hidden(frame, fit.seen.evidence);
  const bool rest = fitter_.rest_fits(fit.seen);
  if (rest) {
    const Innovation of_rest = known_.memory.innovation(fit.seen.quadratic);
    if (of_rest.nis > gate_.limit(of_rest.dof)) return false;
    outcome.innovation = of_rest;
  } else if (outcome.hidden.robot < limits::kMostHidden) {
    return false;
  }
  outcome.hidden_only = true;
  doubted_since_s_ = -1.0;
  outcome.verdict = rest ? FrameVerdict::kAgrees : FrameVerdict::kDoubtful;
  known_.x = known_.where_it_was();
  known_.in_frame = rest ? known_.memory.in_posture(fit.seen.quadratic) : known_.memory.in_posture();
  if (rest) {
    known_.see_loose_joints();
  } else {
    known_.in_frame.x = known_.x;
  }
  outcome.rms_px = fit.seen.evidence.rms_px();
  outcome.near = rest;
  outcome.best_likelihood = hammoude_likelihood(scorer_.distance(known_.in_frame.x));
  outcome.state = EstimatorState::kConverging;
  return true;
}

/// Nothing explains the frame better so far: the memory stays, the frame is not learned from.
void ArmTracker::stay(const Frame& frame, const OutlineFit& fit, FrameOutcome& outcome) {
  if (doubted_since_s_ < 0.0) doubted_since_s_ = frame.time_s;
  outcome.contradicted = true;
  settle_on(frame, fit, outcome);
  known_.x = known_.where_it_was();
  if (frame.time_s - doubted_since_s_ <= limits::kPatience_s) return;
  outcome.verdict = FrameVerdict::kContradicts;
  outcome.state = EstimatorState::kDiverged;
  if (known_.young()) forget_memory();
}

// --- from frame to frame -----------------------------------------------------------------------

void ArmTracker::spread_particles(const FrameOutcome& outcome) {
  const auto& memory = known_.memory;
  std::optional<Eigen::VectorXd> sd_rad;
  // A young memory that pictures contradict may be the wrong arm's: the search goes on beside it.
  if (!memory.empty() && !(known_.young() && outcome.verdict != FrameVerdict::kAgrees)) {
    sd_rad = memory.estimate().covariance.diagonal().head(model_.state().joints()).cwiseMax(0.0).cwiseSqrt();
  }
  particles_.spread(known_.x, sd_rad);
}

/// Pictures that came between say nothing of what was searched for, or all there is to say: the search would begin
/// anew, and so does what had been in doubt.
void ArmTracker::put_off_searches() {
  round_.reset();
  lost_.reset();
  unexplained_ = false;
  doubted_since_s_ = -1.0;
}

/// What a few pictures taught is contradicted by all that follow: it was theirs, the next frame is searched.
void ArmTracker::forget_memory() {
  put_off_searches();
  known_.memory.forget_all();
  known_.forget_missed();
  fitter_.forget_shape();
  keyframes_.forget();
  gate_.forget_usual();
}

/// Nothing that was learned holds.
void ArmTracker::forget_everything() {
  forget_memory();
  found_in_doubt_ = false;
  known_.forget();
  particles_.restart();
  occlusion_.forget();
  gate_.forget();
}

}  // namespace bodyschema
