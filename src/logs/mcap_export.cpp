#include "bodyschema/logs/mcap_export.hpp"

#include <cmath>
#include <filesystem>
#include <system_error>

#include <nlohmann/json.hpp>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/base64.hpp"
#include "bodyschema/core/error.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "mcap_writer.hpp"
#include "message_kind.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t nanoseconds(Microseconds utime) {
  return utime > 0 ? 1000u * static_cast<std::uint64_t>(utime) : 0u;
}

Json timestamp(Microseconds utime) {
  const auto us = static_cast<std::uint64_t>(std::max<Microseconds>(utime, 0));
  return {{"sec", us / 1'000'000}, {"nsec", us % 1'000'000 * 1000}};
}

/// JSON has no infinities: what is not finite is null.
Json number(double x) {
  return std::isfinite(x) ? Json(x) : Json(nullptr);
}

/// Text that is not UTF-8 is replaced, not refused: the numbers beside it are still good.
std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// A JSON schema that describes one message: viewers offer its fields for plotting by this.
Json schema_of(const Json& value) {
  if (value.is_object()) {
    Json properties = Json::object();
    for (const auto& [key, member] : value.items()) properties[key] = schema_of(member);
    return {{"type", "object"}, {"properties", properties}};
  }
  if (value.is_array()) return {{"type", "array"}, {"items", value.empty() ? Json::object() : schema_of(value[0])}};
  if (value.is_string()) return {{"type", "string"}};
  if (value.is_number_integer()) return {{"type", "integer"}};
  return {{"type", {"number", "null"}}};
}

Json time_schema() {
  return {{"type", "object"},
          {"title", "time"},
          {"properties",
           {{"sec", {{"type", "integer"}, {"minimum", 0}}},
            {"nsec", {{"type", "integer"}, {"minimum", 0}, {"maximum", 999'999'999}}}}}};
}

Json picture_schema() {
  return {{"title", "foxglove.CompressedImage"},
          {"$comment", "A compressed image"},
          {"type", "object"},
          {"properties",
           {{"timestamp", time_schema()},
            {"frame_id", {{"type", "string"}}},
            {"data", {{"type", "string"}, {"contentEncoding", "base64"}}},
            {"format", {{"type", "string"}}}}}};
}

/// With sliding joints known, these by themselves, in every message, since all of a topic have one schema.
Json json_of(const JointStateMessage& m, const std::set<std::string>& sliding_joints) {
  Json json = {{"timestamp", timestamp(m.utime)}, {"position_deg", Json::object()}, {"velocity_deg_s", Json::object()}};
  if (!sliding_joints.empty()) {
    json["position_m"] = Json::object();
    json["velocity_m_s"] = Json::object();
  }
  for (std::size_t i = 0; i < m.names.size(); ++i) {
    const auto position = static_cast<double>(m.position_rad[i]), velocity = static_cast<double>(m.velocity_rad_s[i]);
    const bool slides = sliding_joints.contains(m.names[i]);
    json[slides ? "position_m" : "position_deg"][m.names[i]] = slides ? position : degrees(position);
    json[slides ? "velocity_m_s" : "velocity_deg_s"][m.names[i]] = slides ? velocity : degrees(velocity);
  }
  return json;
}

/// Estimated joints turn, all of them.
Json json_of(const joint_offsets_t& m, const std::set<std::string>&) {
  Json mean = Json::object(), sd = Json::object(), told = Json::object(), hand = Json::object(),
       others = Json::object();
  for (std::size_t i = 0; i < m.joint_name.size(); ++i) {
    mean[m.joint_name[i]] = number(degrees(m.mean_rad[i]));
    sd[m.joint_name[i]] = number(degrees(std::sqrt(std::max(0.0, m.covariance_rad2[i][i]))));
    told[m.joint_name[i]] = m.told[i] != 0;
  }
  for (std::size_t c = 0; c < m.camera_name.size(); ++c) {
    const auto& p = m.hand_pose_in_camera[c].position_m;
    const auto& q = m.hand_pose_in_camera[c].quaternion_wxyz;
    hand[m.camera_name[c]] = {
        {"position_m", {{"x", number(p[0])}, {"y", number(p[1])}, {"z", number(p[2])}}},
        {"orientation", {{"x", number(q[1])}, {"y", number(q[2])}, {"z", number(q[3])}, {"w", number(q[0])}}}};
  }
  for (std::size_t i = 0; i < m.parameter_name.size(); ++i) {
    others[m.parameter_name[i]] = {{"value", number(m.parameter_value[i])},
                                   {"stddev", number(m.parameter_stddev[i])},
                                   {"prior_stddev", number(m.parameter_prior_stddev[i])},
                                   {"unit", m.parameter_unit[i]}};
  }
  return {{"timestamp", timestamp(m.utime)},
          {"sequence", m.sequence},
          {"state", m.state},
          {"offset_deg", mean},
          {"stddev_deg", sd},
          {"hand_in_camera", hand},
          {"told", told},
          {"parameters", others},
          {"hand_stddev_m", number(m.hand_stddev_m)},
          {"verdict", m.verdict},
          {"innovation", number(m.innovation)},
          {"innovation_dof", number(m.innovation_dof)},
          {"innovation_usual", number(m.innovation_usual)},
          {"postures", m.postures},
          {"posture_stddev_deg", number(degrees(m.posture_stddev_rad))},
          {"outline_stddev_px", number(m.outline_stddev_px)},
          {"outline_points_alike", number(m.outline_points_alike)},
          {"changed", m.changed},
          {"misfit", m.misfit},
          {"stalled_joint", m.stalled_joint},
          {"stalled_motion_deg", number(degrees(m.stalled_motion_rad))},
          {"cameras_swapped", m.cameras_swapped != 0},
          {"effective_sample_size", number(m.effective_sample_size)},
          {"best_likelihood", number(m.best_likelihood)},
          {"latency_ms", number(m.latency_ms)},
          {"model_hash", m.model_hash},
          {"config_hash", m.config_hash}};
}

Json json_of(const offsets_status_t& m, const std::set<std::string>&) {
  static constexpr const char* kLevels[] = {"OK", "WARN", "ERROR", "STALE"};
  Json counters = Json::object(), median = Json::object(), p99 = Json::object();
  for (std::size_t i = 0; i < m.counter_name.size(); ++i) counters[m.counter_name[i]] = m.counter_value[i];
  for (std::size_t i = 0; i < m.stage_name.size(); ++i) {
    median[m.stage_name[i]] = number(m.stage_median_ms[i]);
    p99[m.stage_name[i]] = number(m.stage_p99_ms[i]);
  }
  return {{"timestamp", timestamp(m.utime)},
          {"level", m.level},
          {"level_name", m.level >= 0 && m.level < 4 ? kLevels[m.level] : "?"},
          {"sentence", m.sentence},
          {"state", m.state},
          {"uptime_s", 1e-6 * static_cast<double>(m.uptime_us)},
          {"frames_in", m.frames_in},
          {"frames_estimated", m.frames_estimated},
          {"frames_dropped", m.frames_dropped},
          {"gaps", m.gaps},
          {"frame_rate_hz", number(m.frame_rate_hz)},
          {"image_age_ms", number(m.image_age_ms)},
          {"encoder_lag_ms", number(m.encoder_lag_ms)},
          {"latency_median_ms", number(m.latency_median_ms)},
          {"latency_p99_ms", number(m.latency_p99_ms)},
          {"stage_median_ms", median},
          {"stage_p99_ms", p99},
          {"counters", counters},
          {"engine", m.engine},
          {"renderer", m.renderer},
          {"effective_sample_size", number(m.effective_sample_size)},
          {"best_likelihood", number(m.best_likelihood)},
          {"weakest_direction", m.weakest_direction},
          {"weakest_stddev_deg", number(degrees(m.weakest_stddev_rad))},
          {"resident_mb", 1e-6 * static_cast<double>(m.resident_bytes)},
          {"version", m.version},
          {"model_hash", m.model_hash},
          {"config_hash", m.config_hash}};
}

Json json_of(const findings_t& m, const std::set<std::string>&) {
  Json list = Json::array();
  for (const auto& f : m.finding) {
    Json parameters = Json::array();
    for (std::size_t i = 0; i < f.parameter_name.size(); ++i) {
      parameters.push_back({{"name", f.parameter_name[i]},
                            {"unit", f.parameter_unit[i]},
                            {"value", number(f.parameter_value[i])},
                            {"stddev", number(f.parameter_stddev[i])}});
    }
    list.push_back({{"effect", f.effect},
                    {"joint", f.joint},
                    {"source", f.source},
                    {"sentence", f.sentence},
                    {"parameters", parameters},
                    {"z", number(f.z)},
                    {"hand_m", number(f.hand_m)},
                    {"outline_px", number(f.outline_px)},
                    {"from", timestamp(f.from_utime)},
                    {"estimated", f.estimated != 0},
                    {"alike", f.alike}});
  }
  return {{"timestamp", timestamp(m.utime)},      {"span_s", number(m.span_s)}, {"blocks", m.blocks},
          {"z_threshold", number(m.z_threshold)}, {"count", m.num_findings},    {"findings", list}};
}

class Exporter {
 public:
  explicit Exporter(const McapExportOptions& options) : options_(options), reader_(options.log), writer_(options.out) {}

  McapExportSummary run() {
    ProgressBar bar("to-mcap", reader_.size());
    LogEvent event;
    while (reader_.next(event)) {
      take(event);
      bar.set(reader_.position());
    }
    if (summary_.messages.empty()) {
      throw DataError(options_.log.string() +
                      ": no joint states, pictures, offsets or status in this log; nothing is written");
    }
    writer_.close();
    summary_.bytes = writer_.bytes_written();
    return std::move(summary_);
  }

 private:
  void take(const LogEvent& event) {
    switch (kind_of(event.data)) {
      case MessageKind::kJointState: write_decoded(event, joint_state_, "bodyschema.JointState"); break;
      case MessageKind::kJointOffsets: write_decoded(event, offsets_, "bodyschema.JointOffsets"); break;
      case MessageKind::kOffsetsStatus: write_decoded(event, status_, "bodyschema.OffsetsStatus"); break;
      case MessageKind::kFindings: write_decoded(event, findings_, "bodyschema.Findings"); break;
      case MessageKind::kImages: take_images(event); break;
      case MessageKind::kUnknown: ++summary_.unknown; break;
    }
  }

  template <class Message>
  void write_decoded(const LogEvent& event, Message& message, const char* type) {
    if (!decode(event.data, message).ok()) {
      ++summary_.unreadable;
      return;
    }
    const Json json = json_of(message, options_.sliding_joints);
    write("/" + event.channel, type, event.time_us, message.utime, text_of(json), [&] {
      Json schema = schema_of(json);
      schema["title"] = type;
      schema["properties"]["timestamp"] = time_schema();
      return schema;
    });
  }

  void take_images(const LogEvent& event) {
    if (!decode(event.data, images_).ok()) {
      ++summary_.unreadable;
      return;
    }
    for (const auto& view : images_.images) {
      if (!unpack(view, image_).ok()) {
        ++summary_.unreadable;
        continue;
      }
      std::string name = camera_name(view.type);
      std::replace(name.begin(), name.end(), ' ', '_');
      const std::string data = view.pixelformat == bot_core::image_t::PIXEL_FORMAT_MJPEG
                                   ? base64(view.data)
                                   : base64(to_jpeg_message(image_, view.utime, options_.jpeg_quality).data);
      const Json json = {{"timestamp", timestamp(view.utime)}, {"frame_id", name}, {"format", "jpeg"}, {"data", data}};
      write("/" + event.channel + "/" + name, "foxglove.CompressedImage", event.time_us, view.utime, text_of(json),
            [] { return picture_schema(); });
    }
  }

  template <class MakeSchema>
  void write(const std::string& topic, const char* type, Microseconds arrival, Microseconds utime,
             const std::string& json, MakeSchema make_schema) {
    auto at = channels_.find(topic);
    if (at == channels_.end()) {
      const auto schema = writer_.add_schema(type, text_of(make_schema()));
      at = channels_.emplace(topic, writer_.add_channel(topic, schema)).first;
    }
    writer_.write(at->second, nanoseconds(arrival), nanoseconds(utime), json);
    ++summary_.messages[topic];
  }

  McapExportOptions options_;
  LogReader reader_;
  McapWriter writer_;
  McapExportSummary summary_;
  std::map<std::string, McapWriter::ChannelId> channels_;
  JointStateMessage joint_state_;
  joint_offsets_t offsets_;
  offsets_status_t status_;
  findings_t findings_;
  ImagesView images_;
  Image image_;
};

/// What is written must not be what is read, by whatever name: the log would be lost.
void refuse_to_overwrite(const McapExportOptions& options) {
  for (const std::filesystem::path& written : {options.out, UnfinishedFile::part_of(options.out)}) {
    std::error_code none;  // what does not exist is no log
    if (!std::filesystem::equivalent(options.log, written, none)) continue;
    throw FileError(options.out.string() + ": would overwrite the log " + options.log.string() +
                    "; expected another file");
  }
}

}  // namespace

McapExportSummary export_mcap(const McapExportOptions& options) {
  refuse_to_overwrite(options);
  return Exporter(options).run();
}

}  // namespace bodyschema
