#include "bodyschema/simulator/recording.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema::simulator {
namespace {

using Json = nlohmann::ordered_json;

/// From the end of the exposure to the message: reading out and sending a picture.
constexpr Microseconds kPictureTransfer = 6'000;
constexpr Microseconds kEncoderTransfer = 500;

Image to_gray(const Image& rgb) {
  Image gray(rgb.width, rgb.height, 1);
  for (std::size_t i = 0; i < gray.data.size(); ++i) {
    const auto* p = rgb.data.data() + 3 * i;
    gray.data[i] = static_cast<std::uint8_t>((299 * p[0] + 587 * p[1] + 114 * p[2] + 500) / 1000);
  }
  return gray;
}

/// White where the robot is, black elsewhere, gray where a pixel is shared.
Image mask_picture(const CameraFrame& camera) {
  Image gray(camera.silhouette.width(), camera.silhouette.height(), 1);
  gray.data = camera.coverage;
  return gray;
}

/// What the camera compressed, not to be compressed again.
bot_core::image_t sent_jpeg(const CameraFrame& camera, Microseconds utime) {
  bot_core::image_t message;
  message.data = camera.jpeg;
  message.utime = utime;
  message.width = camera.image.width;
  message.height = camera.image.height;
  message.row_stride = 0;
  message.pixelformat = bot_core::image_t::PIXEL_FORMAT_MJPEG;
  message.size = static_cast<std::int32_t>(message.data.size());
  message.nmetadata = 0;
  return message;
}

double rounded(double value, double per_unit) {
  return std::round(value * per_unit) / per_unit;
}

Json rows(const Pose& pose) {
  Json matrix = Json::array();
  for (int r = 0; r < 4; ++r) {
    Json row = Json::array();
    for (int c = 0; c < 4; ++c) row.push_back(pose.matrix()(r, c));
    matrix.push_back(std::move(row));
  }
  return matrix;
}

template <class Points>
Json list(const Points& points) {
  Json result = Json::array();
  for (const auto& point : points) {
    Json one = Json::array();
    for (Eigen::Index k = 0; k < point.size(); ++k) one.push_back(rounded(point[k], 1e7));
    result.push_back(std::move(one));
  }
  return result;
}

Json describe(const FaultSpec& spec) {
  const FaultKind& kind = fault_kind(spec.name);
  Json fault = {{"name", spec.name}, {"parameter", kind.parameter}, {"unit", kind.unit}, {"value", spec.value()}};
  for (const auto& [key, text] : spec.arguments) {
    if (key == "value") continue;
    double number = 0.0;
    const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
    if (result.ec == std::errc() && result.ptr == text.data() + text.size()) {
      fault[key] = number;
    } else {
      fault[key] = text;
    }
  }
  return fault;
}

}  // namespace

FramePublisher::FramePublisher(std::vector<std::string> joint_names, Options options)
    : joint_names_(std::move(joint_names)), options_(std::move(options)) {}

bool FramePublisher::publish(const SimulatedFrame& frame, MessageSink& sink, const Pacer& pacer) {
  bot_core::images_t images;
  images.utime = frame.utime + options_.utime_shift;
  Microseconds last_shutter = 0;
  for (std::size_t c = 0; c < frame.cameras.size(); ++c) {
    if (!frame.cameras[c]) continue;
    const CameraFrame& camera = *frame.cameras[c];
    const Microseconds utime = camera.utime + options_.utime_shift;
    last_shutter = std::max(last_shutter, camera.utime);
    images.image_types.push_back(static_cast<std::int16_t>(camera.number));
    switch (options_.format) {
      case PictureFormat::kMasks: images.images.push_back(to_message(mask_picture(camera), utime)); break;
      case PictureFormat::kRgb:
        images.images.push_back(camera.jpeg.empty() ? to_message(camera.image, utime) : sent_jpeg(camera, utime));
        break;
      case PictureFormat::kGray: images.images.push_back(to_message(to_gray(camera.image), utime)); break;
      case PictureFormat::kJpeg:
        images.images.push_back(camera.jpeg.empty() ? to_jpeg_message(camera.image, utime, options_.jpeg_quality)
                                                    : sent_jpeg(camera, utime));
        break;
    }
  }
  images.n_images = static_cast<std::int32_t>(images.images.size());

  bool pictures_sent = images.images.empty();
  const Microseconds pictures_due = last_shutter + kPictureTransfer;
  const auto send_pictures = [&] {
    pictures_sent = true;
    if (pacer && !pacer(pictures_due)) return false;
    sink.publish_message(options_.channels.cameras, pictures_due + options_.utime_shift, images);
    return true;
  };
  for (const JointSample& sample : frame.encoders) {
    const Microseconds due = sample.utime + kEncoderTransfer;
    if (!pictures_sent && pictures_due < due && !send_pictures()) return false;
    if (pacer && !pacer(due)) return false;
    bot_core::joint_state_t message;
    message.utime = sample.utime + options_.utime_shift;
    message.num_joints = static_cast<std::int16_t>(joint_names_.size());
    message.joint_name = joint_names_;
    for (Eigen::Index j = 0; j < sample.q.size(); ++j) {
      message.joint_position.push_back(static_cast<float>(sample.q[j]));
      message.joint_velocity.push_back(static_cast<float>(sample.qdot[j]));
      message.joint_effort.push_back(0.0f);
    }
    sink.publish_message(options_.channels.joint_state, due + options_.utime_shift, message);
  }
  return pictures_sent || send_pictures();
}

TruthWriter::TruthWriter(std::filesystem::path file, const Simulator& simulator, const RobotSetup& setup,
                         Microseconds utime_shift)
    : file_(std::move(file)), stream_(open_to_write(file_)), joint_names_(simulator.joint_names()),
      utime_shift_(utime_shift), hides_(simulator.has_things()) {
  const SimulationPlan& plan = simulator.plan();
  const TrueRobot& robot = simulator.robot();
  Json offsets = Json::object();
  for (const auto& name : setup.estimated_joints) {
    offsets[name] = rounded(degrees(robot.offsets()[simulator.model().joint_index(name)]), 1e9);
  }
  Json faults = Json::array();
  for (const auto& spec : plan.faults) {
    if (spec.name != "joint_offset") faults.push_back(describe(spec));
  }
  Json cameras = Json::array();
  for (const auto& camera : robot.body().cameras) {
    const auto& k = camera.intrinsics;
    camera_names_.push_back(camera.name);
    cameras.push_back({{"name", camera.name},
                       {"width", k.width},
                       {"height", k.height},
                       {"fx", k.fx},
                       {"fy", k.fy},
                       {"cx", k.cx},
                       {"cy", k.cy},
                       {"distortion", camera.distortion}});
  }
  const FaultSite& site = robot.site();
  // Open at the end: frames are added as they come.
  stream_ << "{\n\"source\": \"bodyschema-sim\",\n"
          << "\"units\": \"m, deg, px (centre of the top-left pixel at 0, 0), utime in us; 4x4 poses map hand to "
             "camera coordinates\",\n"
          << "\"sign\": \"encoder = true + offset; faults as in bodyschema-sim --list-faults\",\n"
          << "\"seed\": " << plan.seed << ",\n\"offsets_deg\": " << offsets.dump() << ",\n\"faults\": " << faults.dump()
          << ",\n\"true_cameras\": " << cameras.dump() << ",\n\"motion_begin_utime\": "
          << simulator.settings().start_utime + microseconds(site.begin_s) + utime_shift
          << ",\n\"motion_end_utime\": " << simulator.settings().start_utime + microseconds(site.end_s) + utime_shift
          << ",\n\"fingers\": " << Json(setup.fingertip_links).dump() << ",\n\"frames\": [\n";
}

TruthWriter::~TruthWriter() {
  try {
    close();
  } catch (const std::exception&) {
    // Nobody is left to hear it.
  }
}

void TruthWriter::add(const SimulatedFrame& frame) {
  Json line = {{"utime", frame.utime + utime_shift_}, {"phase", name_of(frame.phase)}};
  Json exposures = Json::array();
  for (const auto& truth : frame.truth) exposures.push_back(truth.exposure_utime + utime_shift_);
  line["exposure_utime"] = std::move(exposures);
  const CameraTruth& first = frame.truth.front();
  Json joints = Json::object();
  for (std::size_t j = 0; j < joint_names_.size(); ++j) {
    joints[joint_names_[j]] = rounded(degrees(first.q[static_cast<Eigen::Index>(j)]), 1e7);
  }
  line["true_joints_deg"] = std::move(joints);
  std::vector<Eigen::Vector3d> tips_P;
  for (const auto& tip_C : first.fingertips_C) tips_P.push_back(first.X_CP.inverse(Eigen::Isometry) * tip_C);
  line["fingertips_in_hand_m"] = list(tips_P);
  if (hides_) line["holding"] = first.holding;
  for (std::size_t c = 0; c < frame.truth.size(); ++c) {
    const std::string& side = camera_names_[c];
    const CameraTruth& truth = frame.truth[c];
    line["hand_in_" + side + "_camera"] = rows(truth.X_CP);
    line["fingertips_in_" + side + "_camera_m"] = list(truth.fingertips_C);
    line["fingertips_px_" + side] = list(truth.fingertips_px);
    line["visible_share_" + side] = rounded(truth.visible_share, 1e6);
    if (hides_) line["hidden_share_" + side] = rounded(truth.hidden_share, 1e6);
  }
  stream_ << (first_ ? "" : ",\n") << line.dump();
  first_ = false;
}

void TruthWriter::close() {
  if (!stream_.is_open()) return;
  stream_ << "\n]\n}\n";
  stream_.close();
  if (!stream_) throw DeviceError(file_.string() + ": cannot be written (disk full?)");
}

}  // namespace bodyschema::simulator
