#include "bodyschema/bus/synchroniser.hpp"

#include <algorithm>
#include <numeric>

#include "clock_step.hpp"

namespace bodyschema {

std::string_view name_of(DropReason reason) {
  static constexpr std::array<std::string_view, kDropReasonCount> kNames{
      "unpaired",   "no_encoders", "missing_joint", "encoder_gap", "encoder_jump",
      "clock_step", "overload",    "out_of_order",  "duplicate",   "no_mask"};
  return kNames[static_cast<std::size_t>(reason)];
}

std::string_view in_words(DropReason reason) {
  switch (reason) {
    case DropReason::kUnpaired: return "without partner from the other camera";
    case DropReason::kNoEncoders: return "without encoder readings before and after";
    case DropReason::kMissingJoint: return "without readings of a joint";
    case DropReason::kEncoderGap: return "in a gap of the encoder readings";
    case DropReason::kEncoderJump: return "where encoders jumped";
    case DropReason::kClockStep: return "where the clock stepped back";
    case DropReason::kOverload: return "beyond what may wait";
    case DropReason::kOutOfOrder: return "with a stamp before the last one's";
    case DropReason::kDuplicate: return "with the same stamp as another";
    case DropReason::kNoMask: return "whose mask did not come in time";
  }
  return "for another reason";
}

std::uint64_t SynchroniserStatistics::total_dropped() const {
  return std::accumulate(images_dropped.begin(), images_dropped.end(), std::uint64_t{0});
}

Microseconds Synchroniser::Camera::shortest_interval() const {
  // The first few may all be long, pictures being lost: 0, that is any, until enough are known.
  return *std::min_element(intervals.begin(), intervals.end());
}

Microseconds Synchroniser::Instant::utime() const {
  return images[0] ? images[0]->utime : images[1]->utime;
}

std::uint64_t Synchroniser::Instant::count() const {
  return static_cast<std::uint64_t>(images[0].has_value()) + static_cast<std::uint64_t>(images[1].has_value());
}

Synchroniser::Synchroniser(std::vector<std::string> joint_names, const std::map<std::string, double>& fixed_rad,
                           int cameras, const SynchroniserOptions& options)
    : options_(options), history_(std::move(joint_names), fixed_rad, options.joints),
      cameras_(static_cast<std::size_t>(std::clamp(cameras, 1, 2))) {
  options_.camera_wait = std::max(options_.camera_wait, options_.pairing_window);
  options_.max_waiting = std::max(options_.max_waiting, 1);
}

void Synchroniser::add(const JointStateMessage& message) {
  JointHistory::Arrival arrival = history_.add(message);
  if (arrival == JointHistory::Arrival::kOlder && history_.newest() - message.utime > options_.clock_step) {
    if (++older_joints_in_a_row_ >= kStepEvidence) {
      start_anew();
      arrival = history_.add(message);
    }
  }
  switch (arrival) {
    case JointHistory::Arrival::kFresh:
      // Head and arm may come apart: while one's newest stamp lies far ahead by mistake, good messages of the
      // other must not hide that.
      if (history_.newest() - message.utime <= options_.clock_step) older_joints_in_a_row_ = 0;
      ++statistics_.joint_messages;
      newest_joints_ = message.utime;
      resolve(false);
      break;
    case JointHistory::Arrival::kDuplicate: ++statistics_.joint_messages_duplicate; break;
    case JointHistory::Arrival::kOlder: ++statistics_.joint_messages_out_of_order; break;
    case JointHistory::Arrival::kNoKnownJoint: ++statistics_.joint_messages_without_known_joint; break;
  }
}

void Synchroniser::add(std::vector<StampedImage> images) {
  ++group_;
  Microseconds newest = -1;
  for (StampedImage& image : images) {
    if (image.camera < 0 || static_cast<std::size_t>(image.camera) >= cameras_.size()) continue;
    ++statistics_.images;
    Camera& camera = cameras_[static_cast<std::size_t>(image.camera)];
    if (!admit(camera, image.utime)) continue;
    newest = newest < 0 ? image.utime : std::min(newest, image.utime);
    camera.queue.push_back({std::move(image), group_});
    if (camera.queue.size() > static_cast<std::size_t>(options_.max_waiting)) {
      camera.queue.pop_front();
      count_dropped(DropReason::kOverload);
    }
  }
  // That of the last message, not the largest there ever was: a camera that stamped one picture far in the
  // future and died would otherwise make all of the other's too late.
  if (newest >= 0) {
    newest_image_ = newest;
    if (history_.newest() >= 0) statistics_.encoder_lag = newest_image_ - history_.newest();
  }
  pair(false);
  resolve(false);
}

void Synchroniser::add_mask(StampedImage mask) {
  if (!options_.masks || mask.camera < 0 || static_cast<std::size_t>(mask.camera) >= cameras_.size()) return;
  ++statistics_.masks;
  Camera& camera = cameras_[static_cast<std::size_t>(mask.camera)];
  if (mask.utime <= camera.settled && camera.settled - mask.utime <= options_.clock_step) {
    ++statistics_.masks_late;
    return;
  }
  camera.masks.push_back(std::move(mask));
  if (camera.masks.size() > static_cast<std::size_t>(options_.max_waiting)) {
    camera.masks.pop_front();
    ++statistics_.masks_unused;
  }
  resolve(false);
}

std::deque<StampedImage>::iterator Synchroniser::mask_of(const StampedImage& picture) {
  auto& masks = cameras_[static_cast<std::size_t>(picture.camera)].masks;
  return std::find_if(masks.begin(), masks.end(), [&](const StampedImage& m) { return m.utime == picture.utime; });
}

bool Synchroniser::settle_masks(Instant& instant, bool finishing) {
  if (!options_.masks) return true;
  const auto lacks = [&](const std::optional<StampedImage>& picture) {
    return picture && mask_of(*picture) == cameras_[static_cast<std::size_t>(picture->camera)].masks.end();
  };
  if (std::none_of(instant.images.begin(), instant.images.end(), lacks)) return true;
  const Microseconds now = std::max(newest_image_, newest_joints_);
  if (!finishing && now - instant.utime() <= options_.mask_wait) return false;
  for (auto& picture : instant.images) {
    if (!lacks(picture)) continue;
    count_dropped(DropReason::kNoMask);
    settle(*picture);
    picture.reset();
  }
  return true;
}

/// The masks up to this picture's belong to no picture that is still to come.
void Synchroniser::settle(const StampedImage& picture) {
  Camera& camera = cameras_[static_cast<std::size_t>(picture.camera)];
  camera.settled = std::max(camera.settled, picture.utime);
  for (; !camera.masks.empty() && camera.masks.front().utime <= picture.utime; camera.masks.pop_front()) {
    ++statistics_.masks_unused;
  }
}

/// Whether a picture with this stamp may enter its camera's queue.
bool Synchroniser::admit(Camera& camera, Microseconds utime) {
  if (camera.last >= 0 && utime <= camera.last) {
    const bool far = camera.last - utime > options_.clock_step;
    camera.older_in_a_row = far ? camera.older_in_a_row + 1 : 0;
    if (camera.older_in_a_row < kStepEvidence) {
      count_dropped(utime == camera.last ? DropReason::kDuplicate : DropReason::kOutOfOrder);
      return false;
    }
    start_anew();
  }
  if (camera.last >= 0) {
    const Microseconds interval = utime - camera.last;
    camera.intervals[camera.next_interval++ % camera.intervals.size()] = interval;
    if (interval > options_.max_image_gap) ++statistics_.gaps;
  }
  camera.last = utime;
  camera.older_in_a_row = 0;
  return true;
}

/// Moves pictures from the cameras' queues to instants_, as far as their partners are certain.
void Synchroniser::pair(bool finishing) {
  if (cameras_.size() == 1) {
    while (!cameras_[0].queue.empty()) settle_alone(cameras_[0]);
    return;
  }
  while (!cameras_[0].queue.empty() || !cameras_[1].queue.empty()) {
    if (cameras_[0].queue.empty() || cameras_[1].queue.empty()) {
      Camera& present = cameras_[cameras_[0].queue.empty() ? 1 : 0];
      const Microseconds ahead = present.queue.back().image.utime - present.queue.front().image.utime;
      if (!finishing && ahead <= options_.camera_wait) return;
      settle_alone(present);
      continue;
    }
    const bool left_first = cameras_[0].queue.front().image.utime <= cameras_[1].queue.front().image.utime;
    Camera& earlier = cameras_[left_first ? 0 : 1];
    Camera& later = cameras_[left_first ? 1 : 0];
    const QueuedImage& a = earlier.queue.front();
    const QueuedImage& b = later.queue.front();
    const Microseconds apart = b.image.utime - a.image.utime;
    if (apart > options_.pairing_window) {
      settle_alone(earlier);
      continue;
    }
    if (a.group != b.group && apart > 0) {
      // Is the earlier camera's next picture closer to b? Without it, its frame rate tells.
      if (earlier.queue.size() > 1) {
        const Microseconds next_apart = std::abs(earlier.queue[1].image.utime - b.image.utime);
        if (next_apart < apart) {
          settle_alone(earlier);
          continue;
        }
      } else if (!finishing && 2 * apart >= earlier.shortest_interval() &&
                 later.queue.back().image.utime - a.image.utime <= options_.camera_wait) {
        return;
      }
    }
    Instant instant;
    for (std::size_t c = 0; c < 2; ++c) {
      instant.images[c] = std::move(cameras_[c].queue.front().image);
      cameras_[c].queue.pop_front();
    }
    queue_instant(std::move(instant));
  }
}

/// The picture at the head of this camera's queue gets no partner.
void Synchroniser::settle_alone(Camera& camera) {
  StampedImage image = std::move(camera.queue.front().image);
  camera.queue.pop_front();
  if (cameras_.size() > 1 && !options_.allow_mono) {
    count_dropped(DropReason::kUnpaired);
    return;
  }
  Instant instant;
  const auto c = static_cast<std::size_t>(image.camera);
  instant.images[c] = std::move(image);
  queue_instant(std::move(instant));
}

void Synchroniser::queue_instant(Instant instant) {
  instants_.push_back(std::move(instant));
  if (instants_.size() > static_cast<std::size_t>(options_.max_waiting)) {
    drop(instants_.front(), DropReason::kOverload);
    instants_.pop_front();
  }
}

/// Moves instants whose encoders are there to ready_, in order; drops those that must not wait.
void Synchroniser::resolve(bool finishing) {
  using Verdict = JointHistory::Verdict;
  for (; !instants_.empty(); instants_.pop_front()) {
    Instant& instant = instants_.front();
    if (instant.utime() <= last_emitted_) {
      drop(instant, DropReason::kOutOfOrder);
      continue;
    }
    if (!settle_masks(instant, finishing)) return;
    if (instant.count() == 0) continue;  // no mask came
    if (instant.count() < cameras_.size() && !options_.allow_mono) {
      drop(instant, DropReason::kUnpaired);
      continue;
    }
    const Microseconds utime = instant.utime();
    if (utime <= last_emitted_) {  // that of the other camera, the first being left out
      drop(instant, DropReason::kOutOfOrder);
      continue;
    }
    ArrivedObservation arrived;
    arrived.observation.utime = utime;
    arrived.observation.cameras.resize(cameras_.size());
    JointHistory::Answer answer;
    for (std::size_t c = 0; c < cameras_.size() && answer.verdict == Verdict::kReady; ++c) {
      if (!instant.images[c]) continue;
      CameraObservation& camera = arrived.observation.cameras[c].emplace();
      camera.utime = instant.images[c]->utime;
      answer = history_.interpolate(camera.utime, camera.joints);
    }
    // Every joint is "not yet" for a moment; only one that costs an instant is to blame.
    if (answer.verdict != Verdict::kReady && answer.verdict != Verdict::kNotYet) {
      statistics_.blocking_joint = answer.joint;
    }
    switch (answer.verdict) {
      case Verdict::kReady: break;
      case Verdict::kNotYet: {
        if (!finishing && newest_image_ - utime <= options_.encoder_wait) return;
        statistics_.blocking_joint = answer.joint;
        // One joint stopped while others go on, or all encoders are late?
        const bool others_go_on = history_.newest() - history_.newest(answer.joint) > options_.joints.max_gap;
        drop(instant, others_go_on ? DropReason::kMissingJoint : DropReason::kNoEncoders);
        continue;
      }
      case Verdict::kTooOld: drop(instant, DropReason::kNoEncoders); continue;
      case Verdict::kGap: drop(instant, DropReason::kEncoderGap); continue;
      case Verdict::kJump: drop(instant, DropReason::kEncoderJump); continue;
    }
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (!instant.images[c]) continue;
      StampedImage& picture = *instant.images[c];
      CameraObservation& camera = *arrived.observation.cameras[c];
      camera.image = std::move(picture.image);
      arrived.arrival_us = std::max(arrived.arrival_us, picture.arrival_us);
      if (!options_.masks) continue;
      const auto mask = mask_of(picture);
      camera.given_mask = std::move(mask->image);
      arrived.arrival_us = std::max(arrived.arrival_us, mask->arrival_us);
      cameras_[c].masks.erase(mask);
      settle(picture);
    }
    last_emitted_ = utime;
    statistics_.images_used += instant.count();
    ++statistics_.observations;
    if (instant.count() < cameras_.size()) ++statistics_.mono_observations;
    ready_.push_back(std::move(arrived));
    if (ready_.size() > static_cast<std::size_t>(options_.max_waiting)) {
      const auto& shed = ready_.front().observation.cameras;
      const auto images = static_cast<std::uint64_t>(
          std::count_if(shed.begin(), shed.end(), [](const auto& camera) { return camera.has_value(); }));
      statistics_.images_used -= images;
      --statistics_.observations;
      if (images < cameras_.size()) --statistics_.mono_observations;
      count_dropped(DropReason::kOverload, images);
      ready_.pop_front();
    }
  }
}

std::optional<ArrivedObservation> Synchroniser::next() {
  if (ready_.empty()) return std::nullopt;
  std::optional<ArrivedObservation> arrived = std::move(ready_.front());
  ready_.pop_front();
  return arrived;
}

void Synchroniser::finish() {
  pair(true);
  resolve(true);
  for (Camera& camera : cameras_) {
    statistics_.masks_unused += camera.masks.size();
    camera.masks.clear();
  }
}

/// After a clock step nothing seen before can be compared with what comes.
void Synchroniser::start_anew() {
  ++statistics_.clock_steps;
  for (Camera& camera : cameras_) {
    count_dropped(DropReason::kClockStep, camera.queue.size());
    statistics_.masks_unused += camera.masks.size();
    camera = Camera{};
  }
  for (const Instant& instant : instants_) count_dropped(DropReason::kClockStep, instant.count());
  instants_.clear();
  history_.clear();
  newest_image_ = newest_joints_ = last_emitted_ = -1;
  older_joints_in_a_row_ = 0;
}

void Synchroniser::drop(const Instant& instant, DropReason reason) {
  count_dropped(reason, instant.count());
  if (!options_.masks) return;
  for (const auto& picture : instant.images) {
    if (picture) settle(*picture);
  }
}

void Synchroniser::count_dropped(DropReason reason, std::uint64_t images) {
  statistics_.images_dropped[static_cast<std::size_t>(reason)] += images;
}

std::uint64_t Synchroniser::waiting_images() const {
  std::uint64_t waiting = 0;
  for (const Camera& camera : cameras_) waiting += camera.queue.size();
  for (const Instant& instant : instants_) waiting += instant.count();
  return waiting;
}

}  // namespace bodyschema
