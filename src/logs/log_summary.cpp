#include "bodyschema/logs/log_summary.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <deque>
#include <map>
#include <spdlog/fmt/fmt.h>
#include <tuple>
#include <utility>

#include <nlohmann/json.hpp>

#include "bodyschema/bus/log.hpp"
#include "bodyschema/bus/messages.hpp"
#include "bodyschema/core/progress_bar.hpp"
#include "bodyschema/geometry/pose.hpp"
#include "message_kind.hpp"

namespace bodyschema {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kGapPeriods = 3.0;
constexpr double kTurn_rad = radians(0.5);
constexpr double kTurn_m = 0.001;
constexpr Microseconds kSpeedWindow = 50'000;
constexpr std::size_t kMostPorts = 8;  // listed for people

/// Stamps as they come, and what they say when all are there.
class Stamps {
 public:
  void add(Microseconds stamp) { stamps_.push_back(stamp); }
  [[nodiscard]] Regularity regularity() const {
    Regularity result;
    result.count = stamps_.size();
    if (stamps_.size() < 2) return result;
    std::vector<Microseconds> steps;
    for (std::size_t i = 1; i < stamps_.size(); ++i) {
      const Microseconds step = stamps_[i] - stamps_[i - 1];
      result.backwards += step < 0 ? 1 : 0;
      steps.push_back(step);
    }
    result.longest_gap_s = seconds(*std::max_element(steps.begin(), steps.end()));
    auto sorted = steps;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double usual = static_cast<double>(sorted[sorted.size() / 2]);
    for (const Microseconds step : steps) {
      result.gaps += usual > 0.0 && static_cast<double>(step) > kGapPeriods * usual ? 1 : 0;
    }
    const auto [first, last] = std::minmax_element(stamps_.begin(), stamps_.end());
    const double span_s = seconds(*last - *first);
    if (span_s > 0.0) result.rate_hz = static_cast<double>(stamps_.size() - 1) / span_s;
    return result;
  }

 private:
  std::vector<Microseconds> stamps_;
};

/// What counts as motion, rad or m.
double least_motion(bool slides) {
  return slides ? kTurn_m : kTurn_rad;
}

class JointWatcher {
 public:
  JointWatcher(std::string name, bool slides) : least_(least_motion(slides)) {
    motion.name = std::move(name);
    motion.slides = slides;
  }
  void add(Microseconds utime, double q) {
    if (motion.readings++ == 0) {
      motion.lowest_rad = motion.highest_rad = extreme_ = q;
    }
    motion.lowest_rad = std::min(motion.lowest_rad, q);
    motion.highest_rad = std::max(motion.highest_rad, q);
    if (!recent_.empty() && utime <= recent_.back().first) return;
    recent_.emplace_back(utime, q);
    while (recent_.size() > 1 && recent_[1].first <= utime - kSpeedWindow) recent_.pop_front();
    const double span_s = seconds(utime - recent_.front().first);
    if (span_s >= 0.5 * seconds(kSpeedWindow)) {
      motion.fastest_rad_s = std::max(motion.fastest_rad_s, std::abs(q - recent_.front().second) / span_s);
    }
    // Turning points at least that far apart, so that encoder noise is none.
    if (direction_ >= 0 && q < extreme_ - least_) {
      motion.turns += direction_ > 0 ? 1 : 0;
      direction_ = -1;
      extreme_ = q;
    } else if (direction_ <= 0 && q > extreme_ + least_) {
      motion.turns += direction_ < 0 ? 1 : 0;
      direction_ = 1;
      extreme_ = q;
    } else if ((direction_ > 0 && q > extreme_) || (direction_ < 0 && q < extreme_)) {
      extreme_ = q;
    }
  }
  JointMotion motion;

 private:
  double least_;
  std::deque<std::pair<Microseconds, double>> recent_;
  double extreme_ = 0.0;
  int direction_ = 0;
};

const char* encoding_name(std::int32_t format) {
  switch (format) {
    case bot_core::image_t::PIXEL_FORMAT_GRAY: return "gray";
    case bot_core::image_t::PIXEL_FORMAT_RGB: return "RGB";
    case bot_core::image_t::PIXEL_FORMAT_BGR: return "BGR";
    case bot_core::image_t::PIXEL_FORMAT_MJPEG: return "JPEG";
    default: return "unknown";
  }
}

class Summariser {
 public:
  Summariser(const std::filesystem::path& log, std::optional<std::set<std::string>> sliding_joints) : reader_(log) {
    summary_.file = log.string();
    summary_.sliding_joints = std::move(sliding_joints);
  }

  LogSummary run() {
    ProgressBar bar("reading", reader_.size());
    LogEvent event;
    Microseconds end = 0;
    while (reader_.next(event)) {
      if (summary_.messages++ == 0) summary_.begin = end = event.time_us;
      summary_.begin = std::min(summary_.begin, event.time_us);
      end = std::max(end, event.time_us);
      take(event);
      bar.set(reader_.position());
    }
    summary_.bytes = reader_.size();
    summary_.damaged_places = reader_.damaged_places();
    summary_.duration_s = seconds(end - summary_.begin);
    finish();
    return std::move(summary_);
  }

 private:
  struct Channel {
    ChannelSummary summary;
    Stamps arrivals;
  };

  void take(const LogEvent& event) {
    Channel& channel = channels_[event.channel];
    channel.arrivals.add(event.time_us);
    channel.summary.bytes += event.data.size();
    const MessageKind kind = kind_of(event.data);
    if (channel.summary.type.empty() || channel.summary.type == name_of(MessageKind::kUnknown)) {
      channel.summary.type = name_of(kind);
    }
    bool good = true;
    switch (kind) {
      case MessageKind::kJointState: good = take_joints(event); break;
      case MessageKind::kImages: good = take_images(event); break;
      case MessageKind::kJointOffsets: good = decode(event.data, offsets_).ok(); break;
      case MessageKind::kOffsetsStatus: good = decode(event.data, status_).ok(); break;
      case MessageKind::kFindings: good = decode(event.data, findings_).ok(); break;
      // Noise on a channel of ours is unreadable; a channel of others is none of our business.
      case MessageKind::kUnknown: good = channel.summary.type == name_of(MessageKind::kUnknown); break;
    }
    channel.summary.unreadable += good ? 0 : 1;
  }

  bool take_joints(const LogEvent& event) {
    if (!decode(event.data, joint_state_).ok()) return false;
    // Arm and head of a YARP recording come in turns; only each by itself has a rate.
    const auto [port, is_new_port] = encoder_index_.try_emplace(joint_state_.names, encoder_stamps_.size());
    if (is_new_port) {
      summary_.encoders.push_back({joint_state_.names, {}});
      encoder_stamps_.emplace_back();
    }
    encoder_stamps_[port->second].add(joint_state_.utime);
    auto& channels = summary_.joint_channels;
    if (std::find(channels.begin(), channels.end(), event.channel) == channels.end()) channels.push_back(event.channel);
    for (std::size_t i = 0; i < joint_state_.names.size(); ++i) {
      const std::string& name = joint_state_.names[i];
      const auto [at, is_new] = joint_index_.try_emplace(name, joints_.size());
      if (is_new) joints_.emplace_back(name, summary_.sliding_joints && summary_.sliding_joints->contains(name));
      joints_[at->second].add(joint_state_.utime, static_cast<double>(joint_state_.position_rad[i]));
      posture_.resize(joints_.size(), 0.0);
      if (!joints_[at->second].motion.slides) posture_[at->second] = static_cast<double>(joint_state_.position_rad[i]);
    }
    return true;
  }

  bool take_images(const LogEvent& event) {
    if (!decode(event.data, images_).ok()) return false;
    for (const auto& image : images_.images) {
      pictures_[{event.channel, image.type, image.width, image.height, image.pixelformat}].add(image.utime);
    }
    if (!images_.images.empty()) count_posture();
    return true;
  }

  /// Where the joints are, as far as has been said, is another posture or one of those before.
  void count_posture() {
    if (posture_.empty() || postures_.size() == kMostPostures) return;
    const auto same = [&](const std::vector<double>& other) {
      for (std::size_t j = 0; j < posture_.size(); ++j) {
        const double q = j < other.size() ? other[j] : 0.0;
        if (!(std::abs(posture_[j] - q) < kSamePosture_rad)) return false;
      }
      return true;
    };
    // Newest first: a moving arm is near where it just was.
    if (std::none_of(postures_.rbegin(), postures_.rend(), same)) postures_.push_back(posture_);
  }

  void finish() {
    for (auto& [name, channel] : channels_) {
      channel.summary.channel = name;
      channel.summary.arrivals = channel.arrivals.regularity();
      summary_.channels.push_back(channel.summary);
    }
    for (const auto& [key, stamps] : pictures_) {
      const auto& [channel, type, width, height, format] = key;
      summary_.pictures.push_back(
          {channel, camera_name(type), encoding_name(format), width, height, stamps.regularity()});
    }
    for (std::size_t e = 0; e < encoder_stamps_.size(); ++e)
      summary_.encoders[e].stamps = encoder_stamps_[e].regularity();
    summary_.postures = postures_.size();
    for (auto& joint : joints_) summary_.joints.push_back(std::move(joint.motion));
  }

  LogReader reader_;
  LogSummary summary_;
  std::map<std::string, Channel> channels_;
  std::map<std::tuple<std::string, int, int, int, std::int32_t>, Stamps> pictures_;
  std::map<std::vector<std::string>, std::size_t> encoder_index_;
  std::vector<Stamps> encoder_stamps_;
  std::map<std::string, std::size_t> joint_index_;
  std::vector<JointWatcher> joints_;
  std::vector<double> posture_;                ///< the last reading of each joint that turns
  std::vector<std::vector<double>> postures_;  ///< those that were pictured, each once
  JointStateMessage joint_state_;
  ImagesView images_;
  joint_offsets_t offsets_;
  offsets_status_t status_;
  findings_t findings_;
};

std::string date_text(Microseconds utime) {
  const auto time = static_cast<std::time_t>(utime / 1'000'000);
  std::tm utc{};
  if (gmtime_r(&time, &utc) == nullptr) return "unknown";
  char text[64];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S UTC", &utc);
  return text;
}

std::string plural(std::uint64_t n, const std::string& word) {
  return fmt::format("{} {}{}", n, word, n == 1 ? "" : "s");
}

std::string gaps_text(const Regularity& r) {
  std::string text;
  if (r.gaps > 0) text += fmt::format("{}, the longest {:.0f} ms", plural(r.gaps, "gap"), 1e3 * r.longest_gap_s);
  if (r.backwards > 0) text += fmt::format("{}{} out of order", text.empty() ? "" : "; ", r.backwards);
  return text.empty() ? "no gaps" : text;
}

Json regularity_json(const Regularity& r) {
  return {{"count", r.count},
          {"rate_hz", r.rate_hz},
          {"gaps", r.gaps},
          {"longest_gap_s", r.longest_gap_s},
          {"out_of_order", r.backwards}};
}

}  // namespace

std::string LogSummary::text() const {
  std::string out = fmt::format("{}: {:.1f} MB, {}, {:.1f} s from {}\n", file, 1e-6 * static_cast<double>(bytes),
                                plural(messages, "message"), duration_s, date_text(begin));
  if (damaged_places > 0)
    out += fmt::format("damaged at {}; what could be read counts below\n", plural(damaged_places, "place"));
  out += fmt::format("\n{:<28} {:<28} {:>9} {:>8} {:>9}\n", "channel", "type", "messages", "Hz", "MB");
  for (const auto& c : channels) {
    out += fmt::format("{:<28} {:<28} {:>9} {:>8.1f} {:>9.1f}{}\n", c.channel, c.type, c.arrivals.count,
                       c.arrivals.rate_hz, 1e-6 * static_cast<double>(c.bytes),
                       c.unreadable > 0 ? fmt::format("  {} unreadable", c.unreadable) : "");
  }
  if (!pictures.empty())
    out += fmt::format("\n{:<28} {:<10} {:<18} {:>9} {:>8}  by their stamps\n", "pictures", "camera", "size",
                       "pictures", "Hz");
  for (const auto& p : pictures) {
    out += fmt::format("{:<28} {:<10} {:<18} {:>9} {:>8.1f}  {}\n", p.channel, p.camera,
                       fmt::format("{}x{} {}", p.width, p.height, p.encoding), p.stamps.count, p.stamps.rate_hz,
                       gaps_text(p.stamps));
  }
  if (joints.empty()) return out;
  out += "\n";
  for (std::size_t e = 0; e < std::min(encoders.size(), kMostPorts); ++e) {
    const auto& [names, stamps] = encoders[e];
    const std::string which = encoders.size() > 1 && !names.empty() ? fmt::format(" ({}, ...)", names.front()) : "";
    out += fmt::format("encoders: {}{} at {:.1f} Hz, {}\n", plural(names.size(), "joint"), which, stamps.rate_hz,
                       gaps_text(stamps));
  }
  if (encoders.size() > kMostPorts)
    out += fmt::format("encoders: {} other sets of joints\n", encoders.size() - kMostPorts);
  for (const bool slides : {false, true}) {
    const char* unit = slides ? "mm" : "deg";
    const double per_unit = slides ? 1e3 : degrees(1.0);
    std::string moved;
    std::size_t still = 0;
    for (const auto& j : joints) {
      if (j.slides != slides) continue;
      if (j.highest_rad - j.lowest_rad < least_motion(slides)) {
        ++still;
        continue;
      }
      moved += fmt::format("{:<28} {:>10.1f} {:>10.1f} {:>12.0f} {:>6}\n", j.name, per_unit * j.lowest_rad,
                           per_unit * j.highest_rad, per_unit * j.fastest_rad_s, j.turns);
    }
    if (!slides || !moved.empty()) {
      out += fmt::format("{:<28} {:>10} {:>10} {:>12} {:>6}\n",
                         slides ? "sliding joint that moved" : "joint that moved", fmt::format("from {}", unit),
                         fmt::format("to {}", unit), fmt::format("{}/s at most", unit), "turns");
    }
    out += moved;
    if (still > 0) {
      out += fmt::format("{} moved by less than {:.1f} {}\n", plural(still, slides ? "sliding joint" : "joint"),
                         per_unit * least_motion(slides), unit);
    }
  }
  if (!pictures.empty()) {
    out += fmt::format("pictures show {}{} (a joint apart by {:.0f} deg or more)\n",
                       postures == kMostPostures ? "at least " : "", plural(postures, "different posture"),
                       degrees(kSamePosture_rad));
  }
  if (!sliding_joints) out += "in deg as if every joint turned: a log does not say which slide, a configuration does\n";
  return out;
}

std::string LogSummary::json() const {
  Json j = {{"file", file},         {"bytes", bytes},
            {"messages", messages}, {"damaged_places", damaged_places},
            {"begin_utime", begin}, {"duration_s", duration_s}};
  j["channels"] = Json::array();
  for (const auto& c : channels) {
    j["channels"].push_back({{"channel", c.channel},
                             {"type", c.type},
                             {"arrivals", regularity_json(c.arrivals)},
                             {"bytes", c.bytes},
                             {"unreadable", c.unreadable}});
  }
  j["pictures"] = Json::array();
  for (const auto& p : pictures) {
    j["pictures"].push_back({{"channel", p.channel},
                             {"camera", p.camera},
                             {"encoding", p.encoding},
                             {"width", p.width},
                             {"height", p.height},
                             {"stamps", regularity_json(p.stamps)}});
  }
  j["encoders"] = Json::array();
  for (const auto& e : encoders) {
    j["encoders"].push_back({{"joints", e.joints}, {"stamps", regularity_json(e.stamps)}});
  }
  j["joints"] = Json::array();
  for (const auto& m : joints) {
    const std::string unit = m.slides ? "_m" : "_deg";
    const double per_unit = m.slides ? 1.0 : degrees(1.0);
    j["joints"].push_back({{"joint", m.name},
                           {"readings", m.readings},
                           {"lowest" + unit, per_unit * m.lowest_rad},
                           {"highest" + unit, per_unit * m.highest_rad},
                           {"fastest" + unit + "_s", per_unit * m.fastest_rad_s},
                           {"turns", m.turns}});
  }
  j["postures"] = postures;
  j["sliding_joints"] = sliding_joints ? Json(*sliding_joints) : Json(nullptr);
  return j.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";  // names may be no UTF-8
}

LogSummary summarise_log(const std::filesystem::path& log, std::optional<std::set<std::string>> sliding_joints) {
  return Summariser(log, std::move(sliding_joints)).run();
}

}  // namespace bodyschema
