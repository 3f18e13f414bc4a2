#include "bodyschema/service/health.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <optional>

#include "bodyschema/geometry/pose.hpp"
#include "bodyschema/pipeline/frozen_picture.hpp"

namespace bodyschema {
namespace {

constexpr double kStale_ms = 1000.0;       // nothing for longer: stale
constexpr double kStuck_ms = 2000.0;       // one frame for longer: the estimator is stuck
constexpr double kCameraDead_ms = 1000.0;  // one camera silent while the other goes on
constexpr double kFrozen_ms = 1000.0;      // the same picture for longer while a joint moved (kFrozenMotion_rad)
constexpr double kDark = 4.0;              // mean brightness below: no light
constexpr double kLateEncoders_ms = 60.0;
constexpr double kErringStamps_ms = 5.0;  // in which an arm of 0.2 m/s moves by 1 mm

std::string age(double ms) {
  return ms < 10'000.0    ? fmt::format("{:.1f} s", 1e-3 * ms)
         : ms < 120'000.0 ? fmt::format("{:.0f} s", 1e-3 * ms)
                          : fmt::format("{:.0f} min", ms / 60'000.0);
}

std::string silence(const std::string& what, const std::string& channel, double age_ms) {
  return age_ms < 0.0 ? fmt::format("no {} yet on {}", what, channel)
                      : fmt::format("no {} on {} for {}", what, channel, age(age_ms));
}

std::string list(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < 3; ++i) text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > 3) text += fmt::format(" and {} more", names.size() - 3);
  return text;
}

/// What is wrong with messages and pictures of the last second that were refused, in plain words.
const char* explain(MessageFault fault) {
  switch (fault) {
    case MessageFault::kWrongType: return "another message type than bot_core's";
    case MessageFault::kTruncated: return "messages are cut short";
    case MessageFault::kTrailingBytes: return "messages are longer than they say";
    case MessageFault::kBadCount: return "a count in them is negative";
    case MessageFault::kTooLarge: return "they are larger than the configuration allows";
    case MessageFault::kBadText: return "a name in them is not text";
    case MessageFault::kBadStamp: return "their time stamp cannot be one";
    case MessageFault::kNotFinite: return "an encoder reports NaN or infinity";
    case MessageFault::kWrongSize: return "a picture has not the size that is configured";
    case MessageFault::kUnsupportedFormat: return "the pixel format is not gray, RGB or JPEG";
    case MessageFault::kBrokenPicture: return "a JPEG picture is broken";
    case MessageFault::kOtherKind: return "a picture is gray where colour is expected, or in colour where gray is";
    case MessageFault::kBadMask: return "a mask has another size than its pictures, or is not gray with 0, 128 and 255";
    case MessageFault::kNone: break;
  }
  return "unknown";
}

std::optional<std::string> refused(const HealthFacts& f) {
  const auto& faults = f.since_last.faults;
  const auto most = std::max_element(faults.begin(), faults.end());
  if (*most == 0) return std::nullopt;
  const auto fault = static_cast<MessageFault>(most - faults.begin());
  return fmt::format("{} messages or pictures refused in the last second: {}", *most, explain(fault));
}

/// What is too large may be refused before it counts as having come.
std::optional<std::string> stale(const HealthFacts& f) {
  const bool pictures = f.picture_age_ms >= 0.0 && f.picture_age_ms < kStale_ms;
  const bool joints = f.joints_age_ms >= 0.0 && f.joints_age_ms < kStale_ms;
  if (pictures && joints) return std::nullopt;
  std::string text = pictures ? "" : silence("pictures", f.cameras_channel, f.picture_age_ms);
  if (!joints) text += (pictures ? "" : "; ") + silence("encoder readings", f.joints_channel, f.joints_age_ms);
  const bool too_large = f.since_last.faults[static_cast<std::size_t>(MessageFault::kTooLarge)] > 0;
  return too_large ? text + "; " + *refused(f) : text;
}

std::optional<std::string> failed(const HealthFacts& f) {
  if (f.failed_since_last == 0) return std::nullopt;
  return fmt::format("{} frames of the last second could not be worked on: {}", f.failed_since_last, f.frame_failure);
}

std::string without_masks(const HealthFacts& f) {
  const auto& s = f.since_last.synchroniser;
  if (s.masks_late > 0) {
    return fmt::format("masks on {} come too late, {} of them (bus.mask_wait_ms)", f.masks_channel, s.masks_late);
  }
  return s.masks == 0 ? fmt::format("no masks come on {}: does the segmentation run?", f.masks_channel)
                      : fmt::format("masks on {} do not carry the stamps of pictures", f.masks_channel);
}

/// Why pictures of the last second did not become estimates.
std::optional<std::string> dropped(const HealthFacts& f) {
  const auto& drops = f.since_last.synchroniser.images_dropped;
  const auto most = std::max_element(drops.begin(), drops.end());
  if (*most == 0) return std::nullopt;
  const std::string pictures = fmt::format("{} pictures of the last second not used: ", *most);
  switch (static_cast<DropReason>(most - drops.begin())) {
    case DropReason::kUnpaired: return pictures + "no partner from the other camera";
    case DropReason::kNoEncoders:
      return f.encoder_lag_ms > 0.0 ? fmt::format("encoders late by {:.0f} ms", f.encoder_lag_ms)
                                    : pictures + "no encoder reading before them";
    case DropReason::kMissingJoint:
      if (!f.missing_joints.empty()) {
        return fmt::format("no reading of {}: publish it or set robot.fixed_joints_deg", list(f.missing_joints));
      }
      return fmt::format("readings of {} have stopped", f.blocking_joint.empty() ? "a joint" : f.blocking_joint);
    case DropReason::kEncoderGap: return pictures + "encoders were silent around them";
    case DropReason::kEncoderJump:
      return f.blocking_joint.empty() ? pictures + "encoders jumped"
                                      : pictures + "the encoder of " + f.blocking_joint + " jumped";
    case DropReason::kClockStep: return std::string("the clock of the time stamps stepped back; started anew");
    case DropReason::kOverload: return pictures + "they come faster than they are worked on";
    case DropReason::kOutOfOrder:
    case DropReason::kDuplicate:
      return fmt::format(
          "{} pictures came twice or out of order in the last second: is there a second publisher on {}?", *most,
          f.cameras_channel);
    case DropReason::kNoMask: return pictures + without_masks(f);
  }
  return std::nullopt;
}

std::optional<std::string> error(const HealthFacts& f) {
  if (f.busy_ms > kStuck_ms) {
    return fmt::format("the estimator has been at work on one frame for {}", age(f.busy_ms));
  }
  if (f.estimated_since_last == 0 && !(f.estimate_age_ms >= 0.0 && f.estimate_age_ms < kStale_ms)) {
    if (const auto why = failed(f)) return why;
    if (const auto why = refused(f)) return why;
    if (f.shed_since_last > 0) {
      return fmt::format("{} frames of the last second shed and none worked on: the machine is overloaded",
                         f.shed_since_last);
    }
    if (const auto why = dropped(f)) return why;
    if (!f.missing_joints.empty()) {
      return fmt::format("no reading of {}: publish it or set robot.fixed_joints_deg", list(f.missing_joints));
    }
    if (f.encoder_lag_ms > kLateEncoders_ms) return fmt::format("encoders late by {:.0f} ms", f.encoder_lag_ms);
    return std::string("pictures and encoders arrive but do not come together yet");
  }
  for (const auto& camera : f.cameras) {
    if (camera.age_ms >= 0.0 && camera.age_ms < kStale_ms && camera.brightness < kDark) {
      return fmt::format("the {} camera's picture is black: is the light on, the lens free?", camera.name);
    }
  }
  if (!f.estimate.stalled_joint.empty()) {
    return fmt::format("the encoder of {} stands still while the pictures show the joint move, by {:.0f} deg so far",
                       f.estimate.stalled_joint, degrees(f.estimate.stalled_motion_rad));
  }
  if (f.estimate.cameras_swapped) {
    return std::string(
        "the left and right pictures are swapped: each shows what the other eye sees; nothing is learned "
        "from them");
  }
  if (f.estimate.state == EstimatorState::kDiverged) {
    return fmt::format("diverged: the best prediction does not fit the pictures (likelihood {:.2f}); searching again",
                       f.estimate.best_likelihood);
  }
  return std::nullopt;
}

std::optional<std::string> camera_warning(const HealthFacts& f) {
  for (const auto& camera : f.cameras) {
    if (camera.age_ms < 0.0 || camera.age_ms > kCameraDead_ms) {
      std::string text = camera.age_ms < 0.0
                             ? fmt::format("nothing yet from the {} camera; working with the other", camera.name)
                             : fmt::format("nothing from the {} camera for {}; working with the other", camera.name,
                                           age(camera.age_ms));
      // Its pictures may come and be of no use.
      auto why = refused(f);
      if (!why) why = dropped(f);
      return why ? text + "; " + *why : text;
    }
    if (is_frozen(camera)) {
      const double moved_deg = degrees(camera.moved_meanwhile_rad);
      return fmt::format("the {} camera has shown the same picture for {} while the arm moved by {:.{}f} deg",
                         camera.name, age(camera.unchanged_ms), moved_deg, moved_deg < 9.95 ? 1 : 0);
    }
  }
  return std::nullopt;
}

/// The background is another one than was learned, because the head has turned.
std::string turned_away(const HealthFacts& f) {
  double turned_rad = 0.0;
  for (const auto& camera : f.cameras) {
    if (camera.age_ms < 0.0 || camera.age_ms >= kStale_ms) continue;
    turned_rad = std::max(turned_rad, camera.background_turned_rad);
  }
  if (turned_rad <= 0.0) return "";
  return fmt::format(
      "the head has turned by {:.1f} deg from where the background was learned, masks are wrong: set "
      "vision.method: auto",
      degrees(turned_rad));
}

std::optional<std::string> warning(const HealthFacts& f) {
  if (f.refused.messages > 0) {
    return fmt::format("{} messages of a second source on {}, {}, refused in the last second", f.refused.messages,
                       f.refused.channel, f.refused.sender);
  }
  if (f.since_last.synchroniser.clock_steps > 0) {
    return std::string("the clock of the time stamps stepped back; started anew");
  }
  if (const auto camera = camera_warning(f)) return camera;
  if (auto turned = turned_away(f); !turned.empty()) return turned;
  if (f.estimate.state == EstimatorState::kLearningBackground) {
    return std::string("learning the background: keep the arm out of view or moving");
  }
  if (f.estimate.state == EstimatorState::kHandNotInView) return std::string("hand not in view");
  if (f.estimate.state == EstimatorState::kOccluded) {
    return std::string("occluded: too little of the hand is seen to say where it is; the offsets are kept");
  }
  if (f.estimate.state == EstimatorState::kModelMisfit) {
    return "do not use the offsets: " + f.estimate.misfit;
  }
  for (const auto& camera : f.cameras) {
    if (camera.mask_px == 0) return fmt::format("mask empty in the {} camera", camera.name);
  }
  if (f.encoder_lag_ms > kLateEncoders_ms) return fmt::format("encoders late by {:.0f} ms", f.encoder_lag_ms);
  const std::uint64_t shed = f.shed_since_last + f.since_last.synchroniser.dropped(DropReason::kOverload);
  if (shed > 0) {
    return fmt::format("{} frames of the last second shed: they come faster than they are worked on", shed);
  }
  if (const auto text = failed(f)) return text;
  if (const auto text = refused(f)) return text;
  if (const auto text = dropped(f)) return text;
  if (!f.engine_change.empty()) return f.engine_change;
  if (!f.reload_failure.empty()) return "reload refused, going on as before: " + f.reload_failure;
  if (f.recording_lost > 0) {
    return fmt::format("{} messages missing in the recording: the disk is too slow", f.recording_lost);
  }
  if (f.estimate.state == EstimatorState::kConverging) {
    return fmt::format("converging: hand known to {:.1f} mm so far; weakest {}", 1e3 * f.estimate.hand_sd_m,
                       f.estimate.weakest.text);
  }
  return std::nullopt;
}

}  // namespace

const char* to_string(HealthLevel level) {
  switch (level) {
    case HealthLevel::kOk: return "OK";
    case HealthLevel::kWarn: return "WARN";
    case HealthLevel::kError: return "ERROR";
    case HealthLevel::kStale: return "STALE";
  }
  return "ERROR";
}

bool is_frozen(const CameraFacts& camera) {
  return camera.unchanged_ms > kFrozen_ms && camera.moved_meanwhile_rad > kFrozenMotion_rad;
}

namespace {
Health verdict(const HealthFacts& facts) {
  if (auto text = stale(facts)) return {HealthLevel::kStale, std::move(*text)};
  if (auto text = error(facts)) return {HealthLevel::kError, std::move(*text)};
  if (auto text = warning(facts)) return {HealthLevel::kWarn, std::move(*text)};
  return {HealthLevel::kOk, fmt::format("converged: hand known to {:.1f} mm; weakest {}",
                                        1e3 * facts.estimate.hand_sd_m, facts.estimate.weakest.text)};
}

/// Words of others may be long and hold line breaks: readers of the status refuse both, and systemd takes what
/// follows a break for another field.
std::string in_one_line(std::string text) {
  constexpr std::size_t kLongest = 1000;
  if (text.size() > kLongest) {
    std::size_t end = kLongest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // not within a character
    text.resize(end);
    text += " ...";
  }
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return text;
}
}  // namespace

Health assess(const HealthFacts& facts) {
  Health health = verdict(facts);
  // Said beside what it brings about: estimates that diverge, an arm not found.
  if (const std::string turned = turned_away(facts);
      !turned.empty() && health.sentence != turned && health.level != HealthLevel::kStale) {
    health.sentence += "; " + turned;
  }
  // What is left out of the evidence is said beside what the rest gives.
  if (const std::string hidden = facts.estimate.hidden.text(); !hidden.empty() && health.level <= HealthLevel::kWarn) {
    health.sentence += "; " + hidden;
  }
  // An arm that moves is known no better than its pictures' times, whatever else is known.
  if (const double err_ms = 1e3 * facts.estimate.stamp_sd_s;
      err_ms > kErringStamps_ms && health.level != HealthLevel::kStale) {
    health.sentence += fmt::format("; pictures are taken {:.0f} ms before or after their stamps", err_ms);
    health.level = std::max(health.level, HealthLevel::kWarn);
  }
  // What is wrong beside the offsets is said beside whatever is said of them.
  std::string found;
  for (const auto& cause : facts.estimate.findings.causes) {
    if (!cause.estimated) found += (found.empty() ? "" : "; ") + cause.text();
  }
  // What a file should say is named although it is taken into account.
  for (const auto& cause : facts.estimate.findings.causes) {
    if (cause.estimated && cause.effect == "distortion") health.sentence += "; taken into account: " + cause.sentence;
  }
  if (!found.empty() && health.level != HealthLevel::kStale) {
    health.sentence += "; the pictures ask for: " + found;
    health.level = std::max(health.level, HealthLevel::kWarn);
  }
  // A file that ends is said beside whatever else there is to say: it would not be missed otherwise until
  // it is needed.
  const auto add = [&](const char* what, const std::string& failure) {
    if (failure.empty()) return;
    health.sentence += fmt::format("; {}: {}", what, failure);
    health.level = std::max(health.level, HealthLevel::kWarn);
  };
  add("recording has ended", facts.recording_failure);
  add("writing of estimates has ended", facts.estimates_failure);
  health.sentence = in_one_line(std::move(health.sentence));
  return health;
}

}  // namespace bodyschema
