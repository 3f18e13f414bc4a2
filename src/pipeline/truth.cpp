#include "bodyschema/pipeline/truth.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/file_size.hpp"

namespace bodyschema {
namespace {

constexpr std::uintmax_t kMaxFileBytes = std::uintmax_t{1} << 30;  // an hour at 30 Hz is a fifth of it

constexpr Microseconds kTolerance_us = 60'000;

Pose pose_from(const nlohmann::json& rows) {
  Eigen::Matrix4d m;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c)
      m(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)).get<double>();
  }
  Pose pose;
  pose.matrix() = m;
  return pose;
}

/// @param unit_us  of the number
Microseconds time_from(const nlohmann::json& number, const char* key, double unit_us) {
  const double time_us = number.get<double>() * unit_us;
  if (!(std::abs(time_us) <= static_cast<double>(kLatestStamp))) {
    throw FileError(std::string(key) + " is " + number.dump() + ", expected a time of acquisition");
  }
  return static_cast<Microseconds>(std::llround(time_us));
}

std::vector<Eigen::Vector3d> points_from(const nlohmann::json& list) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& p : list) {
    points.emplace_back(p.at(0).get<double>(), p.at(1).get<double>(), p.at(2).get<double>());
  }
  return points;
}

std::vector<Pose> hand_in(const std::vector<std::string>& cameras, const nlohmann::json& instant) {
  std::vector<Pose> poses;
  for (const auto& camera : cameras) poses.push_back(pose_from(instant.at("hand_in_" + camera + "_camera")));
  return poses;
}

}  // namespace

Truth Truth::load(const std::filesystem::path& file, const std::vector<std::string>& cameras) {
  std::ifstream stream(file);
  if (!stream) throw FileError(file.string() + ": no such truth file");
  file_size_at_most(file, kMaxFileBytes);
  Truth truth;
  try {
    const nlohmann::json json = nlohmann::json::parse(stream);
    if (json.contains("fingers")) truth.fingers_ = json.at("fingers").get<std::vector<std::string>>();
    std::vector<Eigen::Vector3d> common_tips;
    if (json.contains("fingertips_in_hand_m")) {
      common_tips = points_from(json.at("fingertips_in_hand_m"));
    }
    if (json.contains("poses")) {  // the recording: still poses that hold for a while
      for (const auto& pose : json.at("poses")) {
        TruthInstant instant;
        instant.begin = time_from(pose.at("time_s").at(0), "time_s", 1e6);
        instant.end = time_from(pose.at("time_s").at(1), "time_s", 1e6);
        instant.X_CP = hand_in(cameras, pose);
        instant.fingertips_P = common_tips;
        truth.instants_.push_back(std::move(instant));
      }
    } else {  // the simulator: one entry per picture
      for (const auto& frame : json.at("frames")) {
        TruthInstant instant;
        instant.begin = instant.end = time_from(frame.at("utime"), "utime", 1.0);
        instant.X_CP = hand_in(cameras, frame);
        instant.fingertips_P =
            frame.contains("fingertips_in_hand_m") ? points_from(frame.at("fingertips_in_hand_m")) : common_tips;
        truth.instants_.push_back(std::move(instant));
      }
    }
    if (json.contains("offsets_deg")) {
      const auto& offsets = json.at("offsets_deg");
      if (offsets.is_object()) {
        for (const auto& [name, value] : offsets.items()) {
          truth.offsets_.emplace_back(name, radians(value.get<double>()));
        }
      } else {
        const auto& names = json.at("encoder_joints");
        for (std::size_t i = 0; i < offsets.size(); ++i) {
          truth.offsets_.emplace_back(names.at(i).get<std::string>(), radians(offsets.at(i).get<double>()));
        }
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw FileError(file.string() + ": not a truth file: " + e.what());
  } catch (const FileError& e) {
    throw FileError(file.string() + ": " + e.what());
  }
  if (truth.instants_.empty()) throw FileError(file.string() + ": holds no pose");
  std::sort(truth.instants_.begin(), truth.instants_.end(),
            [](const auto& a, const auto& b) { return a.begin < b.begin; });
  return truth;
}

const TruthInstant* Truth::at(Microseconds utime) const {
  const auto after = std::upper_bound(instants_.begin(), instants_.end(), utime,
                                      [](Microseconds t, const TruthInstant& i) { return t < i.begin; });
  const TruthInstant* best = nullptr;
  Microseconds best_gap = kTolerance_us + 1;
  const auto consider = [&](const TruthInstant& instant) {
    const Microseconds gap = std::max<Microseconds>({0, instant.begin - utime, utime - instant.end});
    if (gap < best_gap) {
      best_gap = gap;
      best = &instant;
    }
  };
  if (after != instants_.begin()) consider(*(after - 1));
  if (after != instants_.end()) consider(*after);
  return best;
}

}  // namespace bodyschema
