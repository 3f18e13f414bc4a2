#include "bodyschema/bus/observation_stream.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "bodyschema/core/error.hpp"
#include "bodyschema/robot/forward_kinematics.hpp"

namespace bodyschema {

namespace {

constexpr std::chrono::seconds kQuietTime{5};
/// Pictures in a row that make another kind of camera believed: ten seconds at 30 Hz.
constexpr int kAnotherCamera = 300;
/// Encoder samples that wait for an observation: four seconds at 1 kHz.
constexpr std::size_t kMostEncoders = 4096;

std::vector<std::string> joint_names(const RobotModel& robot) {
  std::vector<std::string> names;
  for (const JointInfo& joint : robot.joints()) names.push_back(joint.name);
  return names;
}

/// Values of the joints that need not be published: those the configuration fixes, and idle ones.
std::map<std::string, double> resting_joints(const RobotModel& robot, const RobotSetup& setup,
                                             const std::set<std::string>& idle) {
  const Eigen::VectorXd q = setup.default_joints(robot);
  std::map<std::string, double> resting = setup.fixed_joints_rad;
  resting.insert(setup.fixed_joints_m.begin(), setup.fixed_joints_m.end());
  for (const std::string& name : idle) resting.emplace(name, q[robot.joint_index(name)]);
  return resting;
}

BusOptions with_idle_joints(BusOptions options, std::set<std::string> idle) {
  options.synchroniser.joints.idle_joints = std::move(idle);
  return options;
}

}  // namespace

std::set<std::string> idle_joints(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                  const StereoRig& rig) {
  std::vector<std::string> links = setup.model.rendered_links;
  links.push_back(setup.hand_link);
  links.insert(links.end(), setup.fingertip_links.begin(), setup.fingertip_links.end());
  for (const CameraModel& camera : rig.cameras) links.push_back(camera.link);
  const ForwardKinematics kinematics(robot, links);
  std::set<std::string> idle;
  for (Eigen::Index j = 0; j < robot->joint_count(); ++j) {
    bool matters = false;
    for (std::size_t link = 0; link < links.size() && !matters; ++link) matters = kinematics.moves(j, link);
    if (!matters) idle.insert(robot->joints()[static_cast<std::size_t>(j)].name);
  }
  return idle;
}

std::vector<std::pair<std::string, std::uint64_t>> BusStatistics::counters() const {
  std::vector<std::pair<std::string, std::uint64_t>> list;
  for (std::size_t i = 1; i < kMessageFaultCount; ++i) {
    list.emplace_back("malformed." + std::string(name_of(static_cast<MessageFault>(i))), faults[i]);
  }
  for (std::size_t i = 0; i < kDropReasonCount; ++i) {
    list.emplace_back("dropped." + std::string(name_of(static_cast<DropReason>(i))), synchroniser.images_dropped[i]);
  }
  list.emplace_back("masks.late", synchroniser.masks_late);
  list.emplace_back("masks.unused", synchroniser.masks_unused);
  list.emplace_back("joint_state.duplicate", synchroniser.joint_messages_duplicate);
  list.emplace_back("joint_state.out_of_order", synchroniser.joint_messages_out_of_order);
  list.emplace_back("joint_state.no_known_joint", synchroniser.joint_messages_without_known_joint);
  list.emplace_back("lost.queue", lost_in_queue);
  list.emplace_back("lost.incomplete", lost_incomplete);
  list.emplace_back("clock_steps", synchroniser.clock_steps);
  return list;
}

std::string BusStatistics::lost_pictures(double tolerable_share) const {
  std::vector<std::pair<std::uint64_t, std::string_view>> reasons;
  std::uint64_t lost = 0;
  const auto add = [&](std::uint64_t count, std::string_view why) {
    if (count > 0) reasons.emplace_back(count, why);
    lost += count;
  };
  for (std::size_t i = 0; i < kDropReasonCount; ++i) {
    add(synchroniser.images_dropped[i], in_words(static_cast<DropReason>(i)));
  }
  std::uint64_t of_pictures = 0;  // the other faults may be of encoder messages as well
  for (const auto& [fault, why] : {std::pair{MessageFault::kWrongSize, "of another size than configured"},
                                   {MessageFault::kUnsupportedFormat, "not gray, RGB or JPEG"},
                                   {MessageFault::kBrokenPicture, "a broken JPEG"},
                                   {MessageFault::kOtherKind, "gray among coloured ones or the reverse"}}) {
    const auto count = std::min(faults[static_cast<std::size_t>(fault)], images_malformed - of_pictures);
    add(count, why);
    of_pictures += count;
  }
  add(images_malformed - of_pictures, "malformed");
  const std::uint64_t all = synchroniser.images + images_malformed;
  if (all == 0 || static_cast<double>(lost) <= tolerable_share * static_cast<double>(all)) return "";
  std::stable_sort(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text = std::to_string(lost) + " of " + std::to_string(all) + " pictures are not used: ";
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    text += (i > 0 ? ", " : "") + std::to_string(reasons[i].first) + " " + std::string(reasons[i].second);
  }
  return text;
}

ObservationStream::ObservationStream(const std::vector<std::string>& joint_names,
                                     const std::map<std::string, double>& fixed_rad,
                                     const std::vector<CameraModel>& cameras, const BusOptions& options)
    : options_(options), channels_(options.channels()),
      synchroniser_(joint_names, fixed_rad, static_cast<int>(cameras.size()), options.synchroniser),
      assembler_(joint_names, fixed_rad, options.synchroniser.clock_step, options.synchroniser.joints.idle_joints) {
  for (const CameraModel& camera : cameras) {
    if (cameras.size() > 2 || (!cameras_.empty() && camera.number() <= cameras_.front().type)) {
      throw ConfigurationError("cameras: '" + camera.name +
                               "': a rig is one camera or two, the one with the smaller number in messages first");
    }
    cameras_.push_back(
        {camera.name, camera.number(), camera.intrinsics.width, camera.intrinsics.height, 1, 0, false, 0});
  }
}

ObservationStream::ObservationStream(const std::shared_ptr<const RobotModel>& robot, const RobotSetup& setup,
                                     const StereoRig& rig, const BusOptions& options)
    : ObservationStream(*robot, setup, rig.cameras, with_idle_joints(options, idle_joints(robot, setup, rig))) {}

ObservationStream::ObservationStream(const RobotModel& robot, const RobotSetup& setup,
                                     const std::vector<CameraModel>& cameras, const BusOptions& options)
    : ObservationStream(joint_names(robot), resting_joints(robot, setup, options.synchroniser.joints.idle_joints),
                        cameras, options) {}

bool ObservationStream::receive(std::string_view channel, Bytes message, std::int64_t arrival_us) {
  if (channel == channels_.joint_state) {
    ++statistics_.messages;
    receive_joints(message);
    return true;
  }
  if (channel == channels_.cameras) {
    ++statistics_.messages;
    receive_images(message, arrival_us);
    return true;
  }
  if (expects_masks() && channel == channels_.masks) {
    ++statistics_.messages;
    receive_masks(message, arrival_us);
    return true;
  }
  return false;
}

void ObservationStream::receive_joints(Bytes message) {
  const DecodeResult result = decode(message, joint_state_, options_.limits);
  if (!result.ok()) {
    ++statistics_.messages_malformed;
    return refuse(channels_.joint_state, result);
  }
  synchroniser_.add(joint_state_);
  keep_encoders();
}

/// Samples go on where the synchroniser's do, clock steps included; and back where a stamp lay so far ahead by mistake
/// that its sample would be the last for long.
void ObservationStream::keep_encoders() {
  if (const auto steps = synchroniser_.statistics().clock_steps; steps != clock_steps_) {
    clock_steps_ = steps;
    assembler_.forget();
    encoders_.clear();
    encoders_begin_anew_ = true;
    kept_ = -1;
  }
  const JointSample* sample = assembler_.take(joint_state_);
  if (sample == nullptr) return;
  if (sample->utime < kept_) {
    encoders_.clear();
    encoders_begin_anew_ = true;
  }
  kept_ = sample->utime;
  if (!encoders_.empty() && encoders_.back().utime == sample->utime) {
    encoders_.back() = *sample;  // head and arm apart, with one stamp
    return;
  }
  // Without pictures nobody takes them: the older half is given up.
  if (encoders_.size() >= kMostEncoders) {
    encoders_.erase(encoders_.begin(), encoders_.begin() + static_cast<std::ptrdiff_t>(kMostEncoders / 2));
  }
  encoders_.push_back(*sample);
}

std::optional<ArrivedObservation> ObservationStream::next() {
  auto arrived = synchroniser_.next();
  if (arrived) {
    arrived->observation.encoders = std::exchange(encoders_, {});
    arrived->observation.encoders_begin_anew = std::exchange(encoders_begin_anew_, false);
  }
  return arrived;
}

void ObservationStream::receive_images(Bytes message, std::int64_t arrival_us) {
  const DecodeResult result = decode(message, images_, options_.limits);
  if (!result.ok()) {
    ++statistics_.messages_malformed;
    return refuse(channels_.cameras, result);
  }
  std::vector<StampedImage> images;
  for (const ImageView& view : images_.images) {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      CameraFormat& camera = cameras_[c];
      if (view.type != camera.type) continue;
      StampedImage image;
      DecodeResult unpacked;
      if (view.width != camera.width || view.height != camera.height) {
        unpacked = {MessageFault::kWrongSize, "picture of " + std::to_string(view.width) + "x" +
                                                  std::to_string(view.height) + ", configured are " +
                                                  std::to_string(camera.width) + "x" + std::to_string(camera.height)};
      } else {
        unpacked = unpack(view, image.image, options_.limits, camera.reduction);
        if (unpacked.ok()) unpacked = admit_kind(camera, image.image.channels);
      }
      if (!unpacked.ok()) {
        ++statistics_.images_malformed;
        refuse(channels_.cameras + " " + camera.name, unpacked);
        continue;
      }
      image.camera = static_cast<int>(c);
      image.utime = view.utime;
      image.arrival_us = arrival_us;
      images.push_back(std::move(image));
    }
  }
  const std::uint64_t missing_before = synchroniser_.statistics().dropped(DropReason::kMissingJoint);
  synchroniser_.add(std::move(images));
  if (synchroniser_.statistics().dropped(DropReason::kMissingJoint) > missing_before) warn_of_missing_joints();
}

void ObservationStream::receive_masks(Bytes message, std::int64_t arrival_us) {
  const DecodeResult result = decode(message, images_, options_.limits);
  if (!result.ok()) {
    ++statistics_.messages_malformed;
    return refuse(channels_.masks, result);
  }
  for (const ImageView& view : images_.images) {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      const CameraFormat& camera = cameras_[c];
      if (view.type != camera.type) continue;
      StampedImage mask;
      DecodeResult unpacked;
      if (view.width != camera.width || view.height != camera.height) {
        unpacked = {MessageFault::kBadMask, "mask of " + std::to_string(view.width) + "x" +
                                                std::to_string(view.height) + ", its pictures are " +
                                                std::to_string(camera.width) + "x" + std::to_string(camera.height)};
      } else if (view.pixelformat == bot_core::image_t::PIXEL_FORMAT_MJPEG) {
        unpacked = {MessageFault::kBadMask, "mask as JPEG, which changes its values; expected raw gray"};
      } else {
        unpacked = unpack(view, mask.image, options_.limits);
        if (unpacked.ok()) unpacked = to_mask(mask.image);
      }
      if (!unpacked.ok()) {
        refuse(channels_.masks + " " + camera.name, {MessageFault::kBadMask, unpacked.detail});
        continue;
      }
      mask.camera = static_cast<int>(c);
      mask.utime = view.utime;
      mask.arrival_us = arrival_us;
      synchroniser_.add_mask(std::move(mask));
    }
  }
}

void ObservationStream::expect_channels(std::size_t camera, int channels) {
  cameras_.at(camera).channels = channels;
  cameras_.at(camera).channels_given = true;
}

void ObservationStream::reduce(std::size_t camera, int reduction) {
  cameras_.at(camera).reduction = reduction;
}

/// Backgrounds are learned of one kind of picture. A stray picture of another kind must not end that; a
/// camera that was exchanged must not be refused for ever.
DecodeResult ObservationStream::admit_kind(CameraFormat& camera, int channels) {
  if (camera.channels != 0 && channels != camera.channels) {
    if (camera.channels_given || ++camera.other_kind_in_a_row < kAnotherCamera) {
      return {MessageFault::kOtherKind,
              channels == 1 ? "gray where colour is expected" : "in colour where gray is expected"};
    }
    spdlog::warn("the {} camera's pictures are now {}", camera.name, channels == 1 ? "gray" : "in colour");
  }
  camera.channels = channels;
  camera.other_kind_in_a_row = 0;
  return {};
}

void ObservationStream::finish() {
  const std::uint64_t missing_before = synchroniser_.statistics().dropped(DropReason::kMissingJoint);
  synchroniser_.finish();
  if (synchroniser_.statistics().dropped(DropReason::kMissingJoint) > missing_before) warn_of_missing_joints();
}

BusStatistics ObservationStream::statistics() const {
  BusStatistics statistics = statistics_;
  statistics.synchroniser = synchroniser_.statistics();
  return statistics;
}

bool ObservationStream::may_complain(Complaint& complaint) {
  const auto now = std::chrono::steady_clock::now();
  if (complaint.last != std::chrono::steady_clock::time_point{} && now - complaint.last < kQuietTime) {
    ++complaint.held_back;
    return false;
  }
  complaint.last = now;
  return true;
}

void ObservationStream::refuse(const std::string& source, const DecodeResult& result) {
  ++statistics_.faults[static_cast<std::size_t>(result.fault)];
  Complaint& complaint = complaints_[{source, result.fault}];
  if (!may_complain(complaint)) return;
  spdlog::warn("{}: skipped, {}: {}{}", source, name_of(result.fault), result.detail,
               complaint.held_back > 0 ? " (and " + std::to_string(complaint.held_back) + " more like it)" : "");
  complaint.held_back = 0;
}

void ObservationStream::warn_of_missing_joints() {
  if (!may_complain(missing_joints_)) return;
  const auto& joints = synchroniser_.joints();
  const auto never = joints.missing_joints();
  if (!never.empty()) {
    std::string list;
    for (const std::string& name : never) list += (list.empty() ? "" : ", ") + name;
    spdlog::warn("{}: no reading of {}; publish it or give it a value under robot.fixed_joints_deg",
                 channels_.joint_state, list);
  } else if (const auto joint = synchroniser_.statistics().blocking_joint; joint >= 0) {
    spdlog::warn("{}: readings of {} have stopped", channels_.joint_state,
                 joints.joint_names()[static_cast<std::size_t>(joint)]);
  }
}

}  // namespace bodyschema
