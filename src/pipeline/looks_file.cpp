#include "bodyschema/pipeline/looks_file.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "bodyschema/core/error.hpp"
#include "bodyschema/core/write_file.hpp"

namespace bodyschema {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kKind = "colours of a robot";
constexpr int kVersion = 1;
/// Less than one pixel in a hundred thousand is left out.
constexpr float kLeastShare = 1e-5f;
constexpr int kShift = 8 - RobotLooks::kBits;

/// Of a cell, its darkest colour.
std::vector<int> levels_of(std::size_t cell, int channels) {
  if (channels == 1) return {static_cast<int>(cell)};
  constexpr std::size_t kMask = (std::size_t{1} << RobotLooks::kBits) - 1;
  const auto level = [&](int place) {
    return static_cast<int>((cell >> (place * RobotLooks::kBits)) & kMask) << kShift;
  };
  return {level(2), level(1), level(0)};
}

Json camera_json(const RobotLooks& looks) {
  Json colours = Json::array();
  for (std::size_t cell = 0; cell < looks.share.size(); ++cell) {
    if (looks.share[cell] < kLeastShare) continue;
    Json colour = levels_of(cell, looks.channels);
    colour.push_back(std::round(1e6 * static_cast<double>(looks.share[cell])) / 1e6);
    colours.push_back(std::move(colour));
  }
  return {{"channels", looks.channels}, {"colours", std::move(colours)}};
}

[[noreturn]] void wrong(const fs::path& file, const std::string& key, const std::string& expected) {
  throw FileError(fmt::format("{}: {}: expected {}", file.string(), key, expected));
}

RobotLooks read_camera(const fs::path& file, const std::string& key, const Json& json) {
  RobotLooks looks;
  if (!json.is_object() || !json.contains("channels") || !(json["channels"] == 1 || json["channels"] == 3)) {
    wrong(file, key + ".channels", "1 or 3");
  }
  looks.channels = json["channels"];
  if (!json.contains("colours") || !json["colours"].is_array()) wrong(file, key + ".colours", "a list");
  looks.share.assign(RobotLooks::kCells, 0.0f);
  const auto channels = static_cast<std::size_t>(looks.channels);
  double sum = 0.0;
  for (const auto& colour : json["colours"]) {
    const auto is_level = [](const Json& v) { return v.is_number_integer() && v >= 0 && v <= 255; };
    bool good = colour.is_array() && colour.size() == channels + 1;
    std::array<std::uint8_t, 3> levels{};
    for (std::size_t c = 0; good && c < channels; ++c) {
      good = is_level(colour[c]);
      if (good) levels[c] = colour[c];
    }
    good = good && colour[channels].is_number() && colour[channels] >= 0.0 && colour[channels] <= 1.0;
    if (!good) wrong(file, key + ".colours", "lists of levels (0 to 255) by channel and a share (0 to 1)");
    const double share = colour[channels];
    looks.share[RobotLooks::cell(levels.data(), looks.channels)] += static_cast<float>(share);
    sum += share;
  }
  constexpr double kRounded = 0.1;
  if (std::abs(sum - 1.0) > kRounded) wrong(file, key + ".colours", fmt::format("shares that sum to 1, not {}", sum));
  for (auto& share : looks.share) share /= static_cast<float>(sum);
  return looks;
}

fs::path state_folder() {
  // Relative paths are invalid there (XDG Base Directory Specification).
  if (const char* state = std::getenv("XDG_STATE_HOME"); state != nullptr && *state == '/') {
    return fs::path(state) / "bodyschema";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home == '/') {
    return fs::path(home) / ".local" / "state" / "bodyschema";
  }
  return {};
}

}  // namespace

void write_looks(const fs::path& file, const std::string& robot, const LooksByCamera& looks) {
  Json json = {{"kind", kKind}, {"version", kVersion}, {"robot", robot}, {"cameras", Json::object()}};
  for (const auto& [camera, of] : looks) json["cameras"][camera] = camera_json(of);
  replace_file(file, json.dump() + "\n");
}

LooksByCamera read_looks(const fs::path& file, const std::string& robot) {
  std::ifstream stream(file);
  if (!stream) throw FileError(file.string() + ": cannot be read");
  const Json json = Json::parse(stream, nullptr, false);
  if (json.is_discarded()) throw FileError(file.string() + ": is not JSON");
  const auto is = [&](const char* key, const Json& value) {
    return json.is_object() && json.value(key, Json()) == value;
  };
  if (!is("kind", kKind)) wrong(file, "kind", fmt::format("'{}'", kKind));
  if (!is("version", kVersion)) wrong(file, "version", std::to_string(kVersion));
  if (!is("robot", robot)) wrong(file, "robot", robot + ", as this robot's model: these are the colours of another");
  if (!json.contains("cameras") || !json["cameras"].is_object()) wrong(file, "cameras", "one entry a camera");
  LooksByCamera looks;
  for (const auto& [camera, of] : json["cameras"].items()) looks[camera] = read_camera(file, "cameras." + camera, of);
  return looks;
}

LooksKeeper::LooksKeeper(fs::path file, std::string robot) : file_(std::move(file)), robot_(std::move(robot)) {
  if (const auto folder = state_folder(); !folder.empty()) elsewhere_ = folder / ("looks_" + robot_ + ".json");
}

LooksByCamera LooksKeeper::read() const {
  for (const auto& file : {file_, elsewhere_}) {
    std::error_code none;
    if (file.empty() || !fs::exists(file, none)) continue;
    try {
      auto looks = read_looks(file, robot_);
      spdlog::info("the robot's colours as learned before: {}", file.string());
      return looks;
    } catch (const FileError& error) {
      spdlog::warn("{}; the robot's colours are learned anew", error.what());
    }
  }
  return {};
}

void LooksKeeper::write(const LooksByCamera& looks) {
  if (looks.empty()) return;
  std::string failure;
  for (const auto& file : {file_, elsewhere_}) {
    if (file.empty()) continue;
    try {
      if (file == elsewhere_) make_folder(file.parent_path());
      write_looks(file, robot_, looks);
      return;
    } catch (const std::exception& error) {
      if (failure.empty()) failure = error.what();
    }
  }
  if (!std::exchange(warned_, true)) spdlog::warn("the robot's colours are not kept for the next start: {}", failure);
}

}  // namespace bodyschema
