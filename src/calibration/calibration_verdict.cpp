#include "calibration_verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bodyschema/pipeline/silhouette_preview.hpp"
#include "limits.hpp"

namespace bodyschema {
namespace {

namespace limits = calibration::limits;

/// Names of those joints, behind a few words; empty where there is none.
template <class Which>
std::string listed(const std::vector<CalibratedJoint>& joints, const char* words, const Which& which) {
  std::string names;
  for (const auto& joint : joints) {
    if (which(joint)) names += (names.empty() ? words : ", ") + joint.name;
  }
  return names;
}

/// Why a result is not good.
struct Objection {
  CalibrationState state;
  std::string sentence;
};

/// Whether pictures and model were brought together, and in one way alone.
std::optional<Objection> objection_of_outlines(const BatchFit& batch, const Doubts& doubts, double unit_px,
                                               const Calibration& result) {
  const auto& found = doubts.found;
  if (found.share < limits::kLeastFound || found.seen < limits::kLeastSeen) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format("Not converged: {:.0f} % of the predicted outline lies near an edge of the robot in the "
                    "pictures, expected at least {:.0f} %; check masks, joint angles (order, sign, unit), robot and "
                    "cameras' intrinsics.",
                    100.0 * found.share * found.seen, 100.0 * limits::kLeastFound)};
  }
  if (const double rms = batch.noise().front().sd_px(); rms > limits::kNear_px) {
    return Objection{CalibrationState::kNotConverged,
                     fmt::format("Not converged: outlines that are found lie {:.1f} px off, expected at most {:.1f}; "
                                 "check masks, joint angles (order, sign, unit), robot and cameras' intrinsics.",
                                 rms * unit_px, limits::kNear_px * unit_px)};
  }
  // That nothing fits is said of many robots; this says why.
  if (!doubts.implausible.empty()) {
    return Objection{CalibrationState::kModelMisfit,
                     "Model misfit: no robot is so wrong as the pictures ask for (" + doubts.implausible +
                         "); something else is wrong with robot or cameras, or less is known of them than is believed "
                         "(estimator.state)."};
  }
  if (!doubts.helps) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format(
            "Not converged: on postures left out of the fit outlines lie {:.1f} px off on average, no nearer than "
            "with robot and cameras as they are configured; nothing of it is to be applied. Check masks, and that "
            "joint "
            "angles (joints.csv of photographs) are right and those of their pictures.",
            doubts.heldout_mean_px)};
  }
  const double after_px = result.outline_px.after / unit_px;
  if (doubts.own_masks && after_px > limits::kOwnMasks_px) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format("Not converged: the masks were made about a prediction of the robot and lie {:.1f} px off "
                    "the result, so that one of the two is wrong; give masks (vision.method: given) or say "
                    "better where the cameras are.",
                    result.outline_px.after)};
  }
  if (!doubts.unsettled.empty()) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format("Not converged: without masks the answer depends on how far from the prediction the robot's "
                    "outline is looked for ({} moves by more than {:.0f} standard deviations); record more "
                    "postures, or give masks (vision.method: given).",
                    doubts.unsettled, limits::kSettled_sd)};
  }
  if (doubts.rival < limits::kOnly) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format("Not converged: another place of the camera explains the pictures nearly as well (misfit "
                    "{:.2f} times as large); record more postures.",
                    doubts.rival)};
  }
  return std::nullopt;
}

/// Whether postures agree, on something that may be.
std::optional<Objection> objection_of_postures(const BatchFit& batch, const Doubts& doubts, std::ptrdiff_t told,
                                               double unit_px, const Calibration& result) {
  if (result.postures < limits::kFewestPostures) {
    return Objection{
        CalibrationState::kNotConverged,
        fmt::format("Not converged: {} distinct postures cannot contradict each other; record at least {}.",
                    result.postures, limits::kFewestPostures)};
  }
  if (const auto wrong = beyond_belief(batch); !wrong.empty()) return Objection{CalibrationState::kModelMisfit, wrong};
  if (result.dispersion > limits::kDisagreement) {
    return Objection{
        CalibrationState::kModelMisfit,
        fmt::format("Model misfit: postures disagree by {:.1f} times what is claimed; run bodyschema diagnose "
                    "on a moving log, and look at the overlays for masks that are wrong.",
                    std::sqrt(result.dispersion))};
  }
  const auto& outlines = result.outline_px;
  const double more_px = outlines.heldout ? *outlines.heldout - outlines.after : 0.0;
  if (more_px > std::max((limits::kContradict - 1.0) * outlines.after, limits::kSame_px * unit_px)) {
    return Objection{CalibrationState::kModelMisfit,
                     fmt::format("Model misfit: outlines of postures left out of the fit lie {:.1f} px off, those of "
                                 "the fit {:.1f}: postures contradict each other; was a camera moved, or are joint "
                                 "angles those of another picture?",
                                 *outlines.heldout, outlines.after)};
  }
  const Eigen::VectorXd innovation = batch.memory().belief_innovation();
  std::size_t scattered = 0;  // most, against what was believed
  const auto spread = [&](std::size_t k) {
    return result.joints[k].seen_sd_rad / batch.state().prior_sd()[static_cast<Eigen::Index>(k)];
  };
  for (std::size_t k = 1; k < result.joints.size(); ++k) {
    if (spread(k) > spread(scattered)) scattered = k;
  }
  if (!result.joints.empty() && spread(scattered) > limits::kScattered) {
    const auto& joint = result.joints[scattered];
    return Objection{CalibrationState::kModelMisfit,
                     fmt::format("Model misfit: parts of the log put {} {:.0f} deg and more apart, further than is "
                                 "believed possible; is its sign, or where it is zero, another than the URDF's?",
                                 joint.name, degrees(joint.seen_sd_rad))};
  }
  for (std::size_t k = 0; k < result.joints.size(); ++k) {
    const auto& joint = result.joints[k];
    const auto at = static_cast<Eigen::Index>(k);
    if (joint.told || !joint.applied || std::abs(innovation[at]) <= limits::kFarUntold_sd) continue;
    return Objection{CalibrationState::kModelMisfit,
                     fmt::format("Model misfit: the pictures ask for {:.0f} deg in {} and hardly tell it; is its sign, "
                                 "or where it is zero, another than the URDF's?",
                                 degrees(joint.offset_rad), joint.name)};
  }
  const bool covered = !doubts.own_masks && doubts.found.hand_covered > limits::kCovered;
  if (doubts.found.hand_is_lost && !covered) {
    return Objection{CalibrationState::kNotConverged,
                     "Not converged: next to nothing of the hand's outline is found, so that no picture shows where it "
                     "is; is it hidden, not on this robot, or turned by a joint whose sign or zero is another than the "
                     "URDF's?"};
  }
  if (told == 0) {
    return Objection{CalibrationState::kNotConverged,
                     "Not converged: the pictures tell no joint's offset; record postures that differ more."};
  }
  return std::nullopt;
}

/// How much of where some parts are predicted the masks show robot.
double covered_share(const PictureLog& log, const BatchFit& batch, std::span<const std::size_t> pictures,
                     const std::vector<bool>& parts) {
  SilhouettePreview preview(log);
  double predicted = 0.0, covered = 0.0;
  for (const auto p : pictures) {
    const auto& picture = log.pictures()[p];
    BinaryMask there = preview.draw_parts(picture.joints.q, batch.at().corrections[p], picture.camera, parts);
    predicted += static_cast<double>(there.count());
    there &= picture.mask;
    covered += static_cast<double>(there.count());
  }
  return covered / std::max(1.0, predicted);
}

}  // namespace

FoundOutlines found_outlines(LogFit& fit, const BatchFit& batch, std::span<const std::size_t> pictures,
                             const std::vector<bool>& loose) {
  const auto& log = fit.log();
  const auto& links = log.setup().model.rendered_links;
  const auto shown = log.parts_shown();
  FoundOutlines result;
  struct Outline {
    double sampled = 0.0, matched = 0.0;
    [[nodiscard]] bool is_lost() const { return matched < limits::kHardlyFound * sampled; }
    void add(const Outline& other) {
      sampled += other.sampled;
      matched += other.matched;
    }
  } all, seen, hand;
  std::vector<bool> of_hand(links.size(), false);
  OutlineEvidence evidence;
  for (const auto& segment : log.roles().segments) {
    for (const auto part : segment.parts) {
      if (!shown[part] || (!loose.empty() && loose[part])) continue;
      Outline own;
      for (const auto p : pictures) {
        const auto& picture = log.pictures()[p];
        auto search = batch.search();
        search.part_weight.assign(links.size(), 0.0);
        search.part_weight[part] = 1.0;
        fit.measurement().linearise(log.edges(p), picture.joints.q, batch.at().corrections[p], picture.camera, {},
                                    search, evidence);
        own.add({evidence.sampled, evidence.matched});
      }
      all.add(own);
      if (segment.name == log.setup().hand_link) {
        hand.add(own);
        of_hand[part] = true;
      }
      if (own.is_lost()) {
        result.lost.push_back(links[part]);
      } else {
        seen.add(own);
      }
    }
  }
  result.hand_is_lost = hand.is_lost();
  if (result.hand_is_lost) result.hand_covered = covered_share(log, batch, pictures, of_hand);
  result.share = seen.matched / std::max(1.0, seen.sampled);
  result.seen = seen.sampled / std::max(1.0, all.sampled);
  return result;
}

std::string beyond_belief(const BatchFit& batch) {
  const auto& state = batch.state();
  const auto& layout = batch.memory().layout();
  const auto& known = batch.memory().estimate();
  const Eigen::VectorXd innovation = batch.memory().belief_innovation();
  Eigen::Index worst = -1;
  for (Eigen::Index k = state.joints(); k < state.size(); ++k) {
    const bool moved = std::abs(known.x[k] - layout.prior_mean[k]) > layout.prior_sd[k];
    if (!moved || std::abs(innovation[k]) <= limits::kBeyondBelief_sd) continue;
    if (worst < 0 || std::abs(innovation[k]) > std::abs(innovation[worst])) worst = k;
  }
  if (worst < 0) return {};
  const auto& p = state.parameters()[static_cast<std::size_t>(worst)];
  // The belief holds back what pictures hardly tell; without it they ask for this.
  const double variance = std::pow(layout.prior_sd[worst], 2);
  const double asked = (known.x[worst] - layout.prior_mean[worst]) * variance / (variance - known.own(worst, worst));
  return fmt::format(
      "Model misfit: the pictures ask for {} {:.3g} {}, {:.0f} times what is believed possible; it is further off "
      "than that (estimator.state and the cameras' pose_sd_mm and pose_sd_deg say what is believed), or something "
      "else is wrong with robot or cameras.",
      p.name, (layout.prior_mean[worst] + asked) / p.si_per_unit, p.unit, std::abs(asked) / layout.prior_sd[worst]);
}

void judge(const BatchFit& batch, const Doubts& doubts, double unit_px, Calibration& result) {
  for (const auto& joint : result.joints) {
    if (!joint.told) result.remarks.push_back(joint.name + ": " + joint.untold_why);
  }
  for (const auto& link : doubts.found.lost) {
    result.remarks.push_back(link + ": next to nothing of its outline is found; hidden, or part of the background");
  }
  const auto told =
      std::count_if(result.joints.begin(), result.joints.end(), [](const auto& joint) { return joint.told; });
  auto objection = objection_of_outlines(batch, doubts, unit_px, result);
  if (!objection) objection = objection_of_postures(batch, doubts, told, unit_px, result);
  if (objection) {
    result.state = objection->state;
    result.sentence = std::move(objection->sentence);
    return;
  }
  result.state = CalibrationState::kGood;
  result.sentence = fmt::format(
      "Good: {} of {} joints told; the hand is known to {:.1f} mm in the camera's frame (one sigma){}{}.", told,
      result.joints.size(), 1e3 * result.hand_sd_m,
      listed(result.joints, "; not told, and not to be applied: ", [](const auto& j) { return !j.applied; }),
      listed(result.joints, "; hardly told, and to be applied with the rest all the same: ", [](const auto& j) {
        return j.applied && !j.told;
      }));
}

}  // namespace bodyschema
